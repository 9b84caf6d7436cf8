"""Mitsuba's own chi-square test: the samples of the cloth have the density that it tells."""

import itertools
import pathlib
import unittest

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

import selvedge  # noqa: E402
import selvedge_mitsuba  # noqa: E402, F401

FABRICS = pathlib.Path(__file__).resolve().parents[5] / "fixtures/fabrics"
NAMES = ["denim", "silk-charmeuse", "tartan-wool", "herringbone-tweed", "duchesse-satin"]
DIRECTIONS = [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (-0.3, 0.8, 0.52), (0.0, 0.6, -0.8)]


def place(name: str, is_warp: bool) -> list[float]:
    """A point on a warp or a weft thread, not in its middle, in metres."""
    fabric = selvedge.Fabric.load(FABRICS / f"{name}.json")
    up = np.random.default_rng(3).random((4000, 2)) * fabric.size
    points = selvedge.Shader(fabric).yarn_at(up)
    fits = (points["kind"] == 1) & (points["is_warp"] == is_warp) & (abs(points["x"]) < 0.6)
    return [float(x) for x in up[np.argmax(fits)]]


def functions(bsdf: mi.BSDF, wi: tuple[float, float, float], uv: list[float]):
    """What draws directions and what tells their density. Mitsuba's own adapter leaves out samples that reflect
    nothing; here they count, since they have a density."""

    def point(count: int) -> mi.SurfaceInteraction3f:
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi, si.uv = list(wi), uv
        return si

    def sample(xi):
        at = point(dr.width(xi))
        drawn, _ = bsdf.sample(mi.BSDFContext(), at, xi[0], mi.Point2f(xi[1], xi[2]))
        # What passes straight through has no density.
        is_reflected = (drawn.pdf > 0) & (drawn.sampled_type != +mi.BSDFFlags.Null)
        return drawn.wo, dr.select(is_reflected, mi.Float(1), 0)

    def pdf(wo):
        return bsdf.pdf(mi.BSDFContext(), point(dr.width(wo)), wo)

    return sample, pdf


class ChiSquare(unittest.TestCase):
    def test_samples_have_their_density(self) -> None:
        from mitsuba.chi2 import ChiSquareTest, SphericalDomain

        count = 0
        for name, wi, is_warp in itertools.product(NAMES, DIRECTIONS, [True, False]):
            if is_warp == (wi == DIRECTIONS[2]):
                continue
            bsdf = {"type": "selvedge", "filename": str(FABRICS / f"{name}.json")}
            if count % 4 == 3:
                # Between points and the mean of all.
                bsdf["footprint"] = 5e-3
            sample, pdf = functions(mi.load_dict(bsdf), wi, place(name, is_warp))
            test = ChiSquareTest(
                domain=SphericalDomain(),
                sample_func=sample,
                pdf_func=pdf,
                sample_dim=3,
                sample_count=200_000,
                res=101,
                ires=8,
                seed=count,
            )
            self.assertTrue(test.run(significance_level=0.01, test_count=40), f"{name} {wi}")
            count += 1
        self.assertGreaterEqual(count, 20)


if __name__ == "__main__":
    unittest.main()
