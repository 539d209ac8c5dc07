"""Point instancers that OpenUSD's scene index cannot take, hidden before a render."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np


def hide_broken_instancers(stage: Any, frames: Iterable[float]) -> list[str]:
    """Deactivates PointInstancers whose protoIndices name no prototype; returns the warnings.

    OpenUSD uses negative indices unchecked, which corrupts its memory. The edits are in the session
    layer, in memory. A frame is NaN for the default time; frames after the first are looked at only
    where the indices vary with time.
    """
    from pxr import Usd

    times = list(frames)
    warnings = []
    for path, problem in _broken_instancers(stage, times).items():
        if not stage.GetPrimAtPath(path):
            continue  # it was below one that is inactive now
        with Usd.EditContext(stage, stage.GetSessionLayer()):
            _editable_prim(stage, path).SetActive(False)
        warnings.append(
            f"{path}: {problem}; this PointInstancer is not rendered. Let its protoIndices name "
            "its prototypes, counted from 0"
        )
    return warnings


def _broken_instancers(stage: Any, times: list[float]) -> dict[Any, str]:
    """What is wrong by path of the broken instancers, those in native instances included."""
    from pxr import Usd

    # Prototypes of instancers may be `over`s, hence not only what is defined.
    predicate = Usd.PrimIsActive & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract
    shared = [Usd.PrimRange(prim, predicate) for prim in stage.GetPrototypes()]
    if any(_broken_in(prims, times) for prims in shared):
        # Rare, so only now every instance is looked into.
        predicate = Usd.TraverseInstanceProxies(predicate)
    return _broken_in(Usd.PrimRange.Stage(stage, predicate), times)


def _broken_in(prims: Iterable[Any], times: list[float]) -> dict[Any, str]:
    from pxr import UsdGeom

    instancers = (prim for prim in prims if prim.IsA(UsdGeom.PointInstancer))
    found = {prim.GetPath(): _problem_with_indices(prim, times) for prim in instancers}
    return {path: problem for path, problem in found.items() if problem}


def _problem_with_indices(prim: Any, times: list[float]) -> str:
    """What is wrong with the instancer's protoIndices at the times, or an empty text."""
    from pxr import Usd, UsdGeom

    instancer = UsdGeom.PointInstancer(prim)
    prototypes = len(instancer.GetPrototypesRel().GetForwardedTargets())
    attribute = instancer.GetProtoIndicesAttr()
    for time in times if attribute.ValueMightBeTimeVarying() else times[:1]:
        indices = np.asarray(attribute.Get(Usd.TimeCode(time)) or (), dtype=np.int64)
        bad = np.flatnonzero((indices < 0) | (indices >= prototypes))
        if bad.size:
            return (
                f"{bad.size} of its {indices.size} protoIndices name none of its {prototypes} "
                f"prototypes, the first, at {bad[0]}, is {indices[bad[0]]}"
            )
    return ""


def _editable_prim(stage: Any, path: Any) -> Any:
    """The prim at the path, with the native instances around it made uninstanced.

    Edits at the stage's edit target.
    """
    prim = stage.GetPrimAtPath(path)
    while prim.IsInstanceProxy():
        instance = prim
        while instance.IsInstanceProxy():
            instance = instance.GetParent()
        instance.SetInstanceable(False)
        prim = stage.GetPrimAtPath(path)
    return prim
