"""The network: splatting, feature sets, invariances, export."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is only in ./run training's environment")

from training.batches import turned  # noqa: E402
from training.dataset import layout  # noqa: E402
from training.model import atrous, encoding, inputs, losses  # noqa: E402
from training.model.config import GUIDE_GROUPS, ConfigError, ModelConfig  # noqa: E402
from training.model.sksn import Sksn, fold_weight_norm, guide_means  # noqa: E402
from training.model.splat import distances, plain_distances, plain_splat, splat  # noqa: E402

SMALL: dict[str, Any] = {
    "width": 8, "unet": (8, 12), "steps": 1, "convs": 1, "kernel": 5, "weight_norm": False,
    "log_scale": 2.0,
}  # fmt: skip
EXTENDED: dict[str, Any] = SMALL | {
    "features": "extended", "valid_bits": True, "increments": True, "first_non_delta": True,
}  # fmt: skip
VARIANTS: dict[str, dict[str, Any]] = {
    "gbuffer": SMALL | {"features": "gbuffer"},
    "paths": SMALL | {"features": "paths"},
    "two steps": SMALL | {"steps": 2, "weight_norm": True},
    "extended": EXTENDED,
    "encoder": EXTENDED | {"vertex_encoder": 8},
    "layers": EXTENDED | {"layers": True},
    "layers, encoder": EXTENDED | {"layers": True, "vertex_encoder": 8},
    "layers, flat": EXTENDED | {"layers": True, "increments": False},
    "affinity": EXTENDED | {"layers": True, "vertex_encoder": 8, "affinity": 3},
    "demodulated": EXTENDED
    | {"layers": True, "vertex_encoder": 8, "affinity": 3, "demodulated": True},
    "guides": EXTENDED | {"layers": True, "vertex_encoder": 8, "guides": True},
    "two vertices": EXTENDED | {"layers": True, "vertices": 2},
    "encoder of two": EXTENDED | {"layers": True, "vertex_encoder": 8, "vertices": 2},
    "atrous": EXTENDED
    | {"layers": True, "vertex_encoder": 8, "affinity": 3, "guides": True, "atrous": (1, 3)}
    | {"guide_roughness": True},
    "atrous, demodulated": EXTENDED
    | {"layers": True, "increments": False, "affinity": 2, "atrous": (2,), "demodulated": True},
    "one class": EXTENDED
    | {"layers": True, "vertex_encoder": 8, "classes": 1, "affinity": 3, "guides": True}
    | {"atrous": (2,)},
    "as best": EXTENDED
    | {"layers": True, "vertex_encoder": 8, "classes": 1, "affinity": 3, "guides": True}
    | {"atrous": (1, 3), "guide_roughness": True, "demodulated": True},
    "one class, demodulated": EXTENDED | {"layers": True, "classes": 1, "demodulated": True},
    "first hit": EXTENDED
    | {"layers": True, "vertex_encoder": 8, "classes": 1, "guides": True, "first_hit": True},
    "shrunk paths": SMALL | {"features": "paths", "shrink": 2},
    "shrunk": EXTENDED
    | {"layers": True, "vertices": 1, "classes": 1, "guides": True, "atrous": (2,), "shrink": 2}
    | {"guide_roughness": True},
    "deep": EXTENDED
    | {"layers": True, "unet": (8, 8, 8, 8), "shrink": 2, "atrous": (1,)}
    | {"affinity": 2},
    "pyramid": EXTENDED | {"pyramid": 3},
    "all": EXTENDED | {"vertex_encoder": 8, "layers": True, "pyramid": 3},
}


def plausible(features: str, n: int = 1, samples: int = 3, h: int = 13, w: int = 10) -> Any:
    """An input of the right kind: bits are 0 or 1, of the events' bits a plausible choice."""
    rng = torch.Generator().manual_seed(4)
    names = inputs.CHANNELS[features]
    x = torch.rand((n, samples, len(names), h, w), generator=rng)
    for i, name in enumerate(names):
        kind = name.partition(":")[0]
        if kind in ("valid", *inputs.EVENT_BITS):
            x[:, :, i] = (x[:, :, i] < 0.5).float()
        if kind == "transmit":  # a path reflects or transmits
            x[:, :, i] *= 1 - x[:, :, i - 1]
    return x


GUIDES = sum(GUIDE_GROUPS)


@pytest.mark.parametrize("groups", [0, 3, 4])
def test_distances_are_from_where_a_tap_goes(groups: int) -> None:
    """By the definition, in both forms, with the gradient of differences."""
    torch.manual_seed(2)
    k, r, height, width = 5, 2, 5, 4
    count = 2 + sum(GUIDE_GROUPS[:groups])
    f = torch.randn(2, count, height, width, dtype=torch.float64, requires_grad=True)
    s = torch.randn(2, groups, height, width, dtype=torch.float64, requires_grad=True)
    scales = s if groups else None
    found = distances(f, k, scales)
    for tap, y, x in np.ndindex(k * k, height, width):
        row, column = y + r - tap // k, x + r - tap % k
        expected = torch.zeros(2, dtype=torch.float64)
        if 0 <= row < height and 0 <= column < width:
            square = (f[:, :, y, x] - f[:, :, row, column]) ** 2
            expected = square[:, :2].sum(dim=1)
            for group, part in zip(range(groups), ((2, 5), (5, 8), (8, 9), (9, 10)), strict=False):
                apart = square[:, slice(*part)].sum(dim=1)
                expected = expected + s[:, group, row, column] ** 2 * apart
        torch.testing.assert_close(found[:, tap, y, x], expected)
    torch.testing.assert_close(plain_distances(f, k, scales), found)
    given = (f, s) if groups else (f,)
    assert torch.autograd.gradcheck(lambda f, *s: distances(f, k, *s), given)


def slow_splat(logits: Any, radiance: Any) -> Any:
    """The definition, one tap after the other."""
    n, samples, taps, h, w = logits.shape
    k = round(taps**0.5)
    r = k // 2
    image, total = np.zeros((n, 3, h, w)), np.zeros((n, 1, h, w))
    for b, s, j, i, y, x in np.ndindex(n, samples, k, k, h, w):
        row, column = y + r - j, x + r - i
        if 0 <= row < h and 0 <= column < w:
            weight = np.exp(float(logits[b, s, j * k + i, y, x]))
            image[b, :, row, column] += weight * radiance[b, s, :, y, x].numpy()
            total[b, :, row, column] += weight
    return torch.from_numpy(image / total)


def test_splat_is_its_definition_and_its_twin() -> None:
    torch.manual_seed(0)
    logits = 2 * torch.randn(2, 3, 9, 6, 5, dtype=torch.float64)
    radiance = torch.rand(2, 3, 3, 6, 5, dtype=torch.float64)
    expected = slow_splat(logits, radiance)
    torch.testing.assert_close(splat(logits, radiance), expected)
    torch.testing.assert_close(plain_splat(logits, radiance), expected)


def test_splat_has_the_gradients_of_its_definition() -> None:
    torch.manual_seed(1)
    logits = torch.randn(1, 2, 9, 5, 4, dtype=torch.float64, requires_grad=True)
    radiance = torch.rand(1, 2, 3, 5, 4, dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(splat, (logits, radiance))


def test_splat_survives_any_logits() -> None:
    """Neither exp() of large ones overflows, nor do later larger ones lose what came before."""
    torch.manual_seed(2)
    for scale in (1.0, 100.0, 3000.0):
        logits = scale * torch.randn(1, 4, 25, 8, 8)
        radiance = torch.rand(1, 4, 3, 8, 8)
        image = splat(logits, radiance)
        assert torch.isfinite(image).all()
        assert image.min() >= 0 and image.max() <= 1.0 + 1e-6
        exact = plain_splat(logits.double(), radiance.double()).float()
        torch.testing.assert_close(image, exact, atol=1e-5, rtol=1e-5)


def test_passes_after_the_splat_are_their_definition() -> None:
    """Pixel by pixel and tap by tap; what lies outside the image counts nothing."""
    torch.manual_seed(3)
    height, width, dilation = 7, 9, 3
    image = torch.rand(2, 3, height, width)
    features = torch.randn(2, 2 + GUIDES, height, width)
    scales = 0.5 * torch.randn(2, 4, height, width)
    centre, table = torch.randn(2, 1, height, width), torch.rand(1, atrous.TAPS + 1)
    likeness = atrous.Likeness(features, scales)
    found = atrous.filtered(image, likeness, centre, table, (dilation,))
    for n, y, x in np.ndindex(2, height, width):
        total, weights = torch.zeros(3), 0.0
        for tap in range(atrous.TAPS):
            row, column = y + dilation * (tap // 5 - 2), x + dilation * (tap % 5 - 2)
            if 0 <= row < height and 0 <= column < width:
                square = (features[n, :, y, x] - features[n, :, row, column]) ** 2
                albedo, normal, depth, roughness = (scales[n, g, y, x] ** 2 for g in range(4))
                apart = square[:2].sum() + albedo * square[2:5].sum()
                apart = apart + normal * square[5:8].sum() + depth * square[8]
                apart = apart + roughness * square[9]
                own = centre[n, 0, y, x] if tap == atrous.MIDDLE else -table[0, -1] * apart
                weight = torch.exp(table[0, tap] + own)
                total, weights = total + weight * image[n, :, row, column], weights + weight
        torch.testing.assert_close(found[n, :, y, x], total / weights)


def test_passes_have_the_gradients_of_their_plain_twin() -> None:
    torch.manual_seed(4)
    likeness = atrous.Likeness(
        torch.randn(2, 2 + GUIDES, 6, 7, dtype=torch.float64, requires_grad=True),
        torch.randn(2, 4, 6, 7, dtype=torch.float64, requires_grad=True),
    )
    image = torch.rand(2, 3, 6, 7, dtype=torch.float64, requires_grad=True)
    centre = torch.randn(2, 2, 6, 7, dtype=torch.float64, requires_grad=True)
    table = torch.rand(2, atrous.TAPS + 1, dtype=torch.float64, requires_grad=True)
    given = (image, *likeness, centre, table)
    weights = torch.rand(2, 3, 6, 7, dtype=torch.float64)
    found = []
    for plain in (False, True):
        result = atrous.filtered(image, likeness, centre, table, (1, 3), plain=plain)
        found.append((result, *torch.autograd.grad((weights * result).sum(), given)))
    for quick, twin in zip(*found, strict=True):
        torch.testing.assert_close(quick, twin)


def test_guides_are_means_and_filled_where_a_class_is_missing() -> None:
    sums = torch.zeros(1, GUIDES + 1, 5, 5)
    sums[0, :GUIDES, 2, 2] = 0.25 * torch.arange(GUIDES)
    sums[0, GUIDES, 2, 2] = 0.25
    found = guide_means(sums, 0, GUIDES)
    expected = torch.arange(GUIDES, dtype=torch.float32)[:, None, None].expand(GUIDES, 5, 5)
    torch.testing.assert_close(found[0], expected, rtol=0.01, atol=0.0)


def test_guides_of_several_ways_are_those_of_the_commonest() -> None:
    """Of a pane that one path in eight is reflected by, hardly anything of what it reflects."""
    rows = torch.zeros(1, 3 * (GUIDES + 1), 3, 3)
    rows[0, :GUIDES] = 0.875 * 1.0
    rows[0, GUIDES] = 0.875
    rows[0, GUIDES + 1 : 2 * GUIDES + 1] = 0.125 * 5.0
    rows[0, 2 * GUIDES + 1] = 0.125
    found = guide_means(rows, 0, GUIDES)
    torch.testing.assert_close(found, torch.ones_like(found), rtol=0.0, atol=0.02)


def test_ways_and_guides_follow_the_path() -> None:
    """Of paths of four vertices: straight, mirror, glass and then a mirror, mirrors alone."""
    names = inputs.CHANNELS["extended"]
    x = torch.zeros(4, len(names), 1, 1)
    events = {
        0: ["transmit", "transmit", "", ""],
        1: ["reflect", "", "", ""],
        2: ["transmit", "reflect", "transmit", ""],
        3: ["transmit", "reflect", "transmit", "transmit"],
    }
    for path, done in events.items():
        for k, event in enumerate(done):
            x[path, names.index(f"valid:{k}")] = 1
            x[path, names.index(f"mbfeat:albedo:{k}.R")] = 0.1 * (k + 1)
            x[path, names.index(f"mbfeat:distance:{k}.Z")] = 1.0
            x[path, names.index(f"mbfeat:roughness:{k}.Y")] = 0.2 * (k + 1)
            if event:
                x[path, names.index(f"specular:{k}")] = 1
                x[path, names.index(f"{event}:{k}")] = 1
            else:  # what spreads light reflects it, too
                x[path, names.index(f"reflect:{k}")] = 1
                x[path, names.index(f"diffuse:{k}")] = 1
    v = encoding.Vertices(x)
    assert encoding.ways(v)[..., 0, 0].argmax(dim=1).tolist() == [0, 1, 2, 2]
    assert torch.equal(encoding.ways(v).sum(dim=1), torch.ones(4, 1, 1))
    found = encoding.guides(v)[..., 0, 0]
    torch.testing.assert_close(found[:, 0], torch.tensor([0.3, 0.2, 0.4, 0.4]))
    depths = encoding.DEPTH_SCALE * torch.log1p(torch.tensor([3.0, 2.0, 4.0, 4.0]))
    torch.testing.assert_close(found[:, 6], depths)
    torch.testing.assert_close(found[:, 7], torch.tensor([0.6, 0.4, 0.8, 0.8]))


def test_published_size_and_parameters() -> None:
    """34.8 million with the published 96 inputs; ours has 60."""
    model = Sksn(ModelConfig())
    published = model.parameter_count + (96 - 60) * 128
    assert abs(published / 1e6 - 34.80) < 0.02


def test_feature_sets_have_the_same_parameters() -> None:
    sets = [dataclasses.replace(ModelConfig(**SMALL), features=f) for f in ("gbuffer", "paths")]
    shapes = [[tuple(p.shape) for p in Sksn(config).parameters()] for config in sets]
    assert shapes[0] == shapes[1]


def test_gbuffer_equals_paths_without_later_vertices() -> None:
    torch.manual_seed(3)
    paths = Sksn(ModelConfig(**VARIANTS["paths"]))
    gbuffer = Sksn(ModelConfig(**VARIANTS["gbuffer"]))
    gbuffer.load_state_dict(paths.state_dict())
    x = plausible("paths")
    first = len(inputs.CHANNELS["gbuffer"])
    x[:, :, first:] = 0.0
    assert torch.equal(paths(x), gbuffer(x[:, :, :first]))
    assert inputs.CHANNELS["paths"][:first] == inputs.CHANNELS["gbuffer"]


@pytest.mark.parametrize("weight_norm", [False, True])
def test_both_feature_sets_may_begin_as_the_same_network(weight_norm: bool) -> None:
    networks = []
    for name in ("paths", "gbuffer"):
        torch.manual_seed(7)
        begun = {"weight_norm": weight_norm, "first_hit_start": True}
        networks.append(Sksn(ModelConfig(**VARIANTS[name] | begun)))
    paths, gbuffer = networks
    x = plausible("paths")
    first = len(inputs.CHANNELS["gbuffer"])
    before = paths(x)
    assert torch.equal(before, gbuffer(x[:, :, :first]))
    before.sum().backward()
    with torch.no_grad():
        for parameter in paths.parameters():
            if parameter.grad is not None:
                parameter -= 1e-3 * parameter.grad
    changed = x.clone()
    changed[:, :, first:] *= 0.5
    assert not torch.equal(paths(changed), paths(x))  # what they are worth is learned


@pytest.mark.parametrize("encoder", [0, 6])
def test_a_network_that_begins_with_the_first_hit_knows_no_later_vertex(encoder: int) -> None:
    begun = {"features": "extended", "vertex_encoder": encoder, "first_hit_start": True}
    model = Sksn(ModelConfig(**SMALL | begun))
    x = plausible("extended")
    names = inputs.CHANNELS["extended"]
    later = [i for i, name in enumerate(names) if ":direct:" in name and ":0." not in name]
    changed = x.clone()
    changed[:, :, later] *= 3.0
    assert torch.equal(model(changed), model(x))
    other = Sksn(ModelConfig(**SMALL | begun | {"first_hit_start": False}))
    assert not torch.equal(other(changed), other(x))


def test_first_hit_alone_sees_no_later_vertex_and_no_event() -> None:
    torch.manual_seed(3)
    config = ModelConfig(**VARIANTS["first hit"])
    blind, seeing = Sksn(config), Sksn(dataclasses.replace(config, first_hit=False))
    seeing.load_state_dict(blind.state_dict())
    assert blind.parameter_count == seeing.parameter_count
    x = plausible("extended")
    kept = inputs.first_hit_channels("extended")
    names = [inputs.CHANNELS["extended"][i] for i in kept]
    assert names[:6] == list(inputs.COMMON)
    assert [n.partition(".")[0] for n in names[6::3]][:3] == [
        f"mbfeat:{kind}:0" for kind in ("albedo", "normal", "direct")
    ]
    other = x.clone()
    hidden = [i for i in range(x.shape[2]) if i not in kept]
    other[:, :, hidden] = 1.0 - other[:, :, hidden]
    assert torch.equal(blind(x), blind(other))
    assert not torch.equal(seeing(x), seeing(other))
    x[:, :, hidden] = 0.0
    assert torch.equal(blind(x), seeing(x))


@pytest.mark.parametrize("name", VARIANTS)
def test_every_variant_takes_any_size_and_number_of_samples(name: str) -> None:
    torch.manual_seed(5)
    config = ModelConfig(**VARIANTS[name])
    model = Sksn(config)
    for samples, h, w in ((1, 8, 8), (3, 13, 10), (8, 9, 17)):
        x = plausible(config.features, 2, samples, h, w)
        image = model(x)
        assert image.shape == (2, 3, h, w) and torch.isfinite(image).all()
        # Weighted means of radiance are within its range, and so is that of each layer. Of divided
        # radiance they are within the range of that.
        most = (config.classes if config.layers else 1) * (1 + 1e-4)
        if config.demodulated:
            most = 1 / encoding.LEAST_ALBEDO
        assert image.min() >= 0 and image.max() <= most
    image.sum().backward()
    assert all(p.grad is not None for p in model.parameters())


def test_demodulated_light_leaves_textures_as_they_are() -> None:
    """Evenly lit paths of any albedo: what arrives is the pixel's own mean, from any kernel."""
    torch.manual_seed(7)
    model = Sksn(ModelConfig(**VARIANTS["demodulated"]))
    assert model.gate is not None and model.gate.bias is not None
    with torch.no_grad():
        model.gate.weight.zero_()
        model.gate.bias.fill_(40.0)
    x = plausible("extended", samples=4)
    names = inputs.CHANNELS["extended"]
    events = [i for i, name in enumerate(names) if name.partition(":")[0] in inputs.EVENT_BITS]
    x[:, :, events] = 0.0
    x[:, :, names.index("valid:0")] = 1.0
    first = names.index("mbfeat:throughput:0.R")
    x[:, :, first : first + 3] = 1.0
    albedo = x[:, :, names.index("mbfeat:albedo:0.R") :][:, :, :3]
    x[:, :, :3] = 0.7 * albedo.clamp(min=encoding.LEAST_ALBEDO)
    torch.testing.assert_close(model(x), x[:, :, :3].mean(dim=1))


@pytest.mark.parametrize("name", VARIANTS)
def test_order_of_samples_does_not_matter(name: str) -> None:
    torch.manual_seed(6)
    config = ModelConfig(**VARIANTS[name])
    model = Sksn(config).double()
    x = plausible(config.features, samples=5).double()
    torch.testing.assert_close(model(x), model(x[:, torch.randperm(5)]))


@pytest.mark.parametrize("name", ["paths", "two steps", "all", "atrous", "shrunk"])
def test_pixels_beyond_the_receptive_field_change_nothing(name: str) -> None:
    torch.manual_seed(7)
    config = ModelConfig(**VARIANTS[name])
    model = Sksn(config).double()
    reach = -(-config.receptive_field // config.unit) * config.unit
    x = plausible(config.features, samples=2, h=8, w=2 * reach + 24).double()
    other = x.clone()
    other[..., :8] = plausible(config.features, samples=2, h=8, w=8).double()[..., :8] * 0.5
    difference = (model(x) - model(other)).abs().amax(dim=(0, 1, 2))
    assert difference[:8].max() > 0
    assert difference[8 + reach :].max() == 0


def test_weight_norm_folds_into_plain_weights() -> None:
    torch.manual_seed(8)
    model = Sksn(ModelConfig(**VARIANTS["two steps"])).double()
    x = plausible("paths").double()
    before = model(x)
    count = model.parameter_count
    fold_weight_norm(model)
    assert model.parameter_count < count
    torch.testing.assert_close(model(x), before)


def test_input_has_the_promised_channels() -> None:
    rng = np.random.default_rng(9)
    half = rng.random((2, len(layout.HALF), 4, 5)).astype(np.float16)
    half[0, 0, 0, 0] = np.inf
    as_bytes = np.zeros((2, len(layout.BYTES), 4, 5), dtype=np.uint8)
    as_bytes[:, 0] = 0b000111
    as_bytes[:, 3] = layout.TRANSMIT | layout.SPECULAR  # vertex 2
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], dtype=np.float32)
    for features, names in inputs.CHANNELS.items():
        x = inputs.network_input(half, as_bytes, turn, features)
        assert x.shape == (2, len(names), 4, 5) and torch.isfinite(x).all()
        place = {name: i for i, name in enumerate(names)}
        stored = half.astype(np.float32)
        np.testing.assert_array_equal(x[1, place["Z"]].numpy(), stored[1, layout.HALF_INDEX["Z"]])
        world_z = stored[1, layout.HALF_INDEX["mbfeat:normal:0.Z"]]
        np.testing.assert_array_equal(x[1, place["mbfeat:normal:0.X"]].numpy(), world_z)
        if features == "extended":
            assert [float(x[0, place[f"valid:{k}"], 1, 1]) for k in range(6)] == [1, 1, 1, 0, 0, 0]
            found = [float(x[0, place[f"{bit}:2"], 1, 1]) for bit in inputs.EVENT_BITS]
            assert found == [1, 0, 1, 0]  # specular, reflect, transmit, diffuse


def test_first_non_delta_looks_through_mirrors() -> None:
    names = inputs.CHANNELS["extended"]
    x = torch.zeros(1, len(names), 1, 1)

    def put(name: str, value: float) -> None:
        x[0, names.index(name)] = value

    for k in (0, 1, 2):
        put(f"valid:{k}", 1)
        put(f"mbfeat:distance:{k}.Z", 1.0 + k)
        put(f"mbfeat:albedo:{k}.R", 0.1 * (k + 1))
        put(f"mbfeat:throughput:{k}.G", 0.9**k)
    put("specular:0", 1)
    put("reflect:0", 1)
    put("specular:1", 1)
    found = encoding.first_non_delta(encoding.Vertices(x))[0, :, 0, 0]
    assert float(found[0]) == pytest.approx(0.3)  # vertex 2
    depth = encoding.DEPTH_SCALE * np.log1p(1.0 + 2.0 + 3.0)
    assert float(found[6]) == pytest.approx(depth)
    assert float(found[8]) == pytest.approx(0.81)
    assert float(found[10]) == 1.0
    classes = encoding.path_class(encoding.Vertices(x))[0, :, 0, 0]
    assert classes.tolist() == [0, 1, 0]
    x[0, names.index("specular:2")] = 1  # nothing but mirrors
    assert encoding.first_non_delta(encoding.Vertices(x)).abs().max() == 0


def test_turning_an_image_turns_what_points_in_it() -> None:
    """Twice the same is nothing, and a slope in the image keeps its relation to its normal."""
    x = plausible("paths", samples=2, h=6, w=6)[0]
    reference = torch.rand(3, 6, 6)
    for flags in ((True, False, False), (False, True, False), (False, False, True)):
        once = turned(x, reference, "paths", *flags)
        twice = turned(*once, "paths", *flags)
        torch.testing.assert_close(twice[0], x)
        torch.testing.assert_close(twice[1], reference)
    first = inputs.CHANNELS["paths"].index("mbfeat:normal:0.X")
    ramp = x.clone()
    ramp[:, 0] = torch.arange(6.0)  # brighter to the right
    ramp[:, first : first + 3] = torch.tensor([1.0, 0.0, 0.0])[:, None, None]
    out, _ = turned(ramp, reference, "paths", False, False, True)
    # Brighter downwards now, and the normal, which pointed there, points down: -y.
    assert float(out[0, 0, 5, 0]) > float(out[0, 0, 0, 0])
    assert out[0, first : first + 3, 0, 0].tolist() == [0.0, -1.0, 0.0]


def test_losses_of_constants() -> None:
    image, reference = torch.full((1, 3, 4, 4), 1.0), torch.full((1, 3, 4, 4), 0.5)
    a, b = 1 / 2, 0.5 / 1.5
    expected = 0.5 * (a - b) ** 2 / (b**2 + 1e-2)
    assert float(losses.tonemapped_relmse(image, reference, 1e-2)) == pytest.approx(expected)
    assert float(losses.smape(image, reference, 1e-2)) == pytest.approx(0.5 / 1.51)
    assert float(losses.log_l1(image, reference)) == pytest.approx(np.log(2 / 1.5), rel=1e-5)
    pairs = torch.tensor([[[0, 1], [5, 1]]])
    reference[:, :, 1, 1] = 3.0  # pixel 5
    embedding = torch.zeros(1, 2, 4, 4)
    embedding[:, 0, 1, 1] = 2.0
    c = [((v / (1 + v)) + 1e-6) ** (1 / 2.2) for v in (0.5, 3.0)]
    distance = 0.5 * 3 * (c[0] - c[1]) ** 2
    expected = 0.5 * (2.0 - distance) ** 2 / 2
    assert float(losses.manifold(embedding, reference, pairs)) == pytest.approx(expected, rel=1e-4)


def test_wrong_configurations_and_inputs_are_named() -> None:
    with pytest.raises(ConfigError, match="odd"):
        ModelConfig(kernel=4)
    with pytest.raises(ConfigError, match="layers needs the feature set extended"):
        ModelConfig(layers=True)
    model = Sksn(ModelConfig(**SMALL))
    with pytest.raises(ValueError, match="60"):
        model(torch.zeros(1, 2, 15, 8, 8))
