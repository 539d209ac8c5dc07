"""Settings as Python and the environment see them."""

from __future__ import annotations

import pytest

from mbfeat import _core
from mbfeat.options import check_overrides

Source = _core.SettingSource


def test_sources_have_rising_precedence() -> None:
    settings = _core.Settings()
    name = "mbfeat:samplesPerPixel"
    assert settings.source(name) == Source.DEFAULT
    for value, source in enumerate(
        [Source.HOST, Source.PRIM, Source.ENVIRONMENT, Source.COMMAND_LINE], start=2
    ):
        settings.set(source, name, value)
        assert (settings.value(name), settings.source(name)) == (value, source)
    settings.set(Source.PRIM, name, 99)
    assert settings.value(name) == 5
    settings.clear(Source.COMMAND_LINE)
    settings.clear(Source.ENVIRONMENT)
    assert settings.value(name) == 99


def test_environment_is_read_and_its_mistakes_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MBFEAT_SAMPLES_PER_PIXEL", "12")
    monkeypatch.setenv("MBFEAT_PIXEL_FILTER", "gaussain")
    monkeypatch.setenv("MBFEAT_MAX_BOUNCE", "4")
    settings = _core.Settings()
    problems = settings.read_environment()
    assert len(problems) == 2
    assert "MBFEAT_MAX_BOUNCE:" in problems[0] and "MBFEAT_MAX_BOUNCES" in problems[0]
    assert "MBFEAT_PIXEL_FILTER:" in problems[1] and '"gaussian"' in problems[1]
    assert settings.value("mbfeat:samplesPerPixel") == 12
    assert settings.source("mbfeat:samplesPerPixel") == Source.ENVIRONMENT


def test_every_setting_has_its_own_environment_variable() -> None:
    variables = [setting.environment for setting in _core.setting_table()]
    assert len(set(variables)) == len(variables)
    assert all(variable.startswith("MBFEAT_") and variable.isupper() for variable in variables)


def test_unknown_setting_is_an_error_that_names_the_nearest() -> None:
    with pytest.raises(_core.Error, match=r'mbfeat:maxBounce: .*nearest is "mbfeat:maxBounces"'):
        _core.Settings().set(Source.PRIM, "mbfeat:maxBounce", 3)


def test_command_line_settings_are_checked_one_by_one() -> None:
    overrides, problems = check_overrides(
        ["mbfeat:seed=7", "mbfeat:viewAov=", "mbfeat:sed=7", "mbfeat:threads=-1", "mbfeat:robust"]
    )
    assert overrides == [("mbfeat:seed", "7"), ("mbfeat:viewAov", "")]
    assert len(problems) == 3
    assert '"mbfeat:seed"' in problems[0]
    assert "an integer from 0 to 1024" in problems[1]
    assert "NAME=VALUE" in problems[2]
    # The command ends: nothing is ignored, and no value stays.
    assert not any("ignored" in problem or "stays" in problem for problem in problems)
