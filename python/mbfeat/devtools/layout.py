"""Where things lie: the checkout, and .mbfeat/ with everything that ./run makes."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from mbfeat.files import write_whole as write_whole  # what makes these files has it from here

PRESET = "release"


@dataclass(frozen=True)
class Layout:
    """Paths in one checkout; `root` is absolute."""

    root: Path

    @property
    def made(self) -> Path:
        return self.root / ".mbfeat"

    @property
    def venv(self) -> Path:
        return self.made / "venv"

    @property
    def venv_python(self) -> Path:
        return self.venv / "bin" / "python"

    @property
    def usd(self) -> Path:
        """The OpenUSD runtime prefix: lib/, pxr/ (Python) and include/."""
        return self.made / "usd"

    @property
    def ocio(self) -> Path:
        """OpenColorIO's built-in configs as files."""
        return self.build / "ocio"

    @property
    def build(self) -> Path:
        return self.made / "build" / PRESET

    @property
    def bin(self) -> Path:
        return self.made / "bin"

    @property
    def blender(self) -> Path:
        """The virtual environment with Blender, for the test that needs it."""
        return self.made / "blender"

    @property
    def peers(self) -> Path:
        """What the benchmark against other renderers makes: their environments, and references."""
        return self.made / "peers"

    @property
    def training(self) -> Path:
        """The virtual environment with PyTorch, for ./run training."""
        return self.made / "training"

    @property
    def downloads(self) -> Path:
        return self.made / "downloads"

    @property
    def devtools(self) -> Path:
        return self.root / "python" / "mbfeat" / "devtools"

    def log(self, step: str) -> Path:
        return self.made / "log" / f"{step}.log"

    def stamp(self, step: str) -> Path:
        return self.made / "stamps" / step


def this_layout() -> Layout:
    return Layout(Path(__file__).resolve().parents[3])


def digest(*parts: str | bytes) -> str:
    """A short hash of these parts, their boundaries included."""
    state = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        state.update(len(data).to_bytes(8, "little") + data)
    return state.hexdigest()[:24]


def read_stamp(path: Path) -> str:
    """The key that a stamp holds; empty when there is none."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return ""
