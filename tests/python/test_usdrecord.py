"""``usdrecord`` as a process: what it renders, writes, says and returns."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from mbfeat import _core, usdrecord

COMMAND = [sys.executable, "-m", "mbfeat.usdrecord"]

# A lit square in front of the camera, whose colour changes with time, and render prims for the
# tests to choose from. Without --renderSettingsPrimPath no settings apply.
STAGE = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 5
    upAxis = "Y"
)
def Xform "World"
{
    def Camera "camera"
    {
        float2 clippingRange = (0.1, 100)
        float focalLength = 20
        float horizontalAperture = 20
        float verticalAperture = 10
        double3 xformOp:translate = (0, 0, 4)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Camera "left" (inherits = </World/camera>)
    {
        double3 xformOp:translate = (-0.5, 0, 4)
    }
    def Mesh "square"
    {
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
        color3f[] primvars:displayColor = [(0.2, 0.4, 0.8)] (
            interpolation = "constant"
        )
    }
    def DistantLight "sun"
    {
        bool inputs:normalize = 1
        float inputs:intensity = 2
        float inputs:intensity.timeSamples = { 1: 1, 5: 5 }
    }
}
def Scope "Render"
{
    def RenderSettings "settings"
    {
        rel camera = </World/left>
        rel products = [</Render/beauty>, </Render/ids>]
        uniform int2 resolution = (24, 12)
        uniform int mbfeat:samplesPerPixel = 3
    }
    def RenderSettings "unwritable"
    {
        rel camera = </World/camera>
        rel products = </Render/nowhere>
        uniform int2 resolution = (24, 12)
        uniform int mbfeat:samplesPerPixel = 1
    }
    def RenderSettings "large"
    {
        rel camera = </World/left>
        rel products = [</Render/paths>, </Render/beauty>]
        uniform int2 resolution = (24, 12)
        uniform int mbfeat:samplesPerPixel = 3
        uniform double mbfeat:pathSampleMemory = 0.0001
    }
    def RenderSettings "misspelt"
    {
        rel camera = </World/camera>
        rel products = </Render/wrong>
        uniform int2 resolution = (24, 12)
        uniform int mbfeat:samplesPerPixel = 1
    }
    def RenderPass "pass"
    {
        rel renderSource = </Render/settings>
    }
    def RenderPass "sourceless"
    {
    }
    def RenderProduct "beauty"
    {
        token productName = "FOLDER/beauty.exr"
        rel orderedVars = [</Render/color>, </Render/albedo0>]
    }
    def RenderProduct "paths"
    {
        token productType = "deepRaster"
        token productName = "FOLDER/paths.exr"
        rel orderedVars = </Render/color>
    }
    def RenderProduct "ids"
    {
        token productName = "FOLDER/ids.exr"
        rel orderedVars = [</Render/primId>]
    }
    def RenderProduct "nowhere"
    {
        token productName = "FOLDER/none/image.exr"
        rel orderedVars = [</Render/color>]
    }
    def RenderProduct "wrong"
    {
        token productName = "FOLDER/wrong.exr"
        rel orderedVars = [</Render/color>, </Render/typo>]
    }
    def RenderVar "color"
    {
    }
    def RenderVar "albedo0"
    {
        uniform string sourceName = "mbfeat:albedo:0"
    }
    def RenderVar "primId"
    {
    }
    def RenderVar "typo"
    {
        uniform string sourceName = "mbfeat:albdo:0"
    }
}
"""


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    path = tmp_path / "stage.usda"
    path.write_text(STAGE.replace("FOLDER", str(tmp_path)))
    return path


@pytest.fixture
def run(tmp_path: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs usdrecord in the test's folder; small and quick unless arguments say otherwise."""

    def call(
        *arguments: str | Path, environment: dict[str, str] | None = None
    ) -> subprocess.CompletedProcess[str]:
        quick = {"MBFEAT_SAMPLES_PER_PIXEL": "2", "MBFEAT_THREADS": "1"}
        return subprocess.run(
            [*COMMAND, *map(str, arguments)],
            cwd=tmp_path,
            env={**os.environ, **(quick if environment is None else environment)},
            capture_output=True,
            text=True,
            timeout=120,
        )

    return call


Run = Callable[..., subprocess.CompletedProcess[str]]


def read_color(path: Path) -> NDArray[np.float32]:
    """Float32 [height, width, 4] of an EXR's unnamed layer."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return np.stack([channels[name].pixels.astype(np.float32) for name in "RGBA"], axis=-1)


def read_header(path: Path) -> dict[str, object]:
    with OpenEXR.File(str(path)) as file:
        return dict(file.header())


def left_over(folder: Path) -> list[str]:
    """Names in the folder that are neither the stage nor a finished image."""
    return [p.name for p in folder.iterdir() if p.suffix not in (".usda", ".exr", ".png")]


def test_image_has_width_aspect_and_header_and_a_summary(
    stage: Path, tmp_path: Path, run: Run
) -> None:
    result = run("-w", "40", "--camera", "/World/camera", "--set", "mbfeat:seed=5", stage, "a.exr")
    assert result.returncode == 0, result.stderr
    color = read_color(tmp_path / "a.exr")
    assert color.shape == (20, 40, 4)
    assert color[10, 20, 2] > color[10, 20, 1] > color[10, 20, 0] > 0
    assert color[0, 0].tolist() == [0, 0, 0, 0]
    header = read_header(tmp_path / "a.exr")
    assert str(header["mbfeat:seed"]) == "5"
    assert "stage.usda" in str(header["mbfeat:stage"])
    assert str(header["mbfeat:branches"]) == "1"
    for text in (
        "stage.usda",
        "/World/camera",
        "40 x 20",
        "a.exr",
        "s (",
        "effects:",
        "mbfeat:seed=5 (command line)",
        "mbfeat:samplesPerPixel=2 (environment)",
        "warnings: 0",
    ):
        assert text in result.stdout
    assert result.stderr == ""
    assert left_over(tmp_path) == []


def test_quiet_says_nothing(stage: Path, tmp_path: Path, run: Run) -> None:
    result = run("--quiet", "-w", "20", stage, "a.exr")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    assert (tmp_path / "a.exr").exists()


def test_frames_are_numbered_and_differ(stage: Path, tmp_path: Path, run: Run) -> None:
    result = run("-w", "20", "-cam", "camera", "-f", "1:3,5", stage, "{a}.##.exr")
    assert result.returncode == 0, result.stderr
    images = [read_color(tmp_path / f"{{a}}.{frame:02}.exr") for frame in (1, 2, 3, 5)]
    centres = np.array([image[5, 10, 2] for image in images])
    assert np.allclose(centres / centres[0], [1, 2, 3, 5], rtol=0.02)
    assert not (tmp_path / "{a}.04.exr").exists()


def test_default_time_is_not_the_first_frame(stage: Path, tmp_path: Path, run: Run) -> None:
    for name, options in (("first.exr", []), ("default.exr", ["--defaultTime"])):
        result = run("-w", "20", "-cam", "camera", *options, stage, name)
        assert result.returncode == 0, result.stderr
    first, default = read_color(tmp_path / "first.exr"), read_color(tmp_path / "default.exr")
    assert default[5, 10, 2] == pytest.approx(2 * first[5, 10, 2], rel=0.02)


def test_products_are_written_and_the_named_image_too(
    stage: Path, tmp_path: Path, run: Run
) -> None:
    result = run("-rs", "/Render/settings", stage, "image.exr", environment={})
    assert result.returncode == 0, result.stderr
    beauty = read_color(tmp_path / "beauty.exr")
    assert beauty.shape == (12, 24, 4)
    assert np.array_equal(read_color(tmp_path / "image.exr"), beauty)
    assert _core.check_product_file(str(tmp_path / "beauty.exr")) == []
    assert _core.check_product_file(str(tmp_path / "ids.exr")) == []
    for name in ("beauty.exr", "ids.exr", "image.exr"):
        assert name in result.stdout
        assert str(read_header(tmp_path / name)["mbfeat:samplesPerPixel"]) == "3"
    assert "mbfeat:samplesPerPixel=3 (prim)" in result.stdout
    assert left_over(tmp_path) == []


def test_pass_leads_to_its_settings(stage: Path, tmp_path: Path, run: Run) -> None:
    result = run("-rp", "/Render/pass", stage, "image.png")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "beauty.exr").exists() and (tmp_path / "image.png").exists()


def test_stale_product_does_not_pass_for_a_new_one(stage: Path, tmp_path: Path, run: Run) -> None:
    old = b"what an earlier render left"
    (tmp_path / "beauty.exr").write_bytes(old)
    result = run("-rs", "/Render/settings", stage, "image.exr")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "beauty.exr").read_bytes() != old


def test_unwritable_product_fails_the_command(stage: Path, tmp_path: Path, run: Run) -> None:
    result = run("-rs", "/Render/unwritable", stage, "image.exr")
    assert result.returncode == 1
    assert "/Render/nowhere" in result.stderr or "none/image.exr" in result.stderr
    assert not (tmp_path / "none").exists()


def test_deep_product_that_takes_too_much_memory_fails_alone(
    stage: Path, tmp_path: Path, run: Run
) -> None:
    arguments = ("-rs", "/Render/large", stage, "out.exr")
    roomy = run(*arguments, "--set", "mbfeat:pathSampleMemory=1")
    assert roomy.returncode == 0, roomy.stderr
    assert (tmp_path / "paths.exr").exists()
    written = (tmp_path / "beauty.exr").stat().st_mtime_ns

    result = run(*arguments)

    assert result.returncode == 1
    # 24 x 12 pixels, 2 paths, 62 floats: 140 KiB, of 105.
    named = [line for line in result.stderr.splitlines() if "error: /Render/paths" in line]
    assert len(named) == 1 and "mbfeat:pathSampleMemory" in named[0], result.stderr
    assert not (tmp_path / "paths.exr").exists()  # the one there was of another render
    assert (tmp_path / "beauty.exr").stat().st_mtime_ns > written
    assert read_color(tmp_path / "out.exr").shape == (12, 24, 4)


def test_unknown_aov_is_named_and_the_rest_is_written(
    stage: Path, tmp_path: Path, run: Run
) -> None:
    result = run("-rs", "/Render/misspelt", stage, "image.exr")
    assert result.returncode == 1
    assert "/Render/typo" in result.stderr and result.stderr.count("mbfeat:albedo:0") == 1
    assert result.stderr.splitlines()[-1].endswith("image.exr was written; see the error above")
    assert read_color(tmp_path / "wrong.exr").shape == (12, 24, 4)


def test_a_wrong_value_on_the_settings_prim_is_a_warning(
    stage: Path, tmp_path: Path, run: Run
) -> None:
    text = stage.read_text().replace("samplesPerPixel = 3", "samplesPerPixel = -3")
    stage.write_text(text)
    result = run("-rs", "/Render/settings", stage, "image.exr")
    assert result.returncode == 0
    (told,) = result.stderr.splitlines()
    assert "/Render/settings: mbfeat:samplesPerPixel" in told
    assert "  warnings: 1" in result.stdout.splitlines()


def test_paths_that_split_are_told(stage: Path, tmp_path: Path, run: Run) -> None:
    result = run("-w", "20", "--set", "mbfeat:splitting=2", stage, "a.exr")
    assert "2 samples per pixel of paths that split into 2" in result.stdout
    assert str(read_header(tmp_path / "a.exr")["mbfeat:branches"]) == "2"


@pytest.mark.parametrize("output", ["none/image.exr", "image.webp", "folder.exr"])
def test_output_that_cannot_be_written_is_told_at_once(
    output: str, stage: Path, tmp_path: Path, run: Run
) -> None:
    (tmp_path / "folder.exr").mkdir()
    result = run(stage, output)
    assert result.returncode == 1
    assert output in result.stderr and len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "none").exists() and not (tmp_path / "image.webp").exists()


def test_old_image_stays_when_the_new_one_fails(stage: Path, tmp_path: Path, run: Run) -> None:
    (tmp_path / "image.exr").write_bytes(b"old")
    result = run("-rs", "/Render/nothing", stage, "image.exr")
    assert result.returncode == 1
    assert (tmp_path / "image.exr").read_bytes() == b"old"


def test_wrong_renderer_is_a_usage_error_that_lists_renderers(stage: Path, run: Run) -> None:
    result = run("--renderer", "MBFeta", stage, "image.exr")
    assert result.returncode == 2
    assert "MBFeta" in result.stderr and "'MBFeat'" in result.stderr


def test_renderer_that_needs_a_gpu_is_refused(stage: Path, run: Run) -> None:
    result = run("--renderer", "Storm", stage, "image.exr")
    assert result.returncode == 1
    assert "GPU" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [
        (["-f", "1:3", "STAGE", "image.exr"], 2, "placeholder"),
        (["STAGE", "image.##.exr"], 2, "placeholder"),
        (["-f", "1:3x0.5", "STAGE", "image.##.exr"], 2, "precision"),
        (["-f", "one", "STAGE", "image.##.exr"], 1, "one"),
        (["-f", "1", "-d", "STAGE", "image.##.exr"], 2, "not allowed with"),
        (["-c", "huge", "STAGE", "image.exr"], 2, "complexity"),
        (["-color", "srgb", "STAGE", "image.exr"], 2, "sRGB"),
        (["--set", "mbfeat:sed=1", "STAGE", "image.exr"], 2, '"mbfeat:seed"'),
        (["--set", "mbfeat:seed=x", "STAGE", "image.exr"], 2, "an integer"),
        (["--purposes", "render,prxy", "STAGE", "image.exr"], 2, "did you mean proxy?"),
        (
            ["--set", "mbfeat:viewAov=mbfeat:albedo:9", "STAGE", "image.exr"],
            2,
            "there is no such AOV; the nearest name is mbfeat:albedo:",
        ),
        (["--purposes", "bogus", "STAGE", "image.exr"], 2, "default, proxy, render, guide"),
        (["-w", "100000000", "STAGE", "image.exr"], 2, "at most 65536"),
        (["missing.usda", "image.exr"], 1, "missing.usda"),
        (["--sessionLayer", "missing.usda", "STAGE", "image.exr"], 1, "missing.usda"),
        (["-rs", "/Render/pass", "STAGE", "image.exr"], 1, "</Render/pass>"),
        (["-rs", "not a path", "STAGE", "image.exr"], 1, "not a path"),
        (["-rp", "/Render/settings", "STAGE", "image.exr"], 1, "</Render/settings>"),
        (["-rp", "/Render/sourceless", "STAGE", "image.exr"], 1, "renderSource"),
        (["-rp", "/Render/pass", "-rs", "/Render/settings", "STAGE", "i.exr"], 1, "exclude"),
        (["-color", "openColorIO", "--ocioView", "nope", "STAGE", "image.png"], 1, "nope"),
    ],
)
def test_mistakes_are_told_with_the_exit_code_of_their_kind(
    arguments: list[str],
    status: int,
    text: str,
    stage: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    try:
        returned: object = usdrecord.main(
            [str(stage) if part == "STAGE" else part for part in arguments]
        )
    except SystemExit as end:
        returned = end.code
    assert returned == status
    assert text in capfd.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["stage.usda"]


def test_bad_environment_is_a_usage_error(stage: Path, run: Run) -> None:
    result = run(stage, "image.exr", environment={"MBFEAT_SAMPLES_PER_PIXLE": "4"})
    assert result.returncode == 2
    assert "MBFEAT_SAMPLES_PER_PIXEL" in result.stderr


def test_missing_camera_is_told_and_another_view_rendered(
    stage: Path, tmp_path: Path, run: Run
) -> None:
    result = run("-w", "20", "--camera", "/World/nobody", stage, "image.exr")
    assert result.returncode == 0
    assert "/World/nobody" in result.stderr
    assert "free camera" in result.stdout
    assert (tmp_path / "image.exr").exists()


def test_png_is_the_exr_with_the_srgb_curve(stage: Path, tmp_path: Path, run: Run) -> None:
    for name in ("image.exr", "image.tga"):
        assert run("-w", "20", "-cam", "camera", stage, name).returncode == 0
    assert run("-w", "20", "-cam", "camera", "-color", "disabled", stage, "raw.tga").returncode == 0
    linear = np.clip(read_color(tmp_path / "image.exr").astype(np.float64), 0, 1)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    curve[..., 3] = linear[..., 3]
    assert np.abs(read_tga(tmp_path / "image.tga") - curve).max() <= 0.51 / 255
    assert np.abs(read_tga(tmp_path / "raw.tga") - linear).max() <= 0.51 / 255


def test_opencolorio_view_differs_from_the_curve(stage: Path, tmp_path: Path, run: Run) -> None:
    for name, options in (("aces.tga", []), ("plain.tga", ["--ocioView", "Un-tone-mapped"])):
        result = run(
            "-w", "20", "-cam", "camera", "-color", "openColorIO",
            "--ocioConfig", "ocio://cg-config-latest", *options, stage, name,
        )  # fmt: skip
        assert result.returncode == 0, result.stderr
    assert run("-w", "20", "-cam", "camera", stage, "srgb.tga").returncode == 0
    aces, plain, srgb = (read_tga(tmp_path / f"{n}.tga") for n in ("aces", "plain", "srgb"))
    assert np.abs(plain - srgb).max() <= 2.5 / 255
    assert np.abs(aces - srgb)[5, 10, :3].max() > 5 / 255


def read_tga(path: Path) -> NDArray[np.float64]:
    """Values 0..1, [height, width, RGBA], of an uncompressed or run-length coded TGA."""
    data = path.read_bytes()
    width, height = int.from_bytes(data[12:14], "little"), int.from_bytes(data[14:16], "little")
    size = data[16] // 8
    pixels = bytearray()
    position = 18 + data[0]
    if data[2] == 2:
        pixels += data[position : position + width * height * size]
    while len(pixels) < width * height * size:
        count = (data[position] & 127) + 1
        if data[position] & 128:
            pixels += data[position + 1 : position + 1 + size] * count
            position += 1 + size
        else:
            pixels += data[position + 1 : position + 1 + size * count]
            position += 1 + size * count
    image = np.frombuffer(bytes(pixels), dtype=np.uint8).reshape(height, width, size) / 255.0
    if not data[17] & 0x20:
        image = image[::-1]
    return image[..., [2, 1, 0, 3]]


def test_interrupt_stops_within_a_second_and_leaves_nothing(stage: Path, tmp_path: Path) -> None:
    (tmp_path / "beauty.exr").write_bytes(b"old")
    process = subprocess.Popen(
        [*COMMAND, "--set", "mbfeat:samplesPerPixel=1000000", "-rs", "/Render/settings",
         str(stage), "image.exr"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    while "Recording" not in process.stdout.readline():
        assert process.poll() is None
    time.sleep(1.5)
    assert process.poll() is None
    started = time.monotonic()
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    seconds = time.monotonic() - started
    assert process.returncode == 130
    assert "interrupted" in errors and "Traceback" not in errors
    assert seconds < 1.0
    assert (tmp_path / "beauty.exr").read_bytes() == b"old"
    assert {path.name for path in tmp_path.iterdir()} == {"stage.usda", "beauty.exr"}


def test_masked_prims_are_not_rendered(stage: Path, tmp_path: Path, run: Run) -> None:
    mask = "/World/camera,/World/sun"
    result = run("-w", "20", "-cam", "camera", "--mask", mask, stage, "image.exr")
    assert result.returncode == 0, result.stderr
    assert not read_color(tmp_path / "image.exr").any()


INSTANCERS = """#usda 1.0
(
    subLayers = [@stage.usda@]
)
def PointInstancer "broken"
{
    rel prototypes = </broken/ball>
    int[] protoIndices = [0, -1, 4]
    point3f[] positions = [(0, 0, 1), (0.3, 0, 1), (0.6, 0, 1)]
    def Sphere "ball"
    {
    }
}
def PointInstancer "late"
{
    rel prototypes = </late/ball>
    int[] protoIndices.timeSamples = { 1: [0], 2: [-7] }
    point3f[] positions = [(0, 0, 1)]
    def Sphere "ball"
    {
    }
}
def PointInstancer "sound"
{
    rel prototypes = </sound/ball>
    int[] protoIndices = [0]
    point3f[] positions = [(0, 0, 2)]
    def Sphere "ball"
    {
        double radius = 0.2
        color3f[] primvars:displayColor = [(1, 0, 0)]
    }
}
class PointInstancer "_flawed"
{
    rel prototypes = </_flawed/ball>
    int[] protoIndices = [3]
    point3f[] positions = [(0, 0, 1)]
    def PointInstancer "ball"
    {
        rel prototypes = </_flawed/ball/none>
        int[] protoIndices = [-1]
    }
}
class "_shared"
{
    def "inner" (
        instanceable = true
        references = </_flawed>
    )
    {
    }
}
def "shared" (
    instanceable = true
    inherits = </_shared>
)
{
}
"""


def test_instancers_with_indices_of_no_prototype_are_told_and_left_out(
    stage: Path, tmp_path: Path, run: Run
) -> None:
    broken = stage.with_name("instancers.usda")
    broken.write_text(INSTANCERS)
    result = run("--quiet", "-w", "20", "-cam", "camera", "-f", "1:2", broken, "a.#.exr")
    assert result.returncode == 0, result.stderr
    lines = result.stderr.splitlines()
    told = {line.split("warning: ")[1].split(": ")[0]: line for line in lines}
    assert len(lines) == 3, result.stderr
    assert set(told) == {"/broken", "/late", "/shared/inner"}
    assert "2 of its 3 protoIndices" in told["/broken"] and "at 1, is -1" in told["/broken"]
    assert "at 0, is -7" in told["/late"]
    for frame in (1, 2):
        color = read_color(tmp_path / f"a.{frame}.exr")
        assert color[5, 10, 0] > 5 * color[5, 10, 2]  # the red ball of the sound instancer
        assert (
            color[5, 6, 2] > 2 * color[5, 6, 0] > 0
        )  # the square beside it, which no other ball hides
    assert broken.read_text() == INSTANCERS


def test_session_layer_is_used(stage: Path, tmp_path: Path, run: Run) -> None:
    session = tmp_path / "session.usda"
    session.write_text(
        '#usda 1.0\nover "World"\n{\n    over "square"\n    {\n'
        '        token visibility = "invisible"\n    }\n}\n'
    )
    result = run("-w", "20", "-cam", "camera", "--sessionLayer", session, stage, "image.exr")
    assert result.returncode == 0, result.stderr
    assert not read_color(tmp_path / "image.exr").any()


def test_viewed_aov_is_what_is_written(stage: Path, tmp_path: Path, run: Run) -> None:
    view = ("-w", "20", "-cam", "camera", "-color", "disabled", "--set")
    assert run(*view, "mbfeat:viewAov=albedo", stage, "albedo.exr").returncode == 0
    assert run(*view, "mbfeat:viewAov=albedo", stage, "albedo.tga").returncode == 0
    assert run(*view, "mbfeat:viewAov=cameraDepth", stage, "depth.tga").returncode == 0
    with OpenEXR.File(str(tmp_path / "albedo.exr"), separate_channels=True) as file:
        channels = file.channels()
        assert set(channels) == {"R", "G", "B"}
        centre = [float(channels[name].pixels[5, 10]) for name in "RGB"]
    assert centre == pytest.approx([0.2, 0.4, 0.8], abs=1e-3)
    shown = read_tga(tmp_path / "albedo.tga")
    assert shown[5, 10] == pytest.approx([0.2, 0.4, 0.8, 1.0], abs=0.51 / 255)
    depth = read_tga(tmp_path / "depth.tga")
    assert (depth[..., 0] == depth[..., 1]).all() and (depth[..., 0] == depth[..., 2]).all()
