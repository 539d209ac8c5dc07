"""The options of ``mbfeat tradeoff``."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def add(commands: Any) -> Any:
    """Adds the command to the parsers of sub-commands; returns its parser."""
    command = commands.add_parser(
        "tradeoff",
        help="measure what accuracy costs in time, on any stage with a camera",
        description="Renders a stage with ever more samples, raw and through every denoiser that "
        "is installed, against a reference, and shows error against total seconds: tradeoff.json, "
        ".csv, .html and .png in the output folder. An interrupted run goes on where it was. "
        "Without --reference the truth is a render of many more samples, of which cost and noise "
        "are told.",
    )
    command.add_argument("stage", nargs="?", metavar="STAGE")
    command.add_argument("--out", type=Path, metavar="DIR", help="folder for what is found")
    questions = command.add_argument_group("questions")
    questions.add_argument(
        "--seconds",
        type=float,
        action="append",
        default=[],
        metavar="S",
        help="with S seconds, what is the best I get and how? (may be repeated)",
    )
    questions.add_argument(
        "--error",
        type=float,
        action="append",
        default=[],
        metavar="E",
        help="to reach error E, how long and how? (may be repeated)",
    )
    questions.add_argument(
        "--metric", default="relMSE", help="of the chart, the front and the answers (%(default)s)"
    )
    _add_scale(command)
    _add_variants(command)
    command.add_argument(
        "--page",
        type=Path,
        nargs="+",
        metavar="DIR",
        help="measure nothing: write the documentation's page from the results in these folders",
    )
    return command


def _add_scale(command: Any) -> None:
    scale = command.add_argument_group("how thoroughly")
    scale.add_argument("--spp", metavar="N,N,...", help="samples a pixel (default: 1,4,16,64,256)")
    scale.add_argument("--seeds", type=int, default=3, help="of each (default: %(default)s)")
    scale.add_argument(
        "--width",
        type=int,
        help="of the images, whose height follows (default: the reference's, else the stage's up "
        "to 320)",
    )
    scale.add_argument("--camera", metavar="PRIMPATH", help="default: the stage's own choice")
    scale.add_argument("--threads", type=int, help="default: one for each core")
    scale.add_argument(
        "--reference",
        type=Path,
        action="append",
        metavar="EXR",
        help="the truth; repeated, the mean of independent ones, whose noise then shows",
    )
    scale.add_argument(
        "--reference-spp",
        type=int,
        metavar="N",
        help="samples a pixel of a rendered reference (default: 16 times the most of --spp)",
    )


def _add_variants(command: Any) -> None:
    variants = command.add_argument_group("what is compared")
    variants.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a render setting of every render",
    )
    variants.add_argument(
        "--variant",
        action="append",
        default=[],
        metavar="NAME:SETTING=VALUE,...",
        help="compare renders with other settings, as in 'few bounces:mbfeat:maxBounces=2'",
    )
    variants.add_argument(
        "--limits",
        action="store_true",
        help="instead of denoisers: what caps on bounces of each kind, and caustics and blur "
        "switched off, save and lose, as far as the stage calls for such effects",
    )
    variants.add_argument("--only", metavar="NAME,...", help="only these variants, and raw")
    variants.add_argument(
        "--peers",
        nargs="?",
        const="mitsuba,cycles",
        metavar="NAMES",
        help="beside other renderers, each against its own reference (default: mitsuba,cycles), "
        "and Open Image Denoise; downloads them first, works in a checkout, on stages that can be "
        "translated (default: that of a room)",
    )
