"""Chooses the OpenUSD that this process renders with.

Two Python packages named ``pxr`` may be installed: usd-core's, which has no imaging, and the one
of the OpenUSD that the Hydra plug-in was built for. A process can hold one of them. In the
environment of ./run the right one is on PYTHONPATH already; an installed package finds it through
MBFEAT_USD_ROOT, or uses a ``pxr`` with imaging that is importable anyway (an SDK's).
"""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path


class RuntimeMissingError(RuntimeError):
    """No OpenUSD with imaging can be imported; the message says what to do."""


def use_runtime() -> None:
    """Makes the rendering OpenUSD importable as ``pxr`` and shows it the plug-in.

    Call it before anything imports ``pxr``; calling it again does nothing. Raises
    RuntimeMissingError when no OpenUSD with imaging is found, or another ``pxr`` is loaded already.
    """
    _show_plugin()
    if "pxr" in sys.modules:
        if importlib.util.find_spec("pxr.UsdAppUtils") is None:
            loaded = getattr(sys.modules["pxr"], "__file__", "?")
            raise RuntimeMissingError(
                f"the pxr of {loaded}, which cannot render, is loaded already; import "
                "mbfeat.runtime and call use_runtime() before anything imports pxr"
            )
        return
    root = os.environ.get("MBFEAT_USD_ROOT", "")
    if root:
        folders = [f for f in (Path(root), Path(root) / "lib" / "python") if (f / "pxr").is_dir()]
        if not folders:
            raise RuntimeMissingError(
                f"MBFEAT_USD_ROOT={root} has neither pxr/ nor lib/python/pxr/; name the runtime "
                "prefix that ./run made, or an OpenUSD SDK"
            )
        if str(folders[0]) not in sys.path[:1]:
            sys.path.insert(0, str(folders[0]))
        # The runtime prefix keeps MaterialX's node definitions where OpenUSD does not look; without
        # them it drops the shaders of .mtlx files.
        definitions = Path(root) / "lib" / "materialx" / "libraries"
        if definitions.is_dir():
            os.environ.setdefault("PXR_MTLX_STDLIB_SEARCH_PATHS", str(definitions))
    if (
        importlib.util.find_spec("pxr") is None
        or importlib.util.find_spec("pxr.UsdAppUtils") is None
    ):
        raise RuntimeMissingError(
            "no OpenUSD with imaging is importable (the usd-core package has none); set "
            "MBFEAT_USD_ROOT to the runtime prefix that ./run made, or to an OpenUSD SDK"
        )


def _show_plugin() -> None:
    """Adds the installed plug-in to PXR_PLUGINPATH_NAME, which OpenUSD reads when it is loaded."""
    plugin = Path(__file__).parent / "plugin"
    known = [part for part in os.environ.get("PXR_PLUGINPATH_NAME", "").split(os.pathsep) if part]
    folder = plugin / "usd"
    if folder.is_dir() and str(folder) not in known:
        os.environ["PXR_PLUGINPATH_NAME"] = os.pathsep.join([str(folder), *known])
    reason = plugin / "not-built.txt"
    if reason.is_file() and not known:
        raise RuntimeMissingError(
            "this mbfeat was installed without its Hydra plug-in: "
            f"{reason.read_text(encoding='utf-8').strip()}; install it again with MBFEAT_USD_ROOT "
            "set to the runtime prefix that ./run made, or to an OpenUSD SDK"
        )
