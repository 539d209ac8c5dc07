"""The ladder: every number of samples by every variant with several seeds, taking turns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mbfeat.metrics import all_metrics
from mbfeat.metrics.bias import brightness_bias
from mbfeat.tradeoff.kept import Keep, digest
from mbfeat.tradeoff.reference import FIRST_SEED, SEEDS, Reference, Tell
from mbfeat.tradeoff.renders import PHASES, Image, Renderer, RenderError, Shot
from mbfeat.tradeoff.variants import RAW, WHOLE, Variant
from mbfeat.tradeoff.wording import duration, samples

Point = dict[str, Any]
MOST_SEEDS = 99  # so that no two rungs share one


@dataclass(frozen=True)
class Task:
    """One render of the ladder."""

    variant: Variant
    spp: int
    seed: int  # from 1 on; that of the renderer differs from rung to rung

    @property
    def random_seed(self) -> int:
        """Equal for all variants, which then differ in nothing but themselves.

        Different from rung to rung: the samples of a short render begin a longer one of its seed.
        """
        number = self.seed + (MOST_SEEDS + 1) * self.spp
        return number if number < FIRST_SEED else number + SEEDS  # those between are references'

    @property
    def label(self) -> str:
        """What is being rendered, for the progress."""
        return f"{self.variant.name}, {samples(self.spp)}, seed {self.seed}"


def tasks(variants: Sequence[Variant], rungs: Sequence[int], seeds: int) -> list[Task]:
    """All renders, the cheap ones first; variants take turns, so that all meet the same machine."""
    return [
        Task(variant, spp, seed)
        for spp in sorted(rungs)
        for seed in range(1, seeds + 1)
        for variant in variants
    ]


@dataclass
class Measured:
    """What came out: `points` in order, the images by variant, samples and seed."""

    points: list[Point] = field(default_factory=list)
    images: dict[tuple[str, int], list[Image]] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)  # variants, and why


class Ladder:
    """Measures tasks; renders those that `keep` does not hold.

    `renderers` and `references` are by Variant.renderer; `subject` is the key of what is rendered.
    """

    def __init__(
        self,
        renderers: Mapping[str, Renderer],
        references: Mapping[str, Reference],
        keep: Keep,
        subject: str,
        tell: Tell,
    ) -> None:
        self._renderers = renderers
        self._references = references
        self._keep = keep
        self._subject = subject
        self._tell = tell

    def run(self, work: Sequence[Task]) -> Measured:
        """Measures; a variant that fails is left out. Raises RenderError where raw fails."""
        result = Measured()
        forecast = Forecast()
        for number, task in enumerate(work, 1):
            name = task.variant.name
            if name in result.left_out:
                continue
            try:
                shot = self._shot(task)
                reference = self._references[task.variant.renderer]
                point = self._point(task, shot, reference)
            except (RenderError, ValueError) as error:
                if name == RAW:
                    raise RenderError(str(error)) from error
                result.left_out[name] = str(error)
                self._tell(f"{name} is left out: {error}")
                continue
            result.points.append(point)
            result.images.setdefault((name, task.spp), []).append(shot.image)
            forecast.learn(task, shot)
            left = forecast.seconds(t for t in work[number:] if not self.is_kept(t))
            more = f"; {duration(left)} left" if left else ""
            found = f"{shot.total:.2f} s, relMSE {point['errors']['relMSE']:.3g}"
            self._tell(f"[{number}/{len(work)}] {task.label}: {found}{more}")
        for name in result.left_out:
            result.points = [point for point in result.points if point["variant"] != name]
            result.images = {key: kept for key, kept in result.images.items() if key[0] != name}
        return result

    def is_kept(self, task: Task) -> bool:
        """Whether the render need not be made."""
        return self._keep.about(self._key(task)) is not None

    def _key(self, task: Task) -> str:
        return digest([self._subject, task.variant.renders, task.spp, task.random_seed])

    def _shot(self, task: Task) -> Shot:
        key = self._key(task)
        shot = self._keep.load(key)
        if shot is None:
            renderer = self._renderers[task.variant.renderer]
            shot = renderer.render(task.variant, task.spp, task.random_seed)
            about = {"variant": task.variant.name, "samples": task.spp, "seed": task.random_seed}
            self._keep.save(key, shot, about)
        return shot

    def _point(self, task: Task, shot: Shot, reference: Reference) -> Point:
        key = f"{self._key(task)}-errors-{digest(reference.key)}"
        errors = self._keep.about(key)
        if errors is None:
            errors = dict(all_metrics(shot.image, reference.image))
            errors["bias"] = brightness_bias(shot.image, reference.image)
            self._keep.describe(key, errors)
        bias = errors.pop("bias")
        return {
            "variant": task.variant.name,
            "renderer": task.variant.renderer,
            "samples_per_pixel": task.spp,
            "seed": task.random_seed,
            "total_seconds": shot.total,
            "seconds": {phase: shot.seconds.get(phase, 0.0) for phase in PHASES},
            "errors": errors,
            "bias": bias,
            "records": task.variant.records,
        }


class Forecast:
    """How long renders will take, from those of the same variant before."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[float, float]] = {}  # fixed seconds, seconds a sample

    def learn(self, task: Task, shot: Shot) -> None:
        """Takes a finished render into account."""
        sampling = shot.seconds.get("sampling", 0.0) + shot.seconds.get("recording", 0.0)
        self._known[task.variant.name] = (shot.total - sampling, sampling / task.spp)

    def seconds(self, work: Iterable[Task]) -> float:
        """Of these tasks; those of unknown variants count like the slowest known one."""
        total = 0.0
        for task in work:
            fixed, each = self._known.get(task.variant.name) or max(self._known.values())
            total += fixed + each * task.spp
        return total


def split_recording(points: Sequence[Point]) -> None:
    """Tells what recording features takes from sampling, in place.

    It is what the sampling took longer than that of whole paths of the same samples and seed, but
    not less than what the renderer tells of it.
    """
    whole_paths = {
        (point["samples_per_pixel"], point["seed"]): point["seconds"]["sampling"]
        for point in points
        if point["variant"] == WHOLE
    }
    for point in points:
        before = whole_paths.get((point["samples_per_pixel"], point["seed"]))
        if not point["records"] or before is None:
            continue
        seconds = point["seconds"]
        whole = seconds["sampling"] + seconds["recording"]
        seconds["recording"] = max(whole - before, seconds["recording"])
        seconds["sampling"] = whole - seconds["recording"]
