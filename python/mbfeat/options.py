"""Command-line options of ``usdrecord``: those of OpenUSD's tool, and MBFeat's own."""

from __future__ import annotations

import argparse
import difflib
import re
from typing import Any

PURPOSES = ("default", "proxy", "render", "guide")

# Far beyond any print; sizes past it overflow memory before the renderer can tell.
MAX_IMAGE_WIDTH = 65536

# What a renderer does with a wrong setting, and the command does not: it ends.
IGNORED = re.compile(r' \(command line\); it is ignored(?: and "[^"]*" \([^)]*\) stays)?')

# What the parsed arguments are called is UsdAppUtils' choice where it adds the options.


def make_parser(program: str) -> argparse.ArgumentParser:
    """The parser; importing the renderer list loads every Hydra plug-in's description."""
    from pxr import UsdAppUtils

    parser = argparse.ArgumentParser(
        prog=program,
        description="Renders images of a USD stage with a Hydra renderer, on the CPU.",
        # As in OpenUSD's tool an option may be shortened.
        allow_abbrev=True,
    )
    parser.add_argument("usdFilePath", help="USD file to render")
    parser.add_argument(
        "outputImagePath",
        help="image to write: an EXR with linear values, or one of .png, .jpg, .jpeg, .bmp, .tga "
        'and .hdr; with --frames it holds exactly one frame placeholder such as "###" or '
        '"###.###", whose width is free',
    )
    _add_stage_options(parser)
    UsdAppUtils.cameraArgs.AddCmdlineArgs(parser)
    UsdAppUtils.framesArgs.AddCmdlineArgs(parser)
    UsdAppUtils.complexityArgs.AddCmdlineArgs(parser)
    UsdAppUtils.colorArgs.AddCmdlineArgs(
        parser,
        altHelpText="colour correction of images that are no EXR, which always stays linear: "
        "sRGB is the transfer curve alone, openColorIO the display and view of the OpenColorIO "
        "config (default=%(default)s)",
    )
    UsdAppUtils.rendererArgs.AddCmdlineArgs(parser)
    _add_image_options(parser)
    _add_render_prim_options(parser)
    _add_profiling_options(parser)
    _add_own_options(parser)
    return parser


def _add_stage_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--mask",
        dest="populationMask",
        metavar="PRIMPATH[,PRIMPATH...]",
        help="open only these prims, their ancestors and descendants; separate paths by commas "
        "or, quoted, by spaces",
    )
    parser.add_argument(
        "--purposes",
        default="proxy",
        metavar="PURPOSE[,PURPOSE...]",
        help='purposes to render beside "default", which always is; separate them by commas or, '
        "quoted, by spaces (default=%(default)s)",
    )
    parser.add_argument(
        "--sessionLayer",
        dest="sessionLayerPath",
        metavar="SESSIONLAYER",
        help="layer to use as the stage's session layer instead of an empty one",
    )
    parser.add_argument(
        "--resolver",
        choices=["root", "inherit"],
        default="root",
        help="asset resolver context: made for the root layer, or the environment's "
        "(default=%(default)s)",
    )


def _add_image_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--imageWidth",
        "-w",
        type=int,
        default=960,
        help="width of the image in pixels; its height follows from the camera's aspect ratio. "
        "Render products have their own resolution (default=%(default)s)",
    )
    parser.add_argument(
        "--disableGpu",
        action="store_false",
        dest="gpuEnabled",
        help="accepted for OpenUSD's sake: this command never uses the GPU",
    )
    parser.add_argument(
        "--disableDrawMode",
        action="store_false",
        dest="drawModeEnabled",
        help="ignore draw modes (cards, bounds, origin) and render all models in full",
    )
    parser.add_argument(
        "--disableCameraLight",
        action="store_false",
        dest="cameraLightEnabled",
        help="don't light the scene from the camera; MBFeat does so only where the stage has no "
        "light at all",
    )
    parser.add_argument(
        "--enableDomeLightVisibility",
        action="store_true",
        dest="domeLightVisibility",
        help="let the camera see dome lights; without it they light the scene but the background "
        "stays empty",
    )


def _add_render_prim_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--renderPassPrimPath",
        "-rp",
        dest="rpPrimPath",
        help="RenderPass prim to render; its renderSource is used instead of the stage's "
        "renderSettingsPrimPath",
    )
    parser.add_argument(
        "--renderSettingsPrimPath",
        "-rs",
        dest="rsPrimPath",
        help="RenderSettings prim to use instead of the stage's renderSettingsPrimPath",
    )


def _add_profiling_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--traceToFile", help="write a trace of OpenUSD's own work to this file at the end"
    )
    parser.add_argument(
        "--traceFormat",
        default="chrome",
        choices=["chrome", "trace"],
        help="format of that trace: for the Chrome browser, or a text report (default=%(default)s)",
    )
    parser.add_argument(
        "--memstats",
        action="store_true",
        help="report the memory that OpenUSD allocated, where it keeps accounts",
    )


def _add_own_options(parser: argparse.ArgumentParser) -> None:
    own = parser.add_argument_group("MBFeat")
    own.add_argument(
        "--set",
        dest="overrides",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a render setting such as mbfeat:samplesPerPixel=256, over the stage's and the "
        "environment's; may be repeated (see: mbfeat settings)",
    )
    own.add_argument(
        "--quiet", action="store_true", help="no progress and no summary, errors and warnings only"
    )
    own.add_argument(
        "--ocioConfig",
        metavar="CONFIG",
        help="OpenColorIO config for --colorCorrectionMode openColorIO: a file, or "
        "ocio://cg-config-latest or ocio://studio-config-latest for the ACES configs that MBFeat "
        "comes with (default: $OCIO, else the ACES CG config)",
    )
    own.add_argument("--ocioDisplay", help="display of that config (default: its first)")
    own.add_argument("--ocioView", help="view of that display (default: its first)")


def check_overrides(texts: list[str]) -> tuple[list[tuple[str, str]], list[str]]:
    """Settings of the command line as (name, text), and what is wrong with them."""
    from mbfeat import _core

    settings = _core.Settings()
    overrides: list[tuple[str, str]] = []
    problems: list[str] = []
    for text in texts:
        name, equals, value = text.partition("=")
        name = name.strip()
        if not equals:
            problems.append(f"--set {text}: write --set NAME=VALUE")
            continue
        try:
            settings.set(_core.SettingSource.COMMAND_LINE, name, value)
        except _core.Error as error:
            problems.append(f"--set {IGNORED.sub('', str(error))}")
            continue
        if name == "mbfeat:viewAov" and not is_aov(value):
            problems.append(
                f"--set {name}={value}: there is no such AOV; the nearest name is "
                f"{_core.nearest_aov_name(value)}"
            )
            continue
        overrides.append((name, value))
    return overrides, problems


def is_aov(name: str) -> bool:
    """Whether the renderer has the AOV; the empty name is none, which is allowed."""
    from mbfeat import _core

    known = {aov.name for aov in _core.aov_table()}
    return not name or name in known or name.removeprefix("primvars:") not in ("", name)


def check_purposes(text: str) -> list[str]:
    """What is wrong with the value of --purposes."""
    problems: list[str] = []
    for word in words(text):
        if word not in PURPOSES:
            near = difflib.get_close_matches(word.lower(), PURPOSES, 1)
            advice = f"did you mean {near[0]}?" if near else f"there are {', '.join(PURPOSES)}"
            problems.append(f"--purposes {word}: there is no such purpose; {advice}")
    return problems


def words(text: str) -> list[str]:
    """The parts of a list separated by commas or spaces."""
    return text.replace(",", " ").split()


def parse(program: str, arguments: list[str] | None) -> tuple[argparse.ArgumentParser, Any]:
    """Parses and checks what can be checked without a stage; ends the process on usage errors."""
    from mbfeat import _core

    parser = make_parser(program)
    options = parser.parse_args(arguments)
    options.imageWidth = max(options.imageWidth, 1)
    options.overrides, problems = check_overrides(options.overrides)
    problems += check_purposes(options.purposes)
    if options.imageWidth > MAX_IMAGE_WIDTH:
        problems.append(
            f"--imageWidth {options.imageWidth}: the image is too wide; "
            f"give at most {MAX_IMAGE_WIDTH} pixels"
        )
    problems += _core.Settings().read_environment()
    if problems:
        parser.error("; ".join(problems))
    return parser, options
