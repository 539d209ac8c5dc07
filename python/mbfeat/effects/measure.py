"""What effects cost: renders that differ in one effect take turns, and are compared by round."""

from __future__ import annotations

import statistics
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from mbfeat.effects.rendering import RECORDED, Rendering, Variant, aovs_of

Report = dict[str, Any]


@dataclass
class Plan:
    """How long and how often."""

    rounds: int = 5
    seconds: float = 0.5  # of a render
    threads: int = 1
    clock: str = "cpu"


@dataclass
class Case:
    """A variant, what it stands for, and its seconds a million samples.

    Each of its renders has one of the stage as it is beside it: `base`.
    """

    effect: str
    how: str
    variant: Variant
    seconds: list[float] = field(default_factory=list)
    base: list[float] = field(default_factory=list)


def cases_of(own: Variant, present: Sequence[str], absent: Sequence[str]) -> list[Case]:
    """A case for every effect that can be taken away or forced on."""
    from mbfeat import _core

    cases = []
    for row in _core.effect_table():
        name = row.name
        if name == "path samples":
            deep = replace(own, deep=name in absent)
            cases.append(Case(name, "kept" if deep.deep else "not kept", deep))
        elif name in RECORDED:
            group = aovs_of(name)
            if name in present:
                left = tuple(a for a in own.aovs if not a.startswith(RECORDED[name]))
                cases.append(Case(name, "AOVs left out", replace(own, aovs=left)))
            elif group:
                cases.append(Case(name, "AOVs added", replace(own, aovs=(*own.aovs, *group))))
        elif name in absent:
            cases.append(Case(name, "forced on", replace(own, effects=f"auto, +{name}")))
        elif row.without:
            cases.append(Case(name, "taken away", replace(own, effects=f"auto, -{name}")))
    return cases


def spread(values: Sequence[float]) -> dict[str, float]:
    """Median and range."""
    return {"median": statistics.median(values), "low": min(values), "high": max(values)}


def seconds_of(report: Report, clock: str) -> float:
    """Seconds of sampling for a million samples."""
    wall = sum(s["seconds"] for s in report["seconds"] if s["phase"] == "sampling")
    seconds = report["samplingCpuSeconds"] if clock == "cpu" else wall
    return 1e6 * float(seconds) / float(report["trace"]["paths"])


def measure(rendering: Rendering, report: Report, plan: Plan) -> dict[str, Any]:
    """Runs all cases in turns; `report` is one of the stage as it is."""
    present, absent = report["effects"]["present"], report["effects"]["absent"]
    own = rendering.own
    # Recorded paths do not split, and an effect less may change what a trial of splitting finds.
    alike = {"threads": str(plan.threads), "splitting": "1"}
    full = Case("", "full", replace(own, effects="full"))
    cases = cases_of(own, present, absent)
    # The full kernel oftener than the others: its ratio is asked for to a hundredth.
    third = len(cases) // 3
    order = [full, *cases[:third], full, *cases[third : 2 * third], full, *cases[2 * third :]]

    def run(variant: Variant, samples: int) -> float:
        result = rendering.render(variant, samplesPerPixel=str(samples), **alike)
        return seconds_of(result, plan.clock)

    samples = _samples(lambda spp: rendering.render(own, samplesPerPixel=spp, **alike), plan)
    for case in order:
        run(case.variant, 1)  # touches memory and commits the scene
    images = [
        rendering.render(variant, samplesPerPixel="2", **alike)["digest"]
        for variant in (own, full.variant)
    ]
    for turn in range(plan.rounds):
        for i, case in enumerate(order):
            pair = [(case.seconds, case.variant), (case.base, own)]
            for values, variant in pair if (turn + i) % 2 else reversed(pair):
                values.append(run(variant, samples))
        sys.stderr.write(f"\rround {turn + 1} of {plan.rounds}")
    sys.stderr.write("\n")
    ratio = spread([b / s for s, b in zip(full.seconds, full.base, strict=True)])
    bases = [s for case in (full, *cases) for s in case.base]
    return {
        "samples_per_pixel": samples,
        "rounds": plan.rounds,
        "clock": plan.clock,
        "specialised_over_full": ratio["median"],
        "specialised_over_full_range": [ratio["low"], ratio["high"]],
        "same_image_as_full": images[0] == images[1],
        "seconds_per_million": {"specialised": spread(bases), "full": spread(full.seconds)},
        "cost": {case.effect: _cost(case, case.effect in present) for case in cases},
    }


def _cost(case: Case, present: bool) -> dict[str, Any]:
    """Seconds a million samples that the effect adds, compared render by render."""
    sign = -1.0 if present else 1.0
    added = [sign * (s - b) for s, b in zip(case.seconds, case.base, strict=True)]
    share = [a / b for a, b in zip(added, case.base, strict=True)]
    return {"how": case.how, "seconds_per_million": spread(added), "share": spread(share)}


def _samples(render: Callable[[str], Report], plan: Plan) -> int:
    """Samples per pixel that take about the planned time."""
    render("1")
    samples = 1
    while True:
        report = render(str(samples))
        seconds = 1e-6 * seconds_of(report, plan.clock) * float(report["trace"]["paths"])
        if seconds >= 0.25 * plan.seconds or samples >= 4096:
            return max(1, min(4096, round(samples * plan.seconds / max(seconds, 1e-6))))
        samples *= 2
