"""Blender as a Python module, in a virtual environment of its own.

It is the foreign host of tests/python/test_blender.py, and nothing else ever loads it. The wheel is
the one that the OpenUSD runtime is taken from, so the plug-in fits the OpenUSD inside.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from mbfeat.devtools import usd_runtime
from mbfeat.devtools.console import require_disk
from mbfeat.devtools.layout import digest
from mbfeat.devtools.steps import Step, SystemPackages, base_python

# Of what the wheel asks for, Blender itself imports numpy alone.
PACKAGES = (f"bpy=={usd_runtime.BPY_VERSION}", "numpy==1.26.4")


class BlenderSystemPackages(SystemPackages):
    """The Debian packages that only Blender needs."""

    name = "system-blender"
    title = "system packages for Blender"
    command = "blender"


class BlenderEnvironment(Step):
    """.mbfeat/blender: a virtual environment with the bpy wheel."""

    name = "blender"
    title = f"Blender (bpy {usd_runtime.BPY_VERSION}, 374 MB)"

    def key(self) -> str:
        return digest(base_python(), str(self.layout.blender), *PACKAGES)

    def present(self) -> bool:
        return (self.layout.blender / "bin" / "python").exists()

    def make(self) -> None:
        require_disk(self.layout.made, 1500, "Blender")
        for left in self.layout.made.glob("blender.*.partial"):
            shutil.rmtree(left, ignore_errors=True)
        partial = self.layout.blender.with_name(f"blender.{os.getpid()}.partial")
        failure = f"no virtual environment could be made with {base_python()}"
        self.call([base_python(), "-m", "venv", "--without-pip", partial], failure)
        pip: list[str | Path] = [self.layout.venv_python, "-m", "pip", "--retries", "2"]
        pip += ["--python", partial / "bin" / "python", "install", "--no-deps", "--no-compile"]
        pip += ["--no-cache-dir", "--only-binary", ":all:", "--progress-bar", "raw"]
        # The wheel that also the runtime is taken from, where the user names one.
        bpy = os.environ.get("MBFEAT_BPY_WHEEL") or PACKAGES[0]
        self.call([*pip, bpy, *PACKAGES[1:]], "Blender could not be installed")
        shutil.rmtree(self.layout.blender, ignore_errors=True)
        partial.rename(self.layout.blender)


STEPS = (BlenderSystemPackages, BlenderEnvironment)
