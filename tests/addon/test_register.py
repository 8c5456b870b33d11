"""Registration, settings and panels."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import bpy
import pytest

import addon
from addon import preferences, properties
from addon.export.settings import export_settings
from addon.ui import reuse
from vlp_bpt.settings import FROM_MODE, MODE_PRESETS, RANGES, Device, Filter, Mode, RenderSettings, Weighting

ROOT = Path(__file__).resolve().parents[2]


def test_registering_again_and_again() -> None:
    for _ in range(2):
        addon.unregister()
        assert not hasattr(bpy.types.Scene, "vlp_bpt")
        assert not any("VLP_BPT" in panel.COMPAT_ENGINES for panel in reuse.panels())
        assert not [name for name in dir(bpy.types) if name.startswith("VLP_BPT")]
        addon.register()
        assert bpy.context.scene.vlp_bpt.mode == "BALANCED"
    bpy.context.scene.render.engine = "VLP_BPT"


def test_every_setting_has_its_name_its_default_and_a_tooltip() -> None:
    shown = bpy.context.scene.vlp_bpt
    shown.property_unset("samples")
    preset = MODE_PRESETS[Mode.BALANCED]
    for setting in fields(RenderSettings):
        default = setting.default if setting.default is not None else getattr(preset, setting.name, 0)
        assert getattr(shown, setting.name) == pytest.approx(default) if isinstance(default, float) else str(default)
        definition = shown.bl_rna.properties[setting.name]
        assert len(definition.description) > 20, setting.name
        if setting.name in RANGES and setting.name not in ("samples", "seed"):
            assert (definition.hard_min, definition.hard_max) == pytest.approx(RANGES[setting.name])
    assert set(shown.bl_rna.properties.keys()) - {"rna_type", "name"} == {item.name for item in fields(RenderSettings)}


@pytest.mark.parametrize("mode", list(Mode))
def test_a_mode_writes_what_it_stands_for(mode: Mode) -> None:
    shown, preset = bpy.context.scene.vlp_bpt, MODE_PRESETS[mode]
    shown.light_paths = 123
    shown.vlp_connections = 77
    shown.mode = mode.value
    for name in set(FROM_MODE) - {"light_paths"}:
        assert getattr(shown, name) == getattr(preset, name), name
    assert shown.light_paths == 0
    shown.eye_path_length = 9  # and leaves what is changed afterwards
    settings = export_settings(bpy.context.scene)
    assert (settings.mode, settings.eye_path_length) == (mode, 9)


def test_each_setting_is_exported() -> None:
    shown = bpy.context.scene.vlp_bpt
    values: dict[str, Any] = {
        "samples": 7,
        "time_limit": 12.5,
        "noise_threshold": 0.015,
        "light_path_length": 4,
        "eye_path_length": 5,
        "light_paths": 600,
        "vlp_connections": 2,
        "light_samples": 3,
        "splats": False,
        "roulette": False,
        "adaptive": False,
        "hits": False,
        "weighting": "POWER",
        "filter": "GAUSSIAN",
        "filter_width": 2.5,
        "device": "CPU",
        "threads": 2,
        "seed": 11,
    }
    for name, value in values.items():
        setattr(shown, name, value)
    settings = export_settings(bpy.context.scene)
    assert {name: getattr(settings, name) for name in values} == values


def test_every_value_that_a_setting_can_have_in_blender_is_valid() -> None:
    shown = bpy.context.scene.vlp_bpt
    for name in RANGES:
        definition = shown.bl_rna.properties[name]
        for value in (definition.hard_min, definition.hard_max):
            setattr(shown, name, value)
            export_settings(bpy.context.scene).validate()
        shown.property_unset(name)


def test_numbers_are_exported_as_typed() -> None:
    bpy.context.scene.vlp_bpt.filter_width = 1.7
    assert export_settings(bpy.context.scene).filter_width == 1.7


def test_blenders_own_thread_count_is_heard() -> None:
    scene = bpy.context.scene
    scene.render.threads_mode, scene.render.threads = "FIXED", 3
    assert export_settings(scene).threads == 3
    scene.vlp_bpt.threads = 2
    assert export_settings(scene).threads == 2


def test_panels_of_blender_that_fit_are_shown() -> None:
    names = {panel.__name__ for panel in reuse.panels() if "VLP_BPT" in panel.COMPAT_ENGINES}
    wanted = {
        "DATA_PT_camera",
        "DATA_PT_lens",
        "DATA_PT_camera_dof",
        "EEVEE_MATERIAL_PT_context_material",
        "EEVEE_MATERIAL_PT_surface",
        "EEVEE_WORLD_PT_surface",
        "OBJECT_PT_visibility",
        "RENDER_PT_color_management",
        "RENDER_PT_format",
        "WORLD_PT_context_world",
    }
    assert wanted <= names
    assert not {"DATA_PT_light", "RENDER_PT_simplify", "MATERIAL_PT_preview", "VIEWLAYER_PT_layer_passes"} & names
    assert not {name for name in names if name.startswith(("CYCLES", "RENDER_PT_eevee"))}


def test_panels_of_this_addon_are_for_this_engine_alone() -> None:
    own = [getattr(bpy.types, name) for name in dir(bpy.types) if name.startswith("VLP_BPT_PT")]
    assert len(own) == 9
    assert all({"VLP_BPT"} == panel.COMPAT_ENGINES for panel in own)


def test_devices_are_described() -> None:
    text = preferences.describe({"kind": "CPU", "name": "Ryzen", "isa": "avx2", "memory": 2**33})
    assert text == "CPU: Ryzen, avx2, 8.0 GB"
    assert preferences.device_lines()


def test_enums_match_the_core() -> None:
    shown = (properties.MODES, properties.WEIGHTINGS, properties.FILTERS, properties.DEVICES)
    for items, enum in zip(shown, (Mode, Weighting, Filter, Device), strict=True):
        assert {item[0] for item in items} == {value.value for value in enum}


@pytest.mark.parametrize("blocked", [False, True])
def test_exit_codes_of_the_background(tmp_path: Path, blocked: bool) -> None:
    """A scene without a camera, and a core that is missing: an error, whatever the file would have been."""
    script = (
        f"import sys; sys.path[:0] = [{str(ROOT)!r}]\n"
        + ("sys.modules['vlp_bpt'] = None\n" if blocked else "")
        + "import bpy, os, addon\n"
        "addon.register()\n"
        "scene = bpy.context.scene\n"
        "scene.render.engine = 'VLP_BPT'\n"
        + ("" if blocked else "scene.camera = None\n")
        + "scene.render.image_settings.file_format = 'OPEN_EXR'\n"
        f"scene.render.filepath = {str(tmp_path / 'x.exr')!r}\n"
        "try:\n    bpy.ops.render.render(write_still=True)\n"
        "except RuntimeError as error:\n    print('REPORTED', error); sys.stdout.flush(); os._exit(3)\n"
        "os._exit(0)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 3, done.stdout + done.stderr
    words = "core cannot be loaded" if blocked else "no camera"
    assert words in done.stdout
    assert not (tmp_path / "x.exr").exists()
