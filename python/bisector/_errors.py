"""What the package raises and warns of."""

from __future__ import annotations

import re


def with_keywords(message: str) -> str:
    """The names of options as Python's keywords: "--edge-length" is "edge_length"."""
    message = re.sub(r"(?<![\w-])--([a-z][a-z-]*[a-z])", lambda match: match[1].replace("-", "_"), message)
    return re.sub(r"(?<![\w-])-n\b", "n", message)


class Error(ValueError):
    """Bad input, a bad option or a failed run: one line that says what is wrong, where, and what to do."""

    def __init__(self, message: str) -> None:
        super().__init__(with_keywords(message))


class DeviceError(Error):
    """The device that was asked for is missing or failed."""


class BisectorWarning(UserWarning):
    """What a run warns of, such as vertices that no face uses or features that could not be kept."""
