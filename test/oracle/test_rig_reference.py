"""The virtual rig against the reference numbers of the default scene, and its cylinder lengths against the package's model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("exudyn")

from default_boom import strokes_of_posture

import boom_twin
from boom_twin import UsageError, load_scene
from boom_twin.scene.schema import Clearance, Pin
from boom_twin.validation.rig import Move, Programme, Scheme, at_rest, move, simulate, statics

REFERENCE = Path(__file__).parents[1] / "data" / "reference"


@pytest.mark.parametrize("posture", ["horizontal", "arch"])
def test_statics(posture):
    expected = json.loads((REFERENCE / "statics.json").read_text())[posture]
    found = statics(load_scene(), expected["stroke_m"])
    assert found["tip"] == pytest.approx(expected["tip_m"], abs=1e-4)
    assert found["joints"] == pytest.approx(expected["joint_rad"], abs=1e-5)
    assert found["forces"] == pytest.approx(expected["cylinder_force_N"], rel=1e-3)


EXPECTED = np.genfromtxt(REFERENCE / "arch_move.csv.gz", delimiter=",", names=True)
FIRST = np.array([EXPECTED[f"stroke_{i}_m"][0] for i in range(1, 5)])
ARCH_MOVE = Programme(tuple(FIRST), (Move(0, 0.0, 1.5, FIRST[0] + 0.05), Move(2, 0.0, 1.5, FIRST[2] + 0.03)))
ACCELERATION = np.sqrt(np.mean(EXPECTED["tip_ax_m_s2"] ** 2 + EXPECTED["tip_ay_m_s2"] ** 2))


def rms(values, *columns, every=1):
    return np.sqrt(np.mean(np.sum((values.T - [EXPECTED[each][::every] for each in columns]) ** 2, axis=0)))


@pytest.mark.parametrize("step", [1e-3, pytest.param(5e-4, marks=pytest.mark.slow)])  # to the same bounds
def test_arch_move(step):
    found = simulate(load_scene(), ARCH_MOVE, 4.0, step=step)
    assert rms(found["tip"], "tip_x_m", "tip_y_m") < 1e-5
    assert rms(found["tip_acc"], "tip_ax_m_s2", "tip_ay_m_s2") < 1e-3 * ACCELERATION
    for i in range(1, 5):
        assert rms(found["joints"][:, [i - 1]], f"joint_{i}_rad") < 1e-6
        assert rms(found["forces"][:, [i - 1]], f"cylinder_force_{i}_N") < 5.0


@pytest.mark.parametrize(
    ("elements", "lumped", "scheme", "most_mm", "most_acceleration"),
    [(4, True, Scheme(kept=1, tolerance=3e-4), 0.3, 0.013), (8, False, Scheme(kept=0, tolerance=1e-3), 0.12, 0.004)],
)
def test_the_error_studys_booms_move_as_the_reference(elements, lumped, scheme, most_mm, most_acceleration):
    """The reference itself, of 32 elements that are not exact at their nodes, is 0.05 mm from a finer one."""
    resting = at_rest(load_scene(), FIRST, elements, nodally_exact=True, lumped=lumped)
    found, _ = move(resting, ARCH_MOVE, 4.0, 1e-3, 1e-2, scheme)
    every = round(1e-2 / (EXPECTED["t_s"][1] - EXPECTED["t_s"][0]))
    assert 1e3 * rms(found["tip"], "tip_x_m", "tip_y_m", every=every) < most_mm
    assert rms(found["tip_acc"], "tip_ax_m_s2", "tip_ay_m_s2", every=every) < most_acceleration * ACCELERATION


def test_worn_pins_are_refused():
    worn = Clearance(pins=(Pin(at="joint_2.pivot", pin_radius=0.025, radial_clearance=1e-4),))
    with pytest.raises(UsageError, match=r"clearance.pins: the virtual rig knows ideal pins only"):
        at_rest(load_scene().model_copy(update={"clearance": worn}), FIRST, 2)


def test_lengths_of_the_rig_hold_and_move_the_model_as_its_drives_do():
    first = strokes_of_posture(load_scene(), "arch")
    programme = Programme(tuple(first), (Move(0, 0.1, 0.8, first[0] + 0.03), Move(2, 0.2, 0.9, first[2] - 0.02)))
    rows = simulate(load_scene(), programme, 1.5, elements=12)
    lengths, drives, forces = rows["lengths"], rows["drives"], rows["forces"]
    at_rest = boom_twin.statics(lengths=lengths[0])
    assert at_rest.strokes == pytest.approx(first, abs=1e-7)
    assert at_rest.tip == pytest.approx(rows["tip"][0], abs=2e-4)
    moved = boom_twin.simulate(None, rows["t"], lengths=lengths, estimate_errors=False)
    assert np.abs(moved.tip[:, :2] - rows["tip"]).max() < 5e-4
    assert np.abs(moved.strokes - drives).max() < 1e-5, "where the oil gives 1.2 to 8 mm"
    assert np.abs(moved.cylinder_forces - forces).max() < 1e-3 * np.abs(forces).max()
