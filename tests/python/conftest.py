"""Which tests run in which process, and where things lie.

Two OpenUSD Python packages exist and a process can hold one. `./run test` therefore runs pytest
twice and says in MBFEAT_PXR whose ``pxr`` is importable: ``runtime`` (with imaging, the one that
renders) or ``usd-core`` (plain authoring). Tests marked ``usd_core`` run in the second process,
all others in the first.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def _wants_usd_core() -> bool:
    return os.environ.get("MBFEAT_PXR") == "usd-core"


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Leaves out files without a ``usd_core`` test there: they may import what usd-core lacks."""
    if _wants_usd_core() and collection_path.name.startswith("test_"):
        return "usd_core" not in collection_path.read_text(encoding="utf-8") or None
    return None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keeps the tests that belong to this process's ``pxr``."""
    wanted = _wants_usd_core()
    other = [i for i in items if (i.get_closest_marker("usd_core") is not None) != wanted]
    if other:
        config.hook.pytest_deselected(items=other)
        items[:] = [item for item in items if item not in set(other)]


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def scenes(root: Path) -> Path:
    """The folder of the test stages."""
    return root / "tests" / "scenes"


@pytest.fixture(scope="session")
def build_dir() -> Path:
    """The build that is under test; it is named by ./run."""
    value = os.environ.get("MBFEAT_BUILD_DIR")
    if not value:
        pytest.fail("MBFEAT_BUILD_DIR is not set; run the tests with ./run test")
    return Path(value)
