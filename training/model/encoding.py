"""What the network makes of a path sample's channels before its first layer.

Part of the exported graph, so that the renderer hands over what it has recorded.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from training.dataset.layout import EXTENDED, FEATURES, VERTICES
from training.model.blocks import pointwise
from training.model.config import ModelConfig
from training.model.inputs import CHANNELS, COMMON, EVENT_BITS, PER_VERTEX

COUNT = len(VERTICES)
FLAT = len(COMMON) + len(FEATURES)
DEPTH_SCALE = 0.3
EXTENDED_PER_VERTEX = len(EXTENDED) // COUNT  # roughness, distance, throughput
LEAST_ALBEDO, MOST_ALBEDO = 0.05, 4.0
FOUND = 10  # of first_non_delta(): whether there is one
PLACED = 7  # of first_non_delta(): albedo, normal and depth come first


class Vertices:
    """Views of an ``extended`` input [n, channels, h, w] by vertex; lists of COUNT tensors."""

    def __init__(self, x: Tensor) -> None:
        first = len(COMMON)
        rows = [x[:, first + PER_VERTEX * k : first + PER_VERTEX * (k + 1)] for k in VERTICES]
        self.albedo = [row[:, 0:3] for row in rows]
        self.normal = [row[:, 3:6] for row in rows]
        self.direct = [row[:, 6:9] for row in rows]
        self.valid = [x[:, FLAT + k : FLAT + k + 1] for k in VERTICES]
        first, n = FLAT + COUNT, EXTENDED_PER_VERTEX
        rows = [x[:, first + n * k : first + n * (k + 1)] for k in VERTICES]
        self.roughness = [row[:, 0:1] for row in rows]
        self.distance = [row[:, 1:2] for row in rows]
        self.throughput = [row[:, 2:5] for row in rows]
        first, n = first + n * COUNT, len(EVENT_BITS)
        self.events = [x[:, first + n * k : first + n * (k + 1)] for k in VERTICES]


def log_scaled(x: Tensor, scale: float) -> Tensor:
    """log(1 + x) / scale, negative values as 0 (Gharbi et al., section 4.3)."""
    return torch.log1p(torch.clamp(x, min=0.0)) / scale


def path_class(v: Vertices) -> Tensor:
    """One of three classes [n, 3, h, w], 1 where a sample is in it.

    By what its first vertex did: scattered diffusely or ended, reflected, transmitted.
    """
    reflect, transmitted, diffuse = (v.events[0][:, i : i + 1] for i in (1, 2, 3))
    reflected = reflect * (1.0 - diffuse)
    return torch.cat([1.0 - transmitted - reflected, reflected, transmitted], dim=1)


def first_non_delta(v: Vertices) -> Tensor:
    """Albedo, normal, depth, throughput, whether there is one, and roughness [n, 12, h, w].

    Of the first vertex that is neither mirror nor clear glass.
    """
    before = torch.ones_like(v.valid[0])
    length = torch.zeros_like(v.valid[0])
    parts: list[Tensor] = []
    for k in VERTICES:
        here = before * v.valid[k] * (1.0 - v.events[k][:, 0:1])
        length = length + v.distance[k]
        row = torch.cat(
            [
                v.albedo[k],
                v.normal[k],
                DEPTH_SCALE * torch.log1p(length),
                torch.clamp(v.throughput[k], 0.0, 4.0),
                torch.ones_like(length),
                v.roughness[k],
            ],
            dim=1,
        )
        parts.append(here * row)
        before = before * (1.0 - here)
    return torch.stack(parts).sum(dim=0)


def found_guides(found: Tensor) -> Tensor:
    """Albedo, normal, depth and roughness [n, 8, h, w] of what first_non_delta() found."""
    return torch.cat([found[:, :PLACED], found[:, FOUND + 1 :]], dim=1)


def guides(v: Vertices) -> Tensor:
    """The same of a path [n, 8, h, w]; of its last recorded vertex where there is no such one."""
    found = first_non_delta(v)
    placed = found_guides(found)
    last = torch.zeros_like(placed)
    length = torch.zeros_like(v.valid[0])
    for k in VERTICES:
        length = length + v.distance[k]
        here = v.valid[k] * (1.0 - v.valid[k + 1]) if k + 1 < COUNT else v.valid[k]
        depth = DEPTH_SCALE * torch.log1p(length)
        row = torch.cat([v.albedo[k], v.normal[k], depth, v.roughness[k]], dim=1)
        last = last + here * row
    return torch.where(found[:, FOUND : FOUND + 1] > 0.5, placed, last)


def ways(v: Vertices) -> Tensor:
    """By which of three ways [n, 3, h, w] a sample came to that vertex, 1 where it is it.

    Past no mirror, by a reflection at its first vertex, by one later on.
    """
    on = torch.ones_like(v.valid[0])
    first, later = torch.zeros_like(on), torch.zeros_like(on)
    for k in VERTICES:
        on = on * v.valid[k] * v.events[k][:, 0:1]
        reflects = on * v.events[k][:, 1:2]
        first, later = (reflects, later) if k == 0 else (first, torch.maximum(later, reflects))
    later = later * (1.0 - first)
    return torch.cat([1.0 - first - later, first, later], dim=1)


def demodulator(v: Vertices) -> Tensor:
    """Albedo [n, 3, h, w] that a path's radiance is divided by: 1 where there is none.

    That of the first vertex that is neither mirror nor clear glass, tinted by those before it. Not
    too small, or light that black things scatter at their surfaces would become too large.
    """
    found = first_non_delta(v)
    albedo = found[:, 0:3] * found[:, 7:10]
    albedo = torch.clamp(albedo, LEAST_ALBEDO, MOST_ALBEDO)
    return torch.where(found[:, FOUND : FOUND + 1] > 0.5, albedo, torch.ones_like(albedo))


class Encoding(nn.Module):
    """From a feature set's channels [n, channels, h, w] to features [n, `width`, h, w].

    ``gbuffer`` and ``paths`` give features of the same layout, those of vertices that first-hit
    features lack being zero, so that networks of both have the same parameters.
    """

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        self.width = FLAT
        self.first_hit = len(COMMON) + PER_VERTEX  # features before those of later vertices
        if config.features == "extended":
            self.width = len(COMMON) + (FOUND + 1 if config.first_non_delta else 0)
            row = PER_VERTEX + (
                len(EVENT_BITS) + EXTENDED_PER_VERTEX + 4 if config.valid_bits else 0
            )
            if config.vertex_encoder:
                wide = config.vertex_encoder
                self.vertex_network = pointwise(
                    row + COUNT, wide, wide, 2, weight_norm=config.weight_norm
                )
                later = wide  # vertex 0 also keeps a place of its own
            else:
                later = (config.vertices - 1) * row
            self.first_hit = self.width + row
            self.width = self.first_hit + later

    def forward(self, x: Tensor) -> Tensor:
        scale = self.config.log_scale
        common = torch.cat(
            [log_scaled(x[:, 0:3], scale), x[:, 3:5], DEPTH_SCALE * log_scaled(x[:, 5:6], 1.0)],
            dim=1,
        )
        if self.config.features != "extended":
            parts = [common]
            for k in range((x.shape[1] - len(COMMON)) // PER_VERTEX):
                first = len(COMMON) + PER_VERTEX * k
                parts.append(x[:, first : first + 6])
                parts.append(log_scaled(x[:, first + 6 : first + PER_VERTEX], scale))
            features = torch.cat(parts, dim=1)
            missing = FLAT - len(CHANNELS[self.config.features])
            if missing:
                features = nn.functional.pad(features, (0, 0, 0, 0, 0, missing))
            return features
        v = Vertices(x)
        rows = [self._vertex(v, k) for k in range(self.config.vertices)]
        parts = [common]
        if self.config.first_non_delta:
            parts.append(first_non_delta(v)[:, : FOUND + 1])
        if self.config.vertex_encoder:
            parts += [rows[0], self._shared(v, rows)]
        else:
            parts += rows
        return torch.cat(parts, dim=1)

    def _vertex(self, v: Vertices, k: int) -> Tensor:
        scale = self.config.log_scale
        light = v.throughput[k] * v.direct[k] if self.config.increments else v.direct[k]
        parts = [v.albedo[k], v.normal[k], log_scaled(light, scale)]
        if self.config.valid_bits:
            parts += [
                v.valid[k],
                v.events[k],
                v.roughness[k],
                DEPTH_SCALE * log_scaled(v.distance[k], 1.0),
                # Later vertices count as much as what they can add to the pixel.
                v.throughput[k] / (v.throughput[k] + 0.1),
                log_scaled(v.direct[k], scale),
            ]
        return torch.cat(parts, dim=1)

    def _shared(self, v: Vertices, rows: list[Tensor]) -> Tensor:
        total: Tensor | None = None
        for k in range(self.config.vertices):
            place = torch.cat([torch.full_like(v.valid[k], float(j == k)) for j in VERTICES], dim=1)
            encoded = v.valid[k] * self.vertex_network(torch.cat([rows[k], place], dim=1))
            total = encoded if total is None else total + encoded
        assert total is not None
        return total
