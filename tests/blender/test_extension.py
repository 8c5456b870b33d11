"""The built zip in a real Blender: it installs, renders, reports errors and can be disabled. Run by run.sh."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCENE = "scenes/cornell_box.blend"
FEW_SAMPLES = "import bpy; bpy.context.scene.vlp_bpt.samples = 4"

pytestmark = pytest.mark.skipif(
    "VLP_BLENDER" not in os.environ, reason="VLP_BLENDER names no Blender: tests/blender/run.sh"
)

Blender = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def extension() -> Path:
    zips = sorted((ROOT / "dist").glob("vlp_bpt-*.zip"), key=lambda path: path.stat().st_mtime)
    assert zips, "no dist/vlp_bpt-*.zip: run `make extension` first"
    return zips[-1]


@pytest.fixture(scope="module")
def blender(tmp_path_factory: pytest.TempPathFactory, extension: Path) -> Blender:
    """Runs Blender with the extension installed and enabled, and with user folders of its own."""
    resources = tmp_path_factory.mktemp("blender")
    for name in ("config", "extensions", "scripts", "datafiles"):  # a missing one is looked for in the home folder
        (resources / name).mkdir()

    def run(*arguments: str | Path) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [os.environ["VLP_BLENDER"], *map(str, arguments)],
            cwd=ROOT,
            env=os.environ | {"BLENDER_USER_RESOURCES": str(resources)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=400,
            check=False,
        )

    installed = run("--command", "extension", "install-file", "-r", "user_default", "-e", extension)
    assert installed.returncode == 0, installed.stdout
    return run


def read(path: Path) -> np.ndarray:
    image = OpenImageIO.ImageInput.open(str(path))
    assert image is not None, OpenImageIO.geterror()
    pixels = image.read_image("float")
    image.close()
    return np.asarray(pixels)


def assert_shows_something(path: Path) -> None:
    colours = read(path)[..., :3]
    assert np.isfinite(colours).all()
    assert 0.02 < colours.mean() < 0.98
    assert colours.std() > 0.02


def test_zip_is_valid(blender: Blender, extension: Path) -> None:
    result = blender("--command", "extension", "validate", extension)
    assert result.returncode == 0, result.stdout


def test_engine_is_listed(blender: Blender) -> None:
    result = blender("-b", "-E", "help")
    assert "VLP_BPT" in result.stdout, result.stdout


def test_renders_a_frame(blender: Blender, tmp_path: Path) -> None:
    result = blender(
        "-b", SCENE, "-E", "VLP_BPT", "--python-expr", FEW_SAMPLES, "-F", "PNG", "-o", tmp_path / "x_", "-f", "1"
    )
    assert result.returncode == 0, result.stdout
    assert_shows_something(tmp_path / "x_0001.png")


@pytest.mark.parametrize("file_format, depth", [("PNG", "8"), ("OPEN_EXR", "32")])
def test_the_picture_is_the_one_made_through_bpy(
    blender: Blender, tmp_path: Path, file_format: str, depth: str
) -> None:
    """The installed zip and the bpy module of the source tree, two builds of one core, draw the same paths.

    Rounding may differ from build to build. Where it sends a path past an edge, a pixel is another one: at most one in
    10,000 may be.
    """
    suffix = {"PNG": ".png", "OPEN_EXR": ".exr"}[file_format]
    module = tmp_path / f"module{suffix}"
    options = f"render {SCENE} -o {module} --samples 2 --frame 1 --quiet".split()
    subprocess.run([sys.executable, "-m", "vlp_bpt", *options], cwd=ROOT, check=True, timeout=400)
    expression = (
        "import bpy; scene = bpy.context.scene; scene.vlp_bpt.samples = 2; image = scene.render.image_settings; "
        f"image.file_format, image.color_depth, image.color_mode = '{file_format}', '{depth}', 'RGB'"
    )
    result = blender("-b", SCENE, "-E", "VLP_BPT", "--python-expr", expression, "-o", tmp_path / "x_", "-f", "1")
    assert result.returncode == 0, result.stdout
    found, wanted = read(tmp_path / f"x_0001{suffix}"), read(module)
    assert found.shape == wanted.shape == (512, 512, 3)
    assert wanted.std() > 0.02
    bound = 1.5 / 255 if file_format == "PNG" else 1e-5 + 1e-4 * wanted
    differ = (np.abs(found - wanted) > bound).any(axis=2)
    assert differ.mean() <= 1e-4


def test_renders_an_animation(blender: Blender, tmp_path: Path) -> None:
    frames = ("-F", "OPEN_EXR", "-o", tmp_path / "x_", "-s", "1", "-e", "2", "-a")
    result = blender("-b", SCENE, "-E", "VLP_BPT", "--python-expr", FEW_SAMPLES, *frames)
    assert result.returncode == 0, result.stdout
    for frame in ("x_0001.exr", "x_0002.exr"):
        assert_shows_something(tmp_path / frame)


def test_missing_camera_fails_and_is_named(blender: Blender, tmp_path: Path) -> None:
    remove = "import bpy; [bpy.data.objects.remove(o) for o in list(bpy.data.objects) if o.type == 'CAMERA']"
    result = blender(
        "-b", SCENE, "-E", "VLP_BPT", "--python-expr", remove, "-F", "PNG", "-o", tmp_path / "x_", "-f", "1"
    )
    assert result.returncode != 0
    assert "camera" in result.stdout.lower()
    assert not list(tmp_path.iterdir())


def test_disables_and_enables_again(blender: Blender) -> None:
    code = """
import addon_utils, bpy
name = "bl_ext.user_default.vlp_bpt"
engines = lambda: {getattr(c, "bl_idname", "") for c in bpy.types.RenderEngine.__subclasses__() if c.is_registered}
assert "VLP_BPT" in engines() and hasattr(bpy.types.Scene, "vlp_bpt")
addon_utils.disable(name)
assert "VLP_BPT" not in engines() and not hasattr(bpy.types.Scene, "vlp_bpt")
assert addon_utils.enable(name) is not None
assert "VLP_BPT" in engines() and hasattr(bpy.types.Scene, "vlp_bpt")
print("disabled and enabled")
"""
    result = blender("-b", "--python-exit-code", "3", "--python-expr", code)
    assert result.returncode == 0, result.stdout
    assert "disabled and enabled" in result.stdout
    assert "Traceback" not in result.stdout
