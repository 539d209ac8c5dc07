"""What a data set holds: a small JSON file beside its shards, from which all of it can be made."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path

from mbfeat.devtools.layout import write_whole
from training.scenes.version import VERSION

FILE = "dataset.json"
FORMAT = 1
SPLITS = ("train", "validation", "test", "stages")


class PlanError(Exception):
    """A data set's plan cannot be used; the message says why and what to do."""


@dataclass(frozen=True)
class Plan:
    """A data set.

    `scenes` stages (or, for ``stages``, the three hand-made ones) with `windows` windows of `size`
    pixels a side each; `spp` samples are kept. References are added up in rounds until their own
    relMSE is below `floor` or they have `reference_spp` samples. A shard holds `scenes_per_shard`.
    """

    split: str
    seed: int
    scenes: int
    windows: int = 2
    size: int = 128
    spp: int = 8
    reference_spp: int = 1024
    floor: float = 2e-4
    bounces: int = 12
    scenes_per_shard: int = 8
    catalogue: int = VERSION
    format: int = FORMAT

    def __post_init__(self) -> None:
        if self.split not in SPLITS:
            raise PlanError(f"there is no split {self.split!r}; there are {', '.join(SPLITS)}")
        least = {"scenes": 1, "windows": 1, "size": 8, "spp": 1, "reference_spp": 4}
        for name, low in least.items():
            if getattr(self, name) < low:
                raise PlanError(f"{name} has to be at least {low}, not {getattr(self, name)}")

    @property
    def shards(self) -> int:
        return -(-self.scenes // self.scenes_per_shard)

    def scenes_of(self, shard: int) -> range:
        """Numbers of the scenes in a shard."""
        first = shard * self.scenes_per_shard
        return range(first, min(first + self.scenes_per_shard, self.scenes))

    def write(self, folder: Path) -> None:
        """Puts the plan into the folder, or checks that the one there is the same."""
        file = folder / FILE
        if file.exists():
            existing = Plan.read(folder)
            if existing != self:
                differing = [
                    f"{field.name} is {getattr(existing, field.name)}, not "
                    f"{getattr(self, field.name)}"
                    for field in dataclasses.fields(self)
                    if getattr(existing, field.name) != getattr(self, field.name)
                ]
                raise PlanError(
                    f"{folder} holds another data set ({'; '.join(differing)}); "
                    "name another folder, or give the same arguments to go on with it"
                )
            return
        write_whole(file, json.dumps(dataclasses.asdict(self), indent=2) + "\n")

    @staticmethod
    def read(folder: Path) -> Plan:
        file = folder / FILE
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            plan = Plan(**content)
        except OSError as error:
            raise PlanError(f"{folder} holds no data set: {error.strerror}: {file}") from error
        except (ValueError, TypeError) as error:
            raise PlanError(f"{file} is no plan of a data set: {error}") from error
        if plan.format != FORMAT:
            raise PlanError(f"{file} has format {plan.format}, this program reads {FORMAT}")
        return plan
