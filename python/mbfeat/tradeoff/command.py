"""The command: measures a stage, says what it found, and leaves it in files."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack

from mbfeat.tradeoff import filters, limits, outcome, peers, reference, request, variants
from mbfeat.tradeoff.inspection import InspectionError
from mbfeat.tradeoff.kept import Keep, subject_key
from mbfeat.tradeoff.measure import Ladder, Measured, split_recording, tasks
from mbfeat.tradeoff.reference import Reference, ReferenceError
from mbfeat.tradeoff.renders import Renderer, RenderError, StageRenderer, Subject
from mbfeat.tradeoff.variants import OWN, Variant, VariantError
from mbfeat.tradeoff.wording import duration, not_found

PROBE_SPP = 16
PROBE_SEED = 900_000


def run(options: argparse.Namespace) -> int:
    """Does what the options of the command line say; returns the exit code."""
    try:
        request.check_packages()
        if options.page is not None:
            import mbfeat.tradeoff.page as page

            print(f"wrote {page.write(options.page)}")
            return 0
        return _run(options)
    except (request.UsageError, VariantError) as error:
        return _fail(str(error), 2)
    except (InspectionError, ReferenceError, RenderError, peers.PeersError, OSError) as error:
        return _fail(str(error), 1)
    except KeyboardInterrupt:
        sys.stderr.write(
            "\nmbfeat: tradeoff: interrupted; finished renders are kept, and the same command goes "
            "on from them\n"
        )
        return 130


def _run(options: argparse.Namespace) -> int:
    names = request.peer_names(options.peers)
    stage = request.stage(options)
    scale = request.scale(options)
    out = request.folder(options)
    if options.peers is not None:
        peers.set_up(names)
    subject = request.subject(options, stage)
    for line in not_found(subject.facts.missing):
        tell(line)
    keep = Keep(out / "kept")
    loads = [os.getloadavg()[0]]
    with ExitStack() as stack:
        work = _Work(options, subject, keep, stack, names)
        measured, references = work.measure(scale)
    loads.append(os.getloadavg()[0])
    made = outcome.result(options, subject, scale, work.variants, measured, references, loads)
    made["left_out"] |= work.left_out
    made["limits"] = limits.rows(measured, work.limits, references)
    outcome.write(out, made, measured, references)
    outcome.show(out, made)
    return 0


class _Work:
    """Renderers, references and variants of a measurement."""

    def __init__(
        self,
        options: argparse.Namespace,
        subject: Subject,
        keep: Keep,
        stack: ExitStack,
        names: Sequence[str],
    ) -> None:
        self._options = options
        self._subject = subject
        self._keep = keep
        self._key = subject_key(subject)
        self.left_out: dict[str, str] = {}
        self.limits = self._called_for()
        python = None if options.limits else filters.interpreter()
        apply = None
        if python is not None:
            bound = (subject.threads, subject.cores)
            apply = stack.enter_context(filters.OidnProcess(python, *bound))
        elif not options.only and not options.limits:
            tell("Open Image Denoise takes no part: pyoidn is not installed (pip install pyoidn)")
        self.renderers: dict[str, Renderer] = {OWN: StageRenderer(subject, apply, tell)}
        filtered = variants.open_image_denoise() if apply is not None else []
        models = [] if options.limits else variants.denoise_models()
        extra = [request.variant(text) for text in options.variant]
        limited = [limit.variant for limit in self.limits]
        compared = [*models, *filtered, *limited]
        baselines = [variants.raw(), *([variants.whole()] if compared else [])]
        self.variants = [*baselines, *compared, *extra]
        self._add_peers(names, stack)
        variants.check_names(self.variants)
        self.variants = request.chosen(self.variants, options.only)

    def _called_for(self) -> list[limits.Limit]:
        """The limits that the stage's effects give a meaning to, where they are asked for."""
        if not self._options.limits:
            return []
        present = limits.effects_of(self._subject)
        found = limits.for_effects(present)
        for limit in limits.LIMITS:
            if limit not in found:
                tell(
                    f"{limit.name} is no variant: the stage does not call for "
                    f"{' or '.join(limit.effects)}"
                )
        return found

    def _add_peers(self, names: Sequence[str], stack: ExitStack) -> None:
        """The peers, where the stage can be translated for them."""
        if not names:
            return
        subject = self._subject
        try:
            stage = peers.PeerStage(subject.stage)
        except peers.PeersError as error:
            tell(str(error))
            self.left_out |= dict.fromkeys(names, str(error))
            return
        size = (subject.width, subject.height)
        for variant in peers.variants(names):
            name = variant.renderer
            bound = (size, subject.threads, subject.cores, stack)
            self.renderers[name] = peers.PeerRenderer(name, stage, *bound)
            self.variants.append(variant)

    def measure(self, scale: request.Scale) -> tuple[Measured, dict[str, Reference]]:
        """Makes what is missing of references and ladder."""
        todo = tasks(self.variants, scale.rungs, scale.seeds)
        subject = self._subject
        if self._options.reference:
            size = (subject.width, subject.height)
            references = {OWN: reference.given(self._options.reference, size)}
        else:
            self._announce(scale)
            references = {OWN: self._rendered(variants.raw(), scale.reference_spp)}
        for variant in self.variants:
            if variant.renderer in references:
                continue
            try:
                references[variant.renderer] = self._rendered(variant, scale.reference_spp)
            except RenderError as error:
                self.left_out[variant.name] = str(error)
                tell(f"{variant.name} is left out: {error}")
        todo = [task for task in todo if task.variant.renderer in references]
        ladder = Ladder(self.renderers, references, self._keep, self._key, tell)
        measured = ladder.run(todo)
        split_recording(measured.points)
        return measured, references

    def _rendered(self, variant: Variant, spp: int) -> Reference:
        renderer = self.renderers[variant.renderer]
        return reference.rendered(renderer, variant, spp, self._keep, self._key, tell)

    def _announce(self, scale: request.Scale) -> None:
        """Says what is taken as reference and what that costs, by two small renders."""
        raw, renderer = variants.raw(), self.renderers[OWN]
        text = reference_plan(scale)
        if not reference.is_rendered(raw, scale.reference_spp, self._keep, self._key):
            renderer.render(raw, 1, PROBE_SEED)  # reads the files, so that later renders are alike
            probe = renderer.render(raw, PROBE_SPP, PROBE_SEED)
            chunk, count = reference.chunks_of(scale.reference_spp)
            each = probe.seconds["sampling"] / PROBE_SPP
            seconds = count * (probe.total - probe.seconds["sampling"] + chunk * each)
            text += f" That takes {duration(seconds)}."
        tell(text)


def reference_plan(scale: request.Scale) -> str:
    """What is taken as the reference where none is given."""
    chunk, count = reference.chunks_of(scale.reference_spp)
    return (
        "Without --reference the truth is a render of this stage by MBFeat itself, "
        f"{chunk * count} samples a pixel from seeds that no measured image has, in two halves "
        "whose difference shows its own noise. What MBFeat gets wrong in every render does not "
        "show against it."
    )


def tell(text: str) -> None:
    """A line of progress."""
    print(text, flush=True)


def _fail(text: str, code: int) -> int:
    sys.stderr.write(f"mbfeat: tradeoff: {text}\n")
    return code
