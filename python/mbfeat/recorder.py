"""Rendering the frames of a stage to files, on OpenUSD's frame recorder.

The recorder's own image goes to a scratch folder: MBFeat leaves its finished film with the process,
and the image is made from that, so that it has the header of a product, colour correction works
without a GPU, and nobody ever sees half a file. Another renderer's image is moved into place.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mbfeat import _core
from mbfeat.diagnostics import OpenUsdMessages, tf_messages
from mbfeat.images import (
    LINEAR_EXTENSIONS,
    ColorCorrection,
    problem_with_folder,
    problem_with_format,
    write_image,
)
from mbfeat.summary import summary

OWN_RENDERER = "HdMBFeatRendererPlugin"
ON_ERROR = "mbfeat:onError"


class RecordError(Exception):
    """A frame could not be rendered or written; the message is for the user."""


class InterruptedByUserError(Exception):
    """The user stopped the render; the message says what was left undone."""


@dataclass
class Recording:
    """What is rendered how; `stage` and `camera` are pxr objects, `camera` may be invalid."""

    stage: Any
    camera: Any
    recorder: Any
    correction: ColorCorrection
    quiet: bool = False
    messages: OpenUsdMessages | None = None

    @property
    def is_own_renderer(self) -> bool:
        """Whether MBFeat renders; another renderer leaves its image to the recorder."""
        return bool(self.recorder.GetCurrentRendererId() == OWN_RENDERER)


def record_frames(recording: Recording, frames: Iterable[float], output_format: str) -> None:
    """Renders the frames in order; `output_format` is a str.format text with ``frame`` in it.

    A frame is NaN for the default time. Raises RecordError at the first frame that fails and
    InterruptedByUserError when SIGINT came; earlier frames stay.
    """
    name = Path(recording.stage.GetRootLayer().identifier).name
    for frame in frames:
        _record_frame(recording, frame, output_format.format(frame=frame), name)


def _record_frame(recording: Recording, frame: float, output: str, stage_name: str) -> None:
    label = "the default time" if frame != frame else f"frame {frame:g}"
    problem = problem_with_folder(output)
    if recording.is_own_renderer:
        problem = problem or problem_with_format(output)
    if problem:
        raise RecordError(problem)
    if not recording.quiet:
        print(f"Recording time code: {'default' if frame != frame else f'{frame:f}'}", flush=True)
    _core.Host.drop_last_frame()
    with tempfile.TemporaryDirectory(prefix="mbfeat-") as scratch:
        failure = _run_recorder(recording, frame, output, Path(scratch))
    if recording.messages is not None:
        recording.messages.flush()
    _stop_if_interrupted(label, output)
    finished = _core.Host.last_frame()
    if finished is None and not failure and recording.is_own_renderer:
        failure = "the renderer left no image"
    if failure:
        raise RecordError(f"{label} of {stage_name} failed: {failure}; {output} was not written")
    if finished is not None:
        _write_own_image(recording, finished, output, f"{stage_name}, {label}")


def _run_recorder(recording: Recording, frame: float, output: str, scratch: Path) -> str:
    """Renders one frame; returns what failed, or an empty text."""
    from pxr import Tf

    own = recording.is_own_renderer
    suffix = Path(output).suffix
    target = scratch / "image.exr" if own else scratch / f"image{suffix}"
    try:
        recorded = recording.recorder.Record(recording.stage, recording.camera, frame, str(target))
    except Tf.ErrorException as error:
        return "; ".join(tf_messages(error)) or "OpenUSD reported an error"
    except MemoryError:
        return "there is not enough memory; render a smaller image or fewer AOVs"
    except RuntimeError as error:
        return str(error) or "OpenUSD reported an error"
    if own:
        return ""  # whether there is an image is told by the film
    if not recorded or not target.exists():
        return "" if recorded else "the recorder made no image"
    try:
        partial = Path(f"{output}.{os.getpid()}.partial")
        partial.write_bytes(target.read_bytes())
        partial.replace(output)
    except OSError as error:
        return f"the image could not be written ({error.strerror})"
    return ""


def _stop_if_interrupted(label: str, output: str) -> None:
    if _core.Host.stop_requested():
        raise InterruptedByUserError(f"interrupted in {label}; {output} was not written")


def _write_own_image(
    recording: Recording, finished: _core.FinishedFrame, output: str, what: str
) -> None:
    report = finished.report
    if report.interrupted:
        reason = "; ".join(report.errors) or "the render ended before it was complete"
        raise RecordError(f"{what}: {reason}; {output} was not written")
    if report.errors and (ON_ERROR, "abort") in [row[:2] for row in report.settings]:
        raise RecordError(f"{what}: {output} was not written because of {ON_ERROR}=abort")
    film, camera, _ = finished.images[0]
    try:
        write_image(output, film, report, recording.correction)
    except _core.Error as error:
        raise RecordError(str(error)) from error
    if not recording.quiet:
        width, height = film.resolution
        # A camera that frames the stage is the engine's own, below a prim of this name.
        free = not camera or camera.startswith("/_UsdImaging")
        seen = f"{'free camera' if free else f'camera {camera}'}, {width} x {height} pixels"
        print(summary(report, f"{what}, {seen}", [output]), flush=True)
    if report.errors:
        count = len(report.errors)
        problems = "the error" if count == 1 else f"the {count} errors"
        raise RecordError(f"{what}: {output} was written; see {problems} above")


def is_linear(output: str) -> bool:
    """Whether images of that name hold linear values."""
    return Path(output).suffix.lower() in LINEAR_EXTENSIONS
