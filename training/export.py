"""Exports a trained network to ONNX, and compares what ONNX Runtime makes of it with PyTorch.

    python -m training.export RUN/model.pt OUT.onnx [--whole]

OUT.onnx leaves the last layer and the splat to the renderer: kernels of whole images would not fit
into memory. With ``--whole`` they are in the graph, in plain operators. See `Contract`.
"""

from __future__ import annotations

import argparse
import base64
import io
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
from training.model.atrous import Likeness, filtered  # noqa: E402
from training.model.config import ModelConfig  # noqa: E402
from training.model.inputs import CHANNELS  # noqa: E402
from training.model.pyramid import Pyramid  # noqa: E402
from training.model.sksn import Sksn, fold_weight_norm, mean_albedo, modulated  # noqa: E402
from training.model.splat import distances, plain_splat, splat  # noqa: E402

OPSET = 18
FORMAT = 7
ANY_SIZE_FORMAT = 5  # the last one whose graphs took any size
TOLERANCE = 1e-4
PREFIX = "mbfeat:"  # of the metadata entries that hold the contract


@dataclass(frozen=True)
class Contract:
    """What a program has to know that runs an exported network.

    Inputs are `samples` [samples, channels, h, w] float32, the `channels` in their order, see
    training.model.inputs, and `share` [samples, 1, h, w], what each counts for in its pixel (adding
    up to 1; 0 for none). By kind:

    - ``whole``: gives `image` [3, h, w]; for comparisons.
    - ``hidden``: gives `hidden` [samples, width, h, w] and the last layer, `weight` [kernel^2,
      width] and `bias` [kernel^2]: logits are weight x hidden + bias, and the samples' radiance is
      splatted with them as training.model.splat says.
    - ``layered``, of a network with layers: two graphs. The one in the metadata entry
      mbfeat:samples, as base64, works pixel by pixel and gives `classes` [classes, planes, h, w],
      sums over samples that may be added up in parts, and `mask` [samples, classes, h, w], which
      samples are in a class. The file's own takes `classes` and gives the classes' `hidden`,
      `weight` and `bias`, and where `affinity` is not 0 also `alike` [classes, affinity, h, w]: the
      squared distance of a class's from its own where it is splatted to is taken off its logit.
      The last `guides` of these are albedo, normal, depth and, of 8, roughness, whose differences
      are multiplied by `scales` [classes, 3 or 4, h, w] of where it is splatted to.
      With `atrous`, dilations, it also gives `centre` [classes, passes, h, w] and `table` [passes,
      26] of the passes that follow the splat, see training.model.atrous.
      With `demodulated` the first graph also gives `divisor` [samples, 3, h, w]: radiance divided
      by it is splatted too, what arrives is multiplied by the class's mean divisor of the pixel,
      and counts as much as the second graph's `gate` [classes, h, w] says; the plain radiance
      counts for the rest, and for all of it in classes that the pixel has no sample of.
      Each class's share of the radiance is splatted apart, and added. There are `classes`, 3 or 1
      that all paths are in, with `classPlanes` sums each; of the one, guides and count of each of
      three ways (training.model.encoding.ways) follow the embedding. Where the renderer can compute
      them without the graph there is an entry mbfeat:encoder, see `encoder_bytes`.

    Tiles begin at multiples of `unit` and overlap by `receptiveField`, the splat's kernel // 2 and
    twice each dilation. From format 6 on the sizes of what is given to `hidden` networks and to the
    second graph of `layered` ones are multiples of `unit`, too: what is missing below and to the
    right is filled with zeros, shares among them, and the outputs there are of no use.
    `workingFloats` is about how many numbers a pixel (and sample) takes while the graph runs.
    """

    kind: str
    features: str
    channels: tuple[str, ...]
    kernel: int
    unit: int
    receptiveField: int  # noqa: N815 - the name of the metadata's entry
    classPlanes: int  # noqa: N815
    classes: int
    affinity: int
    guides: int
    demodulated: int
    atrous: tuple[int, ...]
    workingFloats: int  # noqa: N815
    format: int = FORMAT

    def entries(self) -> dict[str, str]:
        """As metadata."""
        values = asdict(self) | {
            "channels": ",".join(self.channels),
            "atrous": ",".join(map(str, self.atrous)),
        }
        return {f"{PREFIX}{name}": str(value) for name, value in values.items()}


class _Whole(nn.Module):
    def __init__(self, model: Sksn) -> None:
        super().__init__()
        self.model = model

    def forward(self, samples: Tensor) -> Tensor:
        image: Tensor = self.model(samples[None], plain_splat)[0]
        return image


def _last_layer(model: Sksn) -> tuple[Tensor, Tensor]:
    last = model.kernels
    assert isinstance(last, nn.Conv2d) and last.bias is not None
    # Not the parameters themselves: an output has to be made by an operator.
    return last.weight.flatten(1) + 0.0, last.bias + 0.0


class _Hidden(nn.Module):
    def __init__(self, model: Sksn) -> None:
        super().__init__()
        self.model = model

    def forward(self, samples: Tensor, share: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        state = self.model.of_whole_cells(samples[None], share[None])
        return state.hidden[0], *_last_layer(self.model)


class _Sums(nn.Module):
    def __init__(self, model: Sksn) -> None:
        super().__init__()
        self.model = model

    def forward(self, samples: Tensor, share: Tensor) -> tuple[Tensor, ...]:
        classes, mask = self.model.class_sums(samples[None], share[None])
        divided = self.model.config.demodulated
        divisors = (self.model.divisors(samples[None])[0],) if divided else ()
        return classes[0], mask[0], *divisors


class _OfClasses(nn.Module):
    def __init__(self, model: Sksn) -> None:
        super().__init__()
        self.model = model

    def forward(self, classes: Tensor) -> tuple[Tensor, ...]:
        hidden, *likeness = self.model.of_classes(classes[None])
        alike = tuple(part for part in likeness if part is not None)
        if self.model.atrous is not None:
            alike = (*alike, self.model.atrous.centre(hidden), self.model.atrous.table())
        gate = () if self.model.gate is None else (self.model.gates(hidden)[:, 0],)
        return hidden, *_last_layer(self.model), *alike, *gate


def contract(config: ModelConfig, *, whole: bool) -> Contract:
    # Activations that are alive at once, of the finest level, measured with ONNX Runtime's arena.
    wide = 20 if config.layers else 10
    working = wide * config.width + (0 if config.layers else len(CHANNELS[config.features]))
    return Contract(
        kind="whole" if whole else "layered" if config.layers else "hidden",
        features=config.features,
        channels=CHANNELS[config.features],
        kernel=config.kernel,
        unit=config.unit,
        receptiveField=config.context_field,
        classPlanes=config.width + config.guide_planes if config.layers else 0,
        classes=config.classes if config.layers else 0,
        affinity=config.likeness,
        guides=config.guide_count,
        demodulated=int(config.demodulated),
        atrous=config.atrous,
        workingFloats=working,
    )


def export(
    model: Sksn,
    path: Path,
    *,
    whole: bool,
    half: bool = False,
    about: dict[str, Any] | None = None,
) -> None:
    """Writes the network; raises ValueError for one with a pyramid that is not `whole`.

    `about` (seed, steps, data) goes into the metadata beside the contract. Folds the model's
    normalised weights, and with `half` rounds them to 16 bits, which halves the file: they are
    widened again when it is loaded.
    """
    if not whole and isinstance(model.kernels, Pyramid):
        raise ValueError("a network with a pyramid has several last layers; export it whole")
    fold_weight_norm(model)
    if half:
        with torch.no_grad():
            for parameter in model.parameters():
                parameter.copy_(parameter.half().float())
    facts = contract(model.config, whole=whole)
    entries = facts.entries() | {f"{PREFIX}training": json.dumps(about or {})}
    last = ["hidden", "weight", "bias"]
    samples, share = _examples(model.config)
    if whole:
        graph = _traced(_Whole(model), {"samples": samples}, ["image"])
    elif facts.kind == "hidden":
        graph = _traced(_Hidden(model), {"samples": samples, "share": share}, last)
    else:
        names = ["classes", "mask", *(["divisor"] if model.config.demodulated else [])]
        sums = _traced(_Sums(model), {"samples": samples, "share": share}, names)
        if half:
            _narrow(sums)
        entries[f"{PREFIX}samples"] = base64.b64encode(sums.SerializeToString()).decode()
        if encoder := encoder_bytes(model):
            entries[f"{PREFIX}encoder"] = base64.b64encode(encoder).decode()
        with torch.no_grad():
            classes = model.class_sums(samples[None], share[None])[0][0]
        if model.config.likeness:
            last.append("alike")
        if model.scales is not None:
            last.append("scales")
        if model.atrous is not None:
            last += ["centre", "table"]
        if model.gate is not None:
            last.append("gate")
        graph = _traced(_OfClasses(model), {"classes": classes}, last)
    import onnx

    if half:
        _narrow(graph)
    onnx.helper.set_model_props(graph, entries)
    partial = path.with_name(f"{path.name}.partial")
    partial.write_bytes(graph.SerializeToString())
    partial.replace(path)


def encoder_bytes(model: Sksn) -> bytes | None:
    """Weights of what is computed for each path, or None for networks that encode otherwise.

    Little-endian: float32 log_scale, int32 counts of guides that follow the embedding and of
    vertices that are looked at, then twice (the network shared over vertices, or none, and the
    embedding) int32 count of layers and for each int32 inputs and outputs, float32 weights [output,
    input] and bias. Read by hdmbfeat/denoise/pathEncoder.cpp.
    """
    c = model.config
    full = c.valid_bits and c.increments and c.first_non_delta
    if not c.layers or not full or c.first_hit:
        return None
    counts = np.array([c.guide_count, c.vertices], dtype=np.int32)
    parts = [np.float32(c.log_scale).tobytes(), counts.tobytes()]
    shared = model.encoding.vertex_network if c.vertex_encoder else nn.Sequential()
    for network in (shared, model.embeddings[0]):
        layers = [layer for layer in network.modules() if isinstance(layer, nn.Conv2d)]
        parts.append(np.int32(len(layers)).tobytes())
        for layer in layers:
            assert layer.bias is not None
            weights = layer.weight.detach().flatten(1).numpy().astype(np.float32)
            parts.append(np.array(weights.shape[::-1], dtype=np.int32).tobytes())
            parts.append(np.ascontiguousarray(weights).tobytes())
            parts.append(layer.bias.detach().numpy().astype(np.float32).tobytes())
    return b"".join(parts)


def _narrow(graph: Any) -> None:
    """Keeps initialisers as 16-bit floats, with a cast behind each, which loading folds away."""
    import onnx

    casts = []
    for tensor in graph.graph.initializer:
        values = onnx.numpy_helper.to_array(tensor)
        if values.dtype != np.float32 or values.size < 64:
            continue
        name = tensor.name
        tensor.CopyFrom(onnx.numpy_helper.from_array(values.astype(np.float16), f"{name}.half"))
        casts.append(onnx.helper.make_node("Cast", [f"{name}.half"], [name], to=1))
    nodes = [*casts, *graph.graph.node]
    del graph.graph.node[:]
    graph.graph.node.extend(nodes)


def _examples(config: ModelConfig) -> tuple[Tensor, Tensor]:
    count, unit = len(CHANNELS[config.features]), config.unit
    # Larger than what passes reach: of a smaller image tracing would keep no taps from outside it.
    least = 2 * max(config.atrous, default=0) + 1
    height, width = (-(-max(size, least) // unit) * unit for size in (24, 32))
    return torch.rand(3, count, height, width), torch.full((3, 1, height, width), 1 / 3)


def _traced(module: nn.Module, inputs: dict[str, Tensor], outputs: list[str]) -> Any:
    """The module as a checked ONNX graph with free sizes."""
    import onnx

    axes: dict[str, dict[int, str]] = {}
    for name in (
        "samples",
        "share",
        "classes",
        "mask",
        "divisor",
        "hidden",
        "alike",
        "scales",
        "centre",
    ):
        if name in inputs or name in outputs:
            axes[name] = {2: "height", 3: "width"}
    if "gate" in outputs:
        axes["gate"] = {1: "height", 2: "width"}
    for name in (
        "samples",
        "share",
        "mask",
        "divisor",
        *(["hidden"] if "samples" in inputs else []),
    ):
        if name in axes:
            axes[name][0] = "samples"
    if "image" in outputs:
        axes["image"] = {1: "height", 2: "width"}
    buffer = io.BytesIO()
    with warnings.catch_warnings(), torch.inference_mode(False), torch.no_grad():
        warnings.simplefilter("ignore")  # of tracing, about sizes that are meant to be fixed
        torch.onnx.export(
            module.eval(),
            tuple(inputs.values()),
            buffer,
            input_names=list(inputs),
            output_names=outputs,
            dynamic_axes=axes,
            opset_version=OPSET,
            dynamo=False,
        )
    graph = onnx.load_from_string(buffer.getvalue())
    for output, name in zip(graph.graph.output, outputs, strict=True):
        if output.name != name:  # of a constant, whose name tracing does not keep
            graph.graph.node.append(onnx.helper.make_node("Identity", [output.name], [name]))
            output.name = name
    onnx.checker.check_model(graph, full_check=True)
    return graph


def open_session(model: str | bytes, threads: int = 0) -> Any:
    """ONNX Runtime's session of a file or of a graph in memory."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    return onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])


def run(path: Path, samples: NDArray[np.float32], *, threads: int = 0) -> NDArray[np.float32]:
    """The image [3, h, w] of an exported network, by ONNX Runtime and PyTorch's splat.

    The twin in Python of what the renderer does, for samples of equal shares.
    """
    session = open_session(str(path), threads)
    entries = session.get_modelmeta().custom_metadata_map
    kind = entries[f"{PREFIX}kind"]
    if kind == "whole":
        return np.asarray(session.run(None, {"samples": samples})[0])
    count, _, height, width = samples.shape
    share = np.full((count, 1, height, width), 1.0 / count, dtype=np.float32)
    unit = int(entries[f"{PREFIX}unit"]) if int(entries[f"{PREFIX}format"]) > ANY_SIZE_FORMAT else 1
    border = ((0, 0), (0, 0), (0, -height % unit), (0, -width % unit))
    given = {"samples": np.pad(samples, border), "share": np.pad(share, border)}
    area = (height, width)
    if kind == "layered":
        return _run_layered(session, entries, given, area, threads)
    hidden, *last = session.run(None, given)
    units = _logits(hidden[..., :height, :width], *last)
    values = torch.from_numpy(np.ascontiguousarray(samples[:, :3]))
    return np.asarray(splat(units[None], values[None])[0].numpy())


def _logits(hidden: Any, weight: Any, bias: Any) -> Tensor:
    logits = np.einsum("tc,uchw->uthw", weight, hidden) + bias[None, :, None, None]
    return torch.from_numpy(logits.astype(np.float32))


def _run_layered(
    session: Any,
    entries: dict[str, str],
    given: dict[str, Any],
    area: tuple[int, int],
    threads: int,
) -> NDArray[np.float32]:
    sums = open_session(base64.b64decode(entries[f"{PREFIX}samples"]), threads)
    classes, mask, *divisor = (torch.from_numpy(a) for a in sums.run(None, given))
    names = [output.name for output in session.get_outputs()]
    found = dict(zip(names, session.run(None, {"classes": classes.numpy()}), strict=True))
    height, width = area
    for name in {"hidden", "alike", "scales", "centre", "gate"} & set(found):
        found[name] = np.ascontiguousarray(found[name][..., :height, :width])
    mask, *divisor = (part[..., :height, :width] for part in (mask, *divisor))
    logits = _logits(found["hidden"], found["weight"], found["bias"])
    likeness = None
    if "alike" in found:
        kernel = round(len(found["bias"]) ** 0.5)
        scales = torch.from_numpy(found["scales"]) if "scales" in found else None
        likeness = Likeness(torch.from_numpy(found["alike"]), scales)
        logits = logits - distances(likeness.features, kernel, scales)
    weight = mask * torch.from_numpy(given["share"])[..., :height, :width]
    samples = torch.from_numpy(given["samples"])[:, :3, :height, :width]
    lights = [samples, *(samples / by for by in divisor)]
    light = torch.einsum("schw,skhw->ckhw", weight, torch.cat(lights, dim=1))
    parts = splat(logits[:, None], light[:, None].contiguous())
    if likeness is not None and "centre" in found:
        dilations = tuple(int(n) for n in entries[f"{PREFIX}atrous"].split(","))
        centre, table = (torch.from_numpy(found[name]) for name in ("centre", "table"))
        parts = filtered(parts, likeness, centre, table, dilations)
    parts = parts[None]
    if divisor:
        gate = torch.from_numpy(found["gate"])[None, :, None]
        parts = modulated(parts, gate, mean_albedo(divisor[0][None], weight[None]))
    return np.asarray(parts[0].sum(dim=0).numpy())


def difference(model: Sksn, path: Path, samples: Tensor) -> float:
    """Largest difference between PyTorch's image and ONNX Runtime's, relative where over 1."""
    image = torch.from_numpy(run(path, samples.numpy()))
    with torch.inference_mode():
        expected = model(samples[None])[0]
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
    parser.add_argument("--half", action="store_true", help="round weights to 16 bits")
    options = parser.parse_args(arguments)
    try:
        trained = load_model(options.model)
        export(
            trained.model,
            options.output,
            whole=options.whole,
            half=options.half,
            about=_about(trained),
        )
    except (CheckpointError, ValueError) as error:
        sys.stderr.write(f"training.export: {error}\n")
        return 1
    x = example(trained.config.model.features, 5, 45, 70)
    found = difference(trained.model, options.output, x)
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
