"""Cylinder lengths, as transducers read them, in place of drives; the interpolant of their histories."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture, with_rigid_cylinders
from oracle import booms
from scipy.interpolate import PchipInterpolator

from boom_twin import SolverError, UsageError, load_scene, simulate, statics
from boom_twin.analysis.drive import pchip
from boom_twin.validation.rig import Move, Programme

OIL = {"bore": 0.1, "rod": 0.07, "bulk_modulus": 1.2e9, "cap_line": 1e-3, "rod_line": 8e-4}


def with_oil():
    spec = booms.document()
    for joint in spec["joints"][1:3]:
        del joint["cylinder"]["k"]
        joint["cylinder"]["oil"] = dict(OIL)
    return booms.scene_of(spec)


SCENES = {"default": load_scene, "oil": with_oil, **{f"random {i}": lambda i=i: booms.random_boom(i) for i in (1, 3, 4)}}


@pytest.mark.parametrize("name", SCENES)
def test_a_boom_at_rest_is_held_by_lengths_as_by_struts(name):
    scene = SCENES[name]()
    at_drives = statics(scene, posture=next(reversed(scene.postures)))
    found, struts = statics(scene, lengths=at_drives.lengths), statics(with_rigid_cylinders(scene), at_drives.lengths)
    assert found.strokes == pytest.approx(at_drives.strokes, abs=1e-12)
    assert found.lengths == pytest.approx(at_drives.lengths, abs=1e-12)
    assert found.tip == pytest.approx(struts.tip, abs=1e-9) and found.joints == pytest.approx(struts.joints, abs=1e-10)
    assert found.cylinder_forces == pytest.approx(struts.cylinder_forces, rel=1e-9)
    assert found.frequencies == pytest.approx(at_drives.frequencies, rel=1e-9), "about the boom with its oil springs"
    for joint, length, drive, force in zip(scene.joints, found.lengths, found.strokes, found.cylinder_forces, strict=True):
        assert length == pytest.approx(drive + force / joint.cylinder.stiffness(drive), abs=1e-12)


@pytest.mark.parametrize("make", [load_scene, with_oil])
def test_a_motion_of_drives_gives_the_lengths_that_give_these_drives(make):
    scene, times = make(), np.linspace(0.0, 1.0, 1001)
    first = strokes_of_posture(scene, "arch")
    drives = Programme(tuple(first), (Move(0, 0.1, 0.6, first[0] + 0.02), Move(2, 0.2, 0.7, first[2] - 0.01)))(times)[0]
    moved = simulate(scene, times, drives, estimate_errors=False)
    again = simulate(scene, times, lengths=moved.lengths, estimate_errors=False)
    assert again.lengths == pytest.approx(moved.lengths, abs=1e-10)
    assert again.tip[:, 0] == pytest.approx(moved.tip[:, 0], abs=2e-7)
    assert again.cylinder_forces == pytest.approx(moved.cylinder_forces, abs=5.0)
    assert again.strokes == pytest.approx(drives, abs=1e-6), "a tenth of what 30 N compress of the softest oil"


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"lengths": [0.6, 0.1, 0.2]}, "lengths = 3 values: the scene has 4 cylinders. Give 4 values in m."),
        ({"lengths": [0.9, 0.1, 0.2, 0.1]}, "length_1 = 0.9 m: cylinder 1 travels 0 to 0.79 m"),
        ({"lengths": [0.6, 0.1, 0.2, 0.0]}, "Give a length inside."),
        ({"lengths": [0.6, 0.1, 0.2, 0.1], "posture": "arch"}, "give one of strokes, posture and lengths"),
    ],
)
def test_what_lengths_cannot_be(given, told):
    with pytest.raises(UsageError) as error:
        statics(None, **given)
    assert told in str(error.value) and "stroke_" not in str(error.value)


def test_oil_that_gives_more_than_there_is_has_no_drive():
    spec = booms.document()
    del spec["joints"][1]["cylinder"]["k"]
    spec["joints"][1]["cylinder"]["oil"] = OIL | {"bore": 0.08, "cap_line": 1e-4, "bulk_modulus": 1e7}
    with pytest.raises(SolverError, match=r"no drives for cylinder forces of .* bulk_modulus"):
        statics(booms.scene_of(spec), lengths=[0.6, 0.1, 0.2, 0.1])


def test_a_motion_follows_strokes_or_lengths():
    rows = np.tile(strokes_of_posture(load_scene(), "arch"), (2, 1))
    for given in ({}, {"strokes": rows, "lengths": rows}):
        with pytest.raises(UsageError, match="give either strokes or lengths"):
            simulate(None, np.array([0.0, 0.1]), **given)
    rows[1, 3] = 2.0
    with pytest.raises(UsageError, match=r"length_4 = 2 m in row 2 of the drive: cylinder 4 travels"):
        simulate(None, np.array([0.0, 0.1]), lengths=rows)


@pytest.mark.parametrize("rows", [2, 3, 4, 50])
@pytest.mark.parametrize("seed", range(5))
def test_same_curve_as_scipy(rows: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(1e-3, 1.0, rows))
    y = np.round(rng.standard_normal((rows, 4)), rng.integers(0, 4))  # few digits: equal neighbours, slopes of zero
    at = np.concatenate([x, rng.uniform(x[0], x[-1], 200)])
    values, rates = pchip(x, y, at)
    curve = PchipInterpolator(x, y, axis=0)
    assert values == pytest.approx(curve(at), abs=1e-13)
    assert rates == pytest.approx(curve.derivative()(at), abs=1e-13 / np.diff(x).min())
