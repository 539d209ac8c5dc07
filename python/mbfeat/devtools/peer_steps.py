"""The set-up steps that only the benchmark against other renderers needs, made on demand.

Each peer has a Python environment of its own in .mbfeat/peers/, since their packages do not fit
together nor with ours.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from mbfeat.devtools.console import require_disk
from mbfeat.devtools.layout import digest
from mbfeat.devtools.steps import Step, SystemPackages, VirtualEnvironment, base_python

# The library of libllvm19. Older ones, which Dr.Jit might find first, cannot compile its code.
LLVM = "libLLVM.so.19.1"


class PeerSystemPackages(SystemPackages):
    """The Debian packages that only the other renderers need."""

    name = "system-peers"
    title = "system packages for the other renderers"
    command = "peers"


class PeerEnvironment(VirtualEnvironment):
    """The Python environment of the peer `peer`, from requirements-PEER.txt."""

    peer = ""
    megabytes = 0

    @property
    def requirements(self) -> Path:
        return self.layout.devtools / f"requirements-{self.peer}.txt"

    @property
    def folder(self) -> Path:
        return self.layout.peers / self.peer

    def key(self) -> str:
        return digest(base_python(), str(self.folder), self.requirements.read_bytes())

    def present(self) -> bool:
        return (self.folder / "bin" / "python").exists()

    def make(self) -> None:
        require_disk(self.layout.made, self.megabytes, self.title)
        partial = self.folder.with_name(f"{self.peer}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        self.layout.peers.mkdir(parents=True, exist_ok=True)
        # Only its python is run, which finds its packages wherever the folder is moved to. There is
        # no `pip check`: it takes Blender's wheel for one of another platform.
        self.fill(partial)
        shutil.rmtree(self.folder, ignore_errors=True)
        partial.rename(self.folder)


class Mitsuba(PeerEnvironment):
    """Mitsuba 3."""

    name = "peer-mitsuba"
    title = "Mitsuba 3 (70 MB)"
    peer = "mitsuba"
    megabytes = 500


class Cycles(PeerEnvironment):
    """Blender as a Python module, which holds Cycles."""

    name = "peer-cycles"
    title = "Cycles (Blender's Python module, 374 MB)"
    peer = "cycles"
    megabytes = 2500


class Oidn(PeerEnvironment):
    """Open Image Denoise, which works on our images."""

    name = "peer-oidn"
    title = "Open Image Denoise (88 MB)"
    peer = "oidn"
    megabytes = 400


PEERS: dict[str, type[PeerEnvironment]] = {"mitsuba": Mitsuba, "cycles": Cycles}


def steps_for(peers: list[str]) -> list[type[Step]]:
    """What has to be set up for these peers."""
    return [PeerSystemPackages, *(PEERS[peer] for peer in peers)] if peers else []
