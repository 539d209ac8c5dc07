"""Renders a data set, or some of its shards; goes on where an earlier run stopped.

    python -m training.generate FOLDER --split train --seed 1 --scenes 200
    python -m training.generate FOLDER                  # goes on with what the folder's plan says
    python -m training.generate FOLDER --shards 3-5     # these only, as a farm's tasks do

Shards that another process makes are left to it, so several may run on one folder.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import sys
import time
from pathlib import Path

from training.dataset.items import items_of
from training.dataset.plan import FILE, SPLITS, Plan, PlanError
from training.dataset.references import References, ReferencesError
from training.dataset.rendering import RenderError
from training.dataset.shards import ShardError, ShardFiles, ShardWriter

INTERRUPTED = 130


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns 0, 1 when something failed, 2 for usage, 130 when interrupted."""
    parser = argparse.ArgumentParser(prog="python -m training.generate", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--split", choices=SPLITS)
    for field in dataclasses.fields(Plan):
        if field.name in ("seed", "scenes", "windows", "size", "spp", "reference_spp", "bounces"):
            parser.add_argument(f"--{field.name.replace('_', '-')}", type=int)
    parser.add_argument("--floor", type=float, help="relMSE at which a reference is clean enough")
    parser.add_argument("--scenes-per-shard", type=int)
    parser.add_argument("--shards", help="FIRST-LAST or a single number (default: all)")
    parser.add_argument("--threads", type=int, default=0, help="of the renderer (default: all)")
    parser.add_argument(
        "--references", type=Path, help="a file of references that are not rendered again"
    )
    parser.add_argument("--plan-only", action="store_true", help="write the plan, render nothing")
    options = parser.parse_args(arguments)
    try:
        plan = _plan(options)
        plan.write(options.folder)
        numbers = _numbers(options.shards, plan.shards)
        if options.plan_only:
            print(f"{options.folder}: {plan.scenes} scenes in {plan.shards} shards")
            return 0
        quiet_openusd()
        references = _references(options.references, plan)
        Generation(options.folder, plan, options.threads, references).run(numbers)
    except (PlanError, ReferencesError, ShardError, RenderError) as error:
        sys.stderr.write(f"training.generate: {error}\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("\ntraining.generate: interrupted; run it again to go on\n")
        return INTERRUPTED
    return 0


def _plan(options: argparse.Namespace) -> Plan:
    """The plan of the folder, changed by nothing; or a new one of the arguments."""
    names = [field.name for field in dataclasses.fields(Plan)]
    given = {n: getattr(options, n) for n in names if getattr(options, n, None) is not None}
    if (options.folder / FILE).exists():
        existing = Plan.read(options.folder)
        return dataclasses.replace(existing, **given) if given else existing
    if missing := [name for name in ("split", "seed", "scenes") if name not in given]:
        raise PlanError(
            f"{options.folder} holds no data set yet; give {', '.join('--' + m for m in missing)}"
        )
    return Plan(**given)


def _references(file: Path | None, plan: Plan) -> References | None:
    if file is None:
        return None
    references = References.read(file)
    if not references.fits(plan):
        raise PlanError(
            f"{file} has the references of another data set ({references.plan}); do without it, "
            "or give that plan's arguments"
        )
    return references


def _numbers(text: str | None, shards: int) -> range:
    """The shards that were asked for."""
    if text is None:
        return range(shards)
    first, _, last = text.partition("-")
    try:
        numbers = range(int(first), int(last or first) + 1)
    except ValueError as error:
        raise PlanError(f"--shards {text}: write FIRST-LAST, as in 0-3") from error
    if not numbers or numbers[0] < 0 or numbers[-1] >= shards:
        raise PlanError(f"--shards {text}: the data set has the shards 0 to {shards - 1}")
    return numbers


class Generation:
    """Makes shards and tells how far it is."""

    def __init__(
        self, folder: Path, plan: Plan, threads: int, references: References | None = None
    ) -> None:
        self._folder, self._plan, self._threads = folder, plan, threads
        self._references = references
        self._made, self._total, self._started = 0, 0, time.monotonic()

    def run(self, numbers: range) -> None:
        """Makes the shards; those that are complete or in other hands are passed over."""
        waiting = [n for n in numbers if not ShardFiles(self._folder, n).is_complete()]
        done = len(numbers) - len(waiting)
        if done:
            print(f"{done} of {len(numbers)} shards are complete already", flush=True)
        self._total = sum(len(self._plan.scenes_of(n)) for n in waiting) * self._plan.windows
        for number in waiting:
            files = ShardFiles(self._folder, number)
            try:
                writer = ShardWriter(files)
            except ShardError as error:
                print(f"{error}; it is left to that one", flush=True)
                self._total -= len(self._plan.scenes_of(number)) * self._plan.windows
                continue
            with writer:
                if not files.is_complete():  # made by another since
                    self._make(number, writer)

    def _make(self, number: int, writer: ShardWriter) -> None:
        kept = len(writer.entries)
        self._total -= kept
        if kept:
            print(f"shard {number}: going on after {kept} items", flush=True)
        for scene in self._plan.scenes_of(number):
            have = sum(1 for entry in writer.entries if entry["about"]["scene"] == scene)
            if have == self._plan.windows:
                continue
            items = items_of(
                self._plan,
                scene,
                threads=self._threads,
                first=have,
                references=self._references,
            )
            for about, arrays in items:
                writer.append(about, arrays)
                self._tell(number, about)
        writer.finish()

    def _tell(self, number: int, about: dict[str, object]) -> None:
        self._made += 1
        each = (time.monotonic() - self._started) / self._made
        left = each * (self._total - self._made) / 60
        print(
            f"[{self._made}/{self._total}] shard {number}, scene {about['scene']} "
            f"({about['class']}): reference of {about['reference_spp']} spp with relMSE "
            f"{about['floor']:.2g} of {about['raw']:.2g} raw; {left:.0f} min left",
            flush=True,
        )


def quiet_openusd() -> None:
    """OpenUSD says of each product that it was generated: collected instead of printed."""
    from mbfeat.runtime import RuntimeMissingError, use_runtime

    try:
        use_runtime()
    except RuntimeMissingError as error:
        raise RenderError(str(error)) from error
    from pxr import UsdUtils

    global _messages
    _messages = UsdUtils.CoalescingDiagnosticDelegate()


_messages: object = None


def command() -> None:
    """The program: main() without the interpreter's own shutdown, see mbfeat.usdrecord.command."""
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    command()
