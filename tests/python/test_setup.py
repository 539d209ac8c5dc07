"""The set-up steps behind ./run: what makes them run again, and what they refuse."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import pytest

from mbfeat.devtools import blender, environment, steps, usd_runtime
from mbfeat.devtools.console import Console, SetupError, run_logged
from mbfeat.devtools.layout import Layout


class CountedStep(steps.Step):
    """A step that counts how often it ran and fails on demand."""

    name = "counted"
    title = "counted"
    depends = "a"
    fails = False
    runs = 0

    def key(self) -> str:
        return self.depends

    def make(self) -> None:
        self.runs += 1
        if self.fails:
            raise SetupError("it failed")


def test_step_runs_until_it_succeeds_and_again_when_its_key_changes(tmp_path: Path) -> None:
    step = CountedStep(Layout(tmp_path), Console())
    assert not step.is_done()
    step.fails = True
    with pytest.raises(SetupError):
        step.run()
    assert not step.is_done()
    step.fails = False
    step.run()
    assert step.is_done()
    step.depends = "b"
    assert not step.is_done()
    step.fails = True
    with pytest.raises(SetupError):
        step.run()
    step.depends = "a"
    assert not step.is_done(), "a failed repetition must not leave the old stamp"


def test_build_key_follows_sources(tmp_path: Path, root: Path) -> None:
    for name in ("CMakeLists.txt", "CMakePresets.json", "python/CMakeLists.txt"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(root / name, tmp_path / name)
    shutil.copytree(root / "python/mbfeat/devtools", tmp_path / "python/mbfeat/devtools")
    source = tmp_path / "hdmbfeat" / "core" / "a.cpp"
    source.parent.mkdir(parents=True)
    keys = []
    build = steps.Build(Layout(tmp_path), Console())
    keys.append(build.key())
    source.write_text("int a;")
    keys.append(build.key())
    os.utime(source, ns=(1, 1))
    keys.append(build.key())
    source.rename(source.with_name("b.cpp"))
    keys.append(build.key())
    (source.parent / "notes.md").write_text("not compiled")
    assert len(set(keys)) == 4
    assert build.key() == keys[-1]


def test_system_packages_of_one_purpose_are_nobody_elses(root: Path) -> None:
    kinds = (steps.SystemPackages, steps.LintSystemPackages, blender.BlenderSystemPackages)
    building, lint, host = (set(kind(Layout(root), Console()).packages()) for kind in kinds)
    assert "cmake" in building and "clang-tidy" in lint and "libxi6" in host
    assert not building & lint and not building & host and not lint & host


def test_repeated_run_does_nothing(root: Path) -> None:
    variables = {**os.environ, "MBFEAT_SKIP_BUILD": "1"}
    result = subprocess.run(
        [root / "run", "sh", "-c", "echo out; exit 3"],
        env=variables,
        capture_output=True,
        text=True,
    )
    assert (result.returncode, result.stdout, result.stderr) == (3, "out\n", "")


def test_unknown_command_is_named(root: Path) -> None:
    variables = {**os.environ, "MBFEAT_SKIP_BUILD": "1"}
    result = subprocess.run(
        [root / "run", "no-such-command"], env=variables, capture_output=True, text=True
    )
    assert result.returncode == 127
    assert result.stderr == "run: no-such-command: No such file or directory.\n"


@pytest.mark.parametrize(
    ("output", "expected"),
    [
        ("error: NewConnectionError(': Failed to establish')", "network"),
        ("OSError: [Errno 28] No space left on device", "disk is full"),
        ("noise\nfoo.cpp:3: error: no such thing\nmore", "foo.cpp:3: error: no such thing"),
    ],
)
def test_failures_are_explained(tmp_path: Path, output: str, expected: str) -> None:
    log = tmp_path / "log" / "step.log"
    command = ["sh", "-c", f'printf "%s\\n" "{output}"; exit 1']
    with pytest.raises(SetupError, match="it did not work") as caught:
        run_logged(command, console=Console(), log=log, failure="it did not work")
    assert expected in str(caught.value)
    assert str(log) in str(caught.value)
    assert output in log.read_text()


def test_other_wheels_are_refused(tmp_path: Path) -> None:
    other = tmp_path / "other.whl"
    with zipfile.ZipFile(other, "w") as archive:
        archive.writestr("bpy-4.0.0.dist-info/METADATA", "")
    with pytest.raises(SetupError, match=r"is not the wheel bpy==5\.0\.1"):
        usd_runtime.unpack_runtime(other, tmp_path / "usd", lambda _: None)
    other.write_bytes(b"PK\3\4 cut short")
    with pytest.raises(SetupError, match="is damaged"):
        usd_runtime.unpack_runtime(other, tmp_path / "usd", lambda _: None)


def test_runtime_modules_find_their_libraries_in_the_prefix() -> None:
    module = Path(os.environ["MBFEAT_USD_ROOT"]) / "pxr" / "Tf" / "_tf.so"
    assert b"\0$ORIGIN/../../lib\0" in module.read_bytes()


def test_runpath_is_replaced_only_where_it_fits(tmp_path: Path) -> None:
    module = tmp_path / "_tf.so"
    shutil.copy(Path(os.environ["MBFEAT_USD_ROOT"]) / "pxr" / "Tf" / "_tf.so", module)
    before = module.read_bytes()
    with pytest.raises(SetupError, match="unexpected RUNPATH"):
        usd_runtime.set_runpath(module, "$ORIGIN/" + "x" * 100)
    assert module.read_bytes() == before
    usd_runtime.set_runpath(module, "$ORIGIN/lib")
    assert b"\0$ORIGIN/lib\0" in module.read_bytes()
    assert module.stat().st_size == len(before)
    module.write_bytes(struct.pack("<I", 1) * 32)
    with pytest.raises(SetupError, match="not a 64-bit ELF library"):
        usd_runtime.set_runpath(module, "$ORIGIN/lib")


def test_usd_core_environment_has_nothing_of_the_runtime(tmp_path: Path) -> None:
    layout = Layout(tmp_path)
    base = {"PATH": "/bin", "PYTHONPATH": "/mine", "PXR_PLUGINPATH_NAME": "/plug"}
    runtime = environment.for_runtime(layout, base)
    assert runtime["PYTHONPATH"].split(":")[0] == str(layout.usd)
    assert runtime["PYTHONPATH"].endswith(":/mine")
    assert runtime["PXR_PLUGINPATH_NAME"].endswith("/plugin/usd:/plug")
    core = environment.for_usd_core(layout, runtime)
    assert str(layout.usd) not in core["PYTHONPATH"].split(":")
    assert core["PYTHONPATH"].endswith(":/mine")
    assert core["PXR_PLUGINPATH_NAME"] == "/plug"
    assert environment.for_runtime(layout, runtime) == runtime
