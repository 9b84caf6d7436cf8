"""Textures of Mitsuba as textures of a fabric."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

#: Greatest width and height at which a texture is read.
MOST = 4096


class Picture:
    """A texture read once at its own resolution, looked up by the nearest texel."""

    def __init__(self, texture, uv_scale: float, is_color: bool) -> None:
        resolution = texture.resolution()
        width, height = (min(max(int(n), 1), MOST) for n in (resolution[0], resolution[1]))
        u = (np.arange(width, dtype=np.float32) + 0.5) / width
        v = (np.arange(height, dtype=np.float32) + 0.5) / height
        at_u, at_v = (grid.ravel() for grid in np.meshgrid(u, v))

        def look_up(at):
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.uv = at
            return np.array(texture.eval(si) if is_color else texture.eval_1(si))

        if dr.is_jit_v(mi.Float):
            texels = look_up(mi.Point2f(mi.Float(at_u), mi.Float(at_v)))
            texels = texels.T if is_color else texels[:, None]
        else:
            points = zip(at_u.tolist(), at_v.tolist(), strict=True)
            texels = np.array([look_up(mi.Point2f(*at)) for at in points]).reshape(at_u.size, -1)
        self.range = (float(texels.min()), float(texels.max()))
        # Lists are read faster than arrays, one by one.
        self._rows = texels.reshape(height, width, -1).tolist()
        self._steps = (width / uv_scale, height / uv_scale)

    def __call__(self, u: float, v: float, _footprint: float) -> list[float]:
        rows, (across, up) = self._rows, self._steps
        row = rows[int(v * up // 1) % len(rows)]
        return row[int(u * across // 1) % len(row)]
