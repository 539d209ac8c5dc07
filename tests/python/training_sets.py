"""A data set that takes no rendering, and settings of a network that takes no time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from training.dataset.layout import BYTES, HALF
from training.dataset.plan import Plan
from training.dataset.shards import ShardFiles, ShardWriter

TINY = [
    "model.width=8", "model.unet=[8, 12]", "model.kernel=5", "model.convs=1",
    "data.batch=2", "data.patch=16", "data.spp_max=4", "optimisation.warmup=5",
]  # fmt: skip


def synthetic_set(folder: Path) -> Path:
    """Windows of 32 x 32 pixels: a smooth image, seen through noise that its albedo is free of."""
    folder.mkdir()
    plan = Plan(split="train", seed=1, scenes=4, windows=1, size=32, spp=4, scenes_per_shard=4)
    plan.write(folder)
    rng = np.random.default_rng(1)
    with ShardWriter(ShardFiles(folder, 0)) as writer:
        for scene in range(plan.scenes):
            y, x = np.mgrid[0:32, 0:32] / 32
            clean = 0.5 + 0.4 * np.sin(
                2 * np.pi * (rng.random((3, 1, 1)) + 0.1 * scene * x + 0.2 * y)
            )
            half = np.zeros((4, len(HALF), 32, 32), dtype=np.float16)
            half[:, :3] = clean * rng.exponential(1.0, (4, 1, 32, 32))
            half[:, HALF.index("mbfeat:albedo:0.R") :][:, :3] = clean
            half[:, HALF.index("Z")] = 1.0
            about = {"scene": scene, "class": "synthetic", "light": "diffuse", "spp": 4}
            about |= {"world_to_camera": np.eye(3).ravel().tolist(), "floor": 0.0, "raw": 1.0}
            arrays = {
                "half": half,
                "bytes": np.full((4, len(BYTES), 32, 32), 1, dtype=np.uint8),
                "reference": clean.astype(np.float32),
                "halves": np.zeros((3, 32, 32), dtype=np.float32),
            }
            writer.append(about, arrays)
        writer.finish()
    return folder
