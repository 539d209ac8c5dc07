"""What of a stage the measurement needs to know.

    python -m mbfeat.tradeoff.inspection STAGE [CAMERA]

prints a JSON object: a :class:`StageFacts`, or `error`. It runs in a process of its own, because
one that has loaded a stage does not end in order (see mbfeat.usdrecord.command).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from mbfeat.diagnostics import tf_messages


class InspectionError(Exception):
    """The stage cannot be measured; the message is for the user."""


@dataclass(frozen=True)
class StageFacts:
    """`settings` is the path of the stage's RenderSettings or empty, `camera` that of a camera."""

    settings: str
    camera: str
    width: int  # of the RenderSettings; 0 where there is none
    height: int
    aspect: float  # width by height of what the camera sees
    files: list[tuple[str, int, int]]  # layers, images and the like, with their sizes and times
    authored: list[str] = field(default_factory=list)  # mbfeat:* of the settings
    missing: list[str] = field(
        default_factory=list
    )  # files that the stage names and that are not there


def inspect(stage: Path, camera: str = "") -> StageFacts:
    """Looks at a stage in a process of its own. Raises InspectionError."""
    command = [sys.executable, "-m", "mbfeat.tradeoff.inspection", str(stage), camera]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        found = json.loads(done.stdout.strip().splitlines()[-1])
    except (IndexError, ValueError):
        last = (done.stderr.strip().splitlines() or ["it ended without a message"])[-1]
        raise InspectionError(f"{stage} could not be read: {last}") from None
    if "error" in found:
        raise InspectionError(str(found["error"]))
    found["files"] = [tuple(row) for row in found["files"]]
    return StageFacts(**found)


def look(file: str, wanted: str) -> StageFacts:
    """What inspect() returns, in this process. Raises InspectionError."""
    from pxr import UsdGeom, UsdRender

    from mbfeat.usdrecord import StageError, find_camera, find_settings, open_file

    try:
        stage = open_file(file)
    except StageError as error:
        raise InspectionError(str(error)) from error
    path = find_settings(stage, None, None)
    settings = UsdRender.Settings(stage.GetPrimAtPath(path)) if path else None
    found = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    there = "the stage has no camera: add one, or a layer over it that has one"
    if found:
        there = f"name one with --camera: {', '.join(str(p.GetPath()) for p in found[:8])}"
    if wanted:
        camera = UsdGeom.Camera(stage.GetPrimAtPath(wanted)) if wanted.startswith("/") else None
        if not camera:
            raise InspectionError(
                f"--camera {wanted}: there is no camera at this path on {file}; {there}"
            )
    else:
        camera = find_camera(stage, None, path if settings else "")
        if not camera and len(found) == 1:
            camera = UsdGeom.Camera(found[0])
        if not camera:
            raise InspectionError(
                f"{file}: neither its render settings nor its primary camera say what to look "
                f"through; {there}"
            )
    size = settings.GetResolutionAttr().Get() if settings else (0, 0)
    seen = camera.GetCamera(0)
    files, missing = _files(stage)
    return StageFacts(
        settings=path if settings else "",
        camera=str(camera.GetPath()),
        width=int(size[0]),
        height=int(size[1]),
        aspect=float(seen.aspectRatio) or 1.0,
        files=sorted((str(p), p.stat().st_size, p.stat().st_mtime_ns) for p in files),
        authored=_authored(settings.GetPrim()) if settings else [],
        missing=missing,
    )


def _authored(prim: Any) -> list[str]:
    """The renderer's settings that the prim says something of."""
    found = [attribute for attribute in prim.GetAttributes() if attribute.HasAuthoredValue()]
    return [a.GetName() for a in found if a.GetName().startswith("mbfeat:")]


def _files(stage: Any) -> tuple[set[Path], list[str]]:
    """The files that an image of the stage may depend on, and those of them that are not there."""
    from pxr import Sdf, UsdUtils

    root = Sdf.AssetPath(stage.GetRootLayer().realPath)
    layers, assets, missing = UsdUtils.ComputeAllDependencies(root)
    named = [layer.realPath for layer in (*stage.GetUsedLayers(), *layers)]
    # What is in a package has the package's name first: package.usdz[image.png].
    named += [str(asset).partition("[")[0] for asset in assets]
    found = {Path(name).resolve() for name in named if name}
    return {path for path in found if path.is_file()}, sorted(map(str, missing))


def main(arguments: list[str]) -> None:
    """Prints the facts, and ends at once."""
    from mbfeat.runtime import RuntimeMissingError, use_runtime

    content: dict[str, Any]
    try:
        use_runtime()
        from pxr import Tf

        try:
            content = asdict(look(*arguments))
        except Tf.ErrorException as error:
            content = {"error": f"{arguments[0]}: {'; '.join(tf_messages(error))}"}
    except (RuntimeMissingError, InspectionError) as error:
        content = {"error": str(error)}
    print(json.dumps(content), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1:])
