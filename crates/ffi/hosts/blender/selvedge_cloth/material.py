"""A Principled BSDF that reads baked maps."""

from __future__ import annotations

import bpy
import numpy as np

from .baking import Baked, BakeError

#: The least greatest reflectance, where the cloth has no highlight.
LEAST = 1e-6


def build(baked: Baked, uv_size: float, is_packed: bool) -> bpy.types.Material:
    """The material of `baked`, for an object 1 of whose UV map spans `uv_size` metres."""
    made = bpy.data.materials.new(baked.name)
    if not made.node_tree:
        made.use_nodes = True
    try:
        _fill(made.node_tree, baked, uv_size, is_packed)
    except RuntimeError as error:
        bpy.data.materials.remove(made)
        raise BakeError(str(error).strip()) from error
    return made


def _fill(tree: bpy.types.NodeTree, baked: Baked, uv_size: float, is_packed: bool) -> None:
    tree.nodes.clear()

    def node(kind: str, column: int, row: float):
        found = tree.nodes.new(kind)
        found.location = (280 * column, -290 * row)
        return found

    def link(a, output: str, b, name: str) -> None:
        tree.links.new(a.outputs[output], b.inputs[name])

    coordinates, mapping = node("ShaderNodeTexCoord", 0, 2), node("ShaderNodeMapping", 1, 2)
    mapping.inputs["Scale"].default_value = (uv_size / baked.size[0], uv_size / baked.size[1], 1.0)
    link(coordinates, "UV", mapping, "Vector")
    surface, output = node("ShaderNodeBsdfPrincipled", 4, 2), node("ShaderNodeOutputMaterial", 5, 2)
    link(surface, "BSDF", output, "Surface")

    def picture(name: str, row: float, is_color: bool = False):
        found = node("ShaderNodeTexImage", 2, row)
        found.label = name
        found.image = _image(baked, name, is_color, is_packed)
        link(mapping, "Vector", found, "Vector")
        return found

    link(picture("base_color", 0, is_color=True), "Color", surface, "Base Color")
    # Across and along the fibres, roughness is stretched by the anisotropy as the BSDF does it; its tangent is where the
    # surface is rougher.
    link(picture("roughness", 1), "Color", surface, "Roughness")
    link(picture("anisotropy", 2), "Color", surface, "Anisotropic")
    rotation = picture("anisotropy_rotation", 3)
    # Angles do not mix: 0 and 1/2 are one direction, and 1/4 is not between them.
    rotation.interpolation = "Closest"
    link(rotation, "Color", surface, "Anisotropic Rotation")
    tangent = node("ShaderNodeTangent", 3, 3.6)
    tangent.direction_type = "UV_MAP"
    link(tangent, "Tangent", surface, "Tangent")
    link(picture("opacity", 4), "Color", surface, "Alpha")
    normals, bent = picture("normal", 5), node("ShaderNodeNormalMap", 3, 5)
    link(normals, "Color", bent, "Color")
    link(bent, "Normal", surface, "Normal")

    # The greatest reflectance is that of the refraction, of which the map has its share.
    reflectance, share = picture("specular", 6), node("ShaderNodeVectorMath", 3, 6)
    greatest = min(max(_greatest(reflectance.image), LEAST), 0.99)
    share.operation = "SCALE"
    share.inputs["Scale"].default_value = 1.0 / greatest
    link(reflectance, "Color", share, "Vector")
    link(share, "Vector", surface, "Specular Tint")
    root = greatest**0.5
    surface.inputs["IOR"].default_value = (1.0 + root) / (1.0 - root)

    weight = max(baked.sheen)
    surface.inputs["Sheen Weight"].default_value = weight
    if weight > 0.0:
        surface.inputs["Sheen Tint"].default_value = (*(part / weight for part in baked.sheen), 1.0)
        surface.inputs["Sheen Roughness"].default_value = baked.sheen_roughness


def _image(baked: Baked, name: str, is_color: bool, is_packed: bool) -> bpy.types.Image:
    image = bpy.data.images.load(str(baked.path(name)))
    image.name = f"{baked.name} {name}"
    image.colorspace_settings.name = "sRGB" if is_color else "Non-Color"
    if is_packed:
        image.pack()
    else:
        image.filepath = bpy.path.relpath(image.filepath)
    return image


def _greatest(image: bpy.types.Image) -> float:
    """The greatest of all colours of an image."""
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return float(pixels.reshape(-1, image.channels)[:, :3].max())
