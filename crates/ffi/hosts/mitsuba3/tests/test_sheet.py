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

SIZE, SAMPLES, SEEDS, DEPTH = 96, 32, 10, 4


def blocks(pictures: np.ndarray) -> np.ndarray:
    """Means over 8 by 8 pixels. The threads are as fine as pixels are, and `selvedge render` shades the mean over the
    width of a ray, so that single pixels show another beat of threads and pixels."""
    return pictures.reshape(len(pictures), SIZE // 8, 8, SIZE // 8, 8, 3).mean(axis=(2, 4))


class Sheet(unittest.TestCase):
    def test_both_renderers_draw_the_same(self) -> None:
        bsdf = mi.load_dict({"type": "selvedge", "filename": str(DENIM), "uv_scale": 0.16})
        scenes = [
            sheet.scene(bsdf, {name: light}, SIZE, DEPTH) for name, light in sheet.lights().items()
        ]
        start = time.perf_counter()
        theirs = [
            sum(np.array(mi.render(scene, spp=SAMPLES, seed=seed)) for scene in scenes)
            for seed in range(SEEDS)
        ]
        middle = time.perf_counter()
        ours = [self.render(seed) for seed in range(SEEDS)]
        end = time.perf_counter()
        samples = SIZE * SIZE * SAMPLES * SEEDS / 1e6
        print(f"Mitsuba: {2 * samples / (middle - start):.3f} million samples/s")
        print(f"selvedge render: {samples / (end - middle):.3f} million samples/s")

        a, b = (blocks(np.array(pictures, dtype=np.float64)) for pictures in (theirs, ours))
        difference = abs(a.mean() / b.mean() - 1)
        print(f"relative difference of the means: {difference:.5f}")
        self.assertLessEqual(difference, 0.01)
        # Each value is a mean over seeds. What is the same in all of them is sky.
        error = (a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / SEEDS
        noisy = error > 1e-12
        z = ((a.mean(axis=0) - b.mean(axis=0))[noisy]) / np.sqrt(error[noisy])
        print(f"z over {z.size} values: mean square {np.mean(z**2):.3f}, greatest {abs(z).max():.2f}")
        # Student's t of 18 degrees of freedom has a mean square of 18/16 and is above 6 in one of 10^5.
        self.assertLess(np.mean(z**2), 2)
        self.assertLess(abs(z).max(), 6)

    def render(self, seed: int) -> np.ndarray:
        with tempfile.TemporaryDirectory() as folder:
            whole, beauty = f"{folder}/whole.exr", f"{folder}/beauty.exr"
            program = os.environ["SELVEDGE_PROGRAM"]
            size = ["--size", f"{SIZE}x{SIZE}", "--depth", str(DEPTH)]
            work = ["--spp", str(SAMPLES), "--seed", str(seed), "--quiet"]
            command = [program, "render", "scene:sheet", *size, *work, "-o", whole]
            subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
            take = [program, "image", "convert", whole, "--layer", "beauty", "-o", beauty]
            subprocess.run(take, check=True)
            return np.array(mi.Bitmap(beauty))[..., :3]


if __name__ == "__main__":
    unittest.main()
