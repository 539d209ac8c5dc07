"""The codeless schemas, in both OpenUSD packages."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

# What a fresh process finds of the schemas in the folder of its PXR_PLUGINPATH_NAME.
SCRIPT = """
import sys

from pxr import Sdf, Usd, UsdRender
registry = Usd.SchemaRegistry()
settings = registry.FindAppliedAPIPrimDefinition("MBFeatRenderSettingsAPI")
denoise = registry.FindAppliedAPIPrimDefinition("MBFeatDenoiseAPI")
assert settings and denoise
assert registry.IsAppliedAPISchema("MBFeatDenoiseAPI")
names = settings.GetPropertyNames()
assert "mbfeat:samplesPerPixel" in names and len(names) == int(sys.argv[1]), names
assert settings.GetAttributeFallbackValue("mbfeat:samplesPerPixel") == 64
assert "path" in settings.GetPropertyDocumentation("mbfeat:samplesPerPixel")
allowed = settings.GetPropertyMetadata("mbfeat:pixelFilter", "allowedTokens")
assert "blackmanHarris" in list(allowed), allowed
assert denoise.GetAttributeDefinition("mbfeat:denoise:model").GetTypeName() == "asset"

stage = Usd.Stage.CreateInMemory()
prim = UsdRender.Settings.Define(stage, "/Render/settings").GetPrim()
render_pass = UsdRender.Pass.Define(stage, "/Render/denoise").GetPrim()
other = stage.DefinePrim("/World", "Xform")
assert prim.CanApplyAPI("MBFeatRenderSettingsAPI")
assert not render_pass.CanApplyAPI("MBFeatRenderSettingsAPI")
assert prim.CanApplyAPI("MBFeatDenoiseAPI") and render_pass.CanApplyAPI("MBFeatDenoiseAPI")
assert not other.CanApplyAPI("MBFeatDenoiseAPI")
assert prim.ApplyAPI("MBFeatRenderSettingsAPI") and render_pass.ApplyAPI("MBFeatDenoiseAPI")
samples = prim.GetAttribute("mbfeat:samplesPerPixel")
assert samples.Get() == 64 and not samples.HasAuthoredValue()
assert samples.Set(16) and samples.Get() == 16
assert render_pass.GetAttribute("mbfeat:denoise:enabled").Get() is False
print("ok")
"""


def _run(schemas: Path) -> None:
    from mbfeat import _core

    environment = {**os.environ, "PXR_PLUGINPATH_NAME": str(schemas)}
    count = str(len(_core.setting_table()))
    result = subprocess.run(
        [sys.executable, "-c", SCRIPT, count], env=environment, capture_output=True, text=True
    )
    assert result.stdout == "ok\n", result.stderr


def test_schemas_load_in_the_runtime(root: Path) -> None:
    _run(root / "schemas")


@pytest.mark.usd_core
def test_schemas_load_in_usd_core(root: Path) -> None:
    _run(root / "schemas")


def test_schemas_are_found_beside_the_plugin(build_dir: Path) -> None:
    _run(build_dir / "plugin" / "usd" / "mbfeatSchemas" / "resources")


def test_generated_schemas_are_up_to_date(root: Path) -> None:
    from mbfeat import schema

    assert schema.outdated(root / "schemas") == [], "run: ./run mbfeat schema"


def test_schema_covers_the_table_with_its_defaults(tmp_path: Path) -> None:
    from pxr import Sdf

    from mbfeat import _core, schema

    assert {path.name for path in schema.write(tmp_path)} == set(schema.files())
    assert schema.write(tmp_path) == []
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "generatedSchema.usda"))
    prim = layer.GetPrimAtPath("/MBFeatRenderSettingsAPI")
    for setting in _core.setting_table():
        attribute = prim.attributes[setting.name]
        assert attribute.default == setting.default, setting.name
        assert setting.doc in attribute.documentation
        assert list(attribute.GetInfo("allowedTokens") or []) == setting.allowed
