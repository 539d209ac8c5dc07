"""Trains a network; goes on where an earlier run of the same folder stopped.

    python -m training.train RUN --data DATA... --config reduced --features paths --minutes 60
    torchrun --nproc-per-node 2 -m training.train RUN ...

``--minutes`` measures a few steps and trains as many as fit; ``--steps`` is reproducible to the bit
with the same number of threads and processes. Curves: tensorboard --logdir RUN.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from training.needs_torch import require

require("training.train")

import torch  # noqa: E402

from training import initial  # noqa: E402
from training.checkpoints import CheckpointError  # noqa: E402
from training.config import Config  # noqa: E402
from training.dataset.plan import PlanError  # noqa: E402
from training.dataset.reader import Dataset  # noqa: E402
from training.dataset.shards import ShardError  # noqa: E402
from training.model.config import FEATURE_SETS, ConfigError  # noqa: E402
from training.processes import Processes, joined, keep_freed_memory  # noqa: E402
from training.trainer import MODEL, Trainer, TrainingError  # noqa: E402

INTERRUPTED = 130


def parser() -> argparse.ArgumentParser:
    """The command's options."""
    p = argparse.ArgumentParser(prog="python -m training.train", description=__doc__)
    p.add_argument("folder", type=Path, help="of the run: checkpoints, logs, the trained model")
    p.add_argument("--data", type=Path, nargs="+", required=True, help="data sets")
    p.add_argument("--validation", type=Path, help="a data set to look at now and then")
    p.add_argument("--config", default="reduced", help="a TOML file, or one of training/configs")
    p.add_argument("--features", choices=FEATURE_SETS, help="instead of the configuration's")
    p.add_argument("--set", action="append", default=[], metavar="SECTION.NAME=VALUE")
    p.add_argument("--init", type=Path, help="begin with these weights: an .onnx or .pt file")
    p.add_argument("--seed", type=int, default=1)
    length = p.add_mutually_exclusive_group(required=True)
    length.add_argument("--minutes", type=float)
    length.add_argument("--steps", type=int)
    p.add_argument("--threads", type=int, default=0, help="of this process (default: all cores)")
    p.add_argument("--checkpoint-minutes", type=float, default=5.0)
    return p


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns 0, 1 when it failed, 130 when it was interrupted."""
    options = parser().parse_args(arguments)
    keep_freed_memory()
    if options.threads:
        torch.set_num_threads(options.threads)
    try:
        with joined() as processes:
            _train(options, processes)
    except (
        CheckpointError,
        ConfigError,
        PlanError,
        ShardError,
        TrainingError,
        ValueError,
    ) as error:
        sys.stderr.write(f"training.train: {error}\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("\ntraining.train: interrupted; run it again to go on\n")
        return INTERRUPTED
    return 0


def _train(options: argparse.Namespace, processes: Processes) -> None:
    config = Config.read(options.config, *options.set).with_features(options.features)
    trainer = Trainer(
        options.folder,
        config,
        [Dataset(folder) for folder in options.data],
        seed=options.seed,
        processes=processes,
        validation=Dataset(options.validation) if options.validation else None,
        initial=initial.read(options.init) if options.init else None,
    )
    if processes.is_first:
        print(
            f"{config.model.features}: {trainer.model.parameter_count} parameters, "
            f"{len(trainer.batches)} windows, {processes.count} processes of "
            f"{torch.get_num_threads()} threads",
            flush=True,
        )
    trainer.run(
        options.steps or 0,
        minutes=options.minutes or 0.0,
        checkpoint_minutes=options.checkpoint_minutes,
    )
    if processes.is_first:
        print(f"wrote {options.folder / MODEL} after {trainer.step} steps")


if __name__ == "__main__":
    sys.exit(main())
