"""A cylinder with `oil`: its stiffness is the contract's formula of the drive's stroke, wherever the model uses it."""

from __future__ import annotations

import math

import pytest
from oracle import booms

from boom_twin import statics
from boom_twin.analysis.equilibrium import rest_at
from boom_twin.analysis.modal import damping_ratio, natural_modes
from boom_twin.scene.kinematics import joint_angles_of_strokes, strokes_of_posture

OIL = {"bore": 0.1, "rod": 0.07, "bulk_modulus": 1.5e9, "cap_line": 1e-3, "rod_line": 8e-4}


def formula(oil, max_stroke, stroke):
    """k (N/m), as the contract writes it."""
    a_c, a_r = math.pi / 4 * oil["bore"] ** 2, math.pi / 4 * (oil["bore"] ** 2 - oil["rod"] ** 2)
    v_c, v_r = oil["cap_line"], oil["rod_line"]
    return oil["bulk_modulus"] * (a_c**2 / (v_c + a_c * stroke) + a_r**2 / (v_r + a_r * (max_stroke - stroke)))


def spec_with_oil(which=range(4)):
    """The default boom, the cylinders `which` with oil, all of another size."""
    spec = booms.document()
    for i in which:
        cylinder = spec["joints"][i]["cylinder"]
        del cylinder["k"]
        size = 1.0 - 0.15 * i
        cylinder["oil"] = OIL | {"bore": OIL["bore"] * size, "rod": OIL["rod"] * size}
    return spec


def with_oil(which=range(4)):
    return booms.scene_of(spec_with_oil(which))


def with_numbers(strokes):
    """The same boom with the k that its oil has at `strokes`, a number each."""
    spec = spec_with_oil()
    for joint, stroke in zip(spec["joints"], strokes, strict=True):
        cylinder = joint["cylinder"]
        cylinder["k"] = formula(cylinder.pop("oil"), cylinder["max_stroke"], stroke)
    return booms.scene_of(spec)


@pytest.mark.parametrize("posture", ["horizontal", "arch", "high", "low"])
def test_rest_frequencies_and_damping_are_those_of_the_number(posture):
    scene = with_oil()
    numbers = with_numbers(strokes_of_posture(scene, posture))
    found, expected = (statics(one, posture=posture) for one in (scene, numbers))
    assert found.tip == pytest.approx(expected.tip, abs=1e-10)
    assert found.cylinder_forces == pytest.approx(expected.cylinder_forces, rel=1e-8)
    assert found.frequencies == pytest.approx(expected.frequencies, rel=1e-8)
    strokes = strokes_of_posture(scene, posture)
    booms_ = [rest_at(one, strokes, joint_angles_of_strokes(one, strokes)) for one in (scene, numbers)]
    damping = [[damping_ratio(boom[0], mode) for mode in natural_modes(*boom, 4)] for boom in booms_]
    assert damping[0] == pytest.approx(damping[1], rel=1e-6)
