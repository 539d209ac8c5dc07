"""What grows, over which values, and how a value is rendered."""

from __future__ import annotations

from dataclasses import dataclass, field

SEED = 1  # of the stages
THREADS = "threads"
FIXED = "fixed"


@dataclass(frozen=True)
class Shot:
    """One render of a stage."""

    kind: str  # a function of growth.stages
    size: int  # its argument
    width: int = 320  # 16:9
    samples: int = 16  # a pixel
    aovs: int = 0  # feature AOVs beside color, in table order
    threads: int = 2

    @property
    def height(self) -> int:
        """Pixels."""
        return self.width * 9 // 16

    @property
    def sample_count(self) -> int:
        """All samples of the image."""
        return self.width * self.height * self.samples


@dataclass(frozen=True)
class Axis:
    """Something that grows; all else stays the same."""

    name: str
    unit: str  # of the values, for tables and plots
    values: list[int]
    shots: list[Shot] = field(default_factory=list)  # one a value

    def __post_init__(self) -> None:
        assert len(self.values) == len(self.shots)


BASE = 100_000  # triangles of the stage on which everything but the stage grows


def _decades(low: int, high: int) -> list[int]:
    return [10**i for i in range(low, high + 1)]


def axes(threads: int, quick: bool) -> list[Axis]:
    """All of them; `quick` are small sizes, which take seconds and say little."""
    width, samples = (64, 4) if quick else (320, 16)
    base = 1000 if quick else BASE

    def of_stage(kind: str, unit: str, values: list[int]) -> Axis:
        shots = [Shot(kind, v, width, samples, threads=threads) for v in values]
        return Axis(kind, unit, values, shots)

    def of_render(name: str, unit: str, shots: dict[int, Shot]) -> Axis:
        return Axis(name, unit, list(shots), list(shots.values()))

    def shot(
        width: int = width, samples: int = samples, aovs: int = 0, threads: int = threads
    ) -> Shot:
        return Shot("triangles", base, width, samples, aovs, threads)

    widths = [64, 128] if quick else [64, 128, 320, 640, 1280, 1920]
    few = 64 if quick else 160  # so that many samples take seconds, not minutes
    counts = [16, 64, 256] if quick else [1, 2, 4, 8, 16, 32, 64, 128, 256]
    aovs = [0, 18] if quick else [0, 3, 6, 9, 12, 15, 18]
    fixed_width = 64 if quick else 1920
    return [
        of_stage("triangles", "triangles", _decades(3, 4 if quick else 7)),
        of_stage("instances", "instances of 1000 triangles", _decades(0, 2 if quick else 6)),
        of_stage("lights", "sphere lights", _decades(0, 2 if quick else 5)),
        of_stage("textures", "MB of decoded texels", [1, 4] if quick else _decades(0, 3)),
        of_render(
            "resolution", "pixels", {shot(w).width * shot(w).height: shot(w, 4) for w in widths}
        ),
        of_render("samples", "samples a pixel", {n: shot(few, n) for n in counts}),
        of_render("aovs", "feature AOVs", {n: shot(aovs=n) for n in aovs}),
        of_render(
            FIXED,
            f"samples a pixel at {fixed_width} x {fixed_width * 9 // 16}",
            {n: shot(fixed_width, n) for n in (1, 16)},
        ),
        of_render(
            THREADS,
            "threads",
            {n: shot(64 if quick else 640, threads=n) for n in (1, 2)},
        ),
    ]
