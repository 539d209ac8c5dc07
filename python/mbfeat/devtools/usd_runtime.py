"""Takes the OpenUSD 25.08 runtime out of the bpy wheel, and the base headers out of the pxr wheels.

The result is a prefix: lib/ (libraries, lib/usd, lib/materialx), pxr/ (Python modules) and
include/pxr/ (base headers as the wheels lay them out; hdmbfeat/hydra gives them an SDK's paths).
"""

from __future__ import annotations

import os
import re
import shutil
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

from mbfeat.devtools.console import SetupError

BPY_VERSION = "5.0.1"
PXR_VERSION = "25.8"
PXR_PYTHON = "5.0/python/lib/python3.11/site-packages/pxr/"
HEADER_LIBRARIES = (
    *("arch", "tf", "gf", "js", "trace", "work", "plug", "vt", "ts"),
    *("sdf", "ar", "boost"),
)
HEADER_PACKAGES = tuple(f"pxr-{name}-dev=={PXR_VERSION}" for name in HEADER_LIBRARIES)

Report = Callable[[str], None]


def unpack_runtime(wheel: Path, prefix: Path, report: Report) -> None:
    """Unpacks the OpenUSD part of the bpy wheel into `prefix`.

    Raises SetupError when the file is not that wheel or is damaged.
    """
    try:
        with zipfile.ZipFile(wheel) as archive:
            names = archive.namelist()
            if f"bpy-{BPY_VERSION}.dist-info/METADATA" not in names:
                raise SetupError(
                    f"{wheel} is not the wheel bpy=={BPY_VERSION}; name that one with "
                    "MBFEAT_BPY_WHEEL, or unset it to download."
                )
            wanted = [(name, target) for name in names if (target := _runtime_target(name))]
            for index, (name, target) in enumerate(wanted):
                if index % 50 == 0:
                    report(f"unpacking, {100 * index // len(wanted)} %")
                _extract(archive, name, prefix / target)
    except (zipfile.BadZipFile, EOFError) as error:
        raise _damaged(wheel, error) from error
    for module in sorted((prefix / "pxr").glob("*/*.so")):
        set_runpath(module, "$ORIGIN/../../lib")


def _damaged(wheel: Path, error: Exception) -> SetupError:
    return SetupError(f"{wheel} is damaged ({error}); delete it and run it again.")


def _runtime_target(name: str) -> str | None:
    """Where a file of the wheel goes in the prefix, or None for what is not OpenUSD's."""
    if name.endswith("/"):
        return None
    inner = name.removeprefix("bpy/")
    if re.fullmatch(r"lib/[^/]+\.so[^/]*|lib/(usd|materialx)/.+", inner):
        return inner
    if inner.startswith(PXR_PYTHON):
        return "pxr/" + inner.removeprefix(PXR_PYTHON)
    return None


def unpack_headers(wheels: list[Path], prefix: Path) -> None:
    """Unpacks the headers of the pxr-*-dev wheels into `prefix`/include."""
    include = prefix / "include"
    for wheel in wheels:
        try:
            with zipfile.ZipFile(wheel) as archive:
                for name in archive.namelist():
                    _, found, header = name.partition("/include/")
                    if found and not name.endswith("/"):
                        _extract(archive, name, include / header)
        except (zipfile.BadZipFile, EOFError) as error:
            raise _damaged(wheel, error) from error


def _extract(archive: zipfile.ZipFile, name: str, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    with archive.open(name) as source, target.open("wb") as sink:
        shutil.copyfileobj(source, sink, 1 << 20)
    if ".so" in target.name:
        target.chmod(0o755)


def set_runpath(library: Path, runpath: str) -> None:
    """Replaces the RUNPATH of a 64-bit little-endian ELF library by a shorter or equal one.

    The modules lie deeper in the wheel than in the prefix. Layouts: ELF-64 object file format,
    program header, dynamic section. Raises SetupError when the library has no RUNPATH to replace.
    """
    pt_load, pt_dynamic, dt_strtab, dt_runpath = 1, 2, 5, 29
    with library.open("r+b") as file:
        header = file.read(64)
        if header[:6] != b"\x7fELF\x02\x01":
            raise SetupError(f"{library} is not a 64-bit ELF library.")
        offset, size, count = (
            struct.unpack_from("<Q", header, 32)[0],
            *struct.unpack_from("<HH", header, 54),
        )
        loads, dynamic = [], None
        for index in range(count):
            file.seek(offset + index * size)
            kind, _, where, address, _, length, _, _ = struct.unpack("<IIQQQQQQ", file.read(56))
            if kind == pt_load:
                loads.append((address, where, length))
            elif kind == pt_dynamic:
                dynamic = (where, length)
        entries: dict[int, int] = {}
        if dynamic:
            file.seek(dynamic[0])
            entries = dict(struct.iter_unpack("<qQ", file.read(dynamic[1])))
        if dt_runpath not in entries:
            raise SetupError(f"{library} has no RUNPATH.")
        strings = entries[dt_strtab]
        start = next(w + strings - a for a, w, n in loads if a <= strings < a + n)
        file.seek(start + entries[dt_runpath])
        old = file.read(4096).split(b"\0", 1)[0]
        new = runpath.encode()
        if not old.startswith(b"$ORIGIN") or len(new) > len(old):
            raise SetupError(f"{library} has an unexpected RUNPATH {os.fsdecode(old)!r}.")
        file.seek(start + entries[dt_runpath])
        file.write(new.ljust(len(old), b"\0"))
