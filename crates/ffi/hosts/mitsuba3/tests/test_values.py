"""What the BSDF gives in either kind of variant is what the shader gives, bit for bit."""

import pathlib
import unittest

import drjit as dr
import mitsuba as mi
import numpy as np
import selvedge

FIXTURES = pathlib.Path(__file__).resolve().parents[5] / "fixtures"
DENIM = FIXTURES / "fabrics/denim.json"
GAUZE = FIXTURES / "fabrics/cotton-gauze.json"
UV_SCALE = 0.02
WI = np.array([0.6, 0, 0.8], dtype=np.float32)
WO = np.array([-0.48, 0.64, 0.6], dtype=np.float32)


def setUpModule() -> None:
    mi.set_variant("llvm_ad_rgb")
    import selvedge_mitsuba  # noqa: F401


def places(count: int) -> np.ndarray:
    return np.random.default_rng(5).random((count, 2)).astype(np.float32)


def values(path: pathlib.Path, uv: np.ndarray, **more):
    """f cos and density for two fixed directions at each uv, from the variant that is chosen."""
    bsdf = mi.load_dict({"type": "selvedge", "filename": str(path), "uv_scale": UV_SCALE, **more})
    context = mi.BSDFContext()
    if dr.is_jit_v(mi.Float):
        si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
        si.uv, si.wi = mi.Point2f(uv.T.copy()), mi.Vector3f(*WI.tolist())
        f, pdf = bsdf.eval_pdf(context, si, mi.Vector3f(*WO.tolist()))
        return np.array(f).T, np.array(pdf)
    found = []
    for at in uv:
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.uv, si.wi = mi.Point2f(*at.tolist()), mi.Vector3f(*WI.tolist())
        found.append(bsdf.eval_pdf(context, si, mi.Vector3f(*WO.tolist())))
    return np.array([np.array(f) for f, _ in found]), np.array([pdf for _, pdf in found])


class Values(unittest.TestCase):
    def test_variants_give_the_bits_of_the_shader(self) -> None:
        uv = places(500)
        for path in (DENIM, GAUZE):
            shader = selvedge.Shader(selvedge.Fabric.load(path))
            at = uv.astype(np.float64) * UV_SCALE
            f, pdf = shader.eval_pdf(at, WO, WI)
            opacity = shader.opacity(at)
            expected = (f * abs(WO[2])).astype(np.float32), pdf * opacity
            self.assertGreater(expected[0].max(), 0)
            for variant in ("llvm_ad_rgb", "scalar_rgb"):
                mi.set_variant(variant)
                for found, wanted in zip(values(path, uv), expected, strict=True):
                    found = found.astype(np.float32)
                    np.testing.assert_array_equal(found.view(np.uint32), wanted.view(np.uint32), variant)

    def test_footprints_are_given_or_those_of_pixels(self) -> None:
        shader = selvedge.Shader(selvedge.Fabric.load(DENIM))
        uv = places(200)
        at = uv.astype(np.float64) * UV_SCALE
        widths = np.geomspace(1e-4, 1e-1, 200).astype(np.float32)
        for variant in ("llvm_ad_rgb", "scalar_rgb"):
            mi.set_variant(variant)
            for width in (2e-3, 1.0):
                f, pdf = values(DENIM, uv, footprint=width)
                expected = shader.eval_pdf(at, WO, WI, footprint=width)
                opacity = shader.opacity(at, footprint=width)
                np.testing.assert_array_equal(pdf.astype(np.float32), expected[1] * opacity)
                np.testing.assert_array_equal(f.astype(np.float32), expected[0] * abs(WO[2]))
        mi.set_variant("llvm_ad_rgb")
        bsdf = mi.load_dict(
            {"type": "selvedge", "filename": str(DENIM), "uv_scale": UV_SCALE, "footprint": 0.0}
        )
        si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
        si.uv, si.wi = mi.Point2f(uv.T.copy()), mi.Vector3f(*WI.tolist())
        si.duv_dx = mi.Vector2f(mi.Float(widths / UV_SCALE), 0)
        si.duv_dy = mi.Vector2f(0, mi.Float(2 * widths / UV_SCALE))
        f = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*WO.tolist()))).T
        expected = shader.eval(at, WO, WI, footprint=widths) * abs(WO[2])
        np.testing.assert_allclose(f, expected, rtol=1e-4)

    def test_light_passes_through_gaps(self) -> None:
        mi.set_variant("llvm_ad_rgb")
        gauze = mi.load_dict({"type": "selvedge", "filename": str(GAUZE), "uv_scale": UV_SCALE})
        uv, xi = places(20000), np.random.default_rng(6).random((3, 20000)).astype(np.float32)
        si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
        si.uv, si.wi = mi.Point2f(uv.T.copy()), mi.Vector3f(*WI.tolist())
        shader = selvedge.Shader(selvedge.Fabric.load(GAUZE))
        opacity = shader.opacity(uv.astype(np.float64) * UV_SCALE)
        self.assertTrue(0.05 < np.mean(opacity == 0) < 0.95)
        passing = np.array(gauze.eval_null_transmission(si))[0]
        np.testing.assert_array_equal(passing, 1 - opacity)
        drawn, weight = gauze.sample(mi.BSDFContext(), si, mi.Float(xi[0]), mi.Point2f(xi[1:]))
        is_null = np.array(drawn.sampled_type) == +mi.BSDFFlags.Null
        np.testing.assert_array_equal(is_null, opacity == 0)
        np.testing.assert_array_equal(np.array(drawn.wo).T[is_null], np.tile(-WI, (is_null.sum(), 1)))
        np.testing.assert_array_equal(np.array(weight).T[is_null], 1)

    def test_parameters_and_textures_are_taken_from_the_scene(self) -> None:
        mi.set_variant("llvm_ad_rgb")
        halves = np.zeros((2, 2, 3), dtype=np.float32)
        halves[:, 1] = [0.5, 0.25, 0]
        texture = {"type": "bitmap", "bitmap": mi.Bitmap(halves), "raw": True, "filter_type": "nearest"}
        bsdf = mi.load_dict(
            {
                "type": "selvedge",
                "filename": str(FIXTURES / "drafts/plain.wif"),
                "uv_scale": UV_SCALE,
                "specular": {"type": "rgb", "value": 0.0},
                "diffuse": "flat",
                "color": texture,
            }
        )
        si = dr.zeros(mi.SurfaceInteraction3f, 2)
        si.uv, si.wi = mi.Point2f([0.2, 0.7], [0.3, 0.3]), mi.Vector3f(*WI.tolist())
        f = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*WO.tolist()))).T
        expected = np.array([[0, 0, 0], [0.5, 0.25, 0]]) * abs(WO[2]) / np.pi
        np.testing.assert_allclose(f, expected, rtol=1e-5)


if __name__ == "__main__":
    unittest.main()
