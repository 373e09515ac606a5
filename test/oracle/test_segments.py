"""Statics and natural frequencies of the model against the finite-segment energy oracle, on many booms."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import posture_angles
from oracle import booms
from reference.segments import equilibrium as segments

from boom_twin import load_scene, statics


def _witness(scene, posture, coarse=2):
    """Tip, joints, forces, frequencies from the oracle, at the strokes of its own geometry."""
    angles = posture_angles(scene, posture)
    drive = segments.Segments(scene, 0).lengths(angles)
    row = segments.extrapolated(scene, drive, angles, coarse)
    n = len(angles)
    closed = np.array([joint.cylinder.closed_length for joint in scene.joints])
    return drive - closed, np.split(row, [2, 2 + n, 2 + 2 * n])


def _compare(scene, posture, sag=2e-5, frequency=None):
    strokes, (tip, joints, forces, frequencies) = _witness(scene, posture)
    found = statics(scene, posture=posture)
    assert found.strokes == pytest.approx(strokes, abs=1e-12)
    assert np.linalg.norm(found.tip - tip) < sag * np.linalg.norm(tip - found.tip_rigid) + 1e-9
    assert found.joints == pytest.approx(joints, abs=2e-6)
    assert found.cylinder_forces == pytest.approx(forces, rel=2e-5, abs=0.05)
    for k, bound in enumerate(frequency or ()):
        if k < len(frequencies):
            assert found.frequencies[k] == pytest.approx(frequencies[k], rel=bound), f"mode {k + 1}"


@pytest.mark.parametrize("posture", ["horizontal", "arch", "high", "low"])
def test_default_scene(posture):
    _compare(load_scene(), posture, frequency=(5e-5, 1e-4, 2e-4, 5e-4, 5e-3, 5e-3))


VARIANTS = {
    "payload": {"tip": {"payload": 60.0}},
    "line_fill": {"line_fill": 12.0},
    "uphill": {"base": {"pivot": [0.1, 0.2], "cylinder_pin": [0.55, -1.05], "inclination": 0.3}},
    "sideways gravity": {"gravity": [3.0, -9.0]},
    "more modes": {"modes": 6},
    "elastic base": {"base": {"pivot": [0.1, 0.2], "cylinder_pin": [0.55, -1.05], "inclination": 0.1, "stiffness": 5.0e6}},
    "cylinder 1 in front": {"base": {"pivot": [0.0, 0.0], "cylinder_pin": [0.9, -1.1]}},
}


@pytest.mark.parametrize("name", VARIANTS)
def test_variants_of_the_default_scene(name):
    spec = booms.document() | VARIANTS[name]
    if name == "cylinder 1 in front":
        spec["joints"][0]["cylinder"]["closed_length"] = 0.5
    _compare(booms.scene_of(spec), "arch", frequency=(5e-5, 1e-4, 2e-4, 5e-4, 5e-3, 5e-3))


@pytest.mark.parametrize("pin", [[0.3, -0.12], [1.4, -0.25], [3.2, -0.2]])
def test_rod_pin_inboard_and_outboard_of_other_pins(pin):
    """On the root, on the beam inboard of C, on the beam outboard of C."""
    spec = booms.document()
    spec["sections"][0]["rod_pin"] = pin
    spec["base"]["cylinder_pin"] = [1.2, -1.0]
    spec["joints"][0]["cylinder"]["closed_length"] = 0.2
    spec["joints"][0]["cylinder"]["max_stroke"] = 5.0
    _compare(booms.scene_of(spec), "arch", frequency=(5e-5, 1e-4, 2e-4, 5e-4, 5e-3, 5e-3))


STATICS_SEEDS = [0, 70, 3, 6, 7, 9, 13, 14, 34]
MORE_SEEDS = [5, 8, 11, 16, 18, 22, 26, 27, 28]


@pytest.mark.parametrize("seed", [*STATICS_SEEDS, *(pytest.param(seed, marks=pytest.mark.slow) for seed in MORE_SEEDS)])
def test_random_booms(seed):
    """1 to 5 sections, any order of joints, pins on root, beam and head, parts rigid, massless or incompressible.

    Every second one stands on an elastic base.
    With eight shapes a part the frequencies have only the single axial shape's error left.
    """
    scene = booms.on_elastic_base(booms.random_boom(seed).model_copy(update={"modes": 8}), 2.0e6 if seed % 2 else None)
    _compare(scene, "test", sag=3e-5, frequency=(1e-4, 1e-4))


IN_THE_LONG_RUN = [pytest.param(chosen, marks=pytest.mark.slow) for chosen in ([2, 3], [1, 2, 3])]


@pytest.mark.parametrize("chosen", [[0], [3], [0, 1], [0, 1, 2], *IN_THE_LONG_RUN])
def test_default_modes_suffice_for_short_booms(chosen):
    """Fewer sections put stretching and higher bending among the first six modes; the bounds must hold there too."""
    spec = booms.document()
    spec["sections"] = [{k: v for k, v in spec["sections"][i].items() if k != "rod_pin"} for i in chosen]
    spec["sections"][0]["rod_pin"] = [0.6, -0.12]
    spec["joints"] = [spec["joints"][0], *(spec["joints"][max(i, 1)] for i in chosen[1:])]
    spec["postures"] = {"bent": [10.0 - 20.0 * k for k in range(len(chosen))]}
    scene = booms.scene_of(spec)
    _, (_, _, _, frequencies) = _witness(scene, "bent", coarse=4)
    found = statics(scene, posture="bent").frequencies
    assert found[:4] == pytest.approx(frequencies[:4], rel=5e-3)
    assert found[4:] == pytest.approx(frequencies[4:], rel=2e-2)
