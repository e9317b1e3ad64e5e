"""Calls that take long: in a thread of their own, so that the caller's hears of progress and of Ctrl-C."""

from __future__ import annotations

import ctypes
import functools
import json
import operator
import os
import queue
import sys
import threading
import warnings
from ctypes import byref
from dataclasses import dataclass
from typing import Any, Callable, Optional, TypeVar

from ._errors import BisectorWarning, Error, with_keywords
from ._library import Callbacks, Handle, ProgressFunction, WarningFunction, call, text

T = TypeVar("T")


@dataclass(frozen=True)
class Progress:
    """What a run is doing."""

    phase: str
    iteration: int           # within the phase; 0: the phase has none
    iterations: int          # at most, within the phase
    energy: float            # of the optimiser
    gradient_norm: float
    fraction: Optional[float]  # of the whole run, from 0 to 1, estimated; None: not known


ProgressCallback = Callable[[Progress], Any]

_PATIENCE = 0.7  # seconds that a cancelled call is waited for
_FOLDER = os.path.dirname(os.path.abspath(__file__)) + os.sep


def _callers_level() -> int:
    """The stack level of the first frame outside of this package, for warnings.warn in the calling function."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and os.path.abspath(frame.f_code.co_filename).startswith(_FOLDER):
        frame, level = frame.f_back, level + 1
    return level


def interruptible(work: Callable[[Any], T], progress: Optional[ProgressCallback] = None) -> T:
    """What work(callbacks) gives, which runs in another thread.

    `progress` is called in the caller's thread. Whatever is raised here meanwhile, KeyboardInterrupt above all, cancels
    the work and is raised once that has ended, or after a moment: a step of the library that cannot be broken off ends
    by itself, and its thread then frees all that it holds. Warnings come after the work.
    """
    news: "queue.SimpleQueue[Optional[Progress]]" = queue.SimpleQueue()
    lines: "list[str]" = []
    outcome: "list[Any]" = []
    cancel = Handle.made_by("cancel", "cancel_new")

    def on_progress(_user: Any, at: Any) -> None:
        p = at.contents
        news.put(Progress((p.phase or b"").decode("utf-8", "replace"), p.iteration, p.iterations, p.energy,
                          p.gradient_norm, p.fraction if p.fraction >= 0 else None))

    def on_warning(_user: Any, line: bytes) -> None:
        lines.append(with_keywords(line.decode("utf-8", "replace")))

    callbacks = Callbacks(ctypes.sizeof(Callbacks), None, ProgressFunction(on_progress) if progress else ProgressFunction(0),
                          WarningFunction(on_warning), cancel.value)

    def body() -> None:
        try:
            outcome.append((work(byref(callbacks)), None))
        except BaseException as error:
            outcome.append((None, error))
        finally:
            news.put(None)

    worker = threading.Thread(target=body, name="bisector")
    try:
        worker.start()
        while True:
            item = news.get()
            if item is None:
                break
            if progress is not None:
                progress(item)
        worker.join()
    except BaseException:
        call("cancel_request", cancel.value)
        if worker.is_alive():
            worker.join(_PATIENCE)
        raise
    value, error = outcome.pop()
    for line in lines:
        warnings.warn(line, BisectorWarning, stacklevel=_callers_level())
    if error is not None:
        try:
            raise error
        finally:
            del error
    return value  # type: ignore[no-any-return]


def word(name: str, value: Any) -> Optional[str]:
    """An option's value as the command line has it; None for a switch."""
    if value is True:
        return None
    if value is False:
        return "false"
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    try:
        return str(operator.index(value))
    except TypeError:
        pass
    try:
        return repr(float(value))
    except (TypeError, ValueError):
        raise Error(f"{name}: a {type(value).__name__} is neither a word nor a number") from None


@functools.lru_cache(maxsize=None)
def _switches(command: str) -> "frozenset[str]":
    options = json.loads(text("describe", command.encode()))
    return frozenset(option["name"].replace("-", "_") for option in options if option["is_switch"])


def set_options(options: Handle, command: str, values: "dict[str, Any]") -> None:
    """Sets those that are not None; False leaves a switch off."""
    for name, value in values.items():
        if value is None or (value is False and name in _switches(command)):
            continue
        given = word(name, value)
        encoded = None if given is None else os.fsencode(given)
        if encoded is not None and b"\0" in encoded:
            raise Error(f"{name}: a value has no null characters")
        call("options_set", options.value, name.replace("_", "-").encode(), encoded)
