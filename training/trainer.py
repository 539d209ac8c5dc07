"""The training loop: steps, checkpoints, logs."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from mbfeat import metrics
from training import checkpoints
from training.batches import Batches
from training.config import Config
from training.dataset.reader import Dataset
from training.inference import denoise
from training.initial import Initial, with_guides
from training.model.losses import LossConfig, image_loss, manifold
from training.model.sksn import Sksn
from training.processes import Processes

CHECKPOINT = "checkpoint.pt"
MODEL = "model.pt"
MEASURED_STEPS = 12  # of which the first third warms up


class TrainingError(Exception):
    """Training cannot go on; the message says why and what to do."""


def described(datasets: Sequence[Dataset]) -> list[str]:
    """What runs remember of their data."""
    return [
        f"{d.plan.split} seed {d.plan.seed}: {len(d)} windows of {d.plan.size}" for d in datasets
    ]


class Objective(nn.Module):
    """The loss as a module, so that the gradients of all of it are shared between processes."""

    def __init__(self, model: Sksn, config: LossConfig) -> None:
        super().__init__()
        self.model = model
        self.config = config

    def forward(self, x: Tensor, reference: Tensor, pairs: Tensor, with_manifold: bool) -> Tensor:
        state = self.model.hidden(x)
        loss = image_loss(self.config, self.model.splatted(state), reference)
        # The term is added always, so that every process shares every gradient.
        weight = self.config.manifold if with_manifold else 0.0
        if self.config.manifold:
            loss = loss + weight * manifold(state.embedding, reference, pairs)
        return loss


class Trainer:
    """A run in a folder; goes on from the folder's checkpoint where there is one."""

    def __init__(
        self,
        folder: Path,
        config: Config,
        datasets: Sequence[Dataset],
        *,
        seed: int,
        processes: Processes | None = None,
        validation: Dataset | None = None,
        initial: Initial | None = None,
    ) -> None:
        self.folder, self.config, self.seed = folder, config, seed
        self.processes = processes or Processes()
        if config.data.batch % self.processes.count:
            raise TrainingError(
                f"data.batch={config.data.batch} cannot be shared by {self.processes.count} "
                "processes; make it a multiple of their number"
            )
        self.validation = validation
        self.batches = Batches(datasets, config.data, config.model.features, seed)
        self.data = described(datasets)
        torch.manual_seed(seed)
        self.model = Sksn(config.model)
        self.origin = initial.origin if initial else None
        if initial:
            self._begin_with(initial)
        self.average = {n: p.detach().clone() for n, p in self.model.state_dict().items()}
        o = config.optimisation
        self.optimiser = torch.optim.AdamW(
            self.model.parameters(), lr=o.rate, weight_decay=o.weight_decay
        )
        self.step, self.total_steps, self.seconds = 0, 0, 0.0
        objective = Objective(self.model, config.loss)
        self.objective: nn.Module = (
            DistributedDataParallel(objective) if self.processes.count > 1 else objective
        )
        share = config.data.batch // self.processes.count
        first = self.processes.rank * share
        self.slots = range(first, first + share)

    def _begin_with(self, initial: Initial) -> None:
        """Parameters that the file's network does not have stay as they are made."""
        try:
            weights = with_guides(initial.weights, self.model)
            left = self.model.load_state_dict(weights, strict=False)
        except RuntimeError as error:
            raise TrainingError(
                f"{initial.origin['file']} is a network of another configuration: {error}"
            ) from error
        new = sorted({name.partition(".")[0] for name in left.missing_keys})
        if left.unexpected_keys or set(new) - {"alike", "scales", "atrous", "gate"}:
            names = ", ".join([*left.unexpected_keys, *left.missing_keys])
            raise TrainingError(
                f"{initial.origin['file']} is a network of another configuration: {names}"
            )

    # One step

    def rate(self, step: int) -> float:
        """The learning rate of a step."""
        o = self.config.optimisation
        warm = min(1.0, (step + 1) / o.warmup) if o.warmup else 1.0
        progress = min(1.0, step / max(self.total_steps, 1))
        falling = o.final_rate + (o.rate - o.final_rate) * 0.5 * (1 + math.cos(math.pi * progress))
        return warm * falling

    def advance(self) -> float:
        """One step; returns its loss, of this process's part of the batch."""
        for group in self.optimiser.param_groups:
            group["lr"] = self.rate(self.step)
        self.optimiser.zero_grad(set_to_none=True)
        until = self.config.loss.manifold_until * max(self.total_steps, 1)
        total = 0.0
        for number, slot in enumerate(self.slots):
            batch = self.batches.batch(self.step, [slot])
            last = number == len(self.slots) - 1
            if isinstance(self.objective, DistributedDataParallel):
                self.objective.require_backward_grad_sync = last
            loss = self.objective(batch.x, batch.reference, batch.pairs, self.step < until)
            (loss / len(self.slots)).backward()
            total += float(loss.detach())
        norm = nn.utils.clip_grad_norm_(self.model.parameters(), self.config.optimisation.clip)
        total /= len(self.slots)
        if not (math.isfinite(total) and math.isfinite(float(norm))):
            raise TrainingError(
                f"step {self.step}: the loss or its gradient is not finite; the last checkpoint "
                "is kept. Lower optimisation.rate, or verify the data with training.verify"
            )
        self.optimiser.step()
        self._update_average()
        self.step += 1
        return total

    def _update_average(self) -> None:
        decay = self.config.optimisation.average
        # Early on the average would remember the untrained weights.
        decay = min(decay, (1 + self.step) / (10 + self.step)) if decay else 0.0
        with torch.no_grad():
            for name, value in self.model.state_dict().items():
                self.average[name].lerp_(value, 1.0 - decay)

    # A run

    def run(
        self,
        total_steps: int,
        *,
        minutes: float = 0.0,
        checkpoint_minutes: float = 5.0,
        validate_every: int = 500,
        stop_after: int | None = None,
    ) -> None:
        """Trains up to `total_steps`; with `minutes` their number is measured first.

        A resumed run keeps the number it had; TrainingError where it was another. `stop_after` ends
        this call early after that many steps, as a kill would, but with a checkpoint.
        """
        self.resume()
        torch.use_deterministic_algorithms(True)
        if total_steps and self.total_steps not in (0, total_steps):
            raise TrainingError(
                f"{self.folder} began as a run of {self.total_steps} steps, not {total_steps}; "
                "name another folder, or give the same number to go on with it"
            )
        if not self.total_steps:
            self.total_steps = total_steps or self._measured(minutes)
        with self._log() as log:
            saved, begun = time.monotonic(), time.monotonic()
            before, first, window = self.seconds, self.step, []
            while self.step < self.total_steps:
                window.append(self.advance())
                self.seconds = before + time.monotonic() - begun
                at_end = self.step == self.total_steps
                if self.step % 50 == 0 or at_end:
                    log.progress(self, float(np.mean(window)), self.step - first)
                    window = []
                if self.validation is not None and (self.step % validate_every == 0 or at_end):
                    log.validation(self, self.validate())
                if time.monotonic() - saved > 60 * checkpoint_minutes or at_end:
                    self.save()
                    saved = time.monotonic()
                if stop_after is not None and self.step - first >= stop_after:
                    break
        self.save()
        if self.step == self.total_steps and self.processes.is_first:
            self.save(MODEL, with_optimiser=False)
        self.processes.wait()

    def _measured(self, minutes: float) -> int:
        """How many steps fit into the time; the run's own state is left as it was."""
        state = {n: p.detach().clone() for n, p in self.model.state_dict().items()}
        average = {n: p.clone() for n, p in self.average.items()}
        optimiser = self.optimiser.state_dict()
        self.total_steps = 1_000_000
        started = time.monotonic()
        for number in range(MEASURED_STEPS):
            if number == MEASURED_STEPS // 3:
                started = time.monotonic()
            self.advance()
        each = (time.monotonic() - started) / (MEASURED_STEPS - MEASURED_STEPS // 3)
        self.model.load_state_dict(state)
        self.average = average
        self.optimiser.load_state_dict(optimiser)
        self.step = 0
        return max(1, int(self.processes.from_first(60.0 * minutes / each)))

    def validate(self) -> dict[str, float]:
        """Mean metrics of the averaged network on the validation windows, at 4 samples."""
        assert self.validation is not None
        model = self.averaged()
        rows = []
        for index in range(min(len(self.validation), 16)):
            item = self.validation[index]
            image = denoise(model, item, samples=min(4, item.half.shape[0]))
            rows.append(metrics.all_metrics(image, item.reference))
        return {name: float(np.mean([row[name] for row in rows])) for name in metrics.NAMES}

    def averaged(self) -> Sksn:
        """A network of the averaged weights."""
        model = Sksn(self.config.model)
        model.load_state_dict(self.average)
        return model.eval()

    # Files

    def save(self, name: str = CHECKPOINT, *, with_optimiser: bool = True) -> None:
        """Writes a checkpoint; only the first process does."""
        if not self.processes.is_first:
            return
        content: dict[str, Any] = {
            "config": _plain(self.config.to_dict()),
            "seed": self.seed,
            "step": self.step,
            "total_steps": self.total_steps,
            "seconds": self.seconds,
            "data": self.data,
            "origin": self.origin,
            "processes": self.processes.count,
            "torch": str(torch.__version__),
            "average": self.average,
            "model": self.model.state_dict() if with_optimiser else {},
        }
        if with_optimiser:
            content["optimiser"] = self.optimiser.state_dict()
        checkpoints.save(self.folder / name, content)

    def resume(self) -> bool:
        """Takes over the folder's checkpoint; raises TrainingError if it is of another run."""
        file = self.folder / CHECKPOINT
        if not file.exists():
            return False
        content = checkpoints.load(file)
        if content["config"] != _plain(self.config.to_dict()) or content["seed"] != self.seed:
            raise TrainingError(
                f"{file} is of another configuration or seed; name another folder, or give the "
                "same arguments to go on with it"
            )
        if content["data"] != self.data:
            raise TrainingError(
                f"{file} was trained on other data ({'; '.join(content['data'])}); name another "
                "folder, or give the same data to go on with it"
            )
        if content.get("origin") != self.origin:
            raise TrainingError(
                f"{file} began with other weights ({content.get('origin')}); name another folder, "
                "or give the same --init to go on with it"
            )
        self.model.load_state_dict(content["model"])
        self.average = content["average"]
        self.optimiser.load_state_dict(content["optimiser"])
        self.step, self.total_steps = content["step"], content["total_steps"]
        self.seconds = content["seconds"]
        return True

    def _log(self) -> Any:
        from training.log import Log

        return Log(self.folder if self.processes.is_first else None, self.step)


def _plain(value: Any) -> Any:
    """Tuples as lists, as they come back from a file."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    return [_plain(part) for part in value] if isinstance(value, (list, tuple)) else value
