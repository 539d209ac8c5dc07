"""Small kernels on several scales in place of one large one.

The network divides each sample's radiance among scales, each of which splats with a small kernel,
and leads the coarser image up through a learned 3x3 kernel (after the partitioning pyramids of
Balint, Wolski, Myszkowski, Seidel and Mantiuk, "Neural Partitioning Pyramids for Denoising Monte
Carlo Renderings", 2023).
"""

from __future__ import annotations

from collections.abc import Callable

from torch import Tensor, nn
from torch.nn.functional import avg_pool2d

from training.model.blocks import enlarged

UP = 3


class Pyramid(nn.Module):
    """Splats units (samples or classes) with hidden features of `width` channels."""

    def __init__(self, width: int, kernel: int, scales: int) -> None:
        super().__init__()
        self.share = nn.Conv2d(width, scales, 1)
        self.kernels = nn.ModuleList(nn.Conv2d(width, kernel**2, 1) for _ in range(scales))
        self.ups = nn.ModuleList(nn.Conv2d(width, UP**2, 1) for _ in range(scales - 1))

    def forward(
        self, hidden: Tensor, radiance: Tensor, splat: Callable[[Tensor, Tensor], Tensor]
    ) -> Tensor:
        """Image [n, 3, h, w] of hidden [n, units, width, h, w], radiance [n, units, 3, h, w]."""
        n, units = hidden.shape[:2]
        flat = hidden.flatten(0, 1)
        share = self.share(flat).softmax(dim=1)
        light = radiance.flatten(0, 1)
        pooled, lights = [flat], [light * share[:, :1]]
        for scale in range(1, len(self.kernels)):
            part = light * share[:, scale : scale + 1]
            for _ in range(scale):
                part = _halved(part)
            pooled.append(_halved(pooled[-1]))
            lights.append(part)
        image: Tensor | None = None
        for scale in reversed(range(len(self.kernels))):
            logits = self.kernels[scale](pooled[scale])
            here = splat(_units(logits, n, units), _units(lights[scale], n, units))
            if image is not None:
                guide = _units(pooled[scale], n, units).mean(dim=1)
                larger = enlarged(image)[..., : here.shape[-2], : here.shape[-1]]
                here = here + splat(self.ups[scale](guide)[:, None], larger[:, None])
            image = here
        assert image is not None
        return image


def _halved(x: Tensor) -> Tensor:
    return avg_pool2d(x, 2, ceil_mode=True, count_include_pad=False)


def _units(x: Tensor, n: int, units: int) -> Tensor:
    return x.reshape(n, units, *x.shape[1:])
