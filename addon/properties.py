"""The settings at `scene.vlp_bpt`: the names of `vlp_bpt.RenderSettings`, explained to artists."""

from __future__ import annotations

from typing import Any

import bpy

from . import core

MODES = (
    (
        "BALANCED",
        "Balanced",
        "The least noise for the time. Light paths are short, and every way of finding light counts as much as it is "
        "good at it. Paths end by chance once they carry little light",
    ),
    (
        "REFERENCE",
        "Reference",
        "Follows light for as long as it matters: slower, but nothing is missing. Use it to judge the other modes",
    ),
    (
        "PAPER",
        "Paper",
        "The method as it was published (Celestino et al. 2014): light paths of one bounce, every way of finding "
        "light counted alike. Fast, with more noise near corners and on shiny surfaces",
    ),
)

WEIGHTINGS = (
    ("BALANCE", "Balanced", "Trusts each way of finding light by how likely it was to find it: the safe choice"),
    ("POWER", "Sharpened", "Trusts the best way of finding light more than Balanced does: less noise in simple light"),
    ("UNIFORM", "Equal", "All ways of finding light count the same, as in the paper: noisy near corners and in gloss"),
)

FILTERS = (
    ("BLACKMAN_HARRIS", "Blackman-Harris", "Smooth and sharp: the best for most pictures"),
    ("GAUSSIAN", "Gaussian", "Softer edges"),
    ("BOX", "Box", "Every pixel for itself: hard edges, and the only filter that keeps neighbouring pixels apart"),
)

DEVICES = (
    ("AUTO", "Automatic", "The fastest that is well tried: the processor, for now"),
    ("CPU", "CPU", "The processor alone"),
    ("CUDA", "GPU", "The NVIDIA graphics card alone"),
    ("HYBRID", "CPU and GPU", "Both together"),
)


def preset(mode: str) -> dict[str, Any]:
    """What a mode sets the other settings to; nothing where the core is missing."""
    try:
        settings = core.load("vlp_bpt.settings")
    except core.CoreMissing:
        return {}
    values = settings.MODE_PRESETS[settings.Mode(mode)]
    names = [name for name in settings.FROM_MODE if name != "light_paths"]
    # Enums as plain text: Blender does not take a StrEnum.
    return {name: getattr(values, name) for name in names} | {"weighting": values.weighting.value, "light_paths": 0}


def apply_mode(self: Any, context: Any) -> None:
    """Writes what the chosen mode stands for into the other settings."""
    for name, value in preset(self.mode).items():
        setattr(self, name, value)


def update_passes(self: Any, context: Any) -> None:
    """Shows the scene's passes, which depend on a setting, to the compositor."""
    for layer in self.id_data.view_layers:
        layer.update_render_passes()


_DEFAULTS = {
    "light_path_length": 12,
    "eye_path_length": 16,
    "vlp_connections": 1,
    "vlp_candidates": 8,
    "light_samples": 1,
    "splats": True,
    "roulette": True,
    "adaptive": True,
    "weighting": "BALANCE",
} | preset("BALANCED")


class VLP_BPT_SceneSettings(bpy.types.PropertyGroup):
    """How a scene is rendered with VLP-BPT."""

    mode: bpy.props.EnumProperty(
        name="Mode",
        description="A starting point: sets the path lengths, connections and weighting, which you may then change",
        items=MODES,
        default="BALANCED",
        update=apply_mode,
    )
    samples: bpy.props.IntProperty(
        name="Samples",
        description="How often the whole picture is rendered and averaged: four times as many halve the noise",
        default=128,
        min=1,
        soft_max=4096,
    )
    time_limit: bpy.props.FloatProperty(
        name="Time Limit",
        description="Stop after this time, even if there are samples left. Zero: no limit",
        default=0.0,
        min=0.0,
        max=1e9,
        soft_max=3600.0,
        step=100,
        unit="TIME_ABSOLUTE",
    )
    noise_threshold: bpy.props.FloatProperty(
        name="Noise Threshold",
        description="Stop once the whole picture's noise is as low as this, even if there are samples left: 0.1 is "
        "rough, 0.01 good, 0.001 very clean, and a tenth takes a hundred times as long. Measured before denoising, in "
        "Cycles' unit. Zero: no threshold",
        default=0.0,
        min=0.0,
        max=1e9,
        soft_max=1.0,
        step=1,
        precision=4,
    )
    adaptive: bpy.props.BoolProperty(
        name="Adaptive Sampling",
        description="Spend more samples where the picture is noisy and fewer where it is clean, more light paths where "
        "there are caustics, more virtual light points in rooms lit indirectly, and none of either where they bring "
        "less than they take. The picture stays right, and the number of samples is that of a pixel on average",
        default=_DEFAULTS["adaptive"],
    )
    light_path_length: bpy.props.IntProperty(
        name="Light Bounces",
        description="How many surfaces light is followed to from the lamps (the paper's L). Each hit becomes a virtual "
        "light point that lights the rest of the scene. Zero: no virtual light points",
        default=_DEFAULTS["light_path_length"],
        min=0,
        max=64,
        soft_max=16,
    )
    eye_path_length: bpy.props.IntProperty(
        name="Camera Bounces",
        description="How many surfaces are followed from the camera (the paper's K). Mirrors and glass need one for "
        "each surface that is passed",
        default=_DEFAULTS["eye_path_length"],
        min=1,
        max=64,
        soft_max=16,
    )
    light_paths: bpy.props.IntProperty(
        name="Light Paths",
        description="How many paths start at the lamps in each sample (the paper's N). More give finer indirect light "
        "and caustics, and take memory. Zero: one for every eight pixels, or for every pixel in Paper mode",
        default=0,
        min=0,
        max=2**26,
        soft_max=2**22,
    )
    vlp_connections: bpy.props.IntProperty(
        name="Virtual Lights per Hit",
        description="How many virtual light points light each surface that a camera path meets (C): less noise in "
        "indirect light, for more time. Zero turns them off, as in an ordinary path tracer",
        default=_DEFAULTS["vlp_connections"],
        min=0,
        max=1024,
        soft_max=16,
    )
    vlp_candidates: bpy.props.IntProperty(
        name="Candidates",
        description="From how many virtual light points each one is chosen, the brighter the likelier: less noise from "
        "those that are far away or turned aside, for a little more time",
        default=_DEFAULTS["vlp_candidates"],
        min=1,
        max=1024,
        soft_max=32,
    )
    light_samples: bpy.props.IntProperty(
        name="Lamps per Hit",
        description="How many points on lamps light each surface that the camera sees (the paper's M_s): softer "
        "shadows with less noise, for more time",
        default=_DEFAULTS["light_samples"],
        min=0,
        max=1024,
        soft_max=16,
    )
    splats: bpy.props.BoolProperty(
        name="Splats",
        description="Light that leaves the lamps may land on the picture from wherever it hits: sharp caustics, as "
        "under a glass, with far less noise. Costs little, and changes nothing else",
        default=_DEFAULTS["splats"],
    )
    roulette: bpy.props.BoolProperty(
        name="Russian Roulette",
        description="Paths end at random, the less light they carry the sooner, and those that go on count for more: "
        "faster, and the picture stays right. Off, every path takes all its bounces, as in the paper",
        default=_DEFAULTS["roulette"],
    )
    hits: bpy.props.BoolProperty(
        name="Lamp Hits",
        description="Count the light that is found by running into a lamp or the sky. Off, shining surfaces and the "
        "sky look black, and so do their images in mirrors: a switch for finding out where noise comes from",
        default=True,
    )
    weighting: bpy.props.EnumProperty(
        name="Weighting",
        description="Light can be found from the camera, from the lamps, or halfway: how the finds are averaged",
        items=WEIGHTINGS,
        default=_DEFAULTS["weighting"],
    )
    clamp_direct: bpy.props.FloatProperty(
        name="Clamp Direct",
        description="The most that one sample of light from a lamp, seen or after one surface, may add to a pixel. "
        "Removes bright specks, and the light that they stand for. Zero: no limit",
        default=0.0,
        min=0.0,
        max=1e9,
        soft_max=100.0,
    )
    clamp_indirect: bpy.props.FloatProperty(
        name="Clamp Indirect",
        description="The most that one sample of light after two surfaces or more may add to a pixel. Removes bright "
        "specks, and the light that they stand for: indirect light and caustics get darker. Zero: no limit",
        default=0.0,
        min=0.0,
        max=1e9,
        soft_max=100.0,
    )
    filter: bpy.props.EnumProperty(
        name="Pixel Filter",
        description="How what lies around a pixel's centre is weighed",
        items=FILTERS,
        default="BLACKMAN_HARRIS",
    )
    filter_width: bpy.props.FloatProperty(
        name="Width",
        description="Full width of the pixel filter, in pixels: less is sharper, more is smoother",
        default=1.5,
        min=0.01,
        max=10.0,
        subtype="PIXEL",
    )
    denoise: bpy.props.BoolProperty(
        name="Denoise",
        description="Removes the noise of the finished picture with Open Image Denoise. The picture as it was rendered "
        "and what guides the denoiser are kept as passes",
        default=False,
        update=update_passes,
    )
    denoise_prefilter: bpy.props.BoolProperty(
        name="Prefilter Guides",
        description="Denoises the colours and normals that guide the denoiser first. Takes several times as long, and "
        "leaves less error; off is good enough for quick looks",
        default=True,
    )
    device: bpy.props.EnumProperty(
        name="Device", description="What computes the picture", items=DEVICES, default="AUTO"
    )
    threads: bpy.props.IntProperty(
        name="Threads",
        description="How many processor threads render. Zero: as the output settings say, else all of them. "
        "The picture does not depend on it",
        default=0,
        min=0,
        max=1024,
    )
    seed: bpy.props.IntProperty(
        name="Seed",
        description="Another seed gives another pattern of noise; the same seed gives the same picture",
        default=0,
        min=0,
    )


def register() -> None:
    bpy.utils.register_class(VLP_BPT_SceneSettings)
    bpy.types.Scene.vlp_bpt = bpy.props.PointerProperty(type=VLP_BPT_SceneSettings, name="VLP-BPT")


def unregister() -> None:
    del bpy.types.Scene.vlp_bpt
    bpy.utils.unregister_class(VLP_BPT_SceneSettings)
