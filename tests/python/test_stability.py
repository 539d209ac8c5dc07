"""The catalogue of hard cases, and the command that runs it."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from mbfeat import cli, stability
from mbfeat.devtools.layout import PRESET, this_layout
from mbfeat.stability import Row


def row(**changes: Any) -> Row:
    values: Row = {
        "case": "sum/example",
        "check": "mean against the exact one, relative",
        "worst": 1.25e-8,
        "budget": 6e-8,
        "verdict": "pass",
        "reason": "one rounding",
        "where": "",
        "measured": 7,
        "traps": [],
        "pictures": [],
        "seconds": 0.5,
    }
    return values | changes  # type: ignore[return-value]


def run(arguments: list[str], tmp_path: Path) -> tuple[int, dict[str, Any]]:
    file = tmp_path / "result.json"
    code = cli.main(["stability", "--json", str(file), "--out", str(tmp_path / "out"), *arguments])
    return code, json.loads(file.read_text()) if file.exists() else {}


def test_part_of_the_catalogue_passes_and_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, result = run(["--filter", "fresnel/*"], tmp_path)
    assert code == 0
    assert len(result["cases"]) >= 10
    for case in result["cases"]:
        assert case["case"].startswith("fresnel/")
        assert case["verdict"] == "pass"
        assert 0.0 <= case["worst"] <= case["budget"]
        assert case["check"] and case["reason"]
        assert case["measured"] > 0
    assert result["date"] and result["processor"] and result["threads"] == 2
    table = (tmp_path / "out" / "table.md").read_text()
    assert table.startswith("| case | check | worst error | budget | verdict |")
    assert "`fresnel/index-1.5`" in table
    assert "pass" in capsys.readouterr().out


def test_a_name_that_no_case_has_is_a_usage_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["--filter", "nothing/*"], tmp_path)[0] == 2
    assert "nothing/*" in capsys.readouterr().err


def test_a_failed_case_fails_the_command_and_tells_all_about_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = row(
        case="sum/bad",
        worst=stability.BEYOND_MEASURE,
        verdict="fail",
        where="value 3",
        traps=["overflow in f()"],
        pictures=["sum-bad.png"],
    )
    monkeypatch.setattr(stability, "FAMILIES", (lambda *_: iter([row(), bad]),))
    code, result = run([], tmp_path)
    assert code == 1
    assert [case["verdict"] for case in result["cases"]] == ["pass", "fail"]
    text = capsys.readouterr().out
    for part in ("1 passed, 1 failed", "no number", "value 3", "overflow in f()", "sum-bad.png"):
        assert part in text


def test_the_page_has_every_case_and_where_budgets_come_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stability, "PAGE", tmp_path / "page.md")
    result = {
        "date": "2026-01-02",
        "processor": "a processor",
        "threads": 2,
        "traps": False,
        "seconds": 12.0,
        "cases": [row(), row(case="sum/other", reason="two roundings"), row(case="dome/sun")],
    }
    source = tmp_path / "result.json"
    source.write_text(json.dumps(result))
    assert cli.main(["stability", "--page", str(source)]) == 0
    page = (tmp_path / "page.md").read_text()
    assert "2026-01-02, a processor, 2 threads" in page
    assert page.index("## sum") < page.index("## dome")
    assert "- other: two roundings." in page
    assert "| `dome/sun` |" in page


def test_the_documentation_lists_the_cases_there_are() -> None:
    executable = stability.build_cases(this_layout(), PRESET)
    names = subprocess.run(
        [executable, "--list"], capture_output=True, text=True, check=True
    ).stdout.split()
    page = stability.PAGE.read_text(encoding="utf-8")
    assert [name for name in names if f"| `{name}` |" not in page] == []
    assert len(names) >= 80


@pytest.mark.slow
def test_the_whole_catalogue_passes(tmp_path: Path) -> None:
    code, result = run([], tmp_path)
    assert [case for case in result["cases"] if case["verdict"] != "pass"] == []
    assert code == 0


@pytest.mark.slow
def test_no_trap_fires_in_a_debug_build(tmp_path: Path) -> None:
    code, result = run(["--traps"], tmp_path)
    assert [case for case in result["cases"] if case["verdict"] != "pass"] == []
    assert result["traps"]
    assert code == 0
