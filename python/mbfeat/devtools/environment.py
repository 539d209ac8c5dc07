"""The environment that ./run gives to a command.

The runtime's ``pxr`` comes first on PYTHONPATH, so that no process renders with usd-core's by
accident; usd-core stays in the virtual environment for tests that ask for it (`for_usd_core`).

| variable | meaning |
|---|---|
| PATH | .mbfeat/bin (mbfeat, usdrecord), then the virtual environment's bin, then the user's |
| PYTHONPATH | the runtime's pxr, python/, the built module, then the user's |
| PXR_PLUGINPATH_NAME | the built plug-in and the schemas, then the user's |
| PXR_MTLX_STDLIB_SEARCH_PATHS | MaterialX's node definitions, without which OpenUSD drops shaders |
| MBFEAT_USD_ROOT | the OpenUSD runtime prefix |
| MBFEAT_OCIO_DIR | OpenColorIO configs as files |
| MBFEAT_BUILD_DIR | the release build |
| MBFEAT_PXR | ``runtime`` or ``usd-core``: whose pxr this environment imports |
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from mbfeat.devtools.layout import Layout


def for_runtime(
    layout: Layout, base: Mapping[str, str], venv: Path | None = None
) -> dict[str, str]:
    """`base` plus the project's variables, with the runtime's pxr.

    `venv` is the virtual environment, by default the development one.
    """
    result = _common(layout, base, venv)
    result["MBFEAT_PXR"] = "runtime"
    _prepend(result, base, "PYTHONPATH", layout.usd, *_own_python(layout))
    _prepend(result, base, "PXR_PLUGINPATH_NAME", layout.build / "plugin" / "usd")
    materialx = layout.usd / "lib" / "materialx" / "libraries"
    _prepend(result, base, "PXR_MTLX_STDLIB_SEARCH_PATHS", materialx)
    return result


def for_usd_core(
    layout: Layout, base: Mapping[str, str], venv: Path | None = None
) -> dict[str, str]:
    """The same with usd-core's pxr and without the plug-in, which fits the runtime alone."""
    result = _common(layout, base, venv)
    result["MBFEAT_PXR"] = "usd-core"
    outside = {"PYTHONPATH": _without(base.get("PYTHONPATH", ""), layout)}
    _prepend(result, outside, "PYTHONPATH", *_own_python(layout))
    result["PXR_PLUGINPATH_NAME"] = _without(base.get("PXR_PLUGINPATH_NAME", ""), layout)
    return result


def _own_python(layout: Layout) -> tuple[Path, Path]:
    return layout.root / "python", layout.build / "python"


def _common(layout: Layout, base: Mapping[str, str], venv: Path | None) -> dict[str, str]:
    result = {name: value for name, value in base.items() if name != "PYTHONHOME"}
    venv = venv or layout.venv
    _prepend(result, base, "PATH", layout.bin, venv / "bin")
    result.update(
        VIRTUAL_ENV=str(venv),
        MBFEAT_USD_ROOT=str(layout.usd),
        MBFEAT_OCIO_DIR=str(layout.ocio),
        MBFEAT_BUILD_DIR=str(layout.build),
    )
    return result


def _prepend(result: dict[str, str], base: Mapping[str, str], name: str, *first: Path) -> None:
    rest = [part for part in base.get(name, "").split(":") if part]
    wanted = [str(path) for path in first]
    result[name] = ":".join(wanted + [part for part in rest if part not in wanted])


def _without(paths: str, layout: Layout) -> str:
    """A path list without what lies in .mbfeat/."""
    made = str(layout.made) + "/"
    return ":".join(part for part in paths.split(":") if part and not part.startswith(made))
