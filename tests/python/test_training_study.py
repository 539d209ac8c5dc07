"""Studies: variants trained alike, kept when they are done, compared; those that come along."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="torch is only in ./run training's environment")

from mbfeat import metrics
from training import study
from training.config import Config
from training.dataset.reader import Dataset
from training.evaluation import studypage
from training.trainer import MODEL
from training_sets import TINY, synthetic_set


def write_study(folder: Path, *, wrong: str = "", steps: int = 3) -> Path:
    settings = json.dumps(TINY)
    file = folder / "tiny.toml"
    file.write_text(
        f"""
        title = "Tiny"
        config = "reduced"
        steps = {steps}
        seeds = [1, 2]
        compared = [["paths", "gbuffer{wrong}"]]
        [variants]
        gbuffer = {{ features = "gbuffer", set = {settings} }}
        paths = {{ features = "paths", set = {settings} }}
        """
    )
    return file


def processes_about(folder: Path) -> list[bytes]:
    """Command lines that name the folder, of what runs."""
    lines = []
    for file in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            lines.append(file.read_bytes())
        except OSError:
            continue  # it has ended
    return [line for line in lines if str(folder).encode() in line]


def killed(command: list[str], until: Callable[[], bool]) -> tuple[int, bytes]:
    """Exit code and words of a study that is terminated when `until` says so."""
    root = Path(study.__file__).resolve().parents[1]
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, cwd=root, stdout=pipe, stderr=pipe, start_new_session=True)
    try:
        deadline = time.monotonic() + 120.0
        while not until():
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.2)
        process.send_signal(signal.SIGTERM)
        _, words = process.communicate(timeout=60.0)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    return process.returncode, words


@pytest.mark.parametrize("one_has_failed", [False, True])
def test_runs_of_a_killed_study_end_with_it(tmp_path: Path, one_has_failed: bool) -> None:
    windows = synthetic_set(tmp_path / "data")
    runs = tmp_path / "runs"
    command = [sys.executable, "-m", "training.study", str(write_study(tmp_path, steps=10**6))]
    command += [str(runs), "--data", str(windows), "--workers", "2"]
    logs = [runs / name / "log.txt" for name in ("gbuffer-1", "paths-1")]
    wanted = ["ms a step", "ms a step"]
    if one_has_failed:  # the study waits for the other before it says so
        logs[0].parent.mkdir(parents=True)
        (logs[0].parent / "checkpoint.pt").write_bytes(b"no checkpoint")
        wanted[0] = "training.train: "

    def run() -> bool:
        pairs = zip(logs, wanted, strict=True)
        return all(log.exists() and words in log.read_text() for log, words in pairs)

    code, words = killed(command, run)
    assert code == 130
    assert b"interrupted; run it again to go on" in words
    assert processes_about(runs) == []


def test_variants_are_trained_once_and_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    windows = synthetic_set(tmp_path / "data")
    monkeypatch.setattr(study, "PLANS", {"test": None})
    monkeypatch.setattr(study, "dataset", lambda folder, name: Dataset(windows))
    monkeypatch.setattr(study, "SAMPLES", 4)
    out, runs = tmp_path / "out.json", tmp_path / "runs"
    command = [str(write_study(tmp_path)), str(runs), "--data", str(windows), "--json", str(out)]
    assert study.main([*command, "--workers", "2"]) == 0
    names = ["gbuffer-1", "gbuffer-2", "paths-1", "paths-2"]
    assert sorted(path.name for path in runs.iterdir()) == names
    result = json.loads(out.read_text())
    assert result["windows"] == 4 and result["seeds"] == [1, 2]
    assert result["variants"]["paths"]["parameters"] == result["variants"]["gbuffer"]["parameters"]
    ratio = result["ratios"]["paths/gbuffer"]
    assert set(ratio) == set(metrics.NAMES)
    means = {name: about["means"]["MSE"] for name, about in result["variants"].items()}
    alone = [a / b for a, b in zip(means["paths"], means["gbuffer"], strict=True)]
    assert ratio["MSE"]["seeds"] == pytest.approx(alone)
    assert ratio["MSE"]["value"] == pytest.approx(sum(means["paths"]) / sum(means["gbuffer"]))
    assert ratio["MSE"]["low"] <= ratio["MSE"]["value"] <= ratio["MSE"]["high"]

    # Again: nothing is trained, and what one seed's network lost is made anew.
    times = {name: (runs / name / MODEL).stat().st_mtime_ns for name in names}
    (runs / "paths-2" / MODEL).unlink()
    (runs / "paths-2" / "checkpoint.pt").unlink()
    assert study.main(command) == 0
    kept = {name: (runs / name / MODEL).stat().st_mtime_ns for name in names}
    assert [name for name in names if kept[name] != times[name]] == ["paths-2"]
    again = json.loads(out.read_text())["variants"]["paths"]["means"]
    assert again["MSE"] == pytest.approx(means["paths"])

    # What is kept is not taken for what a changed study asks for.
    write_study(tmp_path, steps=4)
    (runs / "gbuffer-2" / MODEL).rename(tmp_path / "kept.pt")
    assert study.main(command) == 1
    assert not (runs / "gbuffer-2" / MODEL).exists()  # nothing is trained before
    (tmp_path / "kept.pt").rename(runs / "gbuffer-2" / MODEL)
    assert "another number of steps than the study asks for" in capsys.readouterr().err
    write_study(tmp_path)

    monkeypatch.setattr(studypage, "DOCS", tmp_path)
    assert study.main(["--page", str(out)]) == 0
    page = (tmp_path / "studies.md").read_text()
    assert "## Tiny" in page and f"{ratio['MSE']['value']:.3f} (" in page
    other = tmp_path / "other.json"
    other.write_text(json.dumps(json.loads(out.read_text()) | {"title": "Other"}))
    assert study.main(["--page", str(other)]) == 0
    assert study.main(["--page", str(out)]) == 0  # in its place, and the other one stays
    both = (tmp_path / "studies.md").read_text()
    assert both.startswith(page.rstrip()) and both.count("## ") == 2 and "## Other" in both


def test_studies_that_come_along_are_whole() -> None:
    """Every variant is a network that can be built, and differs from the baseline."""
    for file in sorted(studypage.STUDIES.glob("*.toml")):
        found = study.Study.read(file.stem)
        configs = []
        for options in found.variants.values():
            config = Config.read(found.config, *options.get("set", []))
            configs.append((config, options.get("features")))
        assert all(configs.count(config) == 1 for config in configs)
        assert found.compared


def test_wrong_studies_and_failed_runs_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rest = [str(tmp_path / "runs"), "--data", str(tmp_path / "none")]
    assert study.main(["nothing", *rest]) == 1
    assert "there are features, start, switches" in capsys.readouterr().err
    assert study.main([str(write_study(tmp_path, wrong="s")), *rest]) == 1
    assert "compares gbuffers, which it does not name" in capsys.readouterr().err
    assert study.main([str(write_study(tmp_path)), *rest]) == 1
    assert "could not be trained" in capsys.readouterr().err
    assert study.main(["--page", str(tmp_path / "none.json")]) == 1
    assert "none.json: it is no result" in capsys.readouterr().err
