"""The rig in motion against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from oracle.oscillation import mean_frequency

pytest.importorskip("exudyn")

from default_boom import strokes_of_posture

from boom_twin import Scene
from boom_twin.validation.rig import Move, Programme, simulate


def slider_crank_length(document, angle):
    pin, rod = document["base"]["cylinder_pin"], document["sections"][0]["rod_pin"]
    x = rod[0] * np.cos(angle) - rod[1] * np.sin(angle) - pin[0]
    y = rod[0] * np.sin(angle) + rod[1] * np.cos(angle) - pin[1]
    return np.hypot(x, y)


def test_force_is_spring_and_damper_against_the_drive(one_rigid):
    cylinder = one_rigid["joints"][0]["cylinder"]
    cylinder["d"] = 6.0e4
    move = Programme((0.5,), (Move(0, 0.05, 0.3, 0.55),))
    rows = simulate(Scene.model_validate(one_rigid), move, 0.4, step=2.5e-4, output_step=2.5e-4)
    length = slider_crank_length(one_rigid, rows["joint_1_rad"])
    strokes, rates = move(rows["t_s"])
    rate = np.gradient(length, rows["t_s"], edge_order=2)
    spring = cylinder["k"] * (length - cylinder["closed_length"] - strokes[:, 0])
    damper = cylinder["d"] * (rate - rates[:, 0])
    assert np.abs(damper).max() > 300.0
    assert rows["cylinder_force_1_N"] == pytest.approx(spring + damper, abs=3.0)


def test_work_of_the_drive_becomes_energy(one_rigid):
    move = Programme((0.5,), (Move(0, 0.05, 0.4, 0.56),))
    rows = simulate(Scene.model_validate(one_rigid), move, 0.8, step=2.5e-4, output_step=2.5e-4)
    root, rate = one_rigid["sections"][0]["root"], rows["tip_angular_velocity_rad_s"]
    angle, force = rows["joint_1_rad"], rows["cylinder_force_1_N"]
    inertia = root["inertia"] + root["mass"] * (root["com"][0] ** 2 + root["com"][1] ** 2)
    height = root["com"][0] * np.sin(angle) + root["com"][1] * np.cos(angle)
    energy = inertia * rate**2 / 2 + root["mass"] * 9.81 * height + force**2 / (2 * 2.0e6)
    power = -force * move(rows["t_s"])[1][:, 0]
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
    assert mean_frequency(rows["t_s"][free], rows["tip_y_m"][free]) == pytest.approx(closed_form, rel=5e-3)
