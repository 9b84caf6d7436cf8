"""The sheet looks the same in Mitsuba and in `selvedge render`, whose program SELVEDGE_PROGRAM names."""

import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

import mitsuba as mi
import numpy as np

HERE = pathlib.Path(__file__).resolve()
DENIM = HERE.parents[5] / "fixtures/fabrics/denim.json"
sys.path.insert(0, str(HERE.parents[1]))
mi.set_variant("llvm_ad_rgb")

import selvedge_mitsuba  # noqa: E402, F401
import sheet  # noqa: E402

SIZE, SAMPLES, SEEDS, DEPTH = 48, 256, 16, 4
#: `selvedge render` averages the cloth over the width of each ray, 0.4 pixels and more where it grazes. So its pixels
#: are this much smaller, each with one sample, and these make the pixels that are compared.
FINE = 16


def blocks(pictures: np.ndarray, size: int) -> np.ndarray:
    """Means over squares of pixels."""
    count, height, width, _ = pictures.shape
    return pictures.reshape(count, height // size, size, width // size, size, 3).mean(axis=(2, 4))


class Sheet(unittest.TestCase):
    def test_both_renderers_draw_the_same(self) -> None:
        # The scene of both: without what is irregular, each thread by itself.
        none = {f"noise_{name}": 0.0 for name in ("intensity", "width", "color")}
        bsdf = mi.load_dict({"type": "selvedge", "filename": str(DENIM), "uv_scale": 0.16, **none})
        scenes = [
            sheet.scene(bsdf, {name: light}, SIZE, DEPTH) for name, light in sheet.lights().items()
        ]
        start = time.perf_counter()
        theirs = np.array(
            [
                sum(np.array(mi.render(scene, spp=SAMPLES, seed=seed), dtype=np.float64) for scene in scenes)
                for seed in range(SEEDS)
            ]
        )
        samples = 2 * SIZE * SIZE * SEEDS * SAMPLES / 1e6
        print(f"Mitsuba: {samples / (time.perf_counter() - start):.3f} million samples/s")
        start = time.perf_counter()
        self.render(0, 256, 32)
        samples = 256 * 256 * 32 / 1e6
        print(f"selvedge render: {samples / (time.perf_counter() - start):.3f} million samples/s")
        fine = (self.render(seed, FINE * SIZE, 1) for seed in range(SEEDS))
        ours = np.concatenate([blocks(picture[None], FINE) for picture in fine])

        difference = abs(theirs.mean() / ours.mean() - 1)
        print(f"relative difference of the means: {difference:.5f}")
        self.assertLessEqual(difference, 0.01)
        # Single pixels, and squares of them, where noise hides less.
        for size in (1, 8):
            a, b = blocks(theirs, size), blocks(ours, size)
            # Each value is a mean over seeds. What is the same in all of them is sky.
            error = (a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / SEEDS
            noisy = error > 1e-12
            z = (a.mean(axis=0) - b.mean(axis=0))[noisy] / np.sqrt(error[noisy])
            found = f"mean square {np.mean(z**2):.3f}, greatest {abs(z).max():.2f}"
            print(f"z over {z.size} values of {size} x {size} pixels: {found}")
            # Student's t of 30 degrees of freedom has a mean square of 30/28, within 0.02 if all values were
            # independent; the noise of a highlight is not normal and adds to its tails.
            self.assertLess(np.mean(z**2), 1.3 if size == 1 else 1.6)
            self.assertLess(abs(z).max(), 6)

    def render(self, seed: int, size: int, samples: int) -> np.ndarray:
        with tempfile.TemporaryDirectory() as folder:
            whole, beauty = f"{folder}/whole.exr", f"{folder}/beauty.exr"
            program = os.environ["SELVEDGE_PROGRAM"]
            what = ["--size", f"{size}x{size}", "--depth", str(DEPTH), "--lod", "near"]
            work = ["--spp", str(samples), "--seed", str(seed), "--quiet"]
            command = [program, "render", "scene:sheet", *what, *work, "-o", whole]
            subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
            take = [program, "image", "convert", whole, "--layer", "beauty", "-o", beauty]
            subprocess.run(take, check=True)
            return np.array(mi.Bitmap(beauty), dtype=np.float64)[..., :3]


if __name__ == "__main__":
    unittest.main()
