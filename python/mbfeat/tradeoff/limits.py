"""What the limits on kinds of scattering save and lose on a stage, beside its full render."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbfeat.effects.rendering import EffectsError, Rendering
from mbfeat.metrics.bias import brightness_bias, squared_bias
from mbfeat.tradeoff.analysis import spread
from mbfeat.tradeoff.crops import Crop, displayed, most_changed
from mbfeat.tradeoff.inspection import InspectionError
from mbfeat.tradeoff.measure import Measured, Point
from mbfeat.tradeoff.reference import Reference
from mbfeat.tradeoff.renders import Subject
from mbfeat.tradeoff.variants import OWN, SPLITTING, WHOLE, Variant
from mbfeat.tradeoff.wording import number, samples

ERRORS = ("relMSE", "FLIP")
PROBE_WIDTH = 32
FULL_SCALE = 0.2  # a difference of a display value that is shown as white


@dataclass(frozen=True)
class Limit:
    """A setting that users may do with; `effects` are those of which one makes it matter.

    Without effects it matters in every scene.
    """

    name: str
    setting: str
    value: str
    effects: tuple[str, ...]

    @property
    def variant(self) -> Variant:
        """The limited render."""
        title = f"the mean of the samples with {self.setting}={self.value}"
        return Variant(self.name, title, {self.setting: self.value, SPLITTING: "1"})


LIMITS = (
    Limit("2 diffuse bounces", "mbfeat:maxDiffuseBounces", "2", ()),
    Limit("1 reflection", "mbfeat:maxReflectionBounces", "1", ("reflection",)),
    Limit("2 transmissions", "mbfeat:maxTransmissionBounces", "2", ("transmission",)),
    Limit("no caustics", "mbfeat:caustics", "false", ("reflection", "transmission")),
    Limit("no blur", "mbfeat:blur", "false", ("depth of field",)),
)


def for_effects(present: Collection[str]) -> list[Limit]:
    """The limits that matter to a scene that calls for these effects."""
    return [
        limit
        for limit in LIMITS
        if not limit.effects or any(effect in present for effect in limit.effects)
    ]


def effects_of(subject: Subject) -> list[str]:
    """The effects that the subject's stage calls for. Raises InspectionError."""
    facts = subject.facts
    try:
        with Rendering(
            subject.stage, settings=facts.settings, camera=facts.camera, width=PROBE_WIDTH
        ) as rendering:
            report = rendering.render(rendering.own, samplesPerPixel="1")
    except EffectsError as error:
        why = f": {error}" if str(error) else ""
        raise InspectionError(f"{subject.stage}: its effects are not known{why}") from error
    return list(report["effects"]["present"])


def rows(
    measured: Measured, limits: Sequence[Limit], references: Mapping[str, Reference]
) -> list[dict[str, Any]]:
    """What each limit changes at the most samples that were measured, beside whole paths.

    Limited and full images are of paths that do not split and share their random numbers, so that
    light that is not lost cancels: `lost` is the relMSE that the lost light would leave after any
    number of samples, and `bias` the difference of mean brightness. `sampling` is the time of the
    sampling by that of the full one.
    """
    reference = references[OWN].image.astype(np.float64)
    found = []
    for limit in limits:
        mine = {(p["samples_per_pixel"], p["seed"]): p for p in measured.points if _is(p, limit)}
        if not mine:
            continue  # it failed, and is among those left out
        spp = max(key[0] for key in mine)
        pairs = [
            (point, mine[spp, point["seed"]])
            for point in measured.points
            if point["variant"] == WHOLE and (point["samples_per_pixel"], point["seed"]) in mine
            if point["samples_per_pixel"] == spp
        ]
        full, limited = _images(measured, limit, spp)
        change = [reference + (b - a) for a, b in zip(full, limited, strict=True)]
        found.append(
            {
                "limit": limit.name,
                "setting": f"{limit.setting}={limit.value}",
                "effects": list(limit.effects),
                "samples_per_pixel": spp,
                "sampling": spread(
                    b["seconds"]["sampling"] / max(a["seconds"]["sampling"], 1e-9) for a, b in pairs
                ),
                "errors": {
                    name: {
                        "full": spread(a["errors"][name] for a, _ in pairs)["median"],
                        "limited": spread(b["errors"][name] for _, b in pairs)["median"],
                    }
                    for name in ERRORS
                },
                "bias": spread(brightness_bias(image, reference) for image in change),
                "lost": squared_bias(change, reference),
            }
        )
    return found


def _is(point: Point, limit: Limit) -> bool:
    return bool(point["variant"] == limit.name)


def _images(
    measured: Measured, limit: Limit, spp: int
) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64]]]:
    """Full and limited images of the same seeds, [3, height, width]."""
    full = [image.astype(np.float64) for image in measured.images[WHOLE, spp]]
    limited = [image.astype(np.float64) for image in measured.images[limit.name, spp]]
    return full, limited


def pictures(measured: Measured, found: Sequence[Mapping[str, Any]]) -> list[list[Crop]]:
    """For each row: the full image where it differs most, the limited one, and the difference.

    Means of the seeds. The difference is of display values, white where it is FULL_SCALE or more.
    """
    shown = []
    for row in found:
        name, spp = row["limit"], row["samples_per_pixel"]
        full, limited = (
            np.mean([image.astype(np.float64) for image in measured.images[variant, spp]], axis=0)
            for variant in (WHOLE, name)
        )
        window = most_changed(limited, full)
        before, after = displayed(window.of(full)), displayed(window.of(limited))
        lost = row["lost"]
        shown.append(
            [
                Crop(f"{name}: full", samples(spp), before),
                Crop("limited", row["setting"], after),
                Crop(
                    f"difference x {1 / FULL_SCALE:g}",
                    "" if lost is None else f"lost: relMSE {number(lost)}",
                    np.clip(np.abs(after - before) / FULL_SCALE, 0.0, 1.0),
                ),
            ]
        )
    return shown


COLUMNS = ("limit", "sampling time", "bias", "lost", "relMSE, full", "limited", "FLIP, full")


def cells(found: Sequence[Mapping[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """The table as text: its head and its rows."""
    head = [*COLUMNS, "limited"]
    lines = []
    for row in found:
        errors = row["errors"]
        time = row["sampling"]
        lines.append(
            [
                f"{row['limit']} ({row['setting']})",
                f"{time['median']:.2f} ({time['low']:.2f} .. {time['high']:.2f})",
                f"{100 * row['bias']['median']:.2f} %",
                "" if row["lost"] is None else number(row["lost"]),
                *(number(errors[name][which]) for name in ERRORS for which in ("full", "limited")),
            ]
        )
    return head, lines


def meaning(found: Sequence[Mapping[str, Any]]) -> str:
    """What the table shows, in sentences."""
    spp = max(row["samples_per_pixel"] for row in found)
    return (
        f"At {samples(spp)}. Sampling time is by that of the full render: median and range of the "
        "seeds. Limited and full images are of paths that do not split and share their random "
        "numbers, so that only lost light tells them apart: bias is the difference of their mean "
        "brightness, and lost the relMSE that it leaves after any number of samples (their squared "
        "bias). The errors are against the reference, noise and all: a limit pays where its relMSE "
        "falls by more than is lost."
    )
