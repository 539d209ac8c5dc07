"""Exported networks agree with PyTorch at any size and number of samples."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import pytest

torch = pytest.importorskip("torch", reason="torch is only in ./run training's environment")
onnx = pytest.importorskip("onnx", reason="onnx is only in ./run training's environment")

from test_training_model import VARIANTS  # noqa: E402
from training import export  # noqa: E402
from training.model.config import ModelConfig  # noqa: E402
from training.model.inputs import CHANNELS  # noqa: E402
from training.model.sksn import Sksn  # noqa: E402

SIZES = ((1, 16, 16), (4, 21, 34), (9, 13, 8))


def network(name: str) -> Sksn:
    torch.manual_seed(11)
    model = Sksn(ModelConfig(**VARIANTS[name])).eval()
    with torch.no_grad():  # kernels that differ from place to place
        for parameter in model.kernels.parameters():
            parameter.add_(0.3 * torch.randn_like(parameter))
    return model


@pytest.mark.parametrize("name", VARIANTS)
def test_whole_network_agrees(name: str, tmp_path: Path) -> None:
    model = network(name)
    file = tmp_path / "whole.onnx"
    export.export(model, file, whole=True)
    for size in SIZES:
        x = export.example(model.config.features, *size)
        assert export.difference(model, file, x) < export.TOLERANCE


@pytest.mark.parametrize("name", [name for name in VARIANTS if "pyramid" not in VARIANTS[name]])
def test_hidden_part_agrees(name: str, tmp_path: Path) -> None:
    model = network(name)
    file = tmp_path / "hidden.onnx"
    export.export(model, file, whole=False)
    for size in SIZES:
        x = export.example(model.config.features, *size)
        assert export.difference(model, file, x) < export.TOLERANCE


@pytest.mark.parametrize("name", ["paths", "layers"])
def test_half_as_large_file_agrees(name: str, tmp_path: Path) -> None:
    """With the rounded network; constants of the graph may not be weights."""
    model = network(name)
    large, small = tmp_path / "large.onnx", tmp_path / "small.onnx"
    export.export(model, large, whole=False)
    export.export(model, small, whole=False, half=True)
    assert small.stat().st_size < large.stat().st_size
    x = export.example(model.config.features, 4, 21, 34)
    assert export.difference(model, small, x) < export.TOLERANCE


def test_file_says_how_to_use_it(tmp_path: Path) -> None:
    model = network("layers")
    file = tmp_path / "hidden.onnx"
    export.export(model, file, whole=False, about={"seed": 3})
    graph = onnx.load(str(file))
    assert {entry.version for entry in graph.opset_import if not entry.domain} == {export.OPSET}
    facts = {entry.key: entry.value for entry in graph.metadata_props}
    assert facts["mbfeat:channels"] == ",".join(CHANNELS["extended"])
    assert facts["mbfeat:kind"] == "layered" and facts["mbfeat:kernel"] == "5"
    assert facts["mbfeat:receptiveField"] == str(model.config.context_field)
    assert json.loads(facts["mbfeat:training"]) == {"seed": 3}
    sums = onnx.load_from_string(base64.b64decode(facts["mbfeat:samples"]))
    shape = [d.dim_param or d.dim_value for d in sums.graph.input[0].type.tensor_type.shape.dim]
    assert shape == ["samples", len(CHANNELS["extended"]), "height", "width"]
    with pytest.raises(ValueError, match="export it whole"):
        export.export(network("pyramid"), tmp_path / "no.onnx", whole=False)
