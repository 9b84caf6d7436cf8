"""Maps of a cloth by `selvedge bake`."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Iterator

import bpy


class BakeError(Exception):
    """Why there are no maps, for the user."""


@dataclasses.dataclass(frozen=True)
class Baked:
    """The maps of a cloth."""

    name: str
    """Of the cloth."""
    folder: pathlib.Path
    size: tuple[float, float]
    """Of the piece of cloth that the maps show, along weft and warp, m."""
    sheen: tuple[float, float, float]
    """Its colour, linear."""
    sheen_roughness: float

    def path(self, name: str) -> pathlib.Path:
        """Where the map `name` is."""
        return self.folder / f"{name}.png"


@contextlib.contextmanager
def folder_for(cloth: str, is_packed: bool) -> Iterator[pathlib.Path]:
    """The folder for the maps of a cloth: one beside the file, or one that is gone afterwards."""
    name = bpy.path.clean_name(_name(cloth))
    if not is_packed:
        yield pathlib.Path(bpy.path.abspath("//")) / "selvedge" / name
        return
    with tempfile.TemporaryDirectory() as folder:
        yield pathlib.Path(folder) / name


def bake(program: str, cloth: str, folder: pathlib.Path, pixels: int, repeats: int) -> Baked:
    """Has `program`, or what stands for it if it is empty, write the maps of `cloth` into `folder`."""
    program = program or os.environ.get("SELVEDGE_PROGRAM", "") or shutil.which("selvedge") or ""
    if not program:
        raise BakeError("selvedge: no such program in PATH, expected it there or in the preferences of the add-on")
    options = ["--size", str(pixels), "--repeats", str(repeats), "--format", "png16", "--quiet"]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        command = [program, "bake", cloth, "-o", str(folder), *options]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    except OSError as error:
        raise BakeError(f"{error.filename or program}: {error.strerror}, expected to run selvedge bake") from error
    if done.returncode != 0:
        reason = done.stderr.strip() or f"{program}: ended with {done.returncode}, expected maps"
        raise BakeError(reason.removeprefix("error: "))
    try:
        told = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
        width, height = told["size_mm"]
        sheen = told["fits"]["sheen"]
        red, green, blue = sheen["color"]
        roughness = float(sheen["roughness"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        found = f"{type(error).__name__}: {error}"
        raise BakeError(f"{folder / 'bake.json'}: {found}, expected what selvedge 0.1 writes") from error
    return Baked(_name(cloth), folder, (1e-3 * width, 1e-3 * height), (red, green, blue), roughness)


def _name(cloth: str) -> str:
    """What a cloth is called: by its file without the ending, or by its preset."""
    return pathlib.Path(cloth.removeprefix("preset:")).stem
