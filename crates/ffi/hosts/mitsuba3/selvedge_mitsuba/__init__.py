"""Woven cloth in Mitsuba 3: the BSDF `selvedge`.

>>> import mitsuba as mi
>>> mi.set_variant("llvm_ad_rgb")
>>> import selvedge_mitsuba                                        # registers the BSDF
>>> cloth = {"type": "selvedge", "filename": "denim.json", "uv_scale": 0.08}

The BSDF is registered for the variant that is chosen and for each that is chosen later. Scalar and LLVM variants of
RGB are supported. The loops and calls of the latter are switched to evaluated mode, since a foreign function needs
its arguments as numbers.

Parameters of the BSDF:

- `filename`: a fabric (JSON) or a draft (WIF).
- `uv_scale`: metres along the cloth for 1 of uv (default 1).
- `footprint`: metres that a pixel spans on the cloth, so that threads which cannot be told apart are shaded as one,
  with less noise (default: points are shaded). Where rays know the width of their pixel, that counts if it is
  greater; so far only the integrator `direct` of scalar variants lets them.
- `<parameter>`: a number, or a colour `<parameter>: {"type": "rgb", ...}`, for all types of yarn, or
  `yarn<N>_<parameter>` for one, where a dot is written as `_`: `yarn0_psi`, `noise_intensity`.
  `selvedge.parameters()` lists them. Choices are strings.
- A texture of that name takes the place of the parameter; it is read at its own resolution once.

The x axis of the shading frame is dP/du, along the weft. Light passes through gaps, and through yarn as far as it
is not opaque.
"""

from __future__ import annotations

import importlib
import sys

import drjit as dr
import mitsuba as mi


def register() -> None:
    """Registers the BSDF for the variant that is chosen."""
    name = f"{__name__}.cloth"
    # The class derives from one of the variant.
    loaded = sys.modules.get(name)
    cloth = importlib.reload(loaded) if loaded else importlib.import_module(name)
    if dr.is_jit_v(mi.Float):
        for flag in ("SymbolicLoops", "SymbolicCalls", "SymbolicConditionals"):
            dr.set_flag(getattr(dr.JitFlag, flag), False)
    mi.register_bsdf("selvedge", cloth.Cloth)


if mi.variant() is not None:
    register()
mi.detail.add_variant_callback(lambda _old, _new: register())
