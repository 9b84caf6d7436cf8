"""`python -m selvedge swatch denim.json -o denim.png`: a flat piece of a fabric as a picture."""

from __future__ import annotations

import argparse
import pathlib
import struct
import sys
import zlib

import numpy as np
import numpy.typing as npt

from . import Error, Fabric, Shader, version


def swatch(fabric: Fabric, size: int = 512, millimetres: float = 10.0) -> npt.NDArray[np.uint8]:
    """A square piece from above as sRGB, end 1 at the left and pick 1 at the lower edge, lit from the
    upper left, each pixel the mean of 16 points."""
    shader = Shader(fabric)
    at = (np.arange(4 * size) + 0.5) * (1e-3 * millimetres / (4 * size))
    light = np.array([-0.48, 0.36, 0.8], dtype=np.float32)
    picture = np.empty((size, size, 3), dtype=np.float32)
    for row in range(size):
        v = at[4 * (size - 1 - row) : 4 * (size - row)]
        uv = np.stack(np.meshgrid(at, v), axis=-1)
        f = shader.eval(uv, light, [0, 0, 1])
        picture[row] = f.reshape(4, size, 4, 3).mean(axis=(0, 2))
    linear = np.clip(3.0 * light[2] * picture, 0.0, 1.0)
    bent = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255.0 * bent), dtype=np.uint8)


def png(picture: npt.NDArray[np.uint8]) -> bytes:
    """An RGB picture as the bytes of a PNG."""
    height, width, _ = picture.shape
    rows = b"".join(b"\0" + row.tobytes() for row in picture)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = [(b"IHDR", header), (b"sRGB", b"\0"), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command line; the exit code."""
    parser = argparse.ArgumentParser(prog="selvedge", description="Woven cloth from a draft.")
    parser.add_argument("--version", action="version", version=f"selvedge {version()}")
    commands = parser.add_subparsers(required=True)
    drawing = commands.add_parser("swatch", help="draw a flat piece of a draft or a fabric")
    drawing.add_argument("fabric", type=pathlib.Path, help="a draft (WIF) or a fabric (JSON)")
    drawing.add_argument("-o", "--output", type=pathlib.Path, help="the picture, PNG")
    drawing.add_argument("--size", type=int, default=512, help="its side, pixels")
    drawing.add_argument("--mm", type=float, default=10.0, help="its side on the cloth, mm")
    options = parser.parse_args(arguments)
    if options.size < 1 or not options.mm > 0.0:
        parser.error("--size and --mm must be positive")
    output = options.output or pathlib.Path(options.fabric.stem + ".png")
    try:
        output.write_bytes(png(swatch(Fabric.load(options.fabric), options.size, options.mm)))
    except (Error, OSError) as error:
        print(f"selvedge: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
