"""The BSDF itself, for the variant that was chosen when this was imported."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import selvedge

from ._texture import Picture

#: `BSDFFlags::NeedsDifferentials` of Mitsuba's headers, which its module does not name.
NEEDS_DIFFERENTIALS = 0x20000


def _parameter_of(key: str, yarns: int):
    """The parameter that a property names, and the types of yarn it is for."""
    which = range(yarns)
    if key.startswith("yarn") and "_" in key:
        number, rest = key[4:].split("_", 1)
        if number.isdigit():
            key, which = rest, [int(number)]
    for parameter in selvedge.parameters():
        if parameter.name.replace(".", "_") == key:
            return parameter, [0] if parameter.is_of_cloth else which
    return None, []


def _fabric(props) -> selvedge.Fabric:
    """The fabric that the properties name, with its parameters as they say."""
    path = mi.file_resolver().resolve(props["filename"])
    fabric = selvedge.Fabric.load(str(path))
    for key in props.unqueried():
        parameter, yarns = _parameter_of(key, fabric.yarns)
        if parameter is None:
            continue
        value = props[key]
        for yarn in yarns:
            if isinstance(value, mi.Texture) and parameter.kind != "choice":
                picture = Picture(value, props.get("uv_scale", 1.0), is_color=parameter.kind == "color")
                fabric.set_texture(parameter.name, picture, picture.range, yarn)
            elif parameter.kind == "color":
                fabric.set(parameter.name, [float(x) for x in np.ravel(value)], yarn)
            else:
                fabric.set(parameter.name, value, yarn)
    return fabric


class Cloth(mi.BSDF):
    """Woven cloth; see the module."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.uv_scale = float(props.get("uv_scale", 1.0))
        self.shader = selvedge.Shader(_fabric(props))
        both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
        varying = mi.BSDFFlags.SpatiallyVarying | mi.BSDFFlags.Anisotropic
        self.m_components = [
            mi.BSDFFlags.GlossyReflection | varying | both,
            mi.BSDFFlags.DiffuseReflection | varying | both,
            mi.BSDFFlags.Null | mi.BSDFFlags.SpatiallyVarying | both,
        ]
        self.m_flags = self.m_components[0] | self.m_components[1] | self.m_components[2]
        self.footprint = float(props["footprint"]) if "footprint" in props else None
        if self.footprint is not None:
            self.m_flags = int(self.m_flags) | NEEDS_DIFFERENTIALS

    def _lobes(self, ctx):
        """Which lobes a context asks for, in words, or None; and whether light may pass."""
        glossy = ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0)
        diffuse = ctx.is_enabled(mi.BSDFFlags.DiffuseReflection, 1)
        passes = ctx.is_enabled(mi.BSDFFlags.Null, 2)
        words = {(True, True): "both", (True, False): "specular", (False, True): "diffuse"}
        return words.get((glossy, diffuse)), passes

    def _points(self, si, active):
        """Positions in metres, directions to the viewer, which points count, and the width of each, m."""
        uv = _rows(si.uv).astype(np.float64) * self.uv_scale
        return uv, _rows(si.wi), _flags(active), self._widths(si)

    def _widths(self, si):
        """Of what is seen at each point."""
        if self.footprint is None:
            return 0
        # What is told apart along one direction is seen, so the narrower counts.
        of_pixel = np.hypot(_rows(si.duv_dx), _rows(si.duv_dy)).min(axis=-1) * np.float32(self.uv_scale)
        return np.maximum(of_pixel, np.float32(self.footprint))

    def sample(self, ctx, si, sample1, sample2, active=True):
        lobes, passes = self._lobes(ctx)
        uv, wo, mask, widths = self._points(si, active)
        choice, square = _numbers(sample1), _rows(sample2)
        # What is the same for all points comes as a single one.
        shape = np.broadcast_shapes(uv.shape[:-1], wo.shape[:-1], mask.shape, choice.shape)
        uv, wo, mask = np.broadcast_to(uv, (*shape, 2)), np.broadcast_to(wo, (*shape, 3)), np.broadcast_to(mask, shape)
        opacity = np.ones(shape, np.float32)
        if passes:
            opacity = self.shader.opacity(uv, footprint=widths, active=mask)
        opacity = opacity if lobes else np.zeros_like(opacity)
        is_reflected = choice < opacity
        # What is left of the number that chose between passing and reflection is as random.
        left = np.minimum(choice / np.maximum(opacity, 1e-30), np.float32(1 - 2**-24))
        xi = np.stack(np.broadcast_arrays(left, square[..., 0], square[..., 1]), axis=-1)
        kept = mask & is_reflected
        wi, weight, pdf = self.shader.sample(uv, wo, xi, lobes=lobes or "both", footprint=widths, active=kept)
        share = np.maximum(opacity, 1e-30)
        weight = np.where(kept[..., None], weight / share[..., None], 0)
        passing = mask & ~is_reflected if passes else np.zeros_like(mask)
        weight = np.where(passing[..., None], np.float32(1), weight)
        wi = np.where(passing[..., None], -wo, wi)
        pdf = np.where(passing, 1 - opacity, pdf * opacity)

        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = _vector(mi.Vector3f, wi)
        bs.pdf = _vector(mi.Float, np.where(kept | passing, pdf, 0))
        bs.eta = 1
        # Reflection is drawn from both lobes; the diffuse one names it where it is the only one.
        component = 1 if lobes == "diffuse" else 0
        reflection = mi.BSDFFlags.DiffuseReflection if component else mi.BSDFFlags.GlossyReflection
        if dr.is_jit_v(mi.Float):
            passing = mi.Bool(np.ascontiguousarray(passing))
        else:
            passing = bool(passing)
        bs.sampled_type = dr.select(passing, mi.UInt32(+mi.BSDFFlags.Null), mi.UInt32(+reflection))
        bs.sampled_component = dr.select(passing, mi.UInt32(2), mi.UInt32(component))
        return bs, _spectrum(weight)

    def eval(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx, si, wo, active=True):
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(self, ctx, si, wo, active=True):
        lobes, passes = self._lobes(ctx)
        if lobes is None:
            return mi.Spectrum(0), mi.Float(0)
        uv, to_viewer, mask, widths = self._points(si, active)
        wi = _rows(wo)
        f, pdf = self.shader.eval_pdf(uv, wi, to_viewer, lobes=lobes, footprint=widths, active=mask)
        if passes:
            pdf = pdf * self.shader.opacity(uv, footprint=widths, active=mask)
        return _spectrum(f * np.abs(wi[..., 2:])), _vector(mi.Float, pdf)

    def eval_pdf_sample(self, ctx, si, wo, sample1, sample2, active=True):
        f, pdf = self.eval_pdf(ctx, si, wo, active)
        bs, weight = self.sample(ctx, si, sample1, sample2, active)
        return f, pdf, bs, weight

    def eval_null_transmission(self, si, active=True):
        uv, _, mask, widths = self._points(si, active)
        passing = np.where(mask, 1 - self.shader.opacity(uv, footprint=widths, active=mask), 0)
        return _spectrum(passing[..., None].repeat(3, -1))

    def eval_diffuse_reflectance(self, si, active=True):
        uv, wo, mask, widths = self._points(si, active)
        return _spectrum(self.shader.albedo(uv, wo, footprint=widths, active=mask))

    def traverse(self, callback):
        callback.put("uv_scale", self.uv_scale, mi.ParamFlags.NonDifferentiable)

    def to_string(self):
        return f"Cloth[uv_scale={self.uv_scale}, bytes={self.shader.nbytes}]"


def _rows(vectors) -> np.ndarray:
    """Points by component, where they lie: (..., components)."""
    array = np.array(vectors, copy=None)
    return array.T if dr.is_jit_v(mi.Float) else array


def _numbers(values) -> np.ndarray:
    return np.array(values, copy=None)


def _flags(active) -> np.ndarray:
    return np.array(active, dtype=np.bool_)


def _vector(kind, rows: np.ndarray):
    """Points by component as a type of Mitsuba."""
    rows = np.asarray(rows, dtype=np.float32)
    if not dr.is_jit_v(mi.Float):
        return kind(*rows.tolist()) if rows.ndim else kind(float(rows))
    if rows.ndim == 1:
        return kind(np.ascontiguousarray(rows))
    return kind(*[mi.Float(np.ascontiguousarray(column)) for column in rows.T])


def _spectrum(rows: np.ndarray):
    return mi.Spectrum(_vector(mi.Color3f, rows))
