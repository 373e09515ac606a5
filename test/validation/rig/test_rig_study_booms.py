"""The rig's booms of the error study against the reference; scenes that the rig refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("exudyn")

from default_boom import strokes_of_posture

from boom_twin import UsageError, load_scene
from boom_twin.scene.schema import Clearance, Pin
from boom_twin.validation.rig import Move, Programme, Scheme, at_rest, move


def test_worn_pins_are_refused():
    worn = Clearance(pins=(Pin(at="joint_2.pivot", pin_radius=0.025, radial_clearance=1e-4),))
    scene = load_scene().model_copy(update={"clearance": worn})
    with pytest.raises(UsageError, match=r"clearance.pins: the virtual rig knows ideal pins only"):
        at_rest(scene, strokes_of_posture(scene, "arch"), 2)


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
