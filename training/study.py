"""Trains the variants of a network that a study names, all alike, and compares them.

    python -m training.study switches RUNS --data DATA [--workers 2] [--json FILE]
    python -m training.study --page FILE...             # writes these sections of the page

A study is a TOML file, or one of training/studies by name. Every variant is trained with every seed
by as many steps, on one thread each; what is trained already is kept, and what was interrupted goes
on. Then all of them reconstruct the held-out windows at 8 samples a pixel, as training.evaluate
does, and are compared with the study's baseline.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import hashlib
import json
import signal
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from training.needs_torch import require

require("training.study")

from mbfeat import metrics  # noqa: E402
from mbfeat.devtools.layout import this_layout  # noqa: E402
from mbfeat.files import write_whole  # noqa: E402
from mbfeat.machine import cpu_name  # noqa: E402
from training.checkpoints import CheckpointError, Trained, load_model  # noqa: E402
from training.config import Config  # noqa: E402
from training.dataset.plan import PlanError  # noqa: E402
from training.dataset.reader import Dataset  # noqa: E402
from training.dataset.references import ReferencesError  # noqa: E402
from training.dataset.shards import ShardError  # noqa: E402
from training.evaluation import networks, statistics, studypage  # noqa: E402
from training.evaluation.data import PLANS, DataError, dataset  # noqa: E402
from training.evaluation.methods import Method, measured  # noqa: E402
from training.evaluation.statistics import Row  # noqa: E402
from training.model.config import ConfigError  # noqa: E402
from training.trainer import MODEL, described  # noqa: E402

SAMPLES = 8
KEPT = "metrics.json"  # of a run, beside its model


class StudyError(Exception):
    """A study cannot be read or one of its runs failed; the message says what to do."""


@dataclass(frozen=True)
class Study:
    """`variants` are the options of training.train by name: a feature set, and settings.

    `compared` are pairs of variants, each the first over the second.
    """

    title: str
    config: str
    steps: int
    seeds: tuple[int, ...]
    variants: Mapping[str, Mapping[str, Any]]
    compared: tuple[tuple[str, str], ...] = field(default=())

    @staticmethod
    def read(name: str) -> Study:
        """Raises StudyError."""
        file = Path(name) if name.endswith(".toml") else studypage.STUDIES / f"{name}.toml"
        try:
            values = tomllib.loads(file.read_text(encoding="utf-8"))
            variants = dict(values["variants"])
            pairs = [tuple(pair) for pair in values.get("compared", [])]
            if "baseline" in values:
                base = values["baseline"]
                pairs += [(name, base) for name in variants if name != base]
            study = Study(
                title=values["title"],
                config=values["config"],
                steps=int(values["steps"]),
                seeds=tuple(int(seed) for seed in values["seeds"]),
                variants=variants,
                compared=tuple((str(a), str(b)) for a, b in pairs),
            )
        except OSError as error:
            known = ", ".join(studypage.study_names())
            raise StudyError(f"{file}: {error.strerror}; there are {known}") from error
        except (tomllib.TOMLDecodeError, KeyError, TypeError, ValueError) as error:
            raise StudyError(f"{file} is no study: {error!r}") from error
        unknown = {name for pair in study.compared for name in pair} - set(variants)
        if unknown:
            names = ", ".join(sorted(unknown))
            raise StudyError(f"{file} compares {names}, which it does not name")
        for variant in variants:
            study.configuration(variant)
        return study

    def configuration(self, variant: str) -> Config:
        """Of a variant's runs; raises ConfigError."""
        options = self.variants[variant]
        return Config.read(self.config, *options.get("set", [])).with_features(
            options.get("features")
        )

    def command(self, variant: str, seed: int) -> list[str]:
        """The options of training.train, apart from the folder and the data."""
        options = self.variants[variant]
        command = ["--config", self.config, "--seed", str(seed), "--steps", str(self.steps)]
        if "features" in options:
            command += ["--features", options["features"]]
        for setting in options.get("set", []):
            command += ["--set", setting]
        return command


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m training.study",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("study", nargs="?", help="a TOML file, or one of training/studies")
    parser.add_argument("folder", nargs="?", type=Path, help="of all runs")
    parser.add_argument("--data", type=Path, nargs="+", help="data sets to train on")
    parser.add_argument("--test-data", type=Path, help="folder of the data sets test and stages")
    parser.add_argument("--workers", type=int, default=1, help="runs at once, one thread each")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--page", type=Path, nargs="+", metavar="RESULT", help="JSON files")
    options = parser.parse_args(arguments)
    try:
        if options.page:
            print(f"wrote {studypage.write(options.page)}")
            return 0
        if not (options.study and options.folder and options.data):
            parser.error("a study, a folder and --data are needed")
        result = _run(options)
    except (
        CheckpointError,
        ConfigError,
        DataError,
        PlanError,
        ReferencesError,
        ShardError,
        StudyError,
        ValueError,
        networks.NetworkError,
    ) as error:
        sys.stderr.write(f"training.study: {error}\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("\ntraining.study: interrupted; run it again to go on\n")
        return 130
    print(studypage.section(result))
    if options.json:
        write_whole(options.json, json.dumps(result, indent=1) + "\n")
    return 0


def _run(options: argparse.Namespace) -> dict[str, Any]:
    study = Study.read(options.study)
    runs = [(variant, seed) for seed in study.seeds for variant in study.variants]
    folders = {run: options.folder / f"{run[0].replace(' ', '-')}-{run[1]}" for run in runs}
    begin = time.monotonic()
    finished: list[str] = []
    children = _Children()

    for run in runs:  # before hours are spent on the others
        if (folders[run] / MODEL).exists():
            _check(study, run, folders[run], load_model(folders[run] / MODEL), options.data)

    def train(run: tuple[str, int]) -> None:
        if not (folders[run] / MODEL).exists():
            _train(study, run, folders[run], options.data, children)
        finished.append(run[0])
        print(
            f"[{len(finished)}/{len(runs)}] {run[0]}, seed {run[1]} is trained, "
            f"{(time.monotonic() - begin) / 60:.0f} min",
            flush=True,
        )

    _all(train, runs, options.workers, children)
    trained = {run: load_model(folders[run] / MODEL) for run in runs}
    test = options.test_data or this_layout().made / "training-data"
    rows = {run: _metrics(folders[run], test) for run in runs}
    return _result(study, options.study, rows, trained)


class _Children:
    """Processes that run; all of them are ended when the study is."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._ended = False

    def run(self, command: Sequence[str], **options: Any) -> int:
        """Until it has ended; returns its exit code, which is negative where it was ended."""
        with self._lock:
            if self._ended:
                return -signal.SIGTERM
            child = subprocess.Popen(command, **options)
            self._running.add(child)
        code = child.wait()
        with self._lock:
            self._running.discard(child)
        return code

    def end(self) -> None:
        """Of those that run and those that would."""
        with self._lock:
            self._ended = True
            for child in self._running:
                child.terminate()


def _all(
    train: Callable[[tuple[str, int]], None],
    runs: Sequence[Any],
    workers: int,
    children: _Children,
) -> None:
    """Several at once; the first failure ends it when those that run are done.

    Whatever else ends it, such as an interrupt, ends those that run.
    """
    pool = ThreadPoolExecutor(max(workers, 1))
    try:
        futures = [pool.submit(train, run) for run in runs]
        done, _ = wait(futures, return_when=FIRST_EXCEPTION)
        pool.shutdown(wait=True, cancel_futures=True)
    except BaseException:
        children.end()
        pool.shutdown(wait=True, cancel_futures=True)
        raise
    for future in done:
        future.result()


def _train(
    study: Study, run: tuple[str, int], folder: Path, data: Sequence[Path], children: _Children
) -> None:
    """In a process of its own, whose words go to a file of the run."""
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "training.train", str(folder), *study.command(*run)]
    command += ["--threads", "1", "--data", *map(str, data)]
    root = Path(__file__).resolve().parents[1]
    log = folder / "log.txt"
    with log.open("a", encoding="utf-8") as words:
        code = children.run(command, cwd=root, stdout=words, stderr=words)
    if code:
        raise StudyError(f"{run[0]}, seed {run[1]} could not be trained; {log} says why")


def _check(
    study: Study, run: tuple[str, int], folder: Path, trained: Trained, data: Sequence[Path]
) -> None:
    """What was kept may be of a study that has been changed since; raises StudyError."""
    wanted = {
        "configuration": study.configuration(run[0]).to_dict(),
        "seed": run[1],
        "number of steps": study.steps,
        "data": described([Dataset(folder) for folder in data]),
    }
    history = trained.history
    kept = {
        "configuration": trained.config.to_dict(),
        "seed": history["seed"],
        "number of steps": history["step"],
        "data": history["data"],
    }
    for name, value in wanted.items():
        if kept[name] != value:
            raise StudyError(
                f"{folder} holds a network of another {name} than the study asks for; delete it, "
                "or name another folder"
            )


def _metrics(folder: Path, test: Path) -> list[Row]:
    """Of a run's network on all windows; kept beside it, with what they are of."""
    sets = [dataset(test, name) for name in PLANS]
    network = hashlib.sha256((folder / MODEL).read_bytes()).hexdigest()
    identity = {"network": network, "samples": SAMPLES, "windows": described(sets)}
    kept = folder / KEPT
    if kept.exists():
        content = json.loads(kept.read_text(encoding="utf-8"))
        if isinstance(content, dict) and content.get("of") == identity:
            return [Row(**row) for row in content["rows"]]
    method: Method = networks.network(folder.name, folder / MODEL)
    rows: list[Row] = []
    for windows in sets:
        for index in range(len(windows)):
            rows.append(measured(method, windows[index], len(rows), SAMPLES)[0])
    content = {"of": identity, "rows": [vars(row) for row in rows]}
    write_whole(kept, json.dumps(content) + "\n")
    return rows


def _mean(rows: Sequence[Row], metric: str) -> float:
    return sum(row.metrics[metric] for row in rows) / len(rows)


def _over_seeds(
    study: Study, rows: Mapping[tuple[str, int], Sequence[Row]], variant: str
) -> list[Row]:
    """A variant's rows, of means over its seeds: intervals are of windows alone."""
    of_seeds = [rows[variant, seed] for seed in study.seeds]
    return [
        dataclasses.replace(
            same[0],
            method=variant,
            metrics={name: _mean(same, name) for name in metrics.NAMES},
        )
        for same in zip(*of_seeds, strict=True)
    ]


def _result(
    study: Study,
    name: str,
    rows: Mapping[tuple[str, int], Sequence[Row]],
    trained: Mapping[tuple[str, int], Any],
) -> dict[str, Any]:
    """Plain values: means of each run, and ratios of means over seeds and windows."""
    ratios: dict[str, Any] = {}
    for first, second in study.compared:
        both = [*_over_seeds(study, rows, first), *_over_seeds(study, rows, second)]
        found = {}
        for metric in metrics.NAMES:
            interval = statistics.ratio(both, first, second, metric)
            alone = [
                _mean(rows[first, seed], metric) / _mean(rows[second, seed], metric)
                for seed in study.seeds
            ]
            found[metric] = {**vars(interval), "seeds": alone}
        ratios[f"{first}/{second}"] = found
    return {
        "study": Path(name).stem,
        "title": study.title,
        "config": study.config,
        "steps": study.steps,
        "seeds": list(study.seeds),
        "samples": SAMPLES,
        "windows": len(next(iter(rows.values()))),
        "date": datetime.date.today().isoformat(),
        "processor": cpu_name(),
        "data": next(iter(trained.values())).history["data"],
        "variants": {
            variant: {
                "parameters": trained[variant, study.seeds[0]].model.parameter_count,
                "minutes": sum(trained[variant, s].history["seconds"] for s in study.seeds)
                / 60
                / len(study.seeds),
                "means": {
                    metric: [_mean(rows[variant, s], metric) for s in study.seeds]
                    for metric in metrics.NAMES
                },
            }
            for variant in study.variants
        },
        "ratios": ratios,
    }


if __name__ == "__main__":
    # The runs of a study that is killed end with it, as those of one that is interrupted do.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(main())
