"""Materials by the names of Blender's nodes: lobes, weights and layers."""

from __future__ import annotations

from math import isclose, sqrt

import pytest

from vlp_bpt import materials
from vlp_bpt.scene import Fresnel, LobeKind, Material


def weights(material: Material) -> list[float]:
    return [lobe.weight[1] for lobe in material.lobes]


def test_mixing_scales_weights_and_emission_but_not_colours() -> None:
    a = materials.glossy((0.9, 0.5, 0.1), 0.3)
    b = materials.add(materials.diffuse((0.8, 0.4, 0.2)), materials.emission((1.0, 2.0, 3.0), 2.0))
    mixed = materials.mix(a, b, 0.25)
    assert weights(mixed) == pytest.approx([0.75, 0.1])
    assert mixed.lobes[0].f0 == (0.9, 0.5, 0.1)
    assert mixed.emission == pytest.approx((0.5, 1.0, 1.5))


@pytest.mark.parametrize("factor", [-1.0, 0.0])
def test_mixing_nothing_of_the_second_leaves_the_first(factor: float) -> None:
    a = materials.diffuse()
    assert materials.mix(a, materials.emission(), factor).lobes == a.lobes


def test_adding_keeps_layers_under_their_own_lobes() -> None:
    plastic = materials.principled()
    assert [lobe.layered_under for lobe in plastic.lobes] == [-1, 0]
    both = materials.add(materials.add(materials.mirror(), plastic), plastic)
    assert [lobe.layered_under for lobe in both.lobes] == [-1, -1, 1, -1, 3]
    mixed = materials.mix(plastic, both, 0.5)
    assert [lobe.layered_under for lobe in mixed.lobes] == [-1, 0, -1, -1, 3, -1, 5]


def test_principled_shares_its_weight_among_its_parts() -> None:
    made = materials.principled(
        base_color=(0.25, 0.5, 1.0), metallic=0.5, transmission=0.4, alpha=0.8, emission_strength=3.0
    )
    clear, metal, glass, specular, base = made.lobes
    assert clear.kind == LobeKind.TRANSPARENT and isclose(clear.weight[0], 0.2)
    assert metal.fresnel == Fresnel.SCHLICK and isclose(metal.weight[0], 0.4)
    assert metal.f0 == (0.25, 0.5, 1.0)
    assert glass.kind == LobeKind.DIELECTRIC and isclose(glass.weight[0], 0.16)
    assert glass.f82 == (0.5, sqrt(0.5), 1.0)
    assert specular.fresnel == Fresnel.DIELECTRIC and isclose(specular.weight[0], 0.24)
    assert base.kind == LobeKind.DIFFUSE and base.weight == pytest.approx((0.06, 0.12, 0.24))
    assert base.layered_under == 3
    assert made.emission == pytest.approx((2.4, 2.4, 2.4))


def test_principled_leaves_out_what_has_no_weight() -> None:
    assert [lobe.kind for lobe in materials.principled(metallic=1.0).lobes] == [LobeKind.REFLECTION]
    assert [lobe.kind for lobe in materials.principled(transmission=1.0).lobes] == [LobeKind.DIELECTRIC]
    assert [lobe.kind for lobe in materials.principled(alpha=0.0).lobes] == [LobeKind.TRANSPARENT]
    flat = materials.principled(specular_ior_level=0.0)
    assert [lobe.kind for lobe in flat.lobes] == [LobeKind.DIFFUSE] and flat.lobes[0].layered_under == -1


def test_specular_level_scales_the_reflectance_at_normal_incidence() -> None:
    lobe = materials.principled(ior=1.5, specular_ior_level=1.0).lobes[0]
    assert isclose(((lobe.ior - 1) / (lobe.ior + 1)) ** 2, 2 * 0.04)
    inverse = materials.principled(ior=1 / 1.5, specular_ior_level=1.0).lobes[0]
    assert isclose(inverse.ior, 1 / lobe.ior)
    assert materials.principled(ior=1.7).lobes[0].ior == 1.7


def test_a_tint_never_makes_a_reflectance_above_one() -> None:
    lobe = materials.principled(ior=3.0, specular_ior_level=1.0, specular_tint=(1.0, 5.0, 0.0)).lobes[0]
    assert lobe.fresnel == Fresnel.TINTED_DIELECTRIC
    assert lobe.f0 == pytest.approx((1.0, 2.0, 0.0))


def test_values_out_of_range_are_clamped_as_in_cycles() -> None:
    assert materials.glossy(roughness=1.5).lobes[0].roughness == 1.0
    assert materials.diffuse((-1.0, 0.5, 2.0)).lobes[0].weight == (0.0, 0.5, 2.0)
    assert materials.glass(ior=0.0).lobes[0].ior == 1e-5
    assert materials.principled(metallic=2.0, alpha=7.0) == materials.principled(metallic=1.0)
