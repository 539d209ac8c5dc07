"""Makes the items of a scene from the scene's number alone."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.dataset import windows
from training.dataset.plan import Plan
from training.dataset.references import Kept, References
from training.dataset.rendering import Samples, StageRenderer, Window
from training.keyed import generator, render_seed
from training.scenes import catalogue

# The hand-made stages of the paper's scenes and what dominates them.
STAGES = {"livingroom": "reflection", "staircase": "refraction", "cockpit": "refraction"}
STAGE_RESOLUTION = (640, 360)
FIRST_REFERENCE_SPP = 64

Item = tuple[dict[str, Any], dict[str, NDArray[Any]]]


def stage_folder() -> Path:
    """Where the hand-made stages lie."""
    return Path(__file__).resolve().parents[2] / "tests" / "scenes"


def items_of(
    plan: Plan,
    scene: int,
    *,
    threads: int = 0,
    first: int = 0,
    references: References | None = None,
) -> Iterator[Item]:
    """The items of a scene from window `first` on: what they are, and their arrays.

    Windows that `references` has lie where it says, and their references are not rendered again.

    Arrays: `half`, `bytes` (see layout), `reference` float32 [3, h, w] and `halves` float32
    [3, h, w], the difference of the reference's two halves over two, whose square is an unbiased
    estimate of the reference's variance.
    """
    with _scene(plan, scene, threads) as (what, renderer):
        chosen: list[Window] | None = None
        for number in range(first, plan.windows):
            kept = references.find(scene, number) if references else None
            if kept is None:
                chosen = chosen or _windows(plan, scene, renderer)
                about, arrays = _item(plan, scene, number, renderer, chosen[number])
            else:
                about, arrays = _item_of(plan, kept, renderer)
            yield what | about, arrays


def samples_of(plan: Plan, scene: int, window: int, place: Window, *, threads: int = 0) -> Item:
    """The samples alone of the window at `place`, of random numbers that depend on their number."""
    with _scene(plan, scene, threads) as (what, renderer):
        seed = render_seed("again", plan.split, plan.seed, scene, window, plan.spp)
        samples = renderer.samples(place, plan.spp, seed)
    return what | {"window": window}, {"half": samples.half, "bytes": samples.bytes}


@contextmanager
def _scene(plan: Plan, scene: int, threads: int) -> Iterator[tuple[dict[str, Any], StageRenderer]]:
    """What a scene is, and its renderer."""
    with tempfile.TemporaryDirectory(prefix="mbfeat-scene-") as scratch:
        if plan.split == "stages":
            name = list(STAGES)[scene % len(STAGES)]
            stage, light = stage_folder() / f"{name}.usda", STAGES[name]
        else:
            folder = Path(scratch) / "stage"
            stage, entry = catalogue.write_stage(folder, plan.split, plan.seed, scene)
            name, light = entry.name, entry.light
        renderer = StageRenderer(stage, threads=threads, bounces=plan.bounces)
        yield {"scene": scene, "class": name, "light": light}, renderer


def _windows(plan: Plan, scene: int, renderer: StageRenderer) -> list[Window]:
    key = (plan.split, plan.seed, scene)
    rng = generator("windows", *key)
    resolution = (
        STAGE_RESOLUTION
        if plan.split == "stages"
        else windows.RESOLUTIONS[int(rng.integers(len(windows.RESOLUTIONS)))]
    )
    # A scene that is smaller than its window is seen whole.
    resolution = (max(resolution[0], plan.size), max(resolution[1], plan.size))
    seed = render_seed("preview", *key)
    preview = renderer.samples(windows.preview_window(resolution), windows.PREVIEW_SPP, seed)
    return windows.choose(rng, preview, resolution, plan.size, plan.windows)


def _item(plan: Plan, scene: int, number: int, renderer: StageRenderer, window: Window) -> Item:
    key = (plan.split, plan.seed, scene, number)
    samples = renderer.samples(window, plan.spp, render_seed("input", *key))
    reference, halves, spp, seconds = reference_of(plan, key, renderer, window)
    about = {
        "window": number,
        "resolution": list(window.resolution),
        "at": [window.x, window.y],
        "reference_spp": spp,
        "floor": floor_of(reference, halves),
        "seconds": round(samples.seconds + seconds, 3),
    }
    return _complete(plan, renderer, samples, about, reference, halves)


def _item_of(plan: Plan, kept: Kept, renderer: StageRenderer) -> Item:
    """The item of a window whose reference is there already."""
    height, width = kept.reference.shape[1:]
    (whole_width, whole_height), (x, y) = kept.about["resolution"], kept.about["at"]
    window = Window((whole_width, whole_height), x, y, width, height)
    key = (plan.split, plan.seed, kept.about["scene"], kept.about["window"])
    samples = renderer.samples(window, plan.spp, render_seed("input", *key))
    about = kept.about | {"seconds": round(samples.seconds, 3)}
    return _complete(plan, renderer, samples, about, kept.reference, kept.halves)


def _complete(
    plan: Plan,
    renderer: StageRenderer,
    samples: Samples,
    about: dict[str, Any],
    reference: NDArray[np.floating],
    halves: NDArray[np.floating],
) -> Item:
    """The item: `about` and what the samples tell, and the arrays."""
    event = samples.bytes[:, 1]
    about = about | {
        "world_to_camera": renderer.world_to_camera.ravel().tolist(),
        "spp": plan.spp,
        "raw": relative_error(samples.half[:, :3].astype(np.float64).mean(axis=0), reference),
        "chains": float(((event & 24) != 0).mean()),
        "clipped": samples.clipped,
        "sample_seconds": samples.seconds / plan.spp,
    }
    arrays: dict[str, NDArray[Any]] = {
        "half": samples.half,
        "bytes": samples.bytes,
        "reference": reference.astype(np.float32),
        "halves": halves.astype(np.float32),
    }
    return about, arrays


def reference_of(
    plan: Plan, key: tuple[str, int, int, int], renderer: StageRenderer, window: Window
) -> tuple[NDArray[np.float64], NDArray[np.float64], int, float]:
    """Reference, half difference of its halves, samples and seconds.

    Rounds double the samples; each has two renders of seeds that nothing else uses.
    """
    sums = np.zeros((2, 3, window.height, window.width))
    spp = np.zeros(2)
    seconds, rounds = 0.0, 0
    while True:
        done = int(spp.sum())
        share = max(done, min(FIRST_REFERENCE_SPP, plan.reference_spp)) // 2
        share = min(share, max((plan.reference_spp - done) // 2, 1))
        for half in (0, 1):
            seed = render_seed("reference", *key, rounds, half)
            image, used = renderer.color(window, share, seed)
            sums[half] += image.astype(np.float64) * share
            spp[half] += share
            seconds += used
        rounds += 1
        reference = sums.sum(axis=0) / spp.sum()
        halves = (sums[0] / spp[0] - sums[1] / spp[1]) / 2
        enough = floor_of(reference, halves) < plan.floor
        if enough or spp.sum() + 2 > plan.reference_spp:
            return reference, halves, int(spp.sum()), seconds


def floor_of(reference: NDArray[np.float64], halves: NDArray[np.float64]) -> float:
    """The reference's own relMSE (epsilon 1e-2): what a perfect image would be found to have."""
    return float((halves.astype(np.float64) ** 2 / (reference**2 + 1e-2)).mean())


def relative_error(image: NDArray[np.floating], reference: NDArray[np.floating]) -> float:
    """relMSE with epsilon 1e-2, to compare with the floor."""
    return float(((image - reference) ** 2 / (reference**2 + 1e-2)).mean())
