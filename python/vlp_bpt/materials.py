"""Materials by the names of Blender's shader nodes, weighed as Cycles does: each function returns a `Material`.

Colours are linear Rec. 709 triples; roughness is the node's own, in [0, 1] (values outside are clamped, as in Cycles).
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import Literal

from .scene import Fresnel, Lobe, LobeKind, Material, Rgb

Distribution = Literal["GGX", "MULTI_GGX"]

WHITE: Rgb = (1.0, 1.0, 1.0)
BLACK: Rgb = (0.0, 0.0, 0.0)

# Parts of Principled lighter than this are left out.
_CUTOFF = 1e-5


def diffuse(color: Rgb = (0.8, 0.8, 0.8), *, name: str = "Diffuse") -> Material:
    """Lambertian reflection (Diffuse BSDF of roughness 0)."""
    return Material(name, (Lobe(LobeKind.DIFFUSE, _floor(color)),))


def translucent(color: Rgb = (0.8, 0.8, 0.8), *, name: str = "Translucent") -> Material:
    """Lambertian transmission (Translucent BSDF)."""
    return Material(name, (Lobe(LobeKind.TRANSLUCENT, _floor(color)),))


def mirror(color: Rgb = WHITE, *, name: str = "Mirror") -> Material:
    """A perfect mirror (Glossy BSDF of roughness 0)."""
    return glossy(color, 0.0, name=name)


def glossy(
    color: Rgb = (0.8, 0.8, 0.8),
    roughness: float = 0.5,
    distribution: Distribution = "MULTI_GGX",
    *,
    name: str = "Glossy",
) -> Material:
    """GGX reflection that is equally bright at all angles (Glossy BSDF)."""
    lobe = Lobe(
        LobeKind.REFLECTION,
        roughness=_unit(roughness),
        f0=_floor(color),
        compensate=distribution == "MULTI_GGX",
    )
    return Material(name, (lobe,))


def conductor(
    eta: Rgb = (0.271, 0.676, 1.316),
    k: Rgb = (3.609, 2.624, 2.292),
    roughness: float = 0.5,
    distribution: Distribution = "MULTI_GGX",
    *,
    name: str = "Metallic",
) -> Material:
    """Metal of complex index of refraction eta + i k per channel (Metallic BSDF, Physical Conductor)."""
    lobe = Lobe(
        LobeKind.REFLECTION,
        roughness=_unit(roughness),
        fresnel=Fresnel.CONDUCTOR,
        f0=_floor(eta),
        f82=_floor(k),
        compensate=distribution == "MULTI_GGX",
    )
    return Material(name, (lobe,))


def metallic(
    base_color: Rgb = (0.617, 0.577, 0.540),
    edge_tint: Rgb = (0.695, 0.726, 0.770),
    roughness: float = 0.5,
    distribution: Distribution = "MULTI_GGX",
    *,
    name: str = "Metallic",
) -> Material:
    """Metal by its reflectance at normal incidence and its tint near 82 degrees (Metallic BSDF, F82 Tint)."""
    return Material(name, (_metal(base_color, edge_tint, roughness, distribution, 1.0),))


def glass(
    color: Rgb = WHITE,
    roughness: float = 0.0,
    ior: float = 1.5,
    distribution: Distribution = "MULTI_GGX",
    *,
    name: str = "Glass",
) -> Material:
    """Reflection and refraction by the dielectric Fresnel term, both tinted by `color` (Glass BSDF)."""
    lobe = Lobe(
        LobeKind.DIELECTRIC,
        roughness=_unit(roughness),
        ior=max(ior, 1e-5),
        fresnel=Fresnel.DIELECTRIC,
        f0=_floor(color),
        f82=_floor(color),
        compensate=distribution == "MULTI_GGX",
    )
    return Material(name, (lobe,))


def refraction(color: Rgb = WHITE, roughness: float = 0.0, ior: float = 1.45, *, name: str = "Refraction") -> Material:
    """Refraction without reflection; what would be reflected totally is lost (Refraction BSDF)."""
    return Material(
        name, (Lobe(LobeKind.REFRACTION, roughness=_unit(roughness), ior=max(ior, 1e-5), f82=_floor(color)),)
    )


def transparent(color: Rgb = WHITE, *, name: str = "Transparent") -> Material:
    """Lets light straight through, tinted by `color` (Transparent BSDF)."""
    return Material(name, (Lobe(LobeKind.TRANSPARENT, _floor(color)),))


def emission(color: Rgb = WHITE, strength: float = 1.0, *, name: str = "Emission") -> Material:
    """Radiance `color` * `strength` (W / m² / sr) on both sides (Emission shader)."""
    return Material(name, (), _scale(color, strength))


def mix(a: Material, b: Material, factor: float, *, name: str = "Mix") -> Material:
    """`a` at factor 0, `b` at factor 1 (Mix Shader)."""
    factor = _unit(factor)
    return add(_weighted(a, 1.0 - factor), _weighted(b, factor), name=name)


def add(a: Material, b: Material, *, name: str = "Add") -> Material:
    """The sum of two materials (Add Shader); brighter than either, so energy is the user's business."""
    shift = len(a.lobes)
    moved = tuple(
        replace(lobe, layered_under=lobe.layered_under + shift) if lobe.layered_under >= 0 else lobe for lobe in b.lobes
    )
    total = (a.emission[0] + b.emission[0], a.emission[1] + b.emission[1], a.emission[2] + b.emission[2])
    return Material(name, a.lobes + moved, total)


def principled(
    base_color: Rgb = (0.8, 0.8, 0.8),
    metallic: float = 0.0,
    roughness: float = 0.5,
    ior: float = 1.5,
    transmission: float = 0.0,
    emission_color: Rgb = WHITE,
    emission_strength: float = 0.0,
    alpha: float = 1.0,
    specular_ior_level: float = 0.5,
    specular_tint: Rgb = WHITE,
    distribution: Distribution = "MULTI_GGX",
    *,
    name: str = "Principled",
) -> Material:
    """Principled BSDF without subsurface, coat, sheen, thin film and anisotropy.

    As in Cycles: metal takes its share first, then transmission; the rest is a dielectric specular layer over a diffuse
    base. Emission and all of these are scaled by `alpha`; what remains is transparent.
    """
    compensate = distribution == "MULTI_GGX"
    roughness = _unit(roughness)
    base_color, tint = _floor(base_color), _floor(specular_tint)
    color = _ceil(base_color)
    ior = max(ior, 1e-5)
    lobes: list[Lobe] = []
    weight = _unit(alpha)
    if weight < 1.0:
        lobes.append(Lobe(LobeKind.TRANSPARENT, _scale(WHITE, 1.0 - weight)))
    emitted = _scale(emission_color, emission_strength * weight)

    metallic = _unit(metallic)
    if metallic * weight > _CUTOFF:
        lobes.append(_metal(color, tint, roughness, distribution, metallic * weight))
    weight *= 1.0 - metallic

    transmission = _unit(transmission)
    if transmission * weight > _CUTOFF:
        lobes.append(
            Lobe(
                LobeKind.DIELECTRIC,
                _scale(WHITE, transmission * weight),
                roughness,
                ior,
                Fresnel.DIELECTRIC if tint == WHITE else Fresnel.TINTED_DIELECTRIC,
                f0=_capped_tint(tint, _f0(ior)),
                f82=(sqrt(color[0]), sqrt(color[1]), sqrt(color[2])),
                compensate=compensate,
            )
        )
    weight *= 1.0 - transmission

    if weight > _CUTOFF:
        eta, f0 = _adjusted_ior(ior, specular_ior_level)
        above = -1
        if eta != 1.0:
            above = len(lobes)
            lobes.append(
                Lobe(
                    LobeKind.REFLECTION,
                    _scale(WHITE, weight),
                    roughness,
                    eta,
                    Fresnel.DIELECTRIC if tint == WHITE else Fresnel.TINTED_DIELECTRIC,
                    f0=_capped_tint(tint, f0),
                    compensate=compensate,
                )
            )
        lobes.append(Lobe(LobeKind.DIFFUSE, _scale(base_color, weight), layered_under=above))
    return Material(name, tuple(lobes), emitted)


def _metal(base_color: Rgb, edge_tint: Rgb, roughness: float, distribution: Distribution, weight: float) -> Lobe:
    return Lobe(
        LobeKind.REFLECTION,
        _scale(WHITE, weight),
        _unit(roughness),
        fresnel=Fresnel.SCHLICK,
        f0=_ceil(_floor(base_color)),
        f82=_ceil(_floor(edge_tint)),
        compensate=distribution == "MULTI_GGX",
    )


def _f0(ior: float) -> float:
    return ((ior - 1.0) / (ior + 1.0)) ** 2


def _adjusted_ior(ior: float, level: float) -> tuple[float, float]:
    """The index, and its reflectance at normal incidence, that Specular IOR Level makes of `ior` (0.5 leaves it)."""
    f0 = _f0(ior)
    if level == 0.5:
        return ior, f0
    f0 = min(f0 * 2.0 * max(level, 0.0), 0.99)
    eta = (1.0 + sqrt(f0)) / (1.0 - sqrt(f0))
    return (1.0 / eta if ior < 1.0 else eta), f0


def _capped_tint(tint: Rgb, f0: float) -> Rgb:
    """`tint` such that no reflectance at normal incidence exceeds 1."""
    most = 1.0 / f0 if f0 > 0.0 else float("inf")
    return (min(tint[0], most), min(tint[1], most), min(tint[2], most))


def _weighted(material: Material, factor: float) -> Material:
    if factor == 0.0:
        return Material(material.name)
    lobes = tuple(replace(lobe, weight=_scale(lobe.weight, factor)) for lobe in material.lobes)
    return Material(material.name, lobes, _scale(material.emission, factor))


def _scale(color: Rgb, factor: float) -> Rgb:
    return (color[0] * factor, color[1] * factor, color[2] * factor)


def _floor(color: Rgb) -> Rgb:
    return (max(color[0], 0.0), max(color[1], 0.0), max(color[2], 0.0))


def _ceil(color: Rgb) -> Rgb:
    return (min(color[0], 1.0), min(color[1], 1.0), min(color[2], 1.0))


def _unit(value: float) -> float:
    return min(max(value, 0.0), 1.0)
