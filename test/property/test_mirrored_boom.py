"""A boom reflected in the base's x axis, with gravity reflected too, does the same reflected."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import example_text, posture_angles, skeleton
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import booms
from ruamel.yaml import YAML

from boom_twin import simulate, statics
from boom_twin.scene.kinematics import PassiveJoints

few = settings(max_examples=12, deadline=None, derandomize=True, database=None)
FLIP = np.array([1.0, -1.0])


def pair(spec):
    """A scene from plain dicts, and its mirror image."""
    return booms.scene_of(spec), booms.scene_of(booms.mirrored(spec))


def z_fold():
    return YAML(typ="safe").load(example_text("five_section_z_fold"))


def assert_mirrored_at_rest(spec, posture):
    scene, image = pair(spec)
    found, seen = statics(scene, posture=posture, modes=4), statics(image, posture=posture, modes=4)
    assert seen.strokes == pytest.approx(found.strokes, abs=1e-12)
    assert seen.tip * FLIP == pytest.approx(found.tip, abs=1e-10)
    assert -seen.joints == pytest.approx(found.joints, abs=1e-10)
    assert seen.cylinder_forces == pytest.approx(found.cylinder_forces, rel=1e-8, abs=1e-3)
    assert seen.frequencies == pytest.approx(found.frequencies, rel=1e-8)


@few
@given(st.integers(0, 400))
def test_rest_and_frequencies(number):
    assert_mirrored_at_rest(booms.random_boom(number).model_dump(exclude_none=True), "test")


@pytest.mark.parametrize("posture", ["horizontal", "arch", "high", "low"])
def test_the_default_boom_with_all_its_linkages_on_the_right(posture):
    spec = booms.document()
    assert {joint["side"] for joint in booms.mirrored(spec)["joints"][1:]} == {"right"}
    assert_mirrored_at_rest(spec, posture)


def test_motion():
    spec = booms.document()
    scene, image = pair(spec)
    times = np.linspace(0.0, 0.4, 41)
    strokes = statics(scene, posture="arch", modes=0).strokes + np.outer(times**3, [0.3, -0.1, 0.2, 0.1])
    found, seen = (simulate(one, times, strokes, dt=2e-3) for one in (scene, image))
    assert seen.tip[:, :2] * FLIP == pytest.approx(found.tip[:, :2], abs=1e-9)
    assert seen.tip_acceleration[:, :2] * FLIP == pytest.approx(found.tip_acceleration[:, :2], abs=1e-6)
    assert seen.cylinder_forces == pytest.approx(found.cylinder_forces, rel=1e-7, abs=1e-2)


@pytest.mark.parametrize("make", [booms.document, z_fold])
def test_pins_and_passive_joints(make):
    scene, image = pair(make())
    for posture in scene.postures:
        angles = posture_angles(scene, posture)
        assert posture_angles(image, posture) == pytest.approx(-angles)
        for joint, other in zip(skeleton(scene, angles).joints, skeleton(image, -angles).joints, strict=True):
            assert joint.named.keys() == other.named.keys()
            for name, pin in joint.named.items():
                assert other.named[name] * FLIP == pytest.approx(pin, abs=1e-12)
        passive = np.array([PassiveJoints(one).positions(sign * angles) for one, sign in ((scene, 1.0), (image, -1.0))])
        assert np.exp(1j * passive[1]) == pytest.approx(np.exp(-1j * passive[0]), abs=1e-12)
