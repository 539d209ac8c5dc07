"""What a comparison shows: a table, JSON, and a sheet of crops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture
from PIL import ImageDraw

from mbfeat.metrics import NAMES, srgb
from training.evaluation.statistics import Interval, Row, mean

Ratios = dict[str, dict[str, Interval]]
CROP, HEADER = 192, 16
QUALITY = 92  # of a JPEG


def table(rows: Sequence[Row], ratios: Ratios) -> str:
    """Every metric by samples, group and method; then the ratios."""
    head = f"{'':28}" + "".join(f"{name:>17}" for name in NAMES) + f"{'seconds':>9}"
    lines = ["relMSE, tonemappedRelMSE, relL1 with epsilon 1e-4; DSSIM and FLIP of sRGB"]
    methods = list(dict.fromkeys(row.method for row in rows))
    for samples in sorted({row.samples for row in rows}):
        chosen = [row for row in rows if row.samples == samples]
        groups = list(dict.fromkeys(row.group for row in chosen))
        for group in [*groups, "all"]:
            part = [row for row in chosen if group in (row.group, "all")]
            count = len({row.image for row in part})
            lines += ["", f"{group}, {samples} samples a pixel, {count} images", head]
            for method in methods:
                mine = [row for row in part if row.method == method]
                if mine:
                    cells = "".join(f"{mean(mine, method, name):17.5g}" for name in NAMES)
                    seconds = sum(row.seconds for row in mine)
                    lines.append(f"  {method:26}{cells}{seconds:9.2f}")
    for name, by_metric in ratios.items():
        lines += ["", f"{name}: ratio of means, 95 % interval by resampling images"]
        for metric, found in by_metric.items():
            lines.append(f"  {metric:26}{found.value:8.3f}  [{found.low:.3f}, {found.high:.3f}]")
    return "\n".join(lines)


def as_json(rows: Sequence[Row], ratios: Ratios, about: Mapping[str, Any]) -> dict[str, Any]:
    """The same as plain values; `ratios` holds numbers, `intervals` their bounds."""
    groups: list[dict[str, Any]] = []
    for samples in sorted({row.samples for row in rows}):
        chosen = [row for row in rows if row.samples == samples]
        for group in [*dict.fromkeys(row.group for row in chosen), "all"]:
            part = [row for row in chosen if group in (row.group, "all")]
            for method in dict.fromkeys(row.method for row in part):
                mine = [row for row in part if row.method == method]
                groups.append(
                    {
                        "group": group,
                        "samples": samples,
                        "method": method,
                        "images": len(mine),
                        "seconds": sum(row.seconds for row in mine),
                        "metrics": {name: mean(mine, method, name) for name in NAMES},
                    }
                )
    return {
        **about,
        "ratios": {n: {m: found.value for m, found in r.items()} for n, r in ratios.items()},
        "intervals": {
            n: {m: [found.low, found.high] for m, found in r.items()} for n, r in ratios.items()
        },
        "groups": groups,
        "images": [
            {
                "group": row.group,
                "light": row.light,
                "image": row.image,
                "samples": row.samples,
                "method": row.method,
                "seconds": row.seconds,
                "metrics": dict(row.metrics),
            }
            for row in rows
        ],
    }


def sheet(path: Path, strips: Sequence[tuple[str, Mapping[str, NDArray[np.floating]]]]) -> None:
    """Writes a PNG or JPEG: one row an image, one column a method, each named.

    All of a row have the same exposure, that of the reference, which is the last column.
    """
    columns = max(len(images) for _, images in strips)
    picture = Picture.new("RGB", (columns * CROP, len(strips) * (CROP + HEADER)), "black")
    draw = ImageDraw.Draw(picture)
    for row, (title, images) in enumerate(strips):
        reference = list(images.values())[-1]
        bright = float(np.percentile(reference.mean(axis=0), 95))
        gain = 0.9 / max(bright, 1e-3)
        for column, (name, image) in enumerate(images.items()):
            shown = (srgb(np.asarray(image, dtype=np.float64) * gain) * 255 + 0.5).astype(np.uint8)
            tile = Picture.fromarray(shown.transpose(1, 2, 0))
            place = (column * CROP, row * (CROP + HEADER))
            picture.paste(
                tile.resize((CROP, CROP), Picture.Resampling.NEAREST),
                (place[0], place[1] + HEADER),
            )
            draw.text((place[0] + 3, place[1] + 2), f"{title}: {name}" if not column else name)
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f"{path.stem}.partial{path.suffix}")
    picture.save(partial, optimize=True, quality=QUALITY)
    partial.replace(path)
