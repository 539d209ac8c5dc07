"""``usdrecord``: images of a USD stage, with the options of OpenUSD's tool of that name.

Exit codes: 0 all images and products were written; 1 something could not be opened, rendered or
written; 2 usage error; 130 interrupted. Beyond OpenUSD's tool, this one corrects colours without a
GPU, writes the named image also where products were written, shows progress, sets render settings,
and stops on Ctrl-C within a second without leaving half a file.
"""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any, NoReturn

from mbfeat.diagnostics import OpenUsdMessages, complain, tf_messages
from mbfeat.runtime import RuntimeMissingError, use_runtime

INTERRUPTED = 130
DENOISE_ENABLED = "mbfeat:denoise:enabled"


class StageError(Exception):
    """A layer, prim or frame that was named cannot be used; the message is for the user."""


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; `arguments` are those after the program's name, by default sys.argv's."""
    try:
        use_runtime()
        return _run(arguments)
    except RuntimeMissingError as error:
        complain(str(error))
        return 1
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED


def _run(arguments: list[str] | None) -> int:
    from mbfeat import _core
    from mbfeat.options import parse
    from mbfeat.recorder import InterruptedByUserError, RecordError

    parser, options = parse("usdrecord", arguments)
    _core.Host.clear_stop()
    _core.Host.install_interrupt_handler()
    _core.Host.print_messages("usdrecord")
    messages = OpenUsdMessages()
    profile = _Profile(options)
    try:
        _record(parser, options, messages)
    except InterruptedByUserError as error:
        complain(str(error))
        return INTERRUPTED
    except (StageError, RecordError) as error:
        complain(str(error))
        return 1
    finally:
        _core.Host.restore_interrupt_handler()
        messages.flush()
        profile.finish()
    return 0


def _record(parser: Any, options: Any, messages: OpenUsdMessages) -> None:
    """Opens the stage and renders it."""
    from pxr import Tf, UsdAppUtils

    from mbfeat.images import problem_with_folder
    from mbfeat.instancers import hide_broken_instancers
    from mbfeat.recorder import record_frames

    stage = open_stage(options)
    messages.flush()
    # The path goes through str.format: braces in it are no placeholders.
    options.outputImagePath = options.outputImagePath.replace("{", "{{").replace("}", "}}")
    try:
        UsdAppUtils.framesArgs.ValidateCmdlineArgs(
            parser, options, stage, frameFormatArgName="outputImagePath"
        )
    except Tf.ErrorException as error:
        raise StageError(
            f"--frames {options.frames}: {'; '.join(tf_messages(error))}; write START:ENDxSTRIDE, "
            "with several separated by commas"
        ) from error
    for warning in hide_broken_instancers(stage, options.frames):
        complain(f"warning: {warning}")
    settings_path = find_settings(stage, options.rpPrimPath, options.rsPrimPath)
    camera = find_camera(stage, options.camera, settings_path)
    first = options.outputImagePath.format(frame=next(iter(options.frames)))
    problem = problem_with_folder(first)
    if problem:
        raise StageError(problem)
    try:
        recording = _make_recording(stage, camera, settings_path, options)
    except Tf.ErrorException as error:
        raise StageError(
            f"the renderer could not be set up: {'; '.join(tf_messages(error))}"
        ) from error
    recording.messages = messages
    record_frames(recording, options.frames, options.outputImagePath)


def _make_recording(stage: Any, camera: Any, settings_path: str, options: Any) -> Any:

    from mbfeat import _core
    from mbfeat.images import ColorCorrection, check_correction
    from mbfeat.options import words
    from mbfeat.recorder import Recording, is_linear

    correction = ColorCorrection(
        mode="disabled" if is_linear(options.outputImagePath) else options.colorCorrectionMode,
        config=options.ocioConfig or "",
        display=options.ocioDisplay or "",
        view=options.ocioView or "",
        from_space=rendering_color_space(stage, settings_path),
    )
    try:
        for warning in check_correction(correction):
            complain(warning)
    except _core.Error as error:
        raise StageError(f"--colorCorrectionMode openColorIO: {error}") from error

    style = _core.ProgressStyle.BAR if sys.stderr.isatty() else _core.ProgressStyle.LINES
    _core.Host.set_progress_style(_core.ProgressStyle.NONE if options.quiet else style)
    # Of the pass first, so that the command line's come over them; those of the environment stay.
    variables = {s.name: s.environment for s in _core.denoise_setting_table()}
    of_pass = [
        (name, text)
        for name, text in denoise_settings(stage, options.rpPrimPath)
        if variables[name] not in os.environ
    ]
    _core.Host.set_overrides([*of_pass, *options.overrides])
    layer = stage.GetRootLayer()
    _core.Host.set_stage(layer.realPath or layer.identifier)

    recorder = _make_recorder(options)
    if options.rpPrimPath:
        recorder.SetActiveRenderPassPrimPath(options.rpPrimPath)
    if settings_path:
        recorder.SetActiveRenderSettingsPrimPath(settings_path)
    recorder.SetImageWidth(options.imageWidth)
    recorder.SetComplexity(options.complexity.value)
    recorder.SetCameraLightEnabled(options.cameraLightEnabled)
    recorder.SetColorCorrectionMode("disabled")
    recorder.SetIncludedPurposes(words(options.purposes))
    recorder.SetDomeLightVisibility(options.domeLightVisibility)
    recorder.SetPrimaryCameraPrimPath(camera.GetPath())
    if not options.quiet:
        print(f"Camera: {camera.GetPath().pathString or 'free, framing the stage'}")
        print(f"Renderer plugin: {recorder.GetCurrentRendererId()}", flush=True)
    return Recording(stage, camera, recorder, correction, options.quiet)


def _make_recorder(options: Any) -> Any:
    from pxr import Tf, UsdAppUtils

    name = options.rendererPlugin
    # UsdAppUtils turns Storm into its old name GL, which is no plug-in's.
    name = "Storm" if name == "GL" else name
    plugin = UsdAppUtils.rendererArgs.GetPluginIdFromArgument(name) or ""
    wanted = f"the renderer {name} cannot render" if name else "no renderer was found that renders"
    advice = "choose another with --renderer"
    try:
        recorder = UsdAppUtils.FrameRecorder(plugin, False, options.drawModeEnabled)
        renderer = recorder.GetCurrentRendererId()
    except Tf.ErrorException as error:
        raise StageError(
            f"{wanted} without a GPU, which this command never uses; {advice}"
        ) from error
    if not renderer or (plugin and renderer != plugin):
        raise StageError(f"{wanted} without a GPU, which this command never uses; {advice}")
    return recorder


def open_stage(options: Any) -> Any:
    """Opens the stage that the options name, with mask, session layer and resolver context."""
    from pxr import Ar, Sdf, Tf, Usd

    from mbfeat.options import words

    def layer_of(path: str) -> Any:
        try:
            layer = Sdf.Layer.FindOrOpen(path)
        except Tf.ErrorException as error:
            raise StageError(
                f"could not open layer {path}: {'; '.join(tf_messages(error))}"
            ) from error
        if not layer:
            raise StageError(f"could not open layer {path}: there is no such file, or it is no USD")
        return layer

    root = layer_of(options.usdFilePath)
    session = Sdf.Layer.CreateAnonymous()
    if options.sessionLayerPath:
        session = layer_of(options.sessionLayerPath)
    resolver = Ar.GetResolver()
    if options.resolver == "inherit":
        context = resolver.CreateDefaultContext()
    else:
        context = resolver.CreateDefaultContextForAsset(options.usdFilePath)
    try:
        if options.populationMask:
            mask = Usd.StagePopulationMask()
            for path in words(options.populationMask):
                mask.Add(path)
            stage = Usd.Stage.OpenMasked(root, session, context, mask)
        else:
            stage = Usd.Stage.Open(root, session, context)
    except Tf.ErrorException as error:
        raise StageError(
            f"could not open stage {options.usdFilePath}: {'; '.join(tf_messages(error))}"
        ) from error
    if not stage:
        raise StageError(f"could not open stage {options.usdFilePath}")
    return stage


def open_file(file: str) -> Any:
    """Opens a stage as it is, with an empty session layer. Raises StageError."""
    return open_stage(
        argparse.Namespace(
            usdFilePath=file, sessionLayerPath=None, resolver="root", populationMask=None
        )
    )


def find_settings(stage: Any, pass_path: str | None, settings_path: str | None) -> str:
    """Path of the RenderSettings to use: named, of the named pass, or the stage's; or empty."""
    from pxr import UsdRender

    if pass_path and settings_path:
        raise StageError(
            "--renderSettingsPrimPath and --renderPassPrimPath exclude each other; give one"
        )
    if pass_path:
        render_pass = UsdRender.Pass(_prim_at(stage, pass_path, "--renderPassPrimPath"))
        if not render_pass:
            raise StageError(f"there is no RenderPass <{pass_path}> on the stage")
        targets = render_pass.GetRenderSourceRel().GetForwardedTargets()
        if not targets:
            raise StageError(
                f"the RenderPass <{pass_path}> has no renderSource; let it name a RenderSettings"
            )
        if len(targets) > 1:
            complain(
                f"<{pass_path}> has several render sources; the first, <{targets[0]}>, is used"
            )
        return str(targets[0])
    if settings_path:
        if not UsdRender.Settings(_prim_at(stage, settings_path, "--renderSettingsPrimPath")):
            raise StageError(f"there is no RenderSettings <{settings_path}> on the stage")
        return settings_path
    return str(stage.GetMetadata("renderSettingsPrimPath") or "")


def denoise_settings(stage: Any, pass_path: str | None) -> list[tuple[str, str]]:
    """What a RenderPass of passType denoise says of the denoiser, as settings; else nothing.

    It switches the denoiser on unless it says otherwise. What it does not say is up to the render
    settings.
    """
    from pxr import Sdf, UsdRender

    from mbfeat import _core

    render_pass = UsdRender.Pass(stage.GetPrimAtPath(pass_path)) if pass_path else None
    if not render_pass or render_pass.GetPassTypeAttr().Get() != "denoise":
        return []
    found = {DENOISE_ENABLED: "true"}
    for setting in _core.denoise_setting_table():
        attribute = render_pass.GetPrim().GetAttribute(setting.name)
        value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
        if value is None:
            continue
        if isinstance(value, Sdf.AssetPath):
            value = value.resolvedPath or value.path
        found[setting.name] = str(value).lower() if isinstance(value, bool) else str(value)
    for name, text in found.items():
        try:
            _core.Settings().set(_core.SettingSource.PRIM, name, text)
        except _core.Error as error:
            raise StageError(f"<{pass_path}>: {error}") from error
    return list(found.items())


def _prim_at(stage: Any, path: str, option: str) -> Any:
    from pxr import Sdf

    if not Sdf.Path.IsValidPathString(path) or not Sdf.Path(path).IsAbsolutePath():
        raise StageError(f"{option} {path}: this is no path of a prim; write /Render/Name")
    return stage.GetPrimAtPath(path)


def find_camera(stage: Any, wanted: Any, settings_path: str) -> Any:
    """The camera to render through: named, the settings', the primary one, or an invalid one.

    With an invalid camera the recorder frames the stage.
    """
    from pxr import UsdAppUtils, UsdGeom, UsdRender, UsdUtils

    camera = UsdGeom.Camera()
    if wanted:
        camera = UsdAppUtils.GetCameraAtPath(stage, wanted)
        if not camera:
            complain(f"there is no camera {wanted} on the stage; another view is rendered")
    if not camera and settings_path:
        settings = UsdRender.Settings(stage.GetPrimAtPath(settings_path))
        targets = settings.GetCameraRel().GetForwardedTargets() if settings else []
        if len(targets) == 1:
            camera = UsdGeom.Camera(stage.GetPrimAtPath(targets[0]))
    if not camera:
        camera = UsdAppUtils.GetCameraAtPath(stage, UsdUtils.GetPrimaryCameraName())
    return camera


def rendering_color_space(stage: Any, settings_path: str) -> str:
    """The renderingColorSpace of the settings, or empty."""
    from pxr import UsdRender

    prim = stage.GetPrimAtPath(settings_path) if settings_path else None
    settings = UsdRender.Settings(prim) if prim else None
    if not settings:
        return ""
    return str(settings.GetRenderingColorSpaceAttr().Get() or "")


class _Profile:
    """OpenUSD's own tracing and memory accounts, when the options ask for them."""

    def __init__(self, options: Any) -> None:
        from pxr import Tf, Trace

        self._options = options
        if options.memstats:
            Tf.MallocTag.Initialize()
        if options.traceToFile:
            Trace.Collector().enabled = True

    def finish(self) -> None:
        from pxr import Tf, Trace

        options = self._options
        if options.traceToFile:
            Trace.Collector().enabled = False
            reporter = Trace.Reporter.globalReporter
            if options.traceFormat == "trace":
                reporter.Report(options.traceToFile)
            else:
                reporter.ReportChromeTracingToFile(options.traceToFile)
        if options.memstats:
            if Tf.MallocTag.IsInitialized():
                mebibytes = Tf.MallocTag.GetTotalBytes() / 2**20
                print(f"memory allocated by OpenUSD: {mebibytes:.0f} MiB")
            else:
                complain("--memstats: this OpenUSD keeps no memory accounts")


def command() -> NoReturn:
    """The program: main(), then an end without the interpreter's own shutdown.

    OpenUSD frees a closed stage on threads of its own. One that asks for the interpreter's lock
    while the interpreter shuts down is unwound through C++ frames that allow no unwinding, which
    ends the process with an abort after everything was written.
    """
    try:
        code = main()
    except SystemExit as leaving:  # argparse: --help, --version, usage errors
        code = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    command()
