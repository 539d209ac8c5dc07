"""The set-up step that only ``./run training`` needs, made on demand.

An environment of its own in .mbfeat/training: that of ./run and torch with what goes with it, so
that nothing that renders ever has torch beside it.
"""

from __future__ import annotations

from pathlib import Path

from mbfeat.devtools.layout import digest
from mbfeat.devtools.steps import VirtualEnvironment


class TrainingEnvironment(VirtualEnvironment):
    """.mbfeat/training with the pinned packages of the development environment and of training."""

    name = "training"
    title = "Python packages for training (PyTorch, 250 MB)"

    @property
    def requirements(self) -> Path:
        return self.layout.devtools / "requirements-training.txt"

    @property
    def place(self) -> Path:
        return self.layout.training

    @property
    def store(self) -> Path:
        return self.layout.made / "training-environments"

    def key(self) -> str:
        common = self.layout.devtools / "requirements.txt"
        return digest(super().key(), common.read_bytes())

    def make(self) -> None:
        # Not checked: a torch for graphics cards asks for gigabytes that processors never use.
        self.make_environment(2500, check=False)
