"""The environment that ./run gives to commands and tests."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from mbfeat.devtools.environment import for_runtime
from mbfeat.devtools.layout import Layout


def test_runtime_pxr_is_the_one_with_imaging() -> None:
    import pxr
    from pxr import Usd, UsdAppUtils, UsdImagingGL

    assert Usd.GetVersion() == (0, 25, 8)
    assert Path(pxr.__file__).is_relative_to(os.environ["MBFEAT_USD_ROOT"])
    assert UsdAppUtils.FrameRecorder and UsdImagingGL.Engine


def test_runtime_finds_its_own_resources() -> None:
    from pxr import Plug

    names = {plugin.name for plugin in Plug.Registry().GetAllPlugins()}
    assert {"usdGeom", "usdLux", "usdRender", "hdStorm"} <= names


@pytest.mark.usd_core
def test_usd_core_pxr_has_no_imaging() -> None:
    from pxr import Usd

    assert Usd.GetVersion() == (0, 25, 8)
    with pytest.raises(ImportError):
        from pxr import UsdImagingGL  # noqa: F401


def test_commands_are_on_path() -> None:
    environment = {"PATH": os.environ["PATH"]}
    for command in ("mbfeat", "usdrecord"):
        found = subprocess.run(
            ["sh", "-c", f"command -v {command}"], env=environment, capture_output=True, text=True
        )
        assert Path(found.stdout.strip()).is_relative_to(Path(sys.prefix).parent)


def test_binaries_do_not_tell_where_they_were_built() -> None:
    build = Path(os.environ["MBFEAT_BUILD_DIR"])
    binaries = [path for path in build.rglob("*.so") if "CMakeFiles" not in path.parts]
    assert {path.name.partition(".")[0] for path in binaries} >= {"libmbfeat", "hdMBFeat", "_core"}
    root = str(Path(__file__).resolve().parents[2]).encode()
    assert [path.name for path in binaries if root in path.read_bytes()] == []


def test_color_configs_are_files() -> None:
    configs = sorted(Path(os.environ["MBFEAT_OCIO_DIR"]).glob("*.ocio"))
    assert [config.name.partition("-")[0] for config in configs] == ["cg", "studio"]
    assert all("ocio_profile_version: 2.1" in config.read_text() for config in configs)


def test_training_has_the_common_packages_and_the_pins_of_the_extra(root: Path) -> None:
    devtools = root / "python" / "mbfeat" / "devtools"
    lines = (devtools / "requirements-training.txt").read_text().splitlines()
    assert "-r requirements.txt" in lines
    pins = {line for line in lines if "==" in line}
    pins |= set((devtools / "requirements.txt").read_text().splitlines())
    extra = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    assert set(extra["optional-dependencies"]["training"]) <= pins


def test_training_environment_comes_first_and_renders_with_the_same_openusd(root: Path) -> None:
    layout = Layout(root)
    plain = for_runtime(layout, {"PATH": "/bin"})
    training = for_runtime(layout, {"PATH": "/bin"}, layout.training)
    folders = training["PATH"].split(":")
    assert folders.index(str(layout.training / "bin")) < folders.index("/bin")
    assert str(layout.venv / "bin") not in folders
    assert training["VIRTUAL_ENV"] == str(layout.training)
    assert training["PYTHONPATH"] == plain["PYTHONPATH"]
