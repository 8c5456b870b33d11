"""The command line, as a user runs it: what it writes, what it says, and its exit codes."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from small_scenes import room
from terminals import OnTerminal

from vlp_bpt import Mode, RenderSettings, __version__, devices
from vlp_bpt.images import Image, read_image, write_image
from vlp_bpt.snapshot import Snapshot, save_snapshot


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With room.vlp.npz, which asks for 6 iterations in PAPER mode, and a grey.exr of the same size."""
    scene = room(24, 16)
    save_snapshot(
        tmp_path / "room.vlp.npz", Snapshot(scene, RenderSettings(mode=Mode.PAPER, samples=6), {"note": "hi"})
    )
    write_image(tmp_path / "grey.exr", Image(np.full((16, 24, 4), 0.5, dtype=np.float32), {"iterations": 3}))
    return tmp_path


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "vlp_bpt", *arguments]


def vlp_bpt(folder: Path, *arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
    """Runs `vlp-bpt ARGUMENTS` in the folder and expects the exit code."""
    result = subprocess.run(command(*arguments), cwd=folder, capture_output=True, text=True, check=False, timeout=120)
    assert result.returncode == code, result.stderr
    assert "Traceback" not in result.stderr
    return result


def test_help_teaches(folder: Path) -> None:
    top = vlp_bpt(folder, "--help").stdout
    for name in ("render", "export", "info", "compare", "merge", "bench"):
        assert re.search(rf"^    {name} ", top, re.MULTILINE), name
    for name in ("render", "export", "info", "compare", "merge"):
        text = vlp_bpt(folder, name, "--help").stdout
        assert "examples:" in text
        assert f"vlp-bpt {name}" in text.split("examples:")[1]
    assert vlp_bpt(folder, "--version").stdout == f"VLP-BPT {__version__}\n"


def test_render_writes_a_picture_and_says_what_it_took(folder: Path) -> None:
    result = vlp_bpt(folder, "render", "room.vlp.npz", "-o", "a.exr")
    assert re.fullmatch(r"a\.exr: 6 iterations, \d+\.\d\d s, \d+\.\d{3} Msamples/s, .*\n", result.stdout)
    assert re.fullmatch(r"room\.vlp\.npz: takes CPU \d+\.\d MiB\n", result.stderr)
    image = read_image(folder / "a.exr")
    assert image.pixels.shape == (16, 24, 4)
    assert image.metadata["settings"]["mode"] == "PAPER"
    assert image.metadata["settings"]["light_path_length"] == 1
    assert image.metadata["source"] == {"note": "hi", "file": "room.vlp.npz"}
    assert image.film_state is None


def test_settings_of_the_command_line_come_last(folder: Path) -> None:
    more = ["--set", "samples=9", "--samples", "2", "--seed", "5", "--device", "cpu", "--set", "filter=box"]
    vlp_bpt(folder, "render", "room.vlp.npz", "-o", "a.exr", *more)
    settings = read_image(folder / "a.exr").metadata["settings"]
    found = {name: settings[name] for name in ("samples", "seed", "device", "filter", "mode")}
    assert found == {"samples": 2, "seed": 5, "device": "CPU", "filter": "BOX", "mode": "PAPER"}


def test_debug_strategies_writes_a_picture_of_each(folder: Path) -> None:
    """PAPER with K = 2: hits and light samples of 2 eye vertices or 3, VLPs likewise; no splats."""
    result = vlp_bpt(folder, "render", "room.vlp.npz", "--debug-strategies", "all", "--set", "eye_path_length=2")
    assert result.stdout == "all: 12 pictures and strategies.png, 6 samples\n"
    assert result.stderr == ""
    names = {f"s{s}_t{t}_{kind}.exr" for s in (0, 1, 2) for t in (2, 3) for kind in ("raw", "weighted")}
    assert {path.name for path in (folder / "all").iterdir()} == names | {"strategies.png"}
    vlp_bpt(folder, "render", "room.vlp.npz", "-o", "a.exr", "--set", "eye_path_length=2")
    shares = [read_image(folder / "all" / name).pixels[..., :3] for name in names if "weighted" in name]
    np.testing.assert_allclose(np.sum(shares, axis=0), read_image(folder / "a.exr").pixels[..., :3], rtol=1e-4)


def test_a_new_mode_replaces_what_the_old_one_gave(folder: Path) -> None:
    resolved = RenderSettings.from_dict(RenderSettings(mode=Mode.PAPER, samples=2).resolved(24, 16).to_dict())
    save_snapshot(folder / "resolved.vlp.npz", Snapshot(room(24, 16), resolved))
    more = ["--set", "mode=balanced", "--set", "eye_path_length=4"]
    vlp_bpt(folder, "render", "resolved.vlp.npz", "-o", "a.exr", *more)
    settings = read_image(folder / "a.exr").metadata["settings"]
    wanted = RenderSettings(samples=2, eye_path_length=4).resolved(24, 16)
    assert settings == wanted.to_dict()


@pytest.mark.parametrize(("name", "depth"), [("a.png", "8"), ("a.png", "16"), ("a.exr", "half")])
def test_depths(folder: Path, name: str, depth: str) -> None:
    vlp_bpt(folder, "render", "room.vlp.npz", "-o", "wanted.exr")
    vlp_bpt(folder, "render", "room.vlp.npz", "-o", name, "--depth", depth)
    wanted = np.clip(read_image(folder / "wanted.exr").pixels, 0, 1)
    error = np.abs(np.clip(read_image(folder / name).pixels, 0, 1) - wanted).max()
    assert error < {"8": 1 / 200, "16": 1 / 50000, "half": 2**-11}[depth]


def test_the_time_limit(folder: Path) -> None:
    vlp_bpt(folder, "render", "room.vlp.npz", "-o", "a.exr", "--samples", "100000000", "--time", "0.5")
    metadata = read_image(folder / "a.exr").metadata
    assert metadata["iterations"] < 100000000
    assert 0.2 < metadata["seconds"] < 5


def test_the_noise_threshold(folder: Path) -> None:
    result = vlp_bpt(folder, "render", "room.vlp.npz", "-o", "a.exr", "--samples", "100000", "--noise", "0.05")
    metadata = read_image(folder / "a.exr").metadata
    assert 32 <= metadata["iterations"] < 100000
    assert metadata["noise"] <= metadata["settings"]["noise_threshold"] == 0.05
    assert f"noise {metadata['noise']:.2g}" in result.stdout


def test_a_range_has_its_iterations_whatever_the_noise_threshold_of_the_scene(folder: Path) -> None:
    settings = RenderSettings(mode=Mode.PAPER, noise_threshold=100.0)
    save_snapshot(folder / "soon.vlp.npz", Snapshot(room(24, 16), settings))
    vlp_bpt(folder, "render", "soon.vlp.npz", "-o", "whole.exr", "--samples", "100")
    assert read_image(folder / "whole.exr").metadata["iterations"] == 32
    vlp_bpt(folder, "render", "soon.vlp.npz", "-o", "part.exr", "--iterations", "5:45")
    assert read_image(folder / "part.exr").metadata["ranges"] == [[5, 45]]


def test_ranges_merge_bit_for_bit(folder: Path) -> None:
    vlp_bpt(folder, "render", "room.vlp.npz", "-o", "whole.exr", "--samples", "9")
    vlp_bpt(folder, "render", "room.vlp.npz", "-o", "a.exr", "--iterations", "0:4")
    vlp_bpt(folder, "render", "room.vlp.npz", "-o", "b.exr", "--iterations", "4:9", "--set", "threads=1")
    result = vlp_bpt(folder, "merge", "b.exr", "a.exr", "-o", "merged.exr")
    assert result.stdout == "merged.exr: 9 iterations (0:9)\n"
    whole, merged = read_image(folder / "whole.exr"), read_image(folder / "merged.exr")
    assert np.array_equal(whole.pixels, merged.pixels)
    vlp_bpt(folder, "merge", "a.exr", "b.exr", "-o", "merged.png")
    assert (
        "some of which are in 'a.exr' too" in vlp_bpt(folder, "merge", "a.exr", "a.exr", "-o", "x.exr", code=2).stderr
    )


def test_compare(folder: Path) -> None:
    write_image(folder / "dark.exr", Image(np.full((16, 24, 4), 0.25, dtype=np.float32)))
    text = vlp_bpt(folder, "compare", "dark.exr", "grey.exr").stdout
    assert [line.split()[0] for line in text.splitlines()] == ["SSIM", "FLIP", "relMSE", "mean"]
    figures = json.loads(vlp_bpt(folder, "compare", "dark.exr", "grey.exr", "--json").stdout)
    assert figures["rel_mse"] == pytest.approx(0.0625 / 0.26)
    assert figures["mean_difference"] == pytest.approx(-0.5)
    assert figures["mean_test"] == [0.25] * 3
    same = json.loads(vlp_bpt(folder, "compare", "grey.exr", "grey.exr", "--json").stdout)
    assert (same["ssim"], same["flip"], same["rel_mse"]) == (pytest.approx(1), 0, 0)


def test_info(folder: Path) -> None:
    assert "CPU: " in vlp_bpt(folder, "info").stdout
    scene = vlp_bpt(folder, "info", "room.vlp.npz").stdout
    assert "10 triangles, 0 spheres, 1 instances, 1 materials, 1 lights" in scene
    assert "24 x 16 pixels" in scene
    assert "memory to render with device=CPU (MiB): CPU " in scene
    assert 'note: "hi"' in scene
    picture = vlp_bpt(folder, "info", "grey.exr").stdout
    assert "grey.exr: 24 x 16 pixels, mean (0.5, 0.5, 0.5)" in picture
    assert "iterations: 3" in picture


def test_warnings_do_not_stop_a_render(folder: Path) -> None:
    scene = room(8, 8)
    scene.lights = []
    save_snapshot(folder / "dark.vlp.npz", Snapshot(scene))
    result = vlp_bpt(folder, "render", "dark.vlp.npz", "-o", "a.exr", "--samples", "1")
    warning, memory = result.stderr.splitlines()
    assert warning == "vlp-bpt: warning: scene: nothing emits light, the picture will be black"
    assert memory.startswith("dark.vlp.npz: takes CPU ")


RENDER = ("render", "room.vlp.npz", "-o", "a.exr")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "the following arguments are required: COMMAND"),
        (("paint",), "invalid choice: 'paint'"),
        (("render", "room.vlp.npz"), "the following arguments are required: -o/--output"),
        (("render", "room.vlp.npz", "-o", "a.exr", "--debug-strategies", "x"), "leave --output out"),
        (("render", "room.vlp.npz", "--debug-strategies", "grey.exr"), "'grey.exr': File exists"),
        (("render", "none.vlp.npz", "-o", "a.exr"), "'none.vlp.npz': there is no such file"),
        (("render", "none.blend", "-o", "a.exr"), "'none.blend': there is no such file"),
        (("render", "grey.exr", "-o", "a.exr"), "'grey.exr': scenes are .blend or .vlp.npz files"),
        (("render", "room.vlp.npz", "-o", "a.jpg"), "'a.jpg': pictures are written as .exr or .png, not '.jpg'"),
        (("render", "room.vlp.npz", "-o", "no/a.exr"), "'no/a.exr': there is no folder 'no'"),
        ((*RENDER, "--depth", "12"), "argument --depth: invalid"),
        ((*RENDER, "--depth", "16"), "'a.exr': depth 16 is not one of float, half for .exr"),
        ((*RENDER, "--set", "sampels=3"), "unknown setting 'sampels': did you mean samples?"),
        ((*RENDER, "--set", "samples"), "--set samples: must be NAME=VALUE"),
        ((*RENDER, "--set", "mode=FAST"), "mode = 'FAST': must be one of PAPER, BALANCED, REFERENCE"),
        ((*RENDER, "--samples", "0"), "samples = 0: must be from 1 to 2147483647"),
        ((*RENDER, "--time", "soon"), "time_limit = 'soon': must be a number"),
        ((*RENDER, "--noise", "low"), "noise_threshold = 'low': must be a number"),
        ((*RENDER, "--noise", "-0.1"), "noise_threshold = -0.1: must be from 0 to 1000000000"),
        ((*RENDER, "--iterations", "0:5", "--noise", "0.1"), "leave the noise threshold out"),
        (("render", "room.vlp.npz", "--debug-strategies", "x", "--noise", "0.1"), "leave --noise out"),
        ((*RENDER, "--device", "GPU"), "device = 'GPU': must be one of AUTO, CPU, CUDA, HYBRID"),
        ((*RENDER, "--frame", "3"), "--frame is for .blend files: a snapshot holds one frame"),
        ((*RENDER, "--iterations", "5"), "--iterations 5: must be A:B, two whole numbers"),
        ((*RENDER, "--iterations", "5:5"), "--iterations 5:5: A must be below B and not negative"),
        ((*RENDER, "--iterations", "0:5", "--samples", "5"), "--iterations says how many samples to render"),
        (("render", "room.vlp.npz", "-o", "a.png", "--iterations", "0:5"), "'a.png': --iterations needs an .exr file"),
        (("export", "room.vlp.npz", "-o", "b.vlp.npz"), "'room.vlp.npz': only a .blend can be exported"),
        (("info", "none.exr"), "'none.exr': there is no such file"),
        (("compare", "grey.exr"), "the following arguments are required: B"),
        (("compare", "grey.exr", "none.exr"), "'none.exr': there is no such file"),
        (("merge", "grey.exr", "-o", "a.exr"), "'grey.exr': holds no exact sums"),
        (("merge", "grey.exr", "-o", "a.tif"), "'a.tif': pictures are written as .exr or .png, not '.tif'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_is_asked_wrongly_is_said_in_one_line(folder: Path, arguments: tuple[str, ...], message: str) -> None:
    result = vlp_bpt(folder, *arguments, code=2)
    assert message in result.stderr
    assert result.stderr.count("\n") == 1
    assert result.stderr.startswith("vlp-bpt")
    assert result.stdout == ""
    assert not any((folder / name).exists() for name in ("a.exr", "a.png", "a.jpg", "a.tif"))


def test_a_scene_that_cannot_be_rendered(folder: Path) -> None:
    scene = room(8, 8)
    scene.camera = None
    save_snapshot(folder / "blind.vlp.npz", Snapshot(scene))
    assert vlp_bpt(folder, "render", "blind.vlp.npz", "-o", "a.exr", code=1).stderr == "vlp-bpt: scene: has no camera\n"
    (folder / "junk.vlp.npz").write_bytes(b"junk")
    result = vlp_bpt(folder, "render", "junk.vlp.npz", "-o", "a.exr", code=1)
    assert result.stderr.startswith("vlp-bpt: 'junk.vlp.npz': is not a VLP-BPT snapshot")


@pytest.mark.skipif(len(devices()) > 1, reason="there is a GPU")
@pytest.mark.parametrize("device", ["CUDA", "HYBRID"])
def test_without_a_gpu_the_cpu_renders_and_one_line_says_so(folder: Path, device: str) -> None:
    result = vlp_bpt(folder, *RENDER, "--device", device)
    line, memory = result.stderr.splitlines()
    assert line.startswith("vlp-bpt: warning: device CUDA: ")
    assert line.endswith("; rendering on the CPU")
    assert memory.startswith("room.vlp.npz: takes CPU ")


def test_interrupting_keeps_the_picture(folder: Path) -> None:
    terminal = OnTerminal(folder, "render", "room.vlp.npz", "-o", "a.exr", "--samples", "100000000")
    terminal.read_until(b"Msamples/s")  # shown once an iteration is complete
    terminal.process.send_signal(signal.SIGINT)
    terminal.read_until(None)
    out, _ = terminal.process.communicate(timeout=20)
    assert terminal.process.returncode == 130
    assert out.rstrip().endswith("(interrupted)")
    assert read_image(folder / "a.exr").metadata["iterations"] > 0


def test_interrupting_before_the_first_picture_leaves_none(folder: Path) -> None:
    slow = ("light_samples=1024", "vlp_connections=1024", "light_paths=2000000", "adaptive=off")
    settings = [word for value in slow for word in ("--set", value)]
    terminal = OnTerminal(folder, "render", "room.vlp.npz", "-o", "a.exr", *settings)
    terminal.read_until(b" 0/6 iterations")
    terminal.process.send_signal(signal.SIGINT)
    terminal.read_until(None)
    terminal.process.communicate(timeout=20)
    assert terminal.process.returncode == 130
    assert terminal.shown.rstrip().endswith(b"vlp-bpt: interrupted")
    assert not (folder / "a.exr").exists()


def test_progress_tells_the_noise(folder: Path) -> None:
    noise = ("--noise", "1e-5", "--time", "1.5")
    terminal = OnTerminal(folder, "render", "room.vlp.npz", "-o", "a.exr", "--samples", "100000", *noise)
    terminal.read_until(None)
    terminal.process.communicate(timeout=20)
    assert re.search(rb"/100000 iterations, [^\r]* noise 0\.\d+", terminal.shown)


def test_missing_light_is_told(folder: Path) -> None:
    short = ("--set", "eye_path_length=1", "--set", "light_path_length=0")
    said = vlp_bpt(folder, "render", "room.vlp.npz", "-o", "short.png", "--samples", "2", *short).stdout
    assert re.search(r", \d+\.\d % of the light missing \(it takes longer paths", said)
    assert (
        "missing"
        not in vlp_bpt(
            folder, "render", "room.vlp.npz", "-o", "long.png", "--samples", "2", "--set", "mode=REFERENCE"
        ).stdout
    )


def test_progress_on_a_terminal_and_without_one(folder: Path) -> None:
    arguments = ("render", "room.vlp.npz", "-o", "a.exr", "--samples", "100000", "--time", "1.5")
    terminal = OnTerminal(folder, *arguments)
    terminal.read_until(None)
    terminal.process.communicate(timeout=20)
    assert terminal.process.returncode == 0
    assert re.search(rb"\[#+\.*\] +\d+%, \d+/100000 iterations", terminal.shown)
    assert terminal.shown.endswith(b"\r\x1b[K")  # and the line is wiped
    assert vlp_bpt(folder, *arguments, "--quiet").stderr == ""
