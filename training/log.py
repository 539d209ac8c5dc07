"""Progress on standard output and in TensorBoard."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from training.trainer import Trainer


class Log:
    """Of a run in `folder`, resumed at `step`; without a folder it is silent."""

    def __init__(self, folder: Path | None, step: int) -> None:
        self._writer: Any = None
        self._silent = folder is None
        if folder is None:
            return
        try:
            from torch.utils.tensorboard import SummaryWriter
        except ImportError:
            print("tensorboard is not installed: the curves are only printed", flush=True)
            return
        # Steps that a killed run logged after its last checkpoint are made again.
        self._writer = SummaryWriter(str(folder / "tensorboard"), purge_step=step)

    def progress(self, trainer: Trainer, loss: float, steps_here: int) -> None:
        """One line, and the curves."""
        if self._silent:
            return
        each = trainer.seconds / max(trainer.step, 1)
        left = each * (trainer.total_steps - trainer.step) / 60
        print(
            f"[{trainer.step}/{trainer.total_steps}] loss {loss:.5f}, {each * 1000:.0f} ms a "
            f"step, {left:.0f} min left",
            flush=True,
        )
        if self._writer is not None:
            self._writer.add_scalar("loss", loss, trainer.step)
            self._writer.add_scalar("rate", trainer.rate(trainer.step), trainer.step)
            self._writer.add_scalar("seconds a step", each, trainer.step)

    def validation(self, trainer: Trainer, values: dict[str, float]) -> None:
        """Metrics of the averaged network."""
        if self._silent:
            return
        text = ", ".join(f"{name} {value:.4g}" for name, value in values.items())
        print(f"[{trainer.step}/{trainer.total_steps}] validation: {text}", flush=True)
        if self._writer is not None:
            for name, value in values.items():
                self._writer.add_scalar(f"validation/{name}", value, trainer.step)

    def __enter__(self) -> Log:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._writer is not None:
            self._writer.close()
