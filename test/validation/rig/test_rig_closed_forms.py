"""The rig at rest and in motion against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import stroke_curve

pytest.importorskip("exudyn")

from default_boom import joint_angles_of_strokes, strokes_of_posture

from boom_twin import Scene
from boom_twin.validation.rig import Move, Programme, simulate, statics

G = 9.81


def mean_frequency(times, signal):
    """Of the rising zero crossings of a signal about its mean (Hz)."""
    signal = signal - signal.mean()
    rising = np.flatnonzero((signal[:-1] < 0) & (signal[1:] >= 0))
    crossings = times[rising] - signal[rising] * (times[1] - times[0]) / (signal[rising + 1] - signal[rising])
    return (len(crossings) - 1) / (crossings[-1] - crossings[0])


def length_of_slider_crank(document, angle):
    pin, rod = document["base"]["cylinder_pin"], document["sections"][0]["rod_pin"]
    x = rod[0] * np.cos(angle) - rod[1] * np.sin(angle) - pin[0]
    y = rod[0] * np.sin(angle) + rod[1] * np.cos(angle) - pin[1]
    return np.hypot(x, y)


@pytest.mark.parametrize("inclination", [0.0, 0.2])
def test_moment_balance_of_one_rigid_section(one_rigid, inclination):
    one_rigid["base"] = one_rigid["base"] | {"inclination": inclination}
    found = statics(Scene.model_validate(one_rigid), np.array([0.5]))
    angle, force = found["joints"][0], found["forces"][0]
    root = one_rigid["sections"][0]["root"]
    arm = root["com"][0] * np.cos(angle + inclination) - root["com"][1] * np.sin(angle + inclination)
    lever = (length_of_slider_crank(one_rigid, angle + 1e-6) - length_of_slider_crank(one_rigid, angle - 1e-6)) / 2e-6
    assert force == pytest.approx(-root["mass"] * G * arm / lever, rel=1e-6)
    cylinder = one_rigid["joints"][0]["cylinder"]
    spring = length_of_slider_crank(one_rigid, angle) - cylinder["closed_length"] - 0.5
    assert cylinder["k"] * spring == pytest.approx(force, rel=1e-6)
    assert found["tip"] == pytest.approx([3 * np.cos(angle), 3 * np.sin(angle)], abs=1e-9)


def test_cantilever_under_payload_and_own_weight(cantilever):
    cantilever |= {"tip": {"payload": 5.0}, "line_fill": 10.0}
    scene = Scene.model_validate(cantilever)
    found = statics(scene, strokes_of_posture(scene, "flat"), elements=32)
    bending = 2.06e11 * 1.0e-5
    sag = 5.0 * G * 4.0**3 / (3 * bending) + (20.0 + 10.0) * G * 4.0**4 / (8 * bending)
    assert found["joints"][0] == pytest.approx(0.0, abs=1e-9)
    assert -found["tip"][1] == pytest.approx(sag, rel=1e-3)


@pytest.mark.parametrize("kind", [1, 2, 3])
def test_six_bar_obeys_virtual_work(document, kind):
    """Rigid sections, massless cylinder and links: force = torque of gravity / (d stroke / d angle)."""
    joint = document["joints"][kind]
    for part in ("k", "d", "barrel", "rod"):
        joint["cylinder"].pop(part)
        document["joints"][0]["cylinder"].pop(part)
    joint.pop("mL"), joint.pop("mR")
    turned = {"length": 3.0, "root": {"mass": 50.0, "com": [1.5, 0.1], "inertia": 20.0}}
    document |= {"modes": 0, "sections": [document["sections"][kind - 1], turned], "postures": {}}
    document["sections"][0]["rod_pin"] = [0.60, -0.12]
    document["joints"] = [document["joints"][0], joint]
    scene = Scene.model_validate(document)
    strokes = np.array([0.3, stroke_curve(scene, 1, np.array([-0.7]))[0]])
    found = statics(scene, strokes)
    angles = joint_angles_of_strokes(scene, strokes)
    assert found["joints"] == pytest.approx(angles, abs=1e-8)
    total = angles.sum()
    first, pivot = scene.sections[0].length * np.exp(1j * angles[0]), complex(*scene.base.pivot)
    assert complex(*found["tip"]) == pytest.approx(pivot + first + 3.0 * np.exp(1j * total), abs=1e-8)
    torque = -50.0 * G * (1.5 * np.cos(total) - 0.1 * np.sin(total))
    lever = np.diff(stroke_curve(scene, 1, angles[1] + np.array([-1e-5, 1e-5])))[0] / 2e-5
    assert found["forces"][1] == pytest.approx(torque / lever, rel=1e-5)


def test_force_is_spring_and_damper_against_the_drive(one_rigid):
    cylinder = one_rigid["joints"][0]["cylinder"]
    cylinder["d"] = 6.0e4
    move = Programme((0.5,), (Move(0, 0.05, 0.3, 0.55),))
    rows = simulate(Scene.model_validate(one_rigid), move, 0.4, step=2.5e-4, output_step=2.5e-4)
    length = length_of_slider_crank(one_rigid, rows["joints"][:, 0])
    strokes, rates = move(rows["t"])
    rate = np.gradient(length, rows["t"], edge_order=2)
    spring = cylinder["k"] * (length - cylinder["closed_length"] - strokes[:, 0])
    damper = cylinder["d"] * (rate - rates[:, 0])
    assert np.abs(damper).max() > 300.0
    assert rows["forces"][:, 0] == pytest.approx(spring + damper, abs=3.0)


def test_work_of_the_drive_becomes_energy(one_rigid):
    move = Programme((0.5,), (Move(0, 0.05, 0.4, 0.56),))
    rows = simulate(Scene.model_validate(one_rigid), move, 0.8, step=2.5e-4, output_step=2.5e-4)
    root, rate = one_rigid["sections"][0]["root"], rows["tip_rate"]
    angle, force = rows["joints"][:, 0], rows["forces"][:, 0]
    inertia = root["inertia"] + root["mass"] * (root["com"][0] ** 2 + root["com"][1] ** 2)
    height = root["com"][0] * np.sin(angle) + root["com"][1] * np.cos(angle)
    energy = inertia * rate**2 / 2 + root["mass"] * 9.81 * height + force**2 / (2 * 2.0e6)
    power = -force * move(rows["t"])[1][:, 0]
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * 2.5e-4)])
    assert energy[-1] - energy[0] > 30.0
    assert energy - energy[0] == pytest.approx(work, abs=0.05)


def test_first_frequency_of_a_cantilever(cantilever):
    scene = Scene.model_validate(cantilever)
    first = float(strokes_of_posture(scene, "flat")[0])
    nudge = Programme((first,), (Move(0, 0.0, 0.08, first + 1e-4),))
    rows = simulate(scene, nudge, 1.6, step=1e-3, elements=12)
    closed_form = (1.87510407 / 4.0) ** 2 * np.sqrt(2.06e11 * 1.0e-5 / 20.0) / (2 * np.pi)
    free = slice(100, None)
    assert mean_frequency(rows["t"][free], rows["tip"][:, 1][free]) == pytest.approx(closed_form, rel=5e-3)
