"""Builds the library of this workspace into the package, so that what is installed needs nothing else."""

import json
import pathlib
import shutil
import subprocess
import sys

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py

HERE = pathlib.Path(__file__).resolve().parent
NAME = {"win32": "selvedge.dll", "darwin": "libselvedge.dylib"}.get(sys.platform, "libselvedge.so")


class BuildWithLibrary(build_py):
    """Builds the package and puts the library into it."""

    def run(self) -> None:
        super().run()
        build = ["cargo", "build", "--release", "-p", "selvedge-ffi"]
        subprocess.run(build, cwd=HERE, check=True)
        metadata = ["cargo", "metadata", "--format-version", "1", "--no-deps"]
        found = subprocess.run(metadata, cwd=HERE, check=True, capture_output=True)
        target = pathlib.Path(json.loads(found.stdout)["target_directory"])
        shutil.copy(target / "release" / NAME, pathlib.Path(self.build_lib) / "selvedge" / NAME)


class BinaryDistribution(Distribution):
    """Not the same on every platform."""

    def has_ext_modules(self) -> bool:
        return True


setup(cmdclass={"build_py": BuildWithLibrary}, distclass=BinaryDistribution)
