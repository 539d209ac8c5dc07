"""Exports a trained network to ONNX, and compares what ONNX Runtime makes of it with PyTorch.

    python -m training.export RUN/model.pt OUT.onnx [--whole]

OUT.onnx leaves the last layer and the splat to the renderer: kernels of whole images would not fit
into memory. With ``--whole`` they are in the graph, in plain operators. See `Contract`.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from training.needs_torch import require

require("training.export")

import torch  # noqa: E402
from torch import Tensor, nn  # noqa: E402

from training.checkpoints import CheckpointError, Trained, load_model  # noqa: E402
from training.model.config import ModelConfig  # noqa: E402
from training.model.inputs import CHANNELS  # noqa: E402
from training.model.pyramid import Pyramid  # noqa: E402
from training.model.sksn import Hidden, Sksn, fold_weight_norm  # noqa: E402
from training.model.splat import plain_splat  # noqa: E402

OPSET = 18
FORMAT = 1
TOLERANCE = 1e-4
KEY = "mbfeat"  # of the model's metadata that holds the contract as JSON


@dataclass(frozen=True)
class Contract:
    """What a program has to know that runs an exported network.

    Input `samples` [samples, channels, h, w] float32: the `channels`, in their order, see
    training.model.inputs. A ``whole`` network gives `image` [3, h, w]. A ``hidden`` one gives
    `hidden` [units, width, h, w], `radiance` [units, 3, h, w], and the last layer, `weight`
    [kernel kernel, width] and `bias` [kernel kernel]: logits are weight x hidden + bias, and are
    splatted as training.model.splat says, for all units together or, with `layers`, each unit apart
    and the images added. Tiles begin at multiples of `unit` and overlap by `receptive_field`.
    """

    kind: str
    features: str
    channels: tuple[str, ...]
    kernel: int
    pyramid: int
    layers: bool
    unit: int
    receptive_field: int
    format: int = FORMAT


class _Whole(nn.Module):
    def __init__(self, model: Sksn) -> None:
        super().__init__()
        self.model = model

    def forward(self, samples: Tensor) -> Tensor:
        image: Tensor = self.model(samples[None], plain_splat)[0]
        return image


class _Hidden(nn.Module):
    def __init__(self, model: Sksn) -> None:
        super().__init__()
        self.model = model

    def forward(self, samples: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        state = self.model.hidden(samples[None])
        last = self.model.kernels
        assert isinstance(last, nn.Conv2d) and last.bias is not None
        # Not the parameters themselves: an output has to be made by an operator.
        return state.hidden[0], state.radiance[0], last.weight.flatten(1) + 0.0, last.bias + 0.0


def contract(config: ModelConfig, kind: str) -> Contract:
    return Contract(
        kind=kind,
        features=config.features,
        channels=CHANNELS[config.features],
        kernel=config.kernel,
        pyramid=config.pyramid,
        layers=config.layers,
        unit=config.unit,
        receptive_field=config.receptive_field,
    )


def export(model: Sksn, path: Path, *, whole: bool, about: dict[str, Any] | None = None) -> None:
    """Writes the network; raises ValueError for the hidden part of one with a pyramid.

    `about` (seed, steps, data) goes into the metadata beside the contract. Folds the model's
    normalised weights.
    """
    import onnx

    if not whole and isinstance(model.kernels, Pyramid):
        raise ValueError("a network with a pyramid has several last layers; export it whole")
    fold_weight_norm(model)
    module = (_Whole if whole else _Hidden)(model).eval()
    outputs = ["image"] if whole else ["hidden", "radiance", "weight", "bias"]
    axes: dict[str, dict[int, str]] = {"samples": {0: "samples", 2: "height", 3: "width"}}
    if whole:
        axes["image"] = {1: "height", 2: "width"}
    else:
        for name in ("hidden", "radiance"):
            axes[name] = {0: "units", 2: "height", 3: "width"}
    example = torch.rand(3, len(CHANNELS[model.config.features]), 24, 32)
    partial = path.with_name(f"{path.name}.partial")
    with warnings.catch_warnings(), torch.inference_mode(False), torch.no_grad():
        warnings.simplefilter("ignore")  # of tracing, about sizes that are meant to be fixed
        torch.onnx.export(
            module,
            (example,),
            str(partial),
            input_names=["samples"],
            output_names=outputs,
            dynamic_axes=axes,
            opset_version=OPSET,
            dynamo=False,
        )
    graph = onnx.load(str(partial))
    facts = asdict(contract(model.config, "whole" if whole else "hidden"))
    entries = {KEY: json.dumps(facts), "mbfeat.training": json.dumps(about or {})}
    onnx.helper.set_model_props(graph, entries)
    onnx.checker.check_model(graph, full_check=True)
    partial.write_bytes(graph.SerializeToString())
    partial.replace(path)


def run(path: Path, samples: NDArray[np.float32], *, threads: int = 0) -> list[NDArray[np.float32]]:
    """The outputs of an exported network by ONNX Runtime."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    found: list[NDArray[np.float32]] = session.run(None, {"samples": samples})
    return found


def difference(model: Sksn, path: Path, samples: Tensor, *, whole: bool) -> float:
    """Largest difference between PyTorch's image and ONNX Runtime's, relative where over 1."""
    found = [torch.from_numpy(value) for value in run(path, samples.numpy())]
    with torch.inference_mode():
        expected = model(samples[None])[0]
        if whole:
            image = found[0]
        else:
            # The renderer's part, here by PyTorch.
            hidden, radiance, weight, bias = found
            layer = model.kernels
            assert isinstance(layer, nn.Conv2d) and layer.bias is not None
            assert torch.equal(weight, layer.weight.flatten(1)) and torch.equal(bias, layer.bias)
            state = Hidden(hidden[None], radiance[None], hidden[None, 0])
            image = model.splatted(state)[0]
    return float(((image - expected).abs() / expected.abs().clamp(min=1.0)).max())


def example(features: str, samples: int, height: int, width: int) -> Tensor:
    """An input for comparisons: bits where bits are, otherwise 0..1."""
    from training.model.inputs import EVENT_BITS

    rng = torch.Generator().manual_seed(1)
    x = torch.rand((samples, len(CHANNELS[features]), height, width), generator=rng)
    for i, name in enumerate(CHANNELS[features]):
        if name.partition(":")[0] in ("valid", *EVENT_BITS):
            x[:, i] = (x[:, i] < 0.5).float()
    return x


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; returns 1 when the export failed or differs from PyTorch."""
    parser = argparse.ArgumentParser(prog="python -m training.export", description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--whole", action="store_true", help="with the splat, for comparisons")
    options = parser.parse_args(arguments)
    try:
        trained = load_model(options.model)
        export(trained.model, options.output, whole=options.whole, about=_about(trained))
    except (CheckpointError, ValueError) as error:
        sys.stderr.write(f"training.export: {error}\n")
        return 1
    x = example(trained.config.model.features, 5, 45, 70)
    found = difference(trained.model, options.output, x, whole=options.whole)
    size = options.output.stat().st_size / 1e6
    print(f"{options.output}: {size:.1f} MB, differs from PyTorch by {found:.2g}")
    if found > TOLERANCE:
        sys.stderr.write(f"training.export: that is more than {TOLERANCE:g}\n")
        return 1
    return 0


def _about(trained: Trained) -> dict[str, Any]:
    return trained.history | {"config": trained.config.to_dict()}


if __name__ == "__main__":
    sys.exit(main())
