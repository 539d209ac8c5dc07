"""The process that filters with Open Image Denoise.

    python -m mbfeat.tradeoff.filter_worker THREADS

Each line on standard input is a JSON object with the `recipe`, the files of the images (.npy) and
that of the `output`; each is answered by a line on standard output with the seconds it took, or an
`error`. The first line comes unasked, with the seconds that the device took.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from mbfeat.oidn import Oidn, OidnError

Image = np.ndarray


def filtered(device: Oidn, recipe: str, images: dict[str, Image]) -> Image:
    """The image by a recipe of `filters`."""
    color = images["color"]
    if recipe == "plain":
        return device.plain(color, images["mbfeat:albedo:0"], images["mbfeat:normal:0"])
    # Albedo behind a tinted mirror is seen in the mirror's colour.
    albedo = images["mbfeat:firstNonDelta:albedo"] * images["mbfeat:firstNonDelta:tint"]
    return device.best(color, albedo, images["mbfeat:firstNonDelta:normal"])


def main(threads: int) -> None:
    """Serves until standard input ends."""
    started = time.perf_counter()
    device = Oidn(threads)
    print(json.dumps({"seconds": time.perf_counter() - started}), flush=True)
    for line in sys.stdin:
        order = json.loads(line)
        images = {name: np.load(file) for name, file in order["images"].items()}
        started = time.perf_counter()
        try:
            output = filtered(device, order["recipe"], images)
        except OidnError as error:
            print(json.dumps({"error": str(error)}), flush=True)
            continue
        seconds = time.perf_counter() - started
        np.save(order["output"], output)
        print(json.dumps({"seconds": seconds}), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))
