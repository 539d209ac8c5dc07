"""The reference pages in ``mbfeat/docs``, generated from the tables of settings and AOVs."""

from __future__ import annotations

from pathlib import Path

from mbfeat import _core, schema

FOLDER = Path(__file__).parent / "docs"


def pages() -> dict[str, str]:
    """The generated pages by file name."""
    return {"settings.md": _settings_page(), "aovs.md": _aov_page()}


def outdated(folder: Path = FOLDER) -> list[Path]:
    """The pages of the folder that are missing or differ from the tables."""
    return [
        folder / name
        for name, text in pages().items()
        if not (folder / name).is_file() or (folder / name).read_text(encoding="utf-8") != text
    ]


def write(folder: Path = FOLDER) -> list[Path]:
    """Writes the pages that are not up to date; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    stale = outdated(folder)
    for path in stale:
        path.write_text(pages()[path.name], encoding="utf-8")
    return stale


def _settings_page() -> str:
    lines = [
        "# Settings",
        "",
        "A setting has its value from, in rising precedence: its default, the host program, the",
        "render settings prim (an attribute of the setting's name on the RenderSettings prim,",
        "documented by the schema `MBFeatRenderSettingsAPI`), the environment, and",
        "`usdrecord --set NAME=VALUE`. Of a name that does not exist or a value that does not fit",
        "it is said what is valid. From `--set` or the environment it ends `usdrecord` before it",
        "renders; from a prim or another host it is a warning, and the value before it stays.",
        "",
        "| setting | type | default | environment | meaning |",
        "|---|---|---|---|---|",
    ]
    lines += [_setting_row(setting) for setting in _core.setting_table()]
    lines += [
        "",
        "## Denoiser",
        "",
        "These are set like the others, see [denoising.md](denoising.md); as attributes also of a",
        "RenderPass prim of passType `denoise`. The schema `MBFeatDenoiseAPI` documents them.",
        "",
        "| setting | type | default | environment | meaning |",
        "|---|---|---|---|---|",
    ]
    lines += [_setting_row(setting) for setting in _core.denoise_setting_table()]
    return "\n".join(lines) + "\n"


def _setting_row(setting: _core.SettingDescriptor) -> str:
    return (
        f"| `{setting.name}` | {_type(setting)} | {_default(setting)} "
        f"| `{setting.environment}` | {schema.documentation(setting)} |"
    )


def _type(setting: _core.SettingDescriptor) -> str:
    if setting.allowed:
        return ", ".join(f"`{token}`" for token in setting.allowed)
    return schema.attribute_type(setting)


def _default(setting: _core.SettingDescriptor) -> str:
    if isinstance(setting.default, bool):
        return str(setting.default).lower()
    if isinstance(setting.default, str):
        return f"`{setting.default}`" if setting.default else "(empty)"
    return f"{setting.default:.16g}"


def _aov_page() -> str:
    lines = [
        "# AOVs",
        "",
        "Any of these, and `primvars:NAME` for any primvar, may be the source of a RenderVar. In",
        "an EXR file the channels are `LAYER.CHANNEL`, where the layer is",
        "`driver:parameters:aov:name` or the RenderVar's name, and plain R, G, B, A for the",
        "RenderVar named `color`. Integers are stored as UINT; -1 at the background is 0xFFFFFFFF.",
        "Vertex 0 is the first hit of the camera's ray. A host that needs identifiers as names, as",
        "Blender does, writes `_` for `:`: `mbfeat_albedo_0`, `primvars_NAME`.",
        "",
        "| AOV | channels | type | pixel value | vertex | meaning |",
        "|---|---|---|---|---|---|",
    ]
    reductions = {
        _core.AovReduction.MEAN: "mean",
        _core.AovReduction.NEAREST: "nearest sample",
        _core.AovReduction.SUM: "count",
        _core.AovReduction.VARIANCE: "variance",
    }
    for aov in _core.aov_table():
        vertex = "" if aov.vertex < 0 else str(aov.vertex)
        lines.append(
            f"| `{aov.name}` | {' '.join(aov.channels)} | {'int' if aov.is_integer else 'float'} "
            f"| {reductions[aov.reduction]} | {vertex} | {aov.doc} |"
        )
    lines += [
        "",
        "## Kept paths",
        "",
        'A product of `productType = "deepRaster"` holds every path as one deep sample, in path',
        "order, with these channels; the last ones only where an AOV of the extended set is asked",
        "for. The same values are in `Film.path_samples`.",
        "",
    ]
    plain = [field.name for field in _core.path_sample_fields(False)]
    extended = [field.name for field in _core.path_sample_fields(True)]
    added = [name for name in extended if name not in set(plain)]
    lines += [_wrapped(plain), "", f"Extended set: {_wrapped(added)}"]
    return "\n".join(lines) + "\n"


def _wrapped(names: list[str]) -> str:
    """Channel names as text, those of one layer together."""
    groups: dict[str, list[str]] = {}
    for name in names:
        layer, dot, channel = name.rpartition(".")
        groups.setdefault(layer + dot, []).append(channel)
    return ", ".join(f"`{prefix}{'|'.join(channels)}`" for prefix, channels in groups.items())
