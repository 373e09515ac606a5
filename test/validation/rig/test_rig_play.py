"""The rig's simplifications: a rod pin with play against the twin, lumped masses against the reference."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("exudyn")

from default_boom import strokes_of_posture

from boom_twin import Scene, UsageError, load_scene, simulate, statics
from boom_twin.scene.schema import Clearance, Pin
from boom_twin.validation.rig import Move, Programme, Scheme, at_rest, move
from boom_twin.validation.rig.pin_clearance import contact_of


def worn(at: str, play: float, radius: float = 0.025) -> Scene:
    """The default scene with one pin that has radial `play` (m)."""
    pin = Pin(at=at, pin_radius=radius, radial_clearance=play)
    return load_scene().model_copy(update={"clearance": Clearance(pins=(pin,))})


@pytest.mark.parametrize("posture", ["arch", "horizontal"])
@pytest.mark.parametrize("cylinder", [1, 2, 3, 4])
def test_rest(posture, cylinder):
    """The journal lies off by clearance and penetration, on the side where its cylinder presses; the twin says the same."""
    scene = worn(f"cylinder_{cylinder}.rod", 5e-4)
    resting = at_rest(scene, strokes_of_posture(scene, posture), 8, nodally_exact=True)
    (bush,) = resting.boom.bushes
    offset, force = bush.offset(resting.boom.system), resting.rows["forces"][0, cylinder - 1]
    contact = contact_of(scene, scene.clearance.pins[0])
    depth = (abs(force) / contact.stiffness) ** (1.0 / contact.exponent)
    assert abs(offset) == pytest.approx(5e-4 + depth, rel=0.03)  # the pin bears the rod's weight too
    expected = statics(scene, posture=posture)
    assert force == pytest.approx(expected.cylinder_forces[cylinder - 1], abs=2.0)
    drop = statics(load_scene(), posture=posture).tip - expected.tip
    assert tip_of_ideal_pins(posture) - tip(resting) == pytest.approx(drop, abs=2e-6)


@cache
def tip_of_ideal_pins(posture):
    """Tip (m) of the default boom at rest."""
    scene = load_scene()
    return tip(at_rest(scene, strokes_of_posture(scene, posture), 8, nodally_exact=True))


def tip(resting):
    """Tip (m) of a boom at rest."""
    return resting.rows["tip"][0]


def test_move_that_stays_in_contact():
    scene = worn("cylinder_2.rod", 1e-3)
    first = strokes_of_posture(scene, "arch")
    drive = Programme(tuple(first), (Move(0, 0.0, 0.4, first[0] + 0.01), Move(1, 0.1, 0.3, first[1] + 0.01)))
    rows, _ = move(at_rest(scene, first, 8, nodally_exact=True), drive, 0.5, 1e-3, 5e-3)
    found = simulate(scene, rows["t"], drive(rows["t"])[0], dt=1e-3)
    assert found.lost_contacts.tolist() == [0]
    joints = rows["joints"]
    assert joints == pytest.approx(found.joints, abs=4e-5)
    assert rows["forces"][:, 1] == pytest.approx(found.cylinder_forces[:, 1], rel=2e-3)


def test_load_that_turns_lets_it_cross():
    """Cylinder 4 is pushed, then pulled: the journal crosses its bush, and the joint follows by twice the play and more."""
    scene, first = worn("cylinder_4.rod", 1e-3), strokes_of_posture(load_scene(), "low")
    drive = Programme(tuple(first), (Move(3, 0.2, 1.5, 0.10),))
    resting = at_rest(scene, first, 4, nodally_exact=True)
    rows, _ = move(resting, drive, 3.0, 1e-3, 5e-3)
    ideal, _ = move(at_rest(load_scene(), first, 4, nodally_exact=True), drive, 3.0, 5e-3, 5e-3)
    force = rows["forces"][:, 3]
    assert force[0] < 0.0 < force[-1]
    lag = rows["joints"][:, 3] - ideal["joints"][:, 3]
    assert lag[0] > 5e-3 and lag[-1] < -5e-3
    again, _ = move(resting, drive, 1.0, 1e-3, 5e-3)
    assert np.array_equal(rows["joints"][:, 3][:201], again["joints"][:, 3])


def test_what_it_does_not_know_is_refused():
    with pytest.raises(UsageError, match=r"clearance.pins = joint_2.pivot: the virtual rig knows play in rod pins only"):
        at_rest(worn("joint_2.pivot", 1e-4), strokes_of_posture(load_scene(), "arch"), 2)
    scene = worn("cylinder_1.rod", 1e-4)
    joint = scene.joints[0]
    bare = joint.model_copy(update={"cylinder": joint.cylinder.model_copy(update={"rod": None})})
    with pytest.raises(UsageError, match=r"the rod has no mass.*Give joints\[0\].cylinder.rod a mass"):
        at_rest(scene.model_copy(update={"joints": (bare, *scene.joints[1:])}), strokes_of_posture(scene, "arch"), 2)


REFERENCE = Path(__file__).parents[2] / "data" / "reference"


@pytest.mark.parametrize(
    ("elements", "lumped", "scheme", "most_mm", "most_acceleration"),
    [(4, True, Scheme(kept=1, tolerance=3e-4), 0.3, 0.013), (8, False, Scheme(kept=0, tolerance=1e-3), 0.12, 0.004)],
)
def test_the_error_studys_booms_move_as_the_reference(elements, lumped, scheme, most_mm, most_acceleration):
    """The reference itself, of 32 elements that are not exact at their nodes, is 0.05 mm from a finer one."""
    expected = np.genfromtxt(REFERENCE / "arch_move.csv.gz", delimiter=",", names=True)
    first = tuple(float(expected[f"stroke_{i}_m"][0]) for i in range(1, 5))
    drive = Programme(first, (Move(0, 0.0, 1.5, first[0] + 0.05), Move(2, 0.0, 1.5, first[2] + 0.03)))
    resting = at_rest(load_scene(), np.array(first), elements, nodally_exact=True, lumped=lumped)
    found, _ = move(resting, drive, 4.0, 1e-3, 1e-2, scheme)
    every = round(1e-2 / (expected["t_s"][1] - expected["t_s"][0]))

    def away(name, *columns):
        return np.sqrt(np.mean(np.sum((found[name].T - [expected[each][::every] for each in columns]) ** 2, axis=0)))

    acceleration = np.sqrt(np.mean(expected["tip_ax_m_s2"] ** 2 + expected["tip_ay_m_s2"] ** 2))
    assert 1e3 * away("tip", "tip_x_m", "tip_y_m") < most_mm
    assert away("tip_acc", "tip_ax_m_s2", "tip_ay_m_s2") < most_acceleration * acceleration
