"""The wavy sheet of cloth that renderers are compared on, as `selvedge render scene:sheet` has it.

    python sheet.py denim.json sheet.exr [VARIANT] [SAMPLES]
"""

from __future__ import annotations

import sys
import time

import mitsuba as mi
import numpy as np

SIDE = 512


def heights(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Of the sheet over [-1, 1]²."""
    r, phi = np.hypot(x, y), np.arctan2(y, x)
    bump = 0.45 * np.exp(-1.2 * (r / 0.55) ** 2)
    return bump + 0.05 * np.sin(9 * phi) * np.maximum(r - 0.3, 0) + 0.02 * np.sin(14 * x + 3 * y)


def mesh(bsdf: mi.BSDF) -> mi.Mesh:
    """The sheet as triangles with smooth normals, uv in [0, 1]²."""
    at = np.linspace(0, 1, SIDE)
    u, v = (grid.ravel() for grid in np.meshgrid(at, at))
    x, y = 2 * u - 1, 2 * v - 1
    vertices = np.stack([x, y, heights(x, y)], axis=-1)
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    right, up, across = corner + 1, corner + SIDE, corner + SIDE + 1
    faces = np.concatenate(
        [np.stack([corner, right, across], axis=-1), np.stack([corner, across, up], axis=-1)]
    )
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    # The cross product is as long as the triangle is large.
    face_normals = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], face_normals)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)

    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    sheet = mi.Mesh("sheet", len(vertices), len(faces), properties, True, True)
    parameters = mi.traverse(sheet)
    parameters["vertex_positions"] = vertices.astype(np.float32).ravel()
    parameters["vertex_normals"] = normals.astype(np.float32).ravel()
    parameters["vertex_texcoords"] = np.stack([u, v], axis=-1).astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return sheet


def lights() -> dict[str, dict]:
    """The lights by name. In Mitsuba the quad stands in the way of the sky, which takes a hundredth of the light; in
    a sum of two pictures, one by each, it does not."""
    place = mi.ScalarTransform4f().look_at([1.5, -1.5, 3], [0, 0, 0], [0, 0, 1])
    return {
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 0.35}},
        "quad": {
            "type": "rectangle",
            # Its side is 1, that of the rectangle of Mitsuba 2.
            "to_world": place.scale([0.5, 0.5, 1]),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 18}},
        },
    }


def scene(bsdf: mi.BSDF, lights: dict[str, dict], size: int = 640, depth: int = 4) -> mi.Scene:
    """The sheet under `lights`; paths end after `depth` surfaces."""
    return mi.load_dict(
        {
            "type": "scene",
            # Mitsuba counts the light as well.
            "integrator": {"type": "path", "max_depth": depth + 1, "rr_depth": 100},
            "sensor": {
                "type": "perspective",
                "fov": 14,
                "to_world": mi.ScalarTransform4f().look_at([0, -3.2, 2.2], [0, 0, 0.05], [0, 0, 1]),
                "film": {
                    "type": "hdrfilm",
                    "width": size,
                    "height": size,
                    "rfilter": {"type": "box"},
                    "pixel_format": "rgb",
                },
            },
            **lights,
            "sheet": mesh(bsdf),
        }
    )


def main(fabric: str, output: str, variant: str = "llvm_ad_rgb", samples: str = "16") -> None:
    """Renders the sheet and prints samples per second."""
    mi.set_variant(variant)
    import selvedge_mitsuba  # noqa: F401

    bsdf = mi.load_dict({"type": "selvedge", "filename": fabric, "uv_scale": 0.16})
    subject = scene(bsdf, lights())
    start = time.perf_counter()
    picture = mi.render(subject, spp=int(samples))
    mi.Bitmap(picture).write(output)
    seconds = time.perf_counter() - start
    print(f"{variant}: {640 * 640 * int(samples) / seconds / 1e6:.3f} million samples/s")


if __name__ == "__main__":
    main(*sys.argv[1:])
