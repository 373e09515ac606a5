"""Sessions of the rig: the sensors' statistics, common stamps, truth at the stamps, repeatable files."""

from __future__ import annotations

import gzip
import math

import numpy as np
import pytest
from oracle import booms

pytest.importorskip("exudyn")

from boom_twin.validation.rig import Move, Programme, observe, simulate
from boom_twin.validation.rig.session import EPOCH, Sensors, read, specific_force


@pytest.mark.parametrize(("sigma", "resolution"), [(2e-5, 5e-6), (math.radians(0.01), math.radians(0.005))])
def test_noise_and_rounding(sigma, resolution):
    true = np.full((20_000, 2), 0.123456)
    values = read(true, sigma, resolution, np.random.default_rng(5))
    steps = values / resolution
    assert np.abs(steps - np.rint(steps)).max() < 1e-6
    expected = math.sqrt(sigma**2 + resolution**2 / 12)
    assert (values - true).std(axis=0) == pytest.approx(expected, rel=0.03)
    assert np.abs((values - true).mean(axis=0)).max() < 4 * expected / math.sqrt(20_000)


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
def test_imu_reads_gravity_upwards_and_outward_acceleration_along_x(angle):
    force = specific_force(np.zeros((1, 2)), np.array([angle]), (0.0, -9.81))[0]
    assert force == pytest.approx([9.81 * math.sin(angle), 9.81 * math.cos(angle)])
    outward = np.array([[math.cos(angle), math.sin(angle)]])
    assert specific_force(outward, np.array([angle]), (0.0, 0.0))[0] == pytest.approx([1.0, 0.0], abs=1e-12)


EXACT = Sensors(stroke_sigma=0.0, stroke_resolution=0.0)
MOVE = Programme((0.5,), (Move(0, 0.2, 0.6, 0.56),))


@pytest.fixture
def motion():
    scene = booms.scene_of(booms.one_rigid(k=2.0e6))
    return scene, simulate(scene, MOVE, 1.0, step=1e-3)


def test_transducers_read_lengths_with_the_oil_compressed(motion):
    """The closed form of the slider crank, and the law of the oil spring and its damper."""
    scene, rows = motion
    session = observe(scene, MOVE, rows, EXACT, seed=1)
    pin, rod = np.subtract(scene.base.cylinder_pin, scene.base.pivot), scene.sections[0].rod_pin
    cylinder, angle = scene.joints[0].cylinder, session.truth["joints"]
    x, y = rod[0] * np.cos(angle) - rod[1] * np.sin(angle) - pin[0], rod[0] * np.sin(angle) + rod[1] * np.cos(angle) - pin[1]
    assert session.strokes == pytest.approx(np.hypot(x, y) - cylinder.closed_length, abs=1e-9)
    extension = session.strokes - session.truth["drives"]
    damping = (cylinder.d or 0.0) * np.gradient(extension[:, 0], session.truth["t"])[:, None]
    assert cylinder.k * extension + damping == pytest.approx(session.truth["forces"], abs=2.0)
    assert np.abs(extension).min() > 1e-5


def test_truth_file_repeats_and_reads_back(motion, tmp_path):
    scene, rows = motion
    session = observe(scene, MOVE, rows, Sensors(), seed=1)
    session.save_truth(tmp_path / "a.csv.gz")
    session.save_truth(tmp_path / "b.csv.gz")
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()
    with gzip.open(tmp_path / "a.csv.gz", "rt") as file:
        table = np.genfromtxt(file, delimiter=",", names=True)
    assert EPOCH + np.rint(table["t_s"] * 1e9).astype(np.int64) == pytest.approx(session.stamps, abs=0)
    assert table["tip_y_m"] == pytest.approx(session.truth["tip"][:, 1], abs=6e-7)
    assert table["joint_1_rad"] == pytest.approx(session.truth["joints"][:, 0], abs=6e-8)
    assert table["length_1_m"] == pytest.approx(session.truth["strokes"][:, 0], abs=6e-8)
    assert table["drive_1_m"] == pytest.approx(session.truth["drives"][:, 0], abs=6e-8)
    assert table["cylinder_force_1_N"] == pytest.approx(session.truth["forces"][:, 0], abs=0.06)
