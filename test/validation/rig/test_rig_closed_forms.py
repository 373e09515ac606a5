"""The force of the rig's cylinder against closed forms, at rest and in motion; twins on random booms are its other witness."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms

pytest.importorskip("exudyn")

from boom_twin import Scene
from boom_twin.validation.rig import Move, Programme, simulate, statics

G = 9.81


def length_of_slider_crank(document, angle):
    pin, rod = document["base"]["cylinder_pin"], document["sections"][0]["rod_pin"]
    x = rod[0] * np.cos(angle) - rod[1] * np.sin(angle) - pin[0]
    y = rod[0] * np.sin(angle) + rod[1] * np.cos(angle) - pin[1]
    return np.hypot(x, y)


@pytest.mark.parametrize("inclination", [0.0, 0.2])
def test_moment_balance_of_one_rigid_section(inclination):
    one_rigid = booms.one_rigid(k=2.0e6)
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


def test_force_is_spring_and_damper_against_the_drive():
    one_rigid = booms.one_rigid(k=2.0e6, d=6.0e4)
    cylinder = one_rigid["joints"][0]["cylinder"]
    move = Programme((0.5,), (Move(0, 0.05, 0.3, 0.55),))
    rows = simulate(Scene.model_validate(one_rigid), move, 0.4, step=2.5e-4, output_step=2.5e-4)
    length = length_of_slider_crank(one_rigid, rows["joints"][:, 0])
    strokes, rates = move(rows["t"])
    rate = np.gradient(length, rows["t"], edge_order=2)
    spring = cylinder["k"] * (length - cylinder["closed_length"] - strokes[:, 0])
    damper = cylinder["d"] * (rate - rates[:, 0])
    assert np.abs(damper).max() > 300.0
    assert rows["forces"][:, 0] == pytest.approx(spring + damper, abs=3.0)
