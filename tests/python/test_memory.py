"""What a render takes is told before it begins, and is what it then takes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenes import room
from test_cli import vlp_bpt

from vlp_bpt import Device, Mode, Renderer, RenderSettings
from vlp_bpt.memory import memory_lines, plan_memory
from vlp_bpt.render import load_native
from vlp_bpt.scene import Scene, World
from vlp_bpt.snapshot import Snapshot, save_snapshot
from vlp_bpt.upload import upload


def built(scene: Scene) -> Any:
    native_scene = load_native().Scene()
    upload(scene, native_scene)
    native_scene.build(1)
    return native_scene


@pytest.mark.parametrize("mode", list(Mode))
@pytest.mark.parametrize("values", [{}, {"splats": False}, {"vlp_connections": 0, "splats": False}])
def test_the_plan_is_what_a_renderer_takes(mode: Mode, values: dict[str, object]) -> None:
    scene = room(40, 24)
    scene.world = World(radiance=(1, 1, 1), image=np.ones((8, 16, 3), dtype=np.float32))
    settings = RenderSettings.from_dict({"mode": mode, "device": Device.CPU, "samples": 2, **values})
    renderer = Renderer(scene, settings)
    planned = plan_memory(scene, built(scene), settings)
    assert planned == renderer.memory
    assert renderer.iterate(2) == 2
    assert planned == renderer.memory, "nothing is added while it renders"
    assert planned["CPU"]["world"] >= 8 * 16 * 12
    assert planned["CPU"]["film"] >= 40 * 24 * 80


def test_more_light_paths_and_pixels_take_more() -> None:
    scene = room(40, 24)
    native_scene = built(scene)
    cuda = RenderSettings(device=Device.CUDA, light_paths=100, light_path_length=4)
    one = plan_memory(scene, native_scene, cuda)
    # As asked: a trial would leave out light paths that are more than the picture is worth.
    uniform, two = (plan_memory(scene, native_scene, replace(cuda, adaptive=False, light_paths=n)) for n in (100, 2000))
    blanks = 7 * 32  # of a hand of 8 candidates
    assert one["CUDA"]["light_vertices"] == 100 * 4 * (64 + 32) + blanks
    assert two["CUDA"]["light_vertices"] == 2000 * 4 * (64 + 32) + blanks
    # Samples, splats, sums; moments, level and variance of adaptive sampling.
    assert one["CUDA"]["film"] == 40 * 24 * (16 + 48 + 64 + 16 + 1 + 4)
    # And the sums and the variance that come from the GPU, and the level that goes there.
    assert one["CPU"]["film"] == 40 * 24 * (16 + 48 + 64 + 64 + 4 + 1)
    assert uniform["CUDA"]["film"] == 40 * 24 * (16 + 48 + 64)
    assert two["CUDA"]["geometry"] == one["CUDA"]["geometry"]


def test_info_tells_it(tmp_path: Path) -> None:
    scene = room(24, 16)
    save_snapshot(tmp_path / "room.vlp.npz", Snapshot(scene))
    told = vlp_bpt(tmp_path, "info", "room.vlp.npz", "--resolution", "640x480", "--set", "light_paths=5000").stdout
    assert "picture: 640 x 480 pixels" in told
    settings = RenderSettings(light_paths=5000)
    scene.film.width, scene.film.height = 640, 480
    lines = list(memory_lines(scene, built(scene), settings))
    assert len(lines) == 7
    for line in lines:
        assert f"  {line}\n" in told
    assert "memory to render with device=CUDA (MiB): CPU " in told


def test_a_render_tells_its_total_first(tmp_path: Path) -> None:
    scene = room(24, 16)
    save_snapshot(tmp_path / "room.vlp.npz", Snapshot(scene))
    command = ("render", "room.vlp.npz", "-o", "a.exr", "--samples", "1")
    total = sum(Renderer(scene, RenderSettings()).memory["CPU"].values()) / 2**20
    assert vlp_bpt(tmp_path, *command).stderr == f"room.vlp.npz: takes CPU {total:.1f} MiB\n"
    assert vlp_bpt(tmp_path, *command, "--quiet").stderr == ""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("room.vlp.npz", "--resolution", "12"), "--resolution 12: must be WxH"),
        (("room.vlp.npz", "--resolution", "0x3"), "film: width 0"),
        (("room.vlp.npz", "--set", "samples"), "--set samples: must be NAME=VALUE"),
        (("a.exr", "--set", "samples=3"), "--resolution and --set are for scenes"),
    ],
)
def test_info_refuses(tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    save_snapshot(tmp_path / "room.vlp.npz", Snapshot(room(24, 16)))
    (tmp_path / "a.exr").write_bytes(b"")
    code = 1 if "film" in message else 2
    assert message in vlp_bpt(tmp_path, "info", *arguments, code=code).stderr
