"""Arrays of numpy as the points of selvedge.h, without a copy where the layout allows it."""

from __future__ import annotations

import ctypes as c
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _library

Array = npt.NDArray[Any]
Lobes = {"both": 0, "specular": 1, "diffuse": 2}
Sides = {"both": 0, "face": 1}


class Batch:
    """Points of one shape, which keep their arrays alive."""

    def __init__(
        self,
        inputs: dict[str, npt.ArrayLike],
        active: npt.ArrayLike | None = None,
        lobes: str = "both",
        sides: str = "both",
        footprint: npt.ArrayLike = 0,
    ) -> None:
        self._arrays: list[Array] = []
        widths = {"uv": 2, "wi": 3, "wo": 3, "xi": 3}
        arrays = {}
        for name, values in inputs.items():
            array = np.asarray(values, dtype=np.float64 if name == "uv" else np.float32)
            if array.ndim == 0 or array.shape[-1] != widths[name]:
                found = f"{name}: shape {array.shape}, expected (..., {widths[name]})"
                raise ValueError(found)
            arrays[name] = array
        mask = None if active is None else np.asarray(active, dtype=np.bool_)
        widths_seen = np.asarray(footprint, dtype=np.float32)
        shapes = [array.shape[:-1] for array in arrays.values()] + [widths_seen.shape]
        shapes += [] if mask is None else [mask.shape]
        self.shape = np.broadcast_shapes(*shapes)
        self.count = int(np.prod(self.shape))
        self.points = _library.Points(
            count=self.count,
            lobes=_code("lobes", lobes, Lobes),
            sides=_code("sides", sides, Sides),
        )
        for name, array in arrays.items():
            width = (widths[name],)
            flat = np.broadcast_to(array, self.shape + width).reshape((self.count, *width))
            self._arrays.append(flat)
            stride = flat.strides[0]
            fill(getattr(self.points, name), flat, stride)
        if mask is not None:
            self._fill_values(self.points.active, mask)
        if np.any(widths_seen):
            self._fill_values(self.points.footprint, widths_seen)

    def _fill_values(self, values: Any, array: Array) -> None:
        flat = np.broadcast_to(array, self.shape).reshape(self.count)
        self._arrays.append(flat)
        values.values = flat.ctypes.data
        values.stride = flat.strides[0]

    def vectors(self, out: Array | None = None) -> tuple[Array, _library.Vectors]:
        """Where vectors go: a new array of zeros, or `out`."""
        array = self._place(out, (3,))
        flat = array.reshape((self.count, 3))
        places = _library.Vectors()
        fill(places, flat, flat.strides[0])
        return array, places

    def numbers(self, out: Array | None = None) -> tuple[Array, _library.Numbers]:
        """Where numbers go: a new array of zeros, or `out`."""
        array = self._place(out, ())
        flat = array.reshape(self.count)
        return array, _library.Numbers(values=flat.ctypes.data, stride=flat.strides[0])

    def _place(self, out: Array | None, width: tuple[int, ...]) -> Array:
        shape = self.shape + width
        if out is None:
            return np.zeros(shape, dtype=np.float32)
        if out.dtype != np.float32 or out.shape != shape or not out.flags.writeable:
            found = f"out: {out.dtype} of shape {out.shape}, expected writable float32 of {shape}"
            raise ValueError(found)
        # Only what can be seen as one row of points takes what is written.
        if self.count > 0 and not np.shares_memory(out.reshape((self.count, *width)), out):
            raise ValueError("out: points without a common stride, expected one")
        return out

    def call(self, name: str, handle: int, *outputs: Any) -> None:
        """Calls `selvedge_shader_NAME_batch`."""
        outputs = tuple(c.byref(output) if isinstance(output, c.Structure) else output for output in outputs)
        _library.call(f"shader_{name}_batch", handle, c.byref(self.points), outputs=outputs)


def fill(vectors: Any, array: Array, stride: int) -> None:
    """Points `vectors` at the columns of `array`."""
    step = array.strides[1]
    for k in range(array.shape[1]):
        vectors.component[k] = array.ctypes.data + k * step
    vectors.stride = stride


def _code(name: str, word: str, codes: dict[str, int]) -> int:
    if word not in codes:
        raise ValueError(f"{name}: {word!r}, expected one of {', '.join(codes)}")
    return codes[word]
