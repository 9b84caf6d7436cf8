"""Woven cloth from a weaver's draft: how it reflects light, over arrays of numpy.

>>> import selvedge
>>> fabric = selvedge.Fabric.load("denim.json")          # or a draft, "tartan.wif"
>>> shader = selvedge.Shader(fabric)
>>> shader.eval(uv=[1e-3, 2e-3], wi=[0.6, 0, 0.8], wo=[0, 0, 1])   # doctest: +SKIP

Positions are metres along the cloth, u along the weft and v along the warp. Directions are unit vectors
away from the surface, `wi` to the light and `wo` to the viewer, in the shading frame: x along the weft, y
along the warp, z the normal of the face. Colours are linear, with the primaries of sRGB. Values of the
BRDF are in 1/sr, without the cosine.

Arrays are any whose last axis is that of components; the others broadcast. float64 positions and float32
directions are read where they lie, in whatever order and with whatever strides, if their points have a
common one. A `Draft` and a `Shader` may be used by many threads at a time, which the calls let run; a
`Fabric` while none changes it.
"""

from __future__ import annotations

import ctypes as c
import dataclasses
import json as _json
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _library
from ._library import Error
from ._points import Array, Batch

__all__ = ["YARN_POINT", "Draft", "Error", "Fabric", "Parameter", "Shader", "parameters", "version"]

NO_TYPE = 0xFFFF_FFFF

#: What `Shader.yarn_at` finds. `kind`: 0 a gap, where all else is 0, 1 on top, 2 dipping under the
#: thread on top, 3 between two threads that cover it, 4 never covered. Lengths are in cells, angles in
#: radians, `normal` and `tangent` in the shading frame.
YARN_POINT = np.dtype(
    [
        ("struct_size", np.uintp),
        *[(name, np.uint32) for name in ("kind", "is_warp", "yarn", "thread", "crossings", "reserved")],
        *[(name, np.int64) for name in ("line", "first")],
        *[(name, np.float64) for name in ("x", "y", "length", "width", "u", "v")],
        *[(name, np.float64, 3) for name in ("normal", "tangent")],
    ]
)


def version() -> str:
    """The version of the library."""
    return str(_library.LIBRARY.selvedge_version_string().decode())


class _Owner:
    """A handle that is freed with its object."""

    _free: Callable[[int], None]
    _handle: int | None = None

    def __del__(self) -> None:
        if self._handle is not None:
            type(self)._free(self._handle)

    @property
    def handle(self) -> int:
        """The address of the C object, which this one frees."""
        assert self._handle is not None
        return self._handle


class Draft(_Owner):
    """A weaving draft, from the bytes of a WIF file."""

    _free = _library.LIBRARY.selvedge_draft_free

    def __init__(self, wif: bytes) -> None:
        self._handle = _library.made("draft_new", wif, len(wif))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Draft:
        """The draft in a WIF file."""
        return cls._of("draft_load", os.fspath(path).encode())

    @classmethod
    def from_pattern(
        cls,
        warp_up: npt.ArrayLike,
        *,
        end_colors: npt.ArrayLike | None = None,
        pick_colors: npt.ArrayLike | None = None,
        end_types: npt.ArrayLike | None = None,
        pick_types: npt.ArrayLike | None = None,
        pitch: tuple[float, float] = (0.0, 0.0),
        end_diameters: npt.ArrayLike | None = None,
        pick_diameters: npt.ArrayLike | None = None,
    ) -> Draft:
        """A weave without a file: `warp_up[pick, end]` tells whether the end is on top.

        Colours are linear RGB, one for each thread or one for all; types are numbers that a fabric can
        give yarn of its own (`"color"` in its overrides); pitch (of the ends, of the picks) and diameters
        are in metres, 0 where they are not known.
        """
        up = np.ascontiguousarray(np.asarray(warp_up) != 0, dtype=np.uint8)
        if up.ndim != 2:
            raise ValueError(f"warp_up: shape {up.shape}, expected (picks, ends)")
        picks, ends = up.shape
        kept: list[Array] = [up]

        def pointer(values: npt.ArrayLike | None, shape: tuple[int, ...], dtype: Any) -> int | None:
            if values is None:
                return None
            kept.append(np.ascontiguousarray(np.broadcast_to(np.asarray(values, dtype), shape)))
            return int(kept[-1].ctypes.data)

        pattern = _library.Pattern(
            ends=ends,
            picks=picks,
            warp_up=up.ctypes.data,
            end_types=pointer(end_types, (ends,), np.uint32),
            pick_types=pointer(pick_types, (picks,), np.uint32),
            end_colors=pointer(end_colors, (ends, 3), np.float32),
            pick_colors=pointer(pick_colors, (picks, 3), np.float32),
            end_pitch=pitch[0],
            pick_pitch=pitch[1],
            end_diameters=pointer(end_diameters, (ends,), np.float64),
            pick_diameters=pointer(pick_diameters, (picks,), np.float64),
        )
        return cls._of("draft_from_pattern", c.byref(pattern))

    @classmethod
    def _of(cls, function: str, *arguments: Any) -> Draft:
        draft = cls.__new__(cls)
        draft._handle = _library.made(function, *arguments)
        return draft

    @property
    def warnings(self) -> str:
        """What was odd about the file: three lines for each warning."""
        return _library.text("draft_warnings", self.handle)


@dataclasses.dataclass(frozen=True)
class Parameter:
    """What a parameter of a fabric is, for a panel."""

    index: int
    name: str
    meaning: str
    unit: str
    kind: str
    """`number`, `color` (three numbers) or `choice` (the name of one of `choices`)."""
    choices: tuple[str, ...]
    is_of_cloth: bool
    """Whether it is one of the cloth; otherwise each type of yarn has its own."""
    low: float
    high: float
    default: float | str | tuple[float, float, float]


Value = float | str | Sequence[float]


def parameters() -> list[Parameter]:
    """All parameters: those of yarn in the order in which a panel would show them, then those of the
    cloth."""
    return [_parameter(index) for index in range(_library.LIBRARY.selvedge_parameter_count())]


def _parameter(index: int) -> Parameter:
    info = _library.ParameterInfo()
    _library.call("parameter_describe", index, outputs=(c.byref(info),))
    choices = tuple(info.choices.decode().split("|")) if info.choices else ()
    kind = ("number", "color", "choice")[info.kind]
    return Parameter(
        index=index,
        name=info.name.decode(),
        meaning=info.meaning.decode(),
        unit=info.unit.decode(),
        kind=kind,
        choices=choices,
        is_of_cloth=bool(info.is_of_cloth),
        low=info.low,
        high=info.high,
        default=_value(kind, choices, info.default_value),
    )


def _value(kind: str, choices: tuple[str, ...], value: Any) -> float | str | tuple[float, float, float]:
    if kind == "color":
        return (value[0], value[1], value[2])
    return choices[int(value[0])] if kind == "choice" else float(value[0])


def _find(name: str) -> Parameter:
    index = c.c_uint32()
    _library.call("parameter_find", name.encode(), outputs=(c.byref(index),))
    return _parameter(index.value)


class Fabric(_Owner):
    """A draft woven of yarn, whose parameters can be read and set."""

    _free = _library.LIBRARY.selvedge_fabric_free

    def __init__(self, draft: Draft, json: str | Mapping[str, Any] = "{}") -> None:
        """`json` is what a fabric file says but for its draft, as text or as a dictionary."""
        text = json if isinstance(json, str) else _json.dumps(json)
        data = text.encode()
        self._handle = _library.made("fabric_new", draft.handle, data, len(data))
        self._textures: list[Any] = []

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Fabric:
        """The fabric in a file, with its draft; or a draft alone, woven of the default yarn."""
        fabric = cls.__new__(cls)
        fabric._textures = []
        fabric._handle = _library.made("fabric_load", os.fspath(path).encode())
        return fabric

    def _info(self) -> _library.FabricInfo:
        info = _library.FabricInfo()
        _library.call("fabric_describe", self.handle, outputs=(c.byref(info),))
        return info

    @property
    def yarns(self) -> int:
        """The number of types of yarn."""
        return int(self._info().yarns)

    @property
    def size(self) -> tuple[float, float]:
        """Extent of one repeat along weft and warp, m, before rotation and scale."""
        info = self._info()
        return (info.width, info.height)

    @property
    def warp_up(self) -> npt.NDArray[np.bool_]:
        """Whether the end is on top, by pick and end."""
        info = self._info()
        up = np.zeros((info.picks, info.ends), dtype=np.bool_)
        _library.call("fabric_warp_up", self.handle, up.size, outputs=(up.ctypes.data,))
        return up

    @property
    def end_yarns(self) -> npt.NDArray[np.uint32]:
        """The type of yarn of each end."""
        return self._yarns(0, self._info().ends)

    @property
    def pick_yarns(self) -> npt.NDArray[np.uint32]:
        """The type of yarn of each pick."""
        return self._yarns(1, self._info().picks)

    def _yarns(self, side: int, count: int) -> npt.NDArray[np.uint32]:
        yarns = np.zeros(count, dtype=np.uint32)
        _library.call("fabric_yarns", self.handle, side, count, outputs=(yarns.ctypes.data,))
        return yarns

    def get(self, name: str, yarn: int = 0) -> float | str | tuple[float, float, float]:
        """The parameter `name` of a type of yarn, or of the cloth."""
        parameter, value = _find(name), (c.c_double * 3)()
        _library.call("fabric_value", self.handle, yarn, parameter.index, outputs=(value,))
        return _value(parameter.kind, parameter.choices, value)

    def set(self, name: str, value: Value, yarn: int = 0) -> None:
        """Sets the parameter `name` of a type of yarn, or of the cloth. Shaders that have been made stay
        as they are."""
        parameter = _find(name)
        if isinstance(value, str):
            if value not in parameter.choices:
                expected = ", ".join(parameter.choices) or "a number"
                raise ValueError(f"{name}: {value!r}, expected {expected}")
            value = float(parameter.choices.index(value))
        numbers = [value] if isinstance(value, (int, float)) else list(value)
        if len(numbers) != (3 if parameter.kind == "color" else 1):
            raise ValueError(f"{name}: {len(numbers)} numbers, expected those of a {parameter.kind}")
        three = (c.c_double * 3)(*numbers)
        _library.call("fabric_set_value", self.handle, yarn, parameter.index, three)

    def set_texture(
        self,
        name: str,
        texture: Callable[[float, float, float], float | Sequence[float]],
        value_range: tuple[float, float],
        yarn: int = 0,
    ) -> None:
        """Lets `texture(u, v, footprint)`, metres, determine the parameter `name`: three numbers of a
        color, or one, all within `value_range`. It is called for every point, and slow for that."""

        def value(_user: int | None, uv: Any, footprint: float, rgb: Any) -> None:
            found = texture(uv[0], uv[1], footprint)
            numbers = [found] if isinstance(found, (int, float)) else found
            for k, number in enumerate(numbers[:3]):
                rgb[k] = number

        function = _library.TextureValue(value)
        index = _find(name).index
        _library.call("fabric_set_texture", self.handle, yarn, index, function, None, *value_range)
        self._textures.append(function)

    def set_divisors(self, divisors: npt.ArrayLike, yarn: int = 0) -> None:
        """Has shaders made from now on scale the highlight of a type of yarn as another of the same fabric
        does, whose `Shader.divisors` these are; none has them find their own again."""
        values = np.ascontiguousarray(divisors, dtype=np.float32)
        _library.call("fabric_set_divisors", self.handle, yarn, values.ctypes.data, values.size)


class Shader(_Owner):
    """A cloth ready to be shaded, which never changes.

    `footprint` is the width, m, of what a pixel sees at each point: where it spans a few threads, the mean
    over the repeat gradually takes over, and the mean over the cloth stays the same. 0 shades the points
    themselves. What belongs to one sample gets the same.
    """

    _free = _library.LIBRARY.selvedge_shader_free

    def __init__(self, fabric: Fabric) -> None:
        self._handle = _library.made("shader_new", fabric.handle)
        # Textures are called as long as this lives.
        self._textures = list(fabric._textures)

    def eval(
        self,
        uv: npt.ArrayLike,
        wi: npt.ArrayLike,
        wo: npt.ArrayLike,
        *,
        lobes: str = "both",
        sides: str = "both",
        footprint: npt.ArrayLike = 0,
        active: npt.ArrayLike | None = None,
        out: Array | None = None,
    ) -> Array:
        """The BRDF, 1/sr, without the cosine; of `lobes` (`both`, `specular`, `diffuse`); with the back
        black if `sides` is `face`. Points that are not `active` are 0, or stay as `out` has them."""
        batch = Batch({"uv": uv, "wi": wi, "wo": wo}, active, lobes, sides, footprint)
        f, places = batch.vectors(out)
        batch.call("eval", self.handle, places)
        return f

    def eval_lobes(
        self,
        uv: npt.ArrayLike,
        wi: npt.ArrayLike,
        wo: npt.ArrayLike,
        *,
        sides: str = "both",
        footprint: npt.ArrayLike = 0,
        active: npt.ArrayLike | None = None,
    ) -> tuple[Array, Array]:
        """The highlight and the diffuse reflection, whose sum is the BRDF."""
        batch = Batch({"uv": uv, "wi": wi, "wo": wo}, active, "both", sides, footprint)
        (specular, to_specular), (diffuse, to_diffuse) = batch.vectors(), batch.vectors()
        batch.call("eval_lobes", self.handle, to_specular, to_diffuse)
        return specular, diffuse

    def pdf(
        self,
        uv: npt.ArrayLike,
        wi: npt.ArrayLike,
        wo: npt.ArrayLike,
        *,
        sides: str = "both",
        footprint: npt.ArrayLike = 0,
        active: npt.ArrayLike | None = None,
    ) -> Array:
        """The density, 1/sr, with which `sample` draws `wi` for `wo`."""
        batch = Batch({"uv": uv, "wi": wi, "wo": wo}, active, "both", sides, footprint)
        pdf, places = batch.numbers()
        batch.call("pdf", self.handle, places)
        return pdf

    def reverse_pdf(
        self,
        uv: npt.ArrayLike,
        wi: npt.ArrayLike,
        wo: npt.ArrayLike,
        *,
        sides: str = "both",
        footprint: npt.ArrayLike = 0,
        active: npt.ArrayLike | None = None,
    ) -> Array:
        """The density, 1/sr, with which `sample` would draw `wo` for `wi`."""
        batch = Batch({"uv": uv, "wi": wi, "wo": wo}, active, "both", sides, footprint)
        pdf, places = batch.numbers()
        batch.call("reverse_pdf", self.handle, places)
        return pdf

    def eval_pdf(
        self,
        uv: npt.ArrayLike,
        wi: npt.ArrayLike,
        wo: npt.ArrayLike,
        *,
        lobes: str = "both",
        sides: str = "both",
        footprint: npt.ArrayLike = 0,
        active: npt.ArrayLike | None = None,
    ) -> tuple[Array, Array]:
        """Both `eval` and `pdf`."""
        batch = Batch({"uv": uv, "wi": wi, "wo": wo}, active, lobes, sides, footprint)
        (f, to_f), (pdf, to_pdf) = batch.vectors(), batch.numbers()
        batch.call("eval_pdf", self.handle, to_f, to_pdf)
        return f, pdf

    def sample(
        self,
        uv: npt.ArrayLike,
        wo: npt.ArrayLike,
        xi: npt.ArrayLike,
        *,
        lobes: str = "both",
        sides: str = "both",
        footprint: npt.ArrayLike = 0,
        active: npt.ArrayLike | None = None,
    ) -> tuple[Array, Array, Array]:
        """Directions drawn by three numbers `xi` in [0, 1), their weights f cos / pdf, and densities.
        A draw whose density is 0 counts as a sample that reflects nothing."""
        batch = Batch({"uv": uv, "wo": wo, "xi": xi}, active, lobes, sides, footprint)
        (wi, to_wi), (weight, to_weight) = batch.vectors(), batch.vectors()
        pdf, to_pdf = batch.numbers()
        batch.call("sample", self.handle, to_wi, to_weight, to_pdf)
        return wi, weight, pdf

    def albedo(
        self,
        uv: npt.ArrayLike,
        wo: npt.ArrayLike,
        *,
        sides: str = "both",
        footprint: npt.ArrayLike = 0,
        active: npt.ArrayLike | None = None,
    ) -> Array:
        """The share of the light from all sides that is reflected to `wo`, good to some hundredths."""
        batch = Batch({"uv": uv, "wo": wo}, active, "both", sides, footprint)
        albedo, places = batch.vectors()
        batch.call("albedo", self.handle, places)
        return albedo

    def opacity(
        self,
        uv: npt.ArrayLike,
        *,
        footprint: npt.ArrayLike = 0,
        active: npt.ArrayLike | None = None,
    ) -> Array:
        """The share of the light that does not pass straight through the cloth; 0 in a gap."""
        batch = Batch({"uv": uv}, active, footprint=footprint)
        opacity, places = batch.numbers()
        batch.call("opacity", self.handle, places)
        return opacity

    def yarn_at(self, uv: npt.ArrayLike, *, active: npt.ArrayLike | None = None) -> Array:
        """Which piece of yarn the face shows, as an array of `YARN_POINT`."""
        batch = Batch({"uv": uv}, active)
        found = np.zeros(batch.shape, dtype=YARN_POINT)
        found["struct_size"] = YARN_POINT.itemsize
        batch.call("yarn_at", self.handle, found.ctypes.data)
        return found

    def normalization(self, yarn: int = 0) -> dict[str, tuple[float, float]]:
        """`factor` by which the highlight of a type of yarn is scaled, and the `max_albedo` and its
        `upper_bound` that it rests on: for endless pieces of yarn and for the shortest."""
        found = _library.Normalization()
        _library.call("shader_normalization", self.handle, yarn, outputs=(c.byref(found),))
        return {
            name: (getattr(found, name)[0], getattr(found, name)[1])
            for name in ("factor", "max_albedo", "upper_bound")
        }

    def divisors(self, yarn: int = 0) -> npt.NDArray[np.float32]:
        """What the highlight of a type of yarn is divided by, found when the shader was made."""
        count = c.c_size_t()
        _library.call("shader_divisors", self.handle, yarn, 0, outputs=(None, c.byref(count)))
        found = np.zeros(count.value, dtype=np.float32)
        outputs = (found.ctypes.data, c.byref(count))
        _library.call("shader_divisors", self.handle, yarn, found.size, outputs=outputs)
        return found

    def _info(self) -> _library.ShaderInfo:
        info = _library.ShaderInfo()
        _library.call("shader_describe", self.handle, outputs=(c.byref(info),))
        return info

    @property
    def nbytes(self) -> int:
        """The memory that it takes, bytes."""
        return int(self._info().bytes)

    @property
    def has_gaps(self) -> bool:
        """Whether something may show between the yarns."""
        return bool(self._info().has_gaps)

    @property
    def warnings(self) -> str:
        """What the fabric said in vain or could not be shaded as it said: a line for each."""
        return _library.text("shader_warnings", self.handle)
