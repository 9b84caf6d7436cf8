"""The functions and structs of selvedge.h."""

from __future__ import annotations

import ctypes as c
import ctypes.util
import os
import pathlib
import sys
from typing import Any

ABI_VERSION = 1 << 16


class Error(Exception):
    """A call that failed: its reason, and `status`, a number of `selvedge_status`."""

    def __init__(self, status: int, reason: str) -> None:
        super().__init__(reason or f"status {status}")
        self.status = status


class Sized(c.Structure):
    """A struct that begins with its size, which is set here."""

    def __init__(self, **values: Any) -> None:
        super().__init__(struct_size=c.sizeof(self), **values)


class Pattern(Sized):
    _fields_ = [
        ("struct_size", c.c_size_t),
        ("ends", c.c_uint32),
        ("picks", c.c_uint32),
        ("warp_up", c.c_void_p),
        ("end_types", c.c_void_p),
        ("pick_types", c.c_void_p),
        ("end_colors", c.c_void_p),
        ("pick_colors", c.c_void_p),
        ("end_pitch", c.c_double),
        ("pick_pitch", c.c_double),
        ("end_diameters", c.c_void_p),
        ("pick_diameters", c.c_void_p),
    ]


class FabricInfo(Sized):
    _fields_ = [
        ("struct_size", c.c_size_t),
        ("ends", c.c_uint32),
        ("picks", c.c_uint32),
        ("yarns", c.c_uint32),
        ("reserved", c.c_uint32),
        ("width", c.c_double),
        ("height", c.c_double),
    ]


class ParameterInfo(Sized):
    _fields_ = [
        ("struct_size", c.c_size_t),
        ("name", c.c_char * 32),
        ("meaning", c.c_char * 96),
        ("unit", c.c_char * 8),
        ("choices", c.c_char * 64),
        ("kind", c.c_uint32),
        ("is_of_cloth", c.c_uint32),
        ("low", c.c_double),
        ("high", c.c_double),
        ("default_value", c.c_double * 3),
    ]


class ShaderInfo(Sized):
    _fields_ = [
        ("struct_size", c.c_size_t),
        ("bytes", c.c_uint64),
        ("yarns", c.c_uint32),
        ("has_gaps", c.c_uint32),
    ]


class Normalization(Sized):
    _fields_ = [
        ("struct_size", c.c_size_t),
        ("factor", c.c_double * 2),
        ("max_albedo", c.c_double * 2),
        ("upper_bound", c.c_double * 2),
    ]


class Positions(c.Structure):
    _fields_ = [("component", c.c_void_p * 2), ("stride", c.c_ssize_t)]


class Vectors(c.Structure):
    _fields_ = [("component", c.c_void_p * 3), ("stride", c.c_ssize_t)]


class Numbers(c.Structure):
    _fields_ = [("values", c.c_void_p), ("stride", c.c_ssize_t)]


class Points(Sized):
    _fields_ = [
        ("struct_size", c.c_size_t),
        ("count", c.c_size_t),
        ("uv", Positions),
        ("wi", Vectors),
        ("wo", Vectors),
        ("xi", Vectors),
        ("footprint", Numbers),
        ("active", Numbers),
        ("lobes", c.c_uint32),
        ("sides", c.c_uint32),
    ]


TextureValue = c.CFUNCTYPE(
    None, c.c_void_p, c.POINTER(c.c_double), c.c_double, c.POINTER(c.c_float)
)

_HANDLE, _TEXT, _SIZE, _U32, _STRUCT = c.c_void_p, c.c_char_p, c.c_size_t, c.c_uint32, c.c_void_p
_TO_HANDLE, _MESSAGE = c.POINTER(c.c_void_p), (c.c_char_p, c.c_size_t)

# The arguments of each function that returns a status.
_FUNCTIONS: dict[str, tuple[Any, ...]] = {
    "draft_new": (_TEXT, _SIZE, *_MESSAGE, _TO_HANDLE),
    "draft_load": (_TEXT, *_MESSAGE, _TO_HANDLE),
    "draft_from_pattern": (_STRUCT, *_MESSAGE, _TO_HANDLE),
    "draft_warnings": (_HANDLE, _TEXT, _SIZE, c.POINTER(c.c_size_t)),
    "fabric_new": (_HANDLE, _TEXT, _SIZE, *_MESSAGE, _TO_HANDLE),
    "fabric_load": (_TEXT, *_MESSAGE, _TO_HANDLE),
    "fabric_describe": (_HANDLE, *_MESSAGE, _STRUCT),
    "fabric_warp_up": (_HANDLE, _SIZE, *_MESSAGE, c.c_void_p),
    "fabric_yarns": (_HANDLE, _U32, _SIZE, *_MESSAGE, c.c_void_p),
    "fabric_value": (_HANDLE, _U32, _U32, *_MESSAGE, c.POINTER(c.c_double)),
    "fabric_set_value": (_HANDLE, _U32, _U32, c.POINTER(c.c_double), *_MESSAGE),
    "fabric_set_texture": (
        *(_HANDLE, _U32, _U32, TextureValue, c.c_void_p, c.c_float, c.c_float),
        *_MESSAGE,
    ),
    "parameter_describe": (_U32, *_MESSAGE, _STRUCT),
    "parameter_find": (_TEXT, *_MESSAGE, c.POINTER(c.c_uint32)),
    "shader_new": (_HANDLE, *_MESSAGE, _TO_HANDLE),
    "shader_describe": (_HANDLE, *_MESSAGE, _STRUCT),
    "shader_warnings": (_HANDLE, _TEXT, _SIZE, c.POINTER(c.c_size_t)),
    "fabric_set_divisors": (_HANDLE, _U32, c.c_void_p, _SIZE, *_MESSAGE),
    "shader_divisors": (_HANDLE, _U32, _SIZE, *_MESSAGE, c.c_void_p, c.POINTER(c.c_size_t)),
    "shader_normalization": (_HANDLE, _U32, *_MESSAGE, _STRUCT),
    "shader_eval_batch": (_HANDLE, _STRUCT, *_MESSAGE, _STRUCT),
    "shader_eval_lobes_batch": (_HANDLE, _STRUCT, *_MESSAGE, _STRUCT, _STRUCT),
    "shader_pdf_batch": (_HANDLE, _STRUCT, *_MESSAGE, _STRUCT),
    "shader_reverse_pdf_batch": (_HANDLE, _STRUCT, *_MESSAGE, _STRUCT),
    "shader_eval_pdf_batch": (_HANDLE, _STRUCT, *_MESSAGE, _STRUCT, _STRUCT),
    "shader_sample_batch": (_HANDLE, _STRUCT, *_MESSAGE, _STRUCT, _STRUCT, _STRUCT),
    "shader_albedo_batch": (_HANDLE, _STRUCT, *_MESSAGE, _STRUCT),
    "shader_opacity_batch": (_HANDLE, _STRUCT, *_MESSAGE, _STRUCT),
    "shader_yarn_at_batch": (_HANDLE, _STRUCT, *_MESSAGE, c.c_void_p),
}


def _find() -> str:
    name = {"win32": "selvedge.dll", "darwin": "libselvedge.dylib"}.get(
        sys.platform, "libselvedge.so"
    )
    here = pathlib.Path(__file__).resolve().parent
    places = [pathlib.Path(os.environ.get("SELVEDGE_LIBRARY", "")), here / name]
    for place in places:
        if place.is_file():
            return str(place)
    installed = ctypes.util.find_library("selvedge")
    if installed:
        return installed
    raise ImportError(
        f"{name}: not in the package, nor installed, expected it there or at the path in "
        "SELVEDGE_LIBRARY"
    )


def _load() -> c.CDLL:
    library = c.CDLL(_find())
    library.selvedge_abi_version.restype = c.c_uint32
    found = library.selvedge_abi_version()
    if found >> 16 != ABI_VERSION >> 16 or found < ABI_VERSION:
        raise ImportError(f"libselvedge: interface {found:#x}, expected {ABI_VERSION:#x} or later")
    library.selvedge_version_string.restype = c.c_char_p
    library.selvedge_parameter_count.restype = c.c_uint32
    for kind in ("draft", "fabric", "shader"):
        free = getattr(library, f"selvedge_{kind}_free")
        free.argtypes, free.restype = (c.c_void_p,), None
    for name, arguments in _FUNCTIONS.items():
        function = getattr(library, f"selvedge_{name}")
        function.argtypes, function.restype = arguments, c.c_uint32
    return library


LIBRARY = _load()


def call(name: str, *arguments: Any, outputs: tuple[Any, ...] = ()) -> None:
    """Calls `selvedge_NAME(arguments, message, message_size, outputs)`; raises `Error`."""
    message = c.create_string_buffer(1024)
    function = getattr(LIBRARY, f"selvedge_{name}")
    status = function(*arguments, message, len(message), *outputs)
    if status != 0:
        raise Error(status, message.value.decode())


def made(name: str, *arguments: Any) -> int:
    """The handle that a function makes."""
    handle = c.c_void_p()
    call(name, *arguments, outputs=(c.byref(handle),))
    assert handle.value is not None
    return handle.value


def text(name: str, handle: int) -> str:
    """What a function that writes a text of any length writes."""
    function, length = getattr(LIBRARY, f"selvedge_{name}"), c.c_size_t()
    function(handle, None, 0, c.byref(length))
    buffer = c.create_string_buffer(length.value + 1)
    function(handle, buffer, len(buffer), c.byref(length))
    return buffer.value.decode()
