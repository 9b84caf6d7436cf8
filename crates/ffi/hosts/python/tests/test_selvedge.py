"""Tests of the module: `python -m unittest` in this folder, once it is installed."""

import concurrent.futures
import pathlib
import tempfile
import unittest

import numpy as np
import selvedge
from selvedge import _library
from selvedge.__main__ import main

FFI = pathlib.Path(__file__).resolve().parents[3]
FIXTURES = FFI / "../../fixtures"
DENIM = FIXTURES / "fabrics/denim.json"
UP = np.array([0, 0, 1], dtype=np.float32)
LIGHT = np.array([0.6, 0, 0.8], dtype=np.float32)


def positions(count: int) -> np.ndarray:
    return np.stack([1.3e-5 * np.arange(count), 3.1e-5 * np.arange(count)], axis=-1)


class Structs(unittest.TestCase):
    def test_structs_are_those_of_the_header(self) -> None:
        lines = (FFI / "abi.txt").read_text().splitlines()
        listed = dict(line.rsplit(" ", 1) for line in lines if "(" not in line)
        for name, struct in {
            "pattern": _library.Pattern,
            "fabric_info": _library.FabricInfo,
            "parameter": _library.ParameterInfo,
            "shader_info": _library.ShaderInfo,
            "normalization": _library.Normalization,
            "points": _library.Points,
            "positions": _library.Positions,
            "vectors": _library.Vectors,
            "numbers": _library.Numbers,
        }.items():
            self.assertEqual(_library.c.sizeof(struct), int(listed[f"sizeof selvedge_{name}"]), name)
            for field, _ in struct._fields_:
                found = getattr(struct, field).offset
                self.assertEqual(found, int(listed[f"selvedge_{name}.{field}"]), f"{name}.{field}")
        size = int(listed["sizeof selvedge_yarn_point"])
        self.assertEqual(selvedge.YARN_POINT.itemsize, size)
        for field, (_, offset) in selvedge.YARN_POINT.fields.items():
            self.assertEqual(offset, int(listed[f"selvedge_yarn_point.{field}"]), field)


class Fabrics(unittest.TestCase):
    def test_parameters_are_read_and_set(self) -> None:
        fabric = selvedge.Fabric.load(DENIM)
        known = {parameter.name: parameter for parameter in selvedge.parameters()}
        self.assertEqual(known["psi"].unit, "rad")
        self.assertEqual(known["highlight"].choices, ("window", "rough"))
        fabric.set("psi", -0.25, yarn=1)
        fabric.set("color", (0.25, 0.5, 0.75))
        fabric.set("highlight", "window")
        self.assertEqual(fabric.get("psi", yarn=1), -0.25)
        self.assertEqual(fabric.get("color"), (0.25, 0.5, 0.75))
        self.assertEqual(fabric.get("highlight"), "window")
        with self.assertRaisesRegex(selvedge.Error, "psi: 9, expected") as raised:
            fabric.set("psi", 9)
        self.assertEqual(raised.exception.status, 2)
        with self.assertRaisesRegex(ValueError, "highlight: 'matt', expected window, rough"):
            fabric.set("highlight", "matt")
        with self.assertRaisesRegex(selvedge.Error, 'name: "sheen", expected'):
            fabric.get("sheen")

    def test_a_pattern_is_woven_as_it_is_told(self) -> None:
        up = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        draft = selvedge.Draft.from_pattern(
            up, end_colors=[0.5, 0.1, 0.1], pick_colors=[0.1, 0.1, 0.5], pitch=(5e-4, 4e-4)
        )
        fabric = selvedge.Fabric(draft, {"scale": 2})
        np.testing.assert_array_equal(fabric.warp_up, up != 0)
        self.assertEqual((fabric.yarns, fabric.size), (2, (0.0015, 0.0012000000000000001)))
        np.testing.assert_array_equal(fabric.end_yarns, [0, 0, 0])
        np.testing.assert_array_equal(fabric.pick_yarns, [1, 1, 1])
        self.assertEqual(fabric.get("scale"), 2.0)
        with self.assertRaisesRegex(ValueError, "warp_up: shape"):
            selvedge.Draft.from_pattern([1, 0])
        with self.assertRaisesRegex(selvedge.Error, "end_colors 0"):
            selvedge.Draft.from_pattern(up, end_colors=[2, 0, 0])

    def test_what_cannot_be_read_is_told(self) -> None:
        for call, reason in [
            (lambda: selvedge.Draft(b"x"), "no section of a draft"),
            (lambda: selvedge.Fabric.load("no such file"), "no such file: cannot be read"),
            (lambda: selvedge.Fabric(plain(), '{"sigm": 1}'), "unknown field `sigm`"),
        ]:
            with self.assertRaisesRegex(selvedge.Error, reason):
                call()

    def test_textures_determine_colours(self) -> None:
        fabric = selvedge.Fabric(plain())
        fabric.set("specular", [0, 0, 0])
        fabric.set_texture("color", lambda u, v, footprint: (0.5, u > 1e-4, 0.0), (0.0, 1.0))
        shader = selvedge.Shader(fabric)
        del fabric
        f = shader.eval([[0.5e-4, 1e-4], [1.5e-4, 1e-4]], LIGHT, UP)
        np.testing.assert_allclose(f, np.array([[0.5, 0, 0], [0.5, 1, 0]]) / np.pi, rtol=1e-6)


def plain() -> selvedge.Draft:
    return selvedge.Draft.load(FIXTURES / "drafts/plain.wif")


class Shaders(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.shader = selvedge.Shader(selvedge.Fabric.load(DENIM))

    def test_layouts_and_shapes_give_the_same_bits(self) -> None:
        uv = positions(300)
        expected = np.array([self.shader.eval(at, LIGHT, UP) for at in uv])
        self.assertGreater(expected.max(), 0)
        light = np.tile(LIGHT, (300, 1))
        for name, a, b in [
            ("rows", uv, light),
            ("columns", np.asfortranarray(uv), np.asfortranarray(light)),
            ("padded", uv, np.pad(light, ((0, 0), (0, 1)))[:, :3]),
            ("backwards", uv[::-1].copy()[::-1], light[::-1]),
            ("other types", uv, light.astype(np.float64)),
            ("broadcast", uv, LIGHT),
        ]:
            found = self.shader.eval(a, b, UP)
            self.assertEqual(found.tobytes(), expected.tobytes(), name)
        grid = self.shader.eval(uv.reshape(20, 15, 2), LIGHT, UP)
        self.assertEqual(grid.tobytes(), expected.tobytes())
        out = np.full((300, 3), 7, dtype=np.float32, order="F")
        active = np.arange(300) % 3 == 0
        self.assertIs(self.shader.eval(uv, LIGHT, UP, active=active, out=out), out)
        np.testing.assert_array_equal(out[active], expected[active])
        np.testing.assert_array_equal(out[~active], 7)
        padded = np.full((300, 4), 7, dtype=np.float32)
        self.shader.eval(uv, LIGHT, UP, out=padded[:, :3])
        np.testing.assert_array_equal(padded[:, :3], expected)
        np.testing.assert_array_equal(padded[:, 3], 7)
        self.assertEqual(self.shader.eval(np.empty((0, 2)), LIGHT, UP).shape, (0, 3))

    def test_wrong_shapes_are_told(self) -> None:
        for call in [
            lambda: self.shader.eval([0, 0, 0], LIGHT, UP),
            lambda: self.shader.eval([0, 0], LIGHT[:2], UP),
            lambda: self.shader.eval(np.zeros((3, 2)), np.zeros((2, 3)), UP),
            lambda: self.shader.eval([0, 0], LIGHT, UP, lobes="sheen"),
            lambda: self.shader.eval([0, 0], LIGHT, UP, out=np.zeros(3)),
        ]:
            self.assertRaises(ValueError, call)

    def test_calls_agree_with_each_other(self) -> None:
        uv, xi = positions(500), np.random.default_rng(1).random((500, 3))
        f, pdf = self.shader.eval_pdf(uv, LIGHT, UP)
        specular, diffuse = self.shader.eval_lobes(uv, LIGHT, UP)
        np.testing.assert_array_equal(f, specular + diffuse)
        np.testing.assert_array_equal(specular, self.shader.eval(uv, LIGHT, UP, lobes="specular"))
        np.testing.assert_array_equal(pdf, self.shader.pdf(uv, LIGHT, UP))
        np.testing.assert_array_equal(pdf, self.shader.reverse_pdf(uv, UP, LIGHT))
        wi, weight, density = self.shader.sample(uv, UP, xi)
        drawn = density > 0
        self.assertGreater(drawn.sum(), 400)
        np.testing.assert_array_equal(density[drawn], self.shader.pdf(uv[drawn], wi[drawn], UP))
        expected = self.shader.eval(uv, wi, UP) * wi[:, 2:] / np.maximum(density, 1e-9)[:, None]
        np.testing.assert_allclose(weight, np.where(drawn[:, None], expected, 0), rtol=1e-5)
        below = self.shader.eval(uv, -LIGHT, -UP)
        self.assertGreater(below.max(), 0)
        self.assertEqual(self.shader.eval(uv, -LIGHT, -UP, sides="face").max(), 0)
        albedo = self.shader.albedo(uv, UP)
        self.assertTrue(np.all(albedo >= 0) and np.all(albedo.mean(axis=0) <= 1))

    def test_footprints_blur_threads_and_keep_the_mean(self) -> None:
        uv = np.random.default_rng(2).random((200_000, 2)) * selvedge.Fabric.load(DENIM).size
        near = self.shader.eval(uv, LIGHT, UP)
        for none in (0, np.nan, -1.0, np.zeros(len(uv))):
            at_points = self.shader.eval(uv[:500], LIGHT, UP, footprint=none if np.ndim(none) == 0 else none[:500])
            np.testing.assert_array_equal(at_points, near[:500])
        far = self.shader.eval(uv[:2], LIGHT, UP, footprint=1.0)
        np.testing.assert_array_equal(far[0], far[1])
        np.testing.assert_allclose(near.mean(axis=0), far[0], rtol=0.03)
        # Between, the contrast falls, and all calls tell the same story.
        widths = np.geomspace(1e-4, 1e-1, 60)[:, None]
        xi = np.random.default_rng(4).random((300, 3))
        f, pdf = self.shader.eval_pdf(uv[:300], LIGHT, UP, footprint=widths)
        contrast = f.std(axis=1).max(axis=-1)
        self.assertTrue(np.all(np.diff(contrast) <= 1e-6 * contrast[0]), contrast)
        self.assertTrue(np.any((contrast > 0) & (contrast < 0.9 * contrast[0])))
        specular, diffuse = self.shader.eval_lobes(uv[:300], LIGHT, UP, footprint=widths)
        np.testing.assert_array_equal(f, specular + diffuse)
        wi, weight, density = self.shader.sample(uv[:300], UP, xi, footprint=widths)
        f, pdf = self.shader.eval_pdf(uv[:300], wi, UP, footprint=widths)
        drawn = density > 0
        self.assertGreater(drawn.mean(), 0.8)
        np.testing.assert_allclose(density[drawn], pdf[drawn], rtol=1e-5)
        expected = (f * wi[..., 2:])[drawn] / density[drawn][:, None]
        np.testing.assert_allclose(weight[drawn], expected, rtol=1e-4)

    def test_pieces_of_yarn_are_told(self) -> None:
        points = self.shader.yarn_at(positions(400))
        self.assertTrue(set(points["kind"]) <= {0, 1, 2, 3, 4})
        shown = points[points["kind"] != 0]
        np.testing.assert_allclose(np.linalg.norm(shown["normal"], axis=-1), 1, rtol=1e-12)
        self.assertGreater(self.shader.normalization()["factor"][0], 0)
        self.assertGreater(self.shader.nbytes, 1000)

    def test_divisors_are_handed_on(self) -> None:
        fabric, at = selvedge.Fabric.load(DENIM), positions(100)
        found = self.shader.divisors()
        fabric.set_divisors(2 * found)
        np.testing.assert_array_equal(selvedge.Shader(fabric).divisors(), 2 * found)
        fabric.set_divisors(found)
        again = selvedge.Shader(fabric).eval(at, LIGHT, UP)
        np.testing.assert_array_equal(again, self.shader.eval(at, LIGHT, UP))

    def test_threads_share_a_shader(self) -> None:
        uv = positions(20000)
        expected = self.shader.eval(uv, LIGHT, UP).tobytes()
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            for found in pool.map(lambda _: self.shader.eval(uv, LIGHT, UP).tobytes(), range(16)):
                self.assertEqual(found, expected)


class CommandLine(unittest.TestCase):
    def test_a_swatch_is_a_picture(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.png"
            self.assertEqual(main(["swatch", str(DENIM), "-o", str(path), "--size", "32"]), 0)
            self.assertTrue(path.read_bytes().startswith(b"\x89PNG"))
            self.assertEqual(main(["swatch", "no such file", "-o", str(path)]), 1)


if __name__ == "__main__":
    unittest.main()
