"""The stored channels of a path sample; the features of every network are made from these.

`HALF` channels are float16 [samples, channels, height, width], `BYTES` ones uint8. Normals are in
world space, as rendered; the item's `world_to_camera` turns them.
"""

from __future__ import annotations

VERTICES = range(6)
RGB, XYZ = ("R", "G", "B"), ("X", "Y", "Z")

RADIANCE = RGB
FEATURES = tuple(
    f"mbfeat:{kind}:{k}.{channel}"
    for k in VERTICES
    for kind, channels in (("albedo", RGB), ("normal", XYZ), ("direct", RGB))
    for channel in channels
)
EXTENDED = tuple(
    f"mbfeat:{kind}:{k}.{channel}"
    for k in VERTICES
    for kind, channels in (("roughness", ("Y",)), ("distance", ("Z",)), ("throughput", RGB))
    for channel in channels
)
EVENTS = tuple(f"mbfeat:event:{k}.Y" for k in VERTICES)

HALF = (*RADIANCE, "A", "Z", "subpixel.X", "subpixel.Y", *FEATURES, *EXTENDED)
BYTES = ("validMask", *EVENTS)

# Any of them in a deep product makes the kept paths hold the whole extended set.
EXTENDED_AOV = "mbfeat:event:0"

REFLECT, TRANSMIT, DIFFUSE, GLOSSY, SPECULAR, EMISSION = (1 << bit for bit in range(6))

HALF_INDEX = {name: index for index, name in enumerate(HALF)}


def channels(*names: str) -> list[int]:
    """Indices among the HALF channels; a name without its channel stands for all of its AOV."""
    found: list[int] = []
    for name in names:
        wanted = [i for n, i in HALF_INDEX.items() if n == name or n.startswith(f"{name}.")]
        if not wanted:
            raise KeyError(name)
        found += wanted
    return found
