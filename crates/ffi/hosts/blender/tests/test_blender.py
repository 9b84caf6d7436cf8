"""The add-on in Blender without a window, from the package bpy: bakes with the program that SELVEDGE_PROGRAM names, and
renders with Cycles."""

import os
import pathlib
import sys
import tempfile
import unittest

import bpy
import numpy as np

# Found once Blender is there.
import addon_utils  # isort: skip

HERE = pathlib.Path(__file__).resolve()
FABRICS = HERE.parents[5] / "fixtures/fabrics"
DENIM = FABRICS / "denim.json"
sys.path.insert(0, str(HERE.parents[1]))
PIXELS = 128


def linear(path: str) -> np.ndarray:
    """The colours of a picture, rows from the bottom, as numbers that light adds in."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.array(image.pixels[:], dtype=np.float64).reshape(image.size[1], image.size[0], -1)
    bpy.data.images.remove(image)
    return pixels[..., :3]


def node(made: bpy.types.Material, name: str):
    """What feeds an input of the surface."""
    surface = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    return surface.inputs[name].links[0].from_node


class Blender(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        addon_utils.enable("selvedge_cloth", default_set=True)

    def setUp(self) -> None:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
        bpy.ops.mesh.primitive_plane_add(size=2.0)
        self.plane = bpy.context.object
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def weave(self, path: pathlib.Path | str = DENIM, **options) -> bpy.types.Material:
        found = bpy.ops.material.woven_cloth(filepath=str(path), **{"size": PIXELS, **options})
        self.assertEqual(found, {"FINISHED"})
        return self.plane.material_slots[0].material

    def render(self) -> np.ndarray:
        """The middle of the plane, 1 m wide, from above under an even sky, as linear radiance."""
        scene = bpy.context.scene
        scene.render.engine = "CYCLES"
        scene.cycles.device, scene.cycles.samples, scene.cycles.use_denoising = "CPU", 64, False
        scene.render.resolution_x = scene.render.resolution_y = PIXELS
        scene.render.resolution_percentage = 100
        scene.render.image_settings.file_format = "OPEN_EXR"
        world = bpy.data.worlds.new("sky")
        scene.world = world
        if not world.node_tree:
            world.use_nodes = True
        world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
        data = bpy.data.cameras.new("camera")
        data.type, data.ortho_scale = "ORTHO", 1.0
        scene.camera = bpy.data.objects.new("camera", data)
        scene.camera.location.z = 1.0
        scene.collection.objects.link(scene.camera)
        scene.render.filepath = os.environ.get("SELVEDGE_PICTURE") or str(self.folder / "picture.exr")
        bpy.ops.render.render(write_still=True)
        return linear(scene.render.filepath)

    def test_a_material_has_the_maps_and_the_real_size_of_a_cloth(self) -> None:
        made = self.weave(uv_size=0.5)
        scale = node(made, "Base Color").inputs["Vector"].links[0].from_node.inputs["Scale"].default_value
        # 16 ends and picks of the draft are 6.08 x 7.68 mm.
        np.testing.assert_allclose(scale[:2], [0.5 / 6.08e-3, 0.5 / 7.68e-3], rtol=1e-5)
        for name, space in [
            ("Base Color", "sRGB"),
            ("Roughness", "Non-Color"),
            ("Anisotropic", "Non-Color"),
            ("Anisotropic Rotation", "Non-Color"),
            ("Alpha", "Non-Color"),
        ]:
            image = node(made, name).image
            self.assertEqual(image.colorspace_settings.name, space, name)
            self.assertEqual(tuple(image.size), (PIXELS, PIXELS), name)
            self.assertIsNotNone(image.packed_file, name)
        self.assertEqual(node(made, "Tangent").direction_type, "UV_MAP")
        self.assertEqual(node(made, "Normal").inputs["Color"].links[0].from_node.image.name, "denim normal")
        surface = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        ior, reflectances = surface.inputs["IOR"].default_value, node(made, "Specular Tint").inputs[0].links[0]
        greatest = max(np.array(reflectances.from_node.image.pixels[:]).reshape(-1, 4)[:, :3].ravel())
        self.assertAlmostEqual(((ior - 1) / (ior + 1)) ** 2, greatest, places=5)

    def test_silk_has_sheen(self) -> None:
        made = self.weave(FABRICS / "silk-charmeuse.json")
        surface = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        self.assertGreater(surface.inputs["Sheen Weight"].default_value, 0.0)
        self.assertAlmostEqual(max(surface.inputs["Sheen Tint"].default_value[:3]), 1.0, places=5)

    def test_maps_of_a_saved_file_lie_beside_it(self) -> None:
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "a.blend"))
        image = node(self.weave(), "Roughness").image
        self.assertEqual(image.filepath.replace("\\", "/"), "//selvedge/denim/roughness.png")
        self.assertIsNone(image.packed_file)
        self.assertTrue((self.folder / "selvedge/denim/bake.json").is_file())
        # Once more takes the place of what is there.
        self.weave()
        self.assertIsNotNone(node(self.weave(pack=True), "Roughness").image.packed_file)

    def test_what_goes_wrong_is_told(self) -> None:
        wrong = self.folder / "wrong.wif"
        wrong.write_text("[WARP]\nThreads=4000000000\n")
        for path, reason in [(wrong, "4000000000 ends"), (self.folder / "none.wif", "none.wif")]:
            with self.assertRaisesRegex(RuntimeError, reason):
                bpy.ops.material.woven_cloth(filepath=str(path), size=16)
        preferences = bpy.context.preferences.addons["selvedge_cloth"].preferences
        try:
            for program, reason in [
                (str(self.folder / "no program"), "no program: No such file or directory, expected"),
                (sys.executable, "can't open file|No such file"),
            ]:
                preferences.program = program
                with self.assertRaisesRegex(RuntimeError, reason):
                    bpy.ops.material.woven_cloth(filepath=str(DENIM), size=16)
            preferences.program = ""
            kept = {name: os.environ.pop(name) for name in ("SELVEDGE_PROGRAM", "PATH")}
            try:
                with self.assertRaisesRegex(RuntimeError, "no such program in PATH"):
                    bpy.ops.material.woven_cloth(filepath=str(DENIM), size=16)
            finally:
                os.environ.update(kept)
        finally:
            preferences.program = ""
        self.assertEqual(len(bpy.data.materials), 0)

    def test_cycles_renders_tiles_of_the_colour_of_the_cloth(self) -> None:
        made = self.weave(uv_size=1.0)
        mapping = node(made, "Base Color").inputs["Vector"].links[0].from_node
        # Tiles of half a metre.
        mapping.inputs["Scale"].default_value = (4.0, 4.0, 1.0)
        picture = self.render()
        half = PIXELS // 2
        tile, right = picture[:half, :half], picture[:half, half:]
        noise = np.abs(tile - right).mean()
        shifted = np.abs(tile - np.roll(tile, half // 3, axis=1)).mean()
        print(f"mean {picture.mean(axis=(0, 1)).round(4)}, tiles differ by {noise:.4f}, shifted by {shifted:.4f}")
        self.assertLess(noise, 0.25 * shifted)
        base = node(made, "Base Color").image
        colors = np.array(base.pixels[:], dtype=np.float64).reshape(-1, base.channels)[:, :3]
        if base.colorspace_settings.name == "sRGB" and not base.is_float:
            colors = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4)
        expected, found = colors.mean(axis=0), picture.mean(axis=(0, 1))
        print(f"base colour {expected.round(4)}")
        # Normals that lean away from the sky take about a quarter, for which the map makes up; it stays the blue of
        # denim.
        np.testing.assert_allclose(found, expected, rtol=0.3, atol=0.03)
        self.assertGreater(found[2], 1.2 * found[0])


if __name__ == "__main__":
    # Blender's own arguments are none of the tests'.
    unittest.main(argv=[sys.argv[0]])
