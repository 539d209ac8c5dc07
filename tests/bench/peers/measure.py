"""Measures one scene with all renderers: rate, error, and what both say together.

The rate is of sampling alone. Every renderer renders once with one sample a pixel and once with
many, and the difference of both counts, so that loading, building and compiling do not; the
renderers take turns, so that whatever else the machine does meets all of them alike.

The error is measured on a ladder of 4, 16, 64, ... samples a pixel with several seeds each, up to
the first whose error is below the target, and against the renderer's own converged image.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from peers import errors
from peers.process import Installation, RendererError, RendererProcess
from peers.references import Reference, ReferenceStore
from peers.rendering import BUILD, Job, Rendered

OWN = "mbfeat"
# What makes a scene of each renderer, on which its images depend.
TRANSLATIONS = {OWN: "own.py", "mitsuba": "mitsuba_scene.py", "cycles": "cycles_scene.py"}
STEP = 4  # from rung to rung; powers of 4 suit samplers that stratify in two dimensions
WARM_UP_SEED = 90_000
ATTEMPTS = 5  # to measure a rate


@dataclass(frozen=True)
class Settings:
    """What is measured, and how thoroughly."""

    job: Job
    cores: Sequence[int]
    rounds: int = 5
    seconds: float = 4.0  # about what a render of the rate takes
    seeds: int = 5
    most_spp: int = 1024  # the last rung
    target: float = 0.01
    reference_factor: float = 8.0  # samples of a reference by those to the target
    reference_chunk: int = 64
    least_reference_spp: int = 256
    most_reference_spp: int = 8192
    any_build: bool = False  # references of MBFeat outlive its build
    clock: str = "wall"  # or "cpu": CPU seconds by the number of threads


@dataclass
class Measured:
    """What was found of one renderer on one scene."""

    name: str
    version: str
    wall_rates: list[float] = field(default_factory=list)  # samples a second, one for each round
    cpu_rates: list[float] = field(default_factory=list)
    ladder: dict[int, list[errors.Image]] = field(default_factory=dict)
    reference: Reference | None = None
    fit: errors.Fit | None = None
    errors: dict[int, list[float]] = field(default_factory=dict)

    def rates(self, clock: str) -> list[float]:
        return self.wall_rates if clock == "wall" else self.cpu_rates


@dataclass
class SceneFiles:
    """One scene for all renderers."""

    name: str
    stage: Path
    arrays: Path  # folder of peers.scene
    key: str  # hash of what it holds


class SceneMeasurement:
    """The measurement of a scene; `tell` gets a line about what is being done."""

    def __init__(
        self,
        files: SceneFiles,
        settings: Settings,
        store: ReferenceStore,
        logs: Path,
        tell: Callable[[str], None],
    ) -> None:
        self._files = files
        self._settings = settings
        self._store = store
        self._logs = logs
        self._tell = tell
        self.failures: dict[str, str] = {}
        self.measured: dict[str, Measured] = {}
        self._processes: dict[str, RendererProcess] = {}

    def run(self, installations: Sequence[Installation]) -> None:
        """Measures; a renderer that fails is left out and named in `failures`."""
        with ExitStack() as stack:
            for installation in installations:
                self._attempt(installation.name, self._start, installation, stack)
            many: dict[str, int] = {}
            for name in list(self._processes):
                self._attempt(name, self._calibrate, name, many)
            for turn in range(self._settings.rounds):
                names = list(self._processes)
                for name in names[turn % len(names) :] + names[: turn % len(names)]:
                    self._tell(f"rate of {name}, round {turn + 1} of {self._settings.rounds}")
                    self._attempt(name, self._round, name, many)
            for name in list(self._processes):
                self._attempt(name, self._climb, name)
            for name in list(self._processes):
                self._attempt(name, self._refer, name)

    def _attempt(self, name: str, work: Callable[..., None], *arguments: Any) -> None:
        """Does a part of the work with a renderer, which is out of it when that fails."""
        try:
            work(*arguments)
        except RendererError as error:
            self.failures[name] = str(error)
            self._processes.pop(name, None)
            self.measured.pop(name, None)

    def _start(self, installation: Installation, stack: ExitStack) -> None:
        name = installation.name
        self._tell(f"{name} loads the scene")
        source = self._files.stage if name == OWN else self._files.arrays
        log = self._logs / f"{self._files.name}-{name}.log"
        settings = self._settings
        process = RendererProcess(installation, source, settings.job, settings.cores, log)
        self._processes[name] = stack.enter_context(process)
        self.measured[name] = Measured(name, process.version)

    # ---- rate

    @property
    def _pixels(self) -> int:
        return self._settings.job.width * self._settings.job.height

    def _clock(self, rendered: Rendered) -> float:
        if self._settings.clock == "wall":
            return rendered.seconds
        return rendered.cpu / self._settings.job.threads

    def _calibrate(self, name: str, many: dict[str, int]) -> None:
        """Warms up, and finds the power of 4 whose render takes about as long as is asked for."""
        self._tell(f"{name} warms up")
        process = self._processes[name]
        process.render(1, WARM_UP_SEED)
        once = self._clock(process.render(1, WARM_UP_SEED))
        spp = STEP
        # Half a step beyond the time is as near as half a step before.
        while self._clock(process.render(spp, WARM_UP_SEED)) - once < self._settings.seconds / 2:
            spp *= STEP
        many[name] = spp

    def _round(self, name: str, all_many: dict[str, int]) -> None:
        process, many = self._processes[name], all_many[name]
        seed = WARM_UP_SEED + 1 + len(self.measured[name].wall_rates)
        for _ in range(ATTEMPTS):
            few, full = process.render(1, seed), process.render(many, seed)
            wall, cpu = full.seconds - few.seconds, full.cpu - few.cpu
            # A short render that was held up says nothing of the long one.
            if wall > full.seconds / 2.0 and cpu > full.cpu / 2.0:
                break
            self._tell(f"rate of {name} again, since something held up its short render")
        else:
            raise RendererError(
                f"{name}: one sample a pixel took as long as half of {many}, {ATTEMPTS} times in "
                "a row; end what else runs, or give it longer renders with --seconds"
            )
        samples = (many - 1) * self._pixels
        self.measured[name].wall_rates.append(samples / wall)
        self.measured[name].cpu_rates.append(samples * self._settings.job.threads / cpu)

    # ---- error

    def _climb(self, name: str) -> None:
        """Renders the ladder, up to the rung whose error is below the target."""
        result, settings = self.measured[name], self._settings
        spp = STEP
        while spp <= settings.most_spp:
            images = []
            for seed in range(1, settings.seeds + 1):
                self._tell(f"error of {name}, {spp} samples a pixel, seed {seed}")
                images.append(self._processes[name].render(spp, seed + 100 * spp).image)
            result.ladder[spp] = images
            if errors.spread_mse(images) < settings.target:
                return
            spp *= STEP

    def _refer(self, name: str) -> None:
        """Renders the reference as far as it has to go, and measures the ladder against it."""
        result, settings = self.measured[name], self._settings
        spp, images = max(result.ladder.items())
        needed = spp * errors.spread_mse(images) / settings.target * settings.reference_factor
        needed = min(max(needed, settings.least_reference_spp), settings.most_reference_spp)
        job = settings.job
        version = result.version
        if settings.any_build:
            version = version.partition(BUILD)[0]
        size = f"{job.width}x{job.height}x{job.bounces}"
        translation = (Path(__file__).parent / TRANSLATIONS[name]).read_bytes()
        path = self._store.path(self._files.name, name, size, self._files.key, version, translation)
        reference = self._store.load(path, (job.height, job.width))
        while reference.spp < needed or reference.chunks < 2:
            self._tell(f"reference of {name}, {reference.spp} of {needed:.0f} samples a pixel")
            chunk = settings.reference_chunk
            rendered = self._processes[name].render(chunk, reference.next_seed)
            reference.add(rendered.image, chunk)
            self._store.save(path, reference)
        result.reference = reference
        for spp, images in result.ladder.items():
            row = [errors.relative_mse(image, reference.image) for image in images]
            result.errors[spp] = row
        result.fit = errors.fit(result.errors, reference.spp, settings.target)
        result.ladder.clear()


# ---- what is kept


def entry(measured: Measured, settings: Settings) -> dict[str, Any]:
    """One renderer's numbers as JSON."""
    fit, reference = measured.fit, measured.reference
    assert fit is not None
    assert reference is not None
    rates = measured.rates(settings.clock)
    rate = statistics.median(rates)
    pixels = settings.job.width * settings.job.height
    seconds = fit.spp * pixels / rate
    return {
        "version": measured.version,
        "msamples_per_s": rate / 1e6,
        "msamples_per_s_range": [min(rates) / 1e6, max(rates) / 1e6],
        "msamples_per_s_rounds": [value / 1e6 for value in rates],
        "msamples_per_wall_s_rounds": [value / 1e6 for value in measured.wall_rates],
        "msamples_per_cpu_s_rounds": [value / 1e6 for value in measured.cpu_rates],
        "spp_to_relmse_0_01": fit.spp,
        "spp_to_relmse_0_01_range": list(fit.spp_range),
        "spp_extrapolated": fit.extrapolated,
        "error_exponent": fit.exponent,
        "errors": {str(spp): row for spp, row in measured.errors.items()},
        "seconds_to_relmse_0_01": seconds,
        "seconds_to_relmse_0_01_range": [
            fit.spp_range[0] * pixels / max(rates),
            fit.spp_range[1] * pixels / min(rates),
        ],
        "reference_spp": reference.spp,
        "reference_noise": errors.relative_difference(*reference.halves) / 2.0,
    }


def compared(own: Mapping[str, Any], peer: Mapping[str, Any]) -> dict[str, Any]:
    """Ratios of ours to a peer's with their ranges.

    Rates are compared round by round. The range of the time holds that of the rates and of the
    seeds together.
    """
    rounds = zip(own["msamples_per_s_rounds"], peer["msamples_per_s_rounds"], strict=True)
    rates = [ours / theirs for ours, theirs in rounds]
    rate = statistics.median(rates)
    spp = _ratio(own["spp_to_relmse_0_01"], peer["spp_to_relmse_0_01"])
    low, high = own["spp_to_relmse_0_01_range"]
    peer_low, peer_high = peer["spp_to_relmse_0_01_range"]
    spp_range = [_ratio(low, peer_high), _ratio(high, peer_low)]
    return {
        "rate_ratio": rate,
        "rate_ratio_range": [min(rates), max(rates)],
        "spp_ratio": spp,
        "spp_ratio_range": spp_range,
        "time_ratio": spp / rate,
        "time_ratio_range": [spp_range[0] / max(rates), spp_range[1] / min(rates)],
    }


def _ratio(a: float, b: float) -> float:
    return a / b if b > 0.0 else (1.0 if a == b else float("inf"))


def scene_entry(measurement: SceneMeasurement, name: str, settings: Settings) -> dict[str, Any]:
    """One scene's numbers as JSON: ours, and each peer's with how ours compare."""
    result: dict[str, Any] = {"scene": name}
    if measurement.failures:
        result["failures"] = dict(measurement.failures)
    if OWN not in measurement.measured:
        return result
    own = measurement.measured[OWN]
    result.update(entry(own, settings))
    result["peers"] = {}
    for peer in measurement.measured.values():
        if peer is own:
            continue
        row = entry(peer, settings)
        row.update(compared(result, row))
        assert peer.reference is not None
        assert own.reference is not None
        row["mean_relative_difference"] = errors.relative_difference(
            peer.reference.image, own.reference.image
        )
        row["brightness_ratio"] = float(
            peer.reference.image.mean() / max(own.reference.image.mean(), 1e-30)
        )
        result["peers"][peer.name] = row
    if result["peers"]:
        fastest = min(result["peers"].values(), key=lambda row: row["seconds_to_relmse_0_01"])
        result["time_to_error_ratio"] = fastest["time_ratio"]
        result["time_to_error_ratio_range"] = fastest["time_ratio_range"]
    return result
