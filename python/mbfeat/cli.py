"""The command ``mbfeat``: tables of settings and AOVs, layouts of files and stages, benchmarks."""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys
from pathlib import Path
from typing import Any

from mbfeat.tradeoff import options as tradeoff_options

DIFFERS = 1  # exit code of a check that found a difference


def main(arguments: list[str] | None = None) -> int:
    """Runs a sub-command; returns its exit code: 0, 1 for errors and differences, 2 for usage."""
    parser = argparse.ArgumentParser(
        prog="mbfeat", description="Tables, layouts, generated files and benchmarks of MBFeat."
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_aovs(commands)
    _add_settings(commands)
    _add_generated(commands)
    _add_bench(commands)
    _add_stability(commands)
    _add_denoise(commands)
    tradeoff_options.add(commands).set_defaults(run=_run_tradeoff)
    _add_effects(commands)
    options = parser.parse_args(arguments)
    try:
        return int(options.run(options))
    except BrokenPipeError:
        sys.stderr.close()  # the reader of a pipe has seen enough
        return 0
    except KeyboardInterrupt:
        return 130


def _add_aovs(commands: Any) -> None:
    command = commands.add_parser(
        "aovs",
        help="list the AOVs of an EXR file or of a stage's products, and check a file",
        description="Lists the layout of an EXR file, or of the files that the render products of "
        "a stage would write; without either, every AOV there is. Exits with 1 when a file "
        "differs from the table of AOVs, or a product cannot be written as asked.",
    )
    command.add_argument("file", nargs="?", metavar="STAGE|EXR")
    command.add_argument("--settings", metavar="PRIMPATH", help="only this RenderSettings prim's")
    command.add_argument("--json", action="store_true", help="print JSON")
    command.set_defaults(run=_run_aovs)


def _add_settings(commands: Any) -> None:
    command = commands.add_parser("settings", help="list the render settings")
    command.add_argument("--json", action="store_true", help="print JSON")
    command.set_defaults(run=_run_settings)


def _add_generated(commands: Any) -> None:
    docs = commands.add_parser("docs", help="write the reference pages again from the tables")
    docs.set_defaults(run=_run_docs)
    schema = commands.add_parser("schema", help="write the USD schemas again from the tables")
    schema.add_argument(
        "folder", nargs="?", type=Path, help="where to (default: schemas/ of the checkout)"
    )
    schema.set_defaults(run=_run_schema)
    stubs = commands.add_parser("stubs", help="write the extension module's type stub again")
    stubs.set_defaults(run=_run_stubs)
    for command in (docs, schema, stubs):
        command.add_argument(
            "--check", action="store_true", help="write nothing; exit with 1 if a file is outdated"
        )


def _add_bench(commands: Any) -> None:
    command = commands.add_parser(
        "bench",
        help="measure rate and error on six stages, alone or beside other renderers",
        description="Measures how many samples a second the renderer makes on six stages, and how "
        "many of a pixel it needs to a relative mean squared error of 0.01; with --peers beside "
        "Mitsuba 3 and Cycles, which are downloaded when they are first needed. Works in a "
        "checkout only.",
    )
    command.add_argument(
        "--peers",
        nargs="?",
        const="mitsuba,cycles",
        metavar="NAMES",
        help="compare with these (default: mitsuba,cycles)",
    )
    command.add_argument(
        "--growth",
        action="store_true",
        help="instead, measure how time and memory grow with triangles, instances, lights, "
        "texture bytes, pixels, samples and AOVs, and how soon a viewer shows an image",
    )
    command.add_argument("--axes", metavar="NAMES", help="with --growth: a,b (default: all)")
    command.add_argument(
        "--page",
        type=Path,
        metavar="FILE.json",
        help="with --growth: measure nothing, write the page of the documentation from that",
    )
    command.add_argument("--json", type=Path, metavar="FILE", help="write all numbers there")
    command.add_argument("--scenes", metavar="NAMES", help="a,b (default: all six)")
    command.add_argument("--quick", action="store_true", help="small and rough, in some minutes")
    command.add_argument("--width", type=int, help="of the images, 16:9 (default: 320)")
    command.add_argument("--bounces", type=int, default=12, help="default: 12")
    command.add_argument("--threads", type=int, default=2, help="of each renderer (default: 2)")
    command.add_argument("--rounds", type=int, help="of the rates (default: 5)")
    command.add_argument("--seconds", type=float, help="of a render for the rate (default: 4)")
    command.add_argument("--seeds", type=int, help="of the errors (default: 5)")
    command.add_argument("--max-spp", type=int, help="at most, for the errors (default: 1024)")
    command.add_argument(
        "--max-reference-spp", type=int, help="at most, for converged images (default: 8192)"
    )
    command.add_argument(
        "--clock",
        choices=["wall", "cpu"],
        default="wall",
        help="cpu counts CPU seconds, for a machine that others use too (default: wall)",
    )
    command.add_argument(
        "--any-build",
        action="store_true",
        help="keep MBFeat's converged images after it was built anew",
    )
    command.set_defaults(run=_run_bench)


def _add_denoise(commands: Any) -> None:
    command = commands.add_parser(
        "denoise",
        help="reconstruct the image of a deep EXR file",
        description="Reconstructs an image from the light paths of a deep product (productType "
        "deepRaster), with a trained network. The extended set, which the default network needs, "
        "is in the file when mbfeat:event:0 is among the product's AOVs.",
    )
    command.add_argument("source", type=Path, nargs="?", metavar="IN.exr")
    command.add_argument("target", type=Path, nargs="?", metavar="OUT")
    command.add_argument("--model", default="", help="an ONNX file or a name (default: best)")
    command.add_argument(
        "--features",
        choices=["auto", "none", "firstHit", "multiBounce"],
        default="auto",
        help="what the network is shown of the paths (default: what it was trained with)",
    )
    command.add_argument("--raw", action="store_true", help="add the layer mbfeat:raw to an EXR")
    command.add_argument("--preview", type=Path, help="write an image for people as well")
    command.add_argument(
        "--colorCorrectionMode",
        choices=["disabled", "sRGB", "openColorIO"],
        default="sRGB",
        help="of images that are not EXR (default: sRGB)",
    )
    command.add_argument("--ocioConfig", default="", help="as of usdrecord")
    command.add_argument("--ocioDisplay", default="", help="as of usdrecord")
    command.add_argument("--ocioView", default="", help="as of usdrecord")
    command.add_argument("--threads", type=int, default=0, help="default: all cores")
    command.add_argument("--tile", type=int, default=0, help="pixels (default: from --memory)")
    command.add_argument("--memory", type=float, default=1.0, help="GiB (default: 1)")
    command.add_argument("--list", action="store_true", help="list the networks that there are")
    command.set_defaults(run=_run_denoise)


def _add_stability(commands: Any) -> None:
    command = commands.add_parser(
        "stability",
        help="run the catalogue of numerically hard cases",
        description="Runs the catalogue of numerically hard cases and prints each case, its check, "
        "the worst error, the budget and the verdict. Exits with 1 when a case fails. Works in a "
        "checkout only.",
    )
    command.add_argument("--json", type=Path, metavar="FILE", help="write what was found there")
    command.add_argument(
        "--filter", default="*", metavar="GLOB", help="only cases of such names: 'closure/*'"
    )
    command.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder for the table and for pictures of what fails (default: .mbfeat/stability)",
    )
    command.add_argument(
        "--traps",
        action="store_true",
        help="in a debug build, in which invalid operations, divisions by zero and overflows trap",
    )
    command.add_argument(
        "--page",
        type=Path,
        metavar="FILE",
        help="run nothing: write the page 'hard cases' of the documentation from such a JSON file",
    )
    command.set_defaults(run=_run_stability)


def _add_effects(commands: Any) -> None:
    command = commands.add_parser(
        "effects",
        help="show which effects a stage calls for, who asks for them, and what each costs",
        description="Shows which effects a stage calls for and which prims or AOVs ask for them, "
        "which are left out, and the kernel that was chosen. With --measure, what each effect "
        "costs: renders that differ in one effect take turns. Nothing of the stage's own is "
        "written.",
    )
    command.add_argument("stage", nargs="?", metavar="STAGE")
    command.add_argument("more", nargs="*", help=argparse.SUPPRESS)
    command.add_argument("--json", action="store_true", help="print JSON")
    command.add_argument(
        "--measure", action="store_true", help="measure what each effect costs, in some minutes"
    )
    command.add_argument(
        "--chart", type=Path, metavar="FILE", help="draw the costs into a .png or .svg"
    )
    command.add_argument("--settings", metavar="PRIMPATH", help="this RenderSettings prim's view")
    command.add_argument(
        "--camera",
        metavar="PRIM",
        help="through this camera (default: the stage's own choice; without any, all is in view)",
    )
    command.add_argument("--width", type=int, default=320, help="of the image (default: 320)")
    command.add_argument("--rounds", type=int, default=5, help="of the renders (default: 5)")
    command.add_argument(
        "--seconds", type=float, default=0.5, help="of a render, about (default: 0.5)"
    )
    command.add_argument("--threads", type=int, default=1, help="of a render (default: 1)")
    command.add_argument(
        "--clock",
        choices=["wall", "cpu"],
        default="cpu",
        help="cpu counts CPU seconds, which other programs disturb less (default: cpu)",
    )
    command.add_argument(
        "--page",
        action="store_true",
        default=None,
        help="render nothing: write the page 'effects on demand' of the documentation from the "
        "JSON files that are named in place of the stage",
    )
    command.set_defaults(run=_run_effects)


def _run_effects(options: argparse.Namespace) -> int:
    from mbfeat.effects.command import run

    return run(options)


def _run_aovs(options: argparse.Namespace) -> int:
    from mbfeat import _core, layout

    if options.file is None:
        rows = layout.aov_rows()
        _print([vars(row) for row in rows] if options.json else "\n".join(layout.table(rows)))
        return 0
    try:
        if layout.is_exr(options.file):
            layouts = [layout.read_layout(options.file)]
        else:
            layouts = layout.stage_layouts(options.file, options.settings or "")
    except (_core.Error, ValueError) as error:
        return _fail(str(error))
    except ImportError:
        return _fail(f"{options.file}: reading a stage needs OpenUSD's Python package: usd-core")
    if options.json:
        _print([one.to_json() for one in layouts])
    else:
        _print("\n\n".join(one.to_text() for one in layouts) or "no render products")
    return DIFFERS if any(one.problems for one in layouts) else 0


def _run_settings(options: argparse.Namespace) -> int:
    from mbfeat import _core, schema

    rows: list[dict[str, Any]] = [
        {
            "name": setting.name,
            "type": schema.attribute_type(setting),
            "default": setting.default,
            "environment": setting.environment,
            "allowed": setting.allowed,
            "meaning": schema.documentation(setting),
        }
        for setting in _core.setting_table()
    ]
    if options.json:
        _print(rows)
        return 0
    for row in rows:
        default = json.dumps(row["default"])
        print(f"{row['name']} = {default}  ({row['type']}, {row['environment']})")
        print(f"    {row['meaning']}")
        if row["allowed"]:
            print(f"    one of {', '.join(row['allowed'])}")
    return 0


def _run_docs(options: argparse.Namespace) -> int:
    from mbfeat import pages

    return _generated(pages.outdated() if options.check else pages.write(), options.check)


def _run_schema(options: argparse.Namespace) -> int:
    from mbfeat import schema

    folder = options.folder or Path(__file__).resolve().parents[2] / "schemas"
    if options.folder is None and not (folder.parent / "hdmbfeat").is_dir():
        return _fail("schema: this is no checkout; name the folder to write to")
    changed = schema.outdated(folder) if options.check else schema.write(folder)
    return _generated(changed, options.check)


def _run_stubs(options: argparse.Namespace) -> int:
    from mbfeat import stubs

    try:
        return _generated(stubs.outdated() if options.check else stubs.write(), options.check)
    except ImportError:
        return _fail("stubs: this needs nanobind; pip install nanobind")


def _run_bench(options: argparse.Namespace) -> int:
    folder = Path(__file__).resolve().parents[2] / "tests" / "bench"
    if not (folder / "peers").is_dir() or importlib.util.find_spec("mbfeat.devtools") is None:
        return _fail(
            "bench: this is no checkout, and the stages and the other renderers' translations are "
            "not installed; run ./run mbfeat bench in a checkout"
        )
    sys.path.insert(0, str(folder))
    if options.growth:
        from growth.command import run as run_growth

        return run_growth(options)
    if options.page or options.axes:
        sys.stderr.write("mbfeat: bench: --page and --axes need --growth\n")
        return 2
    from peers.command import run

    return run(options)


def _run_denoise(options: Any) -> int:
    from mbfeat import denoise
    from mbfeat.images import ColorCorrection

    if options.list:
        for model in denoise.models().values():
            print(f"{model.name}: features {model.features}, {model.file}")
        return 0
    if options.source is None or options.target is None:
        sys.stderr.write("mbfeat denoise: give IN.exr and OUT, or --list\n")
        return 2
    correction = ColorCorrection(
        mode=options.colorCorrectionMode,
        config=options.ocioConfig,
        display=options.ocioDisplay,
        view=options.ocioView,
    )
    try:
        report = denoise.denoise(
            options.source,
            options.target,
            model=options.model,
            features=options.features,
            threads=options.threads,
            tile=options.tile,
            memory=options.memory,
            raw=options.raw,
            preview=options.preview,
            correction=correction,
        )
    except denoise.DenoiseError as error:
        sys.stderr.write(f"mbfeat denoise: {error}\n")
        return 1
    phases = ", ".join(f"{name} {seconds:.2f} s" for name, seconds in report.seconds)
    print(f"{options.target}: {report.total_seconds:.2f} s ({phases})")
    return 0


def _run_stability(options: argparse.Namespace) -> int:
    tests = Path(__file__).resolve().parents[2] / "tests"
    if not (tests / "stability").is_dir() or importlib.util.find_spec("mbfeat.devtools") is None:
        return _fail(
            "stability: this is no checkout, and the hard cases are not installed; run "
            "./run mbfeat stability in a checkout"
        )
    sys.path.insert(0, str(tests / "bench"))
    from mbfeat.stability import run

    return run(options)


def _run_tradeoff(options: argparse.Namespace) -> int:
    from mbfeat.tradeoff.command import run

    return run(options)


def _generated(files: list[Path], check: bool) -> int:
    for path in files:
        print(f"{'outdated' if check else 'wrote'} {path}")
    if not files:
        print("everything is up to date")
    return DIFFERS if check and files else 0


def _print(content: Any) -> None:
    print(content if isinstance(content, str) else json.dumps(content, indent=2))


def _fail(text: str) -> int:
    sys.stderr.write(f"mbfeat: {text}\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())
