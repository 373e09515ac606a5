"""Statics, frequencies and motion of the default scene (surrogate parameters) against the reference numbers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from boom_twin import load_scene, simulate, statics

REFERENCE = Path(__file__).parents[1] / "data" / "reference"


@pytest.fixture(scope="module")
def expected():
    return json.loads((REFERENCE / "statics.json").read_text())


@pytest.fixture(scope="module")
def move():
    return np.genfromtxt(REFERENCE / "arch_move.csv.gz", delimiter=",", names=True)


@pytest.fixture(scope="module")
def moved(move):
    return simulate(load_scene(), move["t_s"], _stack(move, "stroke_{}_m"), dt=1e-3)


def _stack(rows, pattern, count=4):
    return np.column_stack([rows[pattern.format(i + 1)] for i in range(count)])


def _rms(vectors):
    return np.sqrt(np.mean(np.sum(np.square(vectors), axis=-1)))


@pytest.mark.parametrize("posture", ["horizontal", "arch"])
@pytest.mark.parametrize("given_by", ["posture", "strokes"])
def test_statics(expected, posture, given_by):
    numbers = expected[posture]
    asked = {"posture": posture} if given_by == "posture" else {"strokes": np.array(numbers["stroke_m"])}
    found = statics(load_scene(), **asked)
    assert found.strokes == pytest.approx(numbers["stroke_m"], abs=1e-9)
    assert found.tip_rigid == pytest.approx(numbers["tip_rigid_m"], abs=1e-7)
    sag = np.subtract(numbers["tip_m"], numbers["tip_rigid_m"])
    assert np.linalg.norm(found.tip - found.tip_rigid - sag) < 2e-5 * np.linalg.norm(sag)  # asked: 5e-3
    assert found.joints == pytest.approx(numbers["joint_rad"], abs=2e-6)  # asked: 1e-4
    assert found.cylinder_forces == pytest.approx(numbers["cylinder_force_N"], rel=2e-5)  # asked: 5e-3
    assert found.frequencies[:4] == pytest.approx(numbers["frequencies_Hz"][:4], rel=2e-4)  # asked: 5e-3
    assert found.frequencies[4:] == pytest.approx(numbers["frequencies_Hz"][4:], rel=2e-3)  # asked: 2e-2


def test_arch_move_tip(move, moved):
    position = np.column_stack([move["tip_x_m"], move["tip_y_m"]])
    acceleration = np.column_stack([move["tip_ax_m_s2"], move["tip_ay_m_s2"]])
    assert _rms(moved.tip[:, :2] - position) < 2e-4  # asked: 2e-3 m
    assert _rms(moved.tip_acceleration[:, :2] - acceleration) < 3e-3 * _rms(acceleration)  # asked: 3e-2


def test_arch_move_joints_and_forces(move, moved):
    joints, forces = _stack(move, "joint_{}_rad"), _stack(move, "cylinder_force_{}_N")
    assert np.all(np.sqrt(np.mean((moved.joints - joints) ** 2, axis=0)) < 1e-5)  # asked: 1e-4 rad
    shares = np.sqrt(np.mean((moved.cylinder_forces - forces) ** 2, axis=0) / np.mean(forces**2, axis=0))
    assert np.all(shares < 2e-3)
