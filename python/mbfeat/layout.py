"""Layouts of AOVs: what an EXR file holds, and what the products of a stage will hold."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from mbfeat import _core
from mbfeat.diagnostics import tf_messages

TYPE_BYTES = {"half": 2, "float": 4, "uint": 4}


@dataclass
class Layer:
    """One AOV in a file.

    `type` is ``half``, ``float`` or ``uint``; `vertex` is 0..5 for the AOVs of a path vertex, else
    -1; `channels` are EXR names; `bytes` are those of a pixel, or of a deep sample, uncompressed.
    """

    layer: str
    aov: str
    type: str
    vertex: int
    channels: list[str]
    meaning: str
    bytes: int


@dataclass
class Layout:
    """One file: `source` is its path, or the RenderProduct's.

    `resolution` and `data_window` (x, y, width, height) are pixels, zero where not known.
    `problems` are differences from the AOV table, or what is wrong with the product; empty is good.
    """

    source: str
    file: str
    deep: bool
    resolution: tuple[int, int]
    data_window: tuple[int, int, int, int]
    compression: str
    parts: int
    bytes: int
    layers: list[Layer]
    problems: list[str] = field(default_factory=list)

    def to_json(self) -> dict[str, Any]:
        """The fields as plain Python values."""
        return asdict(self)

    def to_text(self) -> str:
        """A table for people."""
        what = "deep EXR, one sample for each path" if self.deep else "EXR"
        lines = [f"{self.file}: {what}, {self.compression or 'any'} compression"]
        if self.source != self.file:
            lines[0] += f" (from {self.source})"
        if self.resolution[0]:
            lines.append(
                f"  {self.resolution[0]} x {self.resolution[1]} pixels, data window "
                f"{self.data_window}, {self.parts} part{'' if self.parts == 1 else 's'}"
            )
        lines += table(self.layers)
        lines.append(f"  {self.bytes} bytes for a {'sample' if self.deep else 'pixel'}")
        lines += [f"  differs: {problem}" for problem in self.problems]
        return "\n".join(lines)


def table(layers: Iterable[Layer]) -> list[str]:
    """Rows of a table with a heading."""
    rows = [("layer", "aov", "type", "vertex", "channels", "bytes", "meaning")]
    for layer in layers:
        vertex = "" if layer.vertex < 0 else str(layer.vertex)
        channels = " ".join(channel.rpartition(".")[2] for channel in layer.channels)
        text = str(layer.bytes)
        rows.append((layer.layer, layer.aov, layer.type, vertex, channels, text, layer.meaning))
    widths = [max(len(row[column]) for row in rows) for column in range(6)]
    return [
        "  " + "  ".join([*(row[i].ljust(widths[i]) for i in range(6)), row[6]]).rstrip()
        for row in rows
    ]


def aov_rows() -> list[Layer]:
    """The AOV table itself, each AOV as the layer of its name stored as float (ids as uint)."""
    names = [descriptor.name for descriptor in _core.aov_table()]
    product = _core.ProductSpec("", [_core.ProductLayer(name, name) for name in names])
    return _layers(_core.describe_product(product))


def read_layout(path: str) -> Layout:
    """The layout of an EXR file, and where it differs from the AOV table.

    Raises _core.Error for a file that cannot be read as EXR.
    """
    layout = _from_core(path, path, _core.describe_product_file(path))
    layout.problems = _core.check_product_file(path)
    return layout


def stage_layouts(path: str, settings_path: str = "") -> list[Layout]:
    """What the RenderProducts of a stage would write.

    `settings_path` names a RenderSettings; without it those of all RenderSettings are listed.
    Raises ValueError for a stage that cannot be opened or holds no such settings.
    """
    from pxr import Tf, Usd, UsdRender

    try:
        stage = Usd.Stage.Open(path, Usd.Stage.LoadNone)
    except Tf.ErrorException as error:
        reason = "; ".join(tf_messages(error))
        raise ValueError(f"{path}: this is neither an EXR nor a stage ({reason})") from error
    if settings_path:
        named = UsdRender.Settings.Get(stage, settings_path)
        if not named:
            raise ValueError(f"{path}: there is no RenderSettings <{settings_path}>")
        found = [named]
    else:
        found = [UsdRender.Settings(p) for p in stage.Traverse() if p.IsA(UsdRender.Settings)]
        if not found:
            raise ValueError(f"{path}: there are no RenderSettings on this stage")
    layouts: list[Layout] = []
    seen: set[str] = set()
    for settings in found:
        for target in settings.GetProductsRel().GetForwardedTargets():
            product = UsdRender.Product.Get(stage, target)
            if product and str(target) not in seen:
                seen.add(str(target))
                layouts.append(_product_layout(stage, settings, product))
    return layouts


def _product_layout(stage: Any, settings: Any, product: Any) -> Layout:
    from pxr import UsdRender

    def authored(name: str) -> Any:
        attribute = product.GetPrim().GetAttribute(name)
        return attribute.Get() if attribute and attribute.HasAuthoredValue() else None

    spec = _core.ProductSpec(
        str(product.GetProductNameAttr().Get() or ""),
        deep=product.GetProductTypeAttr().Get() == "deepRaster",
    )
    spec.prim_path = str(product.GetPath())
    for name in ("mbfeat:exr:compression", "driver:parameters:OpenEXR:compression"):
        spec.compression = str(authored(name) or spec.compression)
    spec.multi_part = authored("mbfeat:exr:layout") == "multipart"
    problems: list[str] = []
    layers = []
    for target in product.GetOrderedVarsRel().GetForwardedTargets():
        var = UsdRender.Var.Get(stage, target)
        if not var:
            problems.append(f"{target}: orderedVars names it, but it is no RenderVar")
            continue
        layers.append(_var_layer(var))
    spec.layers = layers
    layout = _from_core(spec.prim_path, spec.path, _core.describe_product(spec))
    problems += _core.validate_product(spec)
    layout.problems = problems
    width, height = authored("resolution") or settings.GetResolutionAttr().Get()
    layout.resolution = (width, height)
    layout.data_window = (0, 0, width, height)
    return layout


def _var_layer(var: Any) -> _core.ProductLayer:
    """The layer of a RenderVar, by the rules of the delegate."""

    def authored(name: str) -> str:
        value = var.GetPrim().GetAttribute(name).Get()
        return "" if value is None else str(value)

    name = str(var.GetSourceNameAttr().Get() or var.GetPrim().GetName())
    if var.GetSourceTypeAttr().Get() == "primvar" and not name.startswith("primvars:"):
        name = f"primvars:{name}"
    stored = authored("driver:parameters:aov:format") or str(var.GetDataTypeAttr().Get())
    half = stored.startswith("half") or (stored[-1:] == "h" and stored[-2:-1].isdigit())
    descriptor = _core.find_aov(name)
    if descriptor is not None and descriptor.is_integer:
        pixel_type = _core.PixelType.UINT
    else:
        pixel_type = _core.PixelType.HALF if half else _core.PixelType.FLOAT
    layer = authored("driver:parameters:aov:name") or var.GetPrim().GetName()
    return _core.ProductLayer(name, layer, pixel_type)


def _from_core(source: str, file: str, layout: _core.AovLayout) -> Layout:
    return Layout(
        source=source,
        file=file,
        deep=layout.deep,
        resolution=layout.resolution,
        data_window=layout.data_window,
        compression=layout.compression,
        parts=layout.parts,
        bytes=layout.bytes,
        layers=_layers(layout),
    )


def _layers(layout: _core.AovLayout) -> list[Layer]:
    return [
        Layer(
            layer=entry.layer,
            aov=entry.aov,
            type=entry.type,
            vertex=entry.vertex,
            channels=list(entry.channels),
            meaning=entry.doc,
            bytes=entry.bytes,
        )
        for entry in layout.layers
    ]


def is_exr(path: str) -> bool:
    """Whether the file is an OpenEXR file, by its first bytes (its name where there is none)."""
    try:
        with Path(path).open("rb") as file:
            return file.read(4) == b"\x76\x2f\x31\x01"
    except OSError:
        return Path(path).suffix.lower() == ".exr"
