"""The C interface (bisector/c.h) through ctypes."""

from __future__ import annotations

import ctypes
import os
from ctypes import POINTER, Structure, byref, c_char_p, c_double, c_int, c_int32, c_int64, c_size_t, c_void_p
from pathlib import Path
from typing import Any

from ._errors import DeviceError, Error

VERSION = 1  # BISECTOR_C_VERSION that this package was written for
NAME = "libbisector_c.so.0"

OK, FAILED, USAGE, DEVICE, NO_MEMORY, CANCELLED, MISUSE = range(7)


class MeshArrays(Structure):
    _fields_ = [
        ("size", c_size_t),
        ("vertices", c_void_p), ("vertex_count", c_size_t),
        ("faces", c_void_p), ("face_count", c_size_t), ("face_offsets", c_void_p),
        ("tets", c_void_p), ("tet_count", c_size_t),
        ("labels", c_void_p), ("label_count", c_size_t),
        ("regions", c_void_p), ("region_count", c_size_t),
        ("feature_edges", c_void_p), ("edge_count", c_size_t),
        ("attributes", c_void_p), ("attribute_count", c_size_t),
    ]


class Attribute(Structure):
    _fields_ = [
        ("name", c_char_p), ("site", c_int32), ("number", c_int32), ("components", c_size_t),
        ("values", c_void_p), ("count", c_size_t),
    ]


class Progress(Structure):
    _fields_ = [
        ("phase", c_char_p), ("iteration", c_int32), ("iterations", c_int32),
        ("energy", c_double), ("gradient_norm", c_double), ("fraction", c_double),
    ]


ProgressFunction = ctypes.CFUNCTYPE(None, c_void_p, POINTER(Progress))
WarningFunction = ctypes.CFUNCTYPE(None, c_void_p, c_char_p)


class Callbacks(Structure):
    _fields_ = [
        ("size", c_size_t), ("user", c_void_p),
        ("progress", ProgressFunction), ("warning", WarningFunction), ("cancel", c_void_p),
    ]


class Array(Structure):
    _fields_ = [("data", c_void_p), ("type", c_int), ("rows", c_size_t), ("columns", c_size_t)]


_SIGNATURES: "dict[str, list[Any]]" = {
    "mesh_from_arrays": [POINTER(MeshArrays), POINTER(c_void_p)],
    "mesh_from_file": [c_char_p, POINTER(c_void_p)],
    "mesh_free": [c_void_p],
    "options_new": [c_char_p, POINTER(c_void_p)],
    "options_set": [c_void_p, c_char_p, c_char_p],
    "options_seeds": [c_void_p, c_void_p, c_size_t],
    "options_density": [c_void_p, c_void_p, c_size_t],
    "options_sizes": [c_void_p, c_void_p, c_void_p, c_size_t, c_void_p, c_size_t],
    "options_keep_vertices": [c_void_p, c_void_p, c_size_t],
    "options_keep_faces": [c_void_p, c_void_p, c_size_t],
    "options_reference": [c_void_p, c_void_p],
    "options_free": [c_void_p],
    "describe": [c_char_p, POINTER(c_char_p)],
    "cancel_new": [POINTER(c_void_p)],
    "cancel_request": [c_void_p],
    "cancel_free": [c_void_p],
    "run": [c_void_p, c_void_p, POINTER(Callbacks), POINTER(c_void_p)],
    "result_array": [c_void_p, c_char_p, POINTER(Array)],
    "result_attribute_count": [c_void_p, POINTER(c_size_t)],
    "result_attribute": [c_void_p, c_size_t, POINTER(Attribute)],
    "result_report": [c_void_p, POINTER(Callbacks), POINTER(c_char_p)],
    "result_save": [c_void_p, c_char_p, c_char_p, POINTER(Callbacks)],
    "result_free": [c_void_p],
    "devices": [POINTER(c_char_p)],
}


def _open() -> ctypes.CDLL:
    given = os.environ.get("BISECTOR_LIBRARY")
    beside = Path(__file__).resolve().parent / "lib" / NAME
    name = given or (str(beside) if beside.exists() else NAME)
    try:
        return ctypes.CDLL(name)
    except OSError as error:
        raise ImportError(
            f"Bisector's library cannot be loaded: {error}; install the wheel, or set BISECTOR_LIBRARY to the path of "
            f"{NAME}") from error


def _load() -> ctypes.CDLL:
    library = _open()
    library.bisector_c_version.restype = c_int32
    if library.bisector_c_version() < VERSION:
        raise ImportError(f"{library._name} is older than this package; install both of one version")
    library.bisector_version.restype = c_char_p
    library.bisector_last_error.restype = c_char_p
    for name, arguments in _SIGNATURES.items():
        function = getattr(library, "bisector_" + name)
        function.argtypes = arguments
        function.restype = c_int
    return library


_library = _load()
version: str = _library.bisector_version().decode()


class Cancelled(Exception):
    """The flag of a call was set."""


def _fail(status: int) -> None:
    message = _library.bisector_last_error().decode("utf-8", "replace")
    if status == DEVICE:
        raise DeviceError(message)
    if status == NO_MEMORY:
        raise MemoryError(message)
    if status == CANCELLED:
        raise Cancelled()
    if status == MISUSE:
        raise RuntimeError(message + "; please report this as a bug")
    raise Error(message)


def call(name: str, *arguments: Any) -> None:
    """Calls bisector_NAME without the interpreter's lock. Raises what its status says."""
    status = getattr(_library, "bisector_" + name)(*arguments)
    if status != OK:
        _fail(status)


def text(name: str, *arguments: Any) -> str:
    """What a function whose last argument is a string to fill in gives."""
    result = c_char_p()
    call(name, *arguments, byref(result))
    assert result.value is not None
    return result.value.decode("utf-8", "replace")


class Handle:
    """An object of the library, freed with this one."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._free = getattr(_library, f"bisector_{kind}_free")
        self.value = c_void_p()

    @classmethod
    def made_by(cls, kind: str, name: str, *arguments: Any) -> "Handle":
        handle = cls(kind)
        call(name, *arguments, byref(handle.value))
        return handle

    def __del__(self) -> None:
        if self.value.value is not None:
            self._free(self.value)
            self.value.value = None


def path_bytes(path: "os.PathLike[str] | str") -> bytes:
    name = os.fsencode(path)
    if b"\0" in name:
        raise Error(f"{os.fspath(path)!r}: a file's name has no null characters")
    return name
