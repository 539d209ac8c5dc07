"""Open Image Denoise, through the package pyoidn where it is installed.

The package brings a TBB of its own: a process that renders must not load it.
"""

from __future__ import annotations

import importlib.util

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]


class OidnError(Exception):
    """Open Image Denoise reported an error."""


def available() -> bool:
    """Whether pyoidn can be imported."""
    return importlib.util.find_spec("pyoidn") is not None


class Oidn:
    """A device with its threads (0: all); images are [3, h, w] float32."""

    def __init__(self, threads: int = 0) -> None:
        import pyoidn

        self._api = pyoidn
        self._device = pyoidn.Device(pyoidn.OIDN_DEVICE_TYPE_CPU)
        self._device.set_int("numThreads", threads)
        self._device.commit()
        self._check()

    def plain(self, color: Image, albedo: Image, normal: Image) -> Image:
        """Filters `color` guided by albedo and normal as they were rendered."""
        images = {"color": color, "albedo": albedo, "normal": normal}
        return self.filtered(images, hdr=True, clean=False)

    def best(self, color: Image, albedo: Image, normal: Image) -> Image:
        """Filters `color` guided by albedo and normal, each of which is filtered itself before."""
        albedo = self.filtered({"albedo": np.clip(albedo, 0.0, 1.0)}, hdr=False, clean=False)
        normal = self.filtered({"normal": normal}, hdr=False, clean=False)
        images = {"color": color, "albedo": albedo, "normal": normal}
        return self.filtered(images, hdr=True, clean=True)

    def filtered(self, images: dict[str, Image], *, hdr: bool, clean: bool) -> Image:
        """One pass of the high-quality filter over ``color``, or over one auxiliary image alone."""
        stored = {n: np.ascontiguousarray(image.transpose(1, 2, 0)) for n, image in images.items()}
        first = next(iter(stored.values()))
        output = np.empty_like(first)
        with self._api.Filter(self._device, self._api.OIDN_FILTER_TYPE_RT) as work:
            for name, image in {**stored, "output": output}.items():
                work.set_image(name, image, self._api.OIDN_FORMAT_FLOAT3)
            if "color" in stored:
                work.set_bool("hdr", hdr)
                work.set_bool("cleanAux", clean)
            work.set_quality(self._api.OIDN_QUALITY_HIGH)
            work.commit()
            work.execute()
            self._check()
        return np.ascontiguousarray(output.transpose(2, 0, 1))

    def _check(self) -> None:
        message = self._device.get_error()
        if message is not None:
            raise OidnError(str(message))
