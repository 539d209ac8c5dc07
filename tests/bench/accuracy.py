"""Estimated error against the true one, and predicted time against the time taken.

    ./run python tests/bench/accuracy.py [SCENE ...] [--reference SPP]

    ./run python tests/bench/accuracy.py [SCENE ...] --forecast TARGET [--resolution W H]

Prints a table for the docs. The true error of an image is against a reference of an independent
seed, by the definition of the estimate with the reference as the pixel's value.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

TESTS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TESTS / "python"))

import rendering  # noqa: E402

SCENES = ("interior", "cockpit", "mirror", "pane", "garden", "livingroom", "staircase")
RESOLUTION = (96, 64)
# Of a render with a forecast: the 95th percentile of fewer pixels is noise itself.
FORECAST_RESOLUTION = (192, 128)
WINDOW = 9  # pixels, of the estimate's percentile
REGULARISER = 0.01

Image = NDArray[np.float64]


def render(scene: str, folder: Path, **settings: object) -> tuple[Image, Any]:
    """Linear colour [h, w, 3], and what the report says of the samples."""
    stage = rendering.open_scene(scene)
    file = folder / "image.exr"
    rendering.add_product(stage, file, ["color"], resolution=RESOLUTION)
    report = rendering.record(stage, folder, **settings).report
    color = rendering.read_parts(file)[0].layers()["color"][..., :3]
    return color.astype(np.float64), report.sampling


def squared_errors(image: Image, reference: Image) -> tuple[float, float]:
    """Relative squared error of the whole, and the 95th percentile of its windows."""
    squares = ((image - reference) ** 2 / (reference**2 + REGULARISER)).mean(axis=-1)
    radius = WINDOW // 2
    padded = np.pad(squares, radius, constant_values=np.nan)
    smooth = np.nanmean(sliding_window_view(padded, (WINDOW, WINDOW)), axis=(-1, -2))
    return float(squares.mean()), float(np.percentile(smooth, 95))


def row(scene: str, reference: Image, spp: int, seeds: int, folder: Path) -> str:
    truth, told = [], []
    for seed in range(seeds):
        # A limit that is never reached: the image is of a fixed count, and its error is estimated.
        image, sampling = render(scene, folder, samplesPerPixel=spp, timeLimit=1e6, seed=seed)
        truth.append(squared_errors(image, reference))
        told.append((sampling.error**2, sampling.error95**2))
    true, true95 = np.sqrt(np.mean(truth, axis=0))
    error, error95 = np.sqrt(np.mean(told, axis=0))
    return (
        f"| {scene} | {spp} | {true:.4f} | {error:.4f} | {error / true:.2f} "
        f"| {true95:.4f} | {error95:.4f} | {error95 / true95:.2f} |"
    )


def forecast_row(
    scene: str, target: float, adaptive: bool, seed: int, size: tuple[int, int], folder: Path
) -> str:
    """What was expected after a tenth of the samples, and later, by what they were in the end.

    After a tenth that stands which was expected last before it.
    """
    stage = rendering.open_scene(scene)
    rendering.add_product(stage, folder / "image.exr", ["color"], resolution=size)
    settings = {"samplesPerPixel": 4096, "targetError": target, "adaptive": adaptive, "seed": seed}
    report = rendering.record(stage, folder, **settings).report
    taken: Any = report.to_dict()["sampling"]
    samples = taken["mean"] * size[0] * size[1]
    seconds = sum(s for phase, s in report.seconds if phase in ("commit", "sampling"))
    told = taken["forecasts"][:-1]  # the last one is made at the end
    before = [f for f in told if f["samples"] <= 0.1 * samples]
    shown = [*before[-1:], *(f for f in told if f["samples"] > 0.1 * samples)]
    ratios = [f["allSamples"] / samples for f in shown]
    late = [f["allSeconds"] / seconds for f in shown]
    return (
        f"| {scene} | {target} | {'on' if adaptive else 'off'} | {seed} "
        f"| {taken['fewest']} / {taken['mean']:.0f} / {taken['most']} "
        f"| {ratios[0]:.2f} | {late[0]:.2f} | {min(ratios):.2f} .. {max(ratios):.2f} "
        f"| {min(late):.2f} .. {max(late):.2f} |"
    )


def print_forecasts(
    scenes: Sequence[str],
    targets: Sequence[float],
    seeds: int,
    size: tuple[int, int],
    folder: Path,
) -> None:
    print(
        "| scene | target | adaptive | seed | samples | after a tenth | its seconds "
        "| from then on | seconds |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for scene in scenes:
        for target in targets:
            for adaptive in (False, True):
                for seed in range(seeds):
                    print(forecast_row(scene, target, adaptive, seed, size, folder), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=SCENES, metavar="SCENE")
    parser.add_argument("--reference", type=int, default=4096, metavar="SPP")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64, 256])
    parser.add_argument(
        "--forecast",
        type=float,
        nargs="+",
        metavar="TARGET",
        help="render to these errors instead: expected over actual, after a tenth of the samples",
    )
    parser.add_argument(
        "--resolution",
        type=int,
        nargs=2,
        default=FORECAST_RESOLUTION,
        metavar=("W", "H"),
        help="pixels of renders with a forecast (default: %(default)s)",
    )
    arguments = parser.parse_args()
    if arguments.forecast:
        with tempfile.TemporaryDirectory() as scratch:
            size = (arguments.resolution[0], arguments.resolution[1])
            folder = Path(scratch)
            print_forecasts(arguments.scenes, arguments.forecast, arguments.seeds, size, folder)
        return
    print("| scene | spp | true | estimated | ratio | true 95 % | estimated 95 % | ratio |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for scene in arguments.scenes:
            settings = {"samplesPerPixel": arguments.reference, "seed": 99999}
            reference, _ = render(scene, folder, **settings)
            for spp in arguments.spp:
                print(row(scene, reference, spp, arguments.seeds, folder), flush=True)


if __name__ == "__main__":
    main()
