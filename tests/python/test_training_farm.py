"""The Open Job Description template makes a data set in pieces."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from training.dataset.reader import Dataset

ROOT = Path(__file__).resolve().parents[2]
TEMPLATE = ROOT / "training" / "generate.openjd.yaml"
OPENJD = shutil.which("openjd")
PARAMETERS = {
    "Checkout": str(ROOT), "Seed": "7", "Scenes": "3", "ScenesPerShard": "2", "LastShard": "1",
    "Size": "16", "Samples": "2", "ReferenceSamples": "8", "Threads": "1",
}  # fmt: skip

pytestmark = pytest.mark.skipif(
    OPENJD is None, reason="openjd is only in ./run training's environment"
)


def openjd(*arguments: str) -> subprocess.CompletedProcess[str]:
    assert OPENJD is not None
    return subprocess.run(
        [OPENJD, *arguments], capture_output=True, text=True, timeout=300, check=False
    )


def test_template_is_valid() -> None:
    finished = openjd("check", str(TEMPLATE))
    assert finished.returncode == 0, finished.stdout + finished.stderr


def test_job_makes_and_verifies_a_data_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MBFEAT_SKIP_BUILD", "1")
    folder = tmp_path / "data"
    parameters = [
        part
        for name, value in {**PARAMETERS, "Folder": str(folder)}.items()
        for part in ("-p", f"{name}={value}")
    ]
    finished = openjd("run", str(TEMPLATE), "--step", "Verify", "--run-dependencies", *parameters)
    assert finished.returncode == 0, finished.stdout + finished.stderr
    dataset = Dataset(folder)
    assert dataset.missing == [] and len(dataset) == 6
