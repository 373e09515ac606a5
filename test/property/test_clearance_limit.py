"""Clearance left out is the limit of its clearance and of the compliance of its contact; nothing on the way is NaN."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture
from oracle import booms
from oracle.clearance.scenes import PINS, RODS, with_pins

from boom_twin import statics
from boom_twin.analysis.methods import integrate_with
from boom_twin.scene.schema import IDEAL_BELOW

TRAVEL, RISE = np.array([0.03, -0.02, 0.03, 0.02]), 0.3  # m, s
STEP, EVERY = 1e-3, 4  # s, steps


def stiff(factor):
    """The default boom with rigid sections, so that its material is that of the pins alone, `factor` times steel."""
    spec = booms.document()
    spec["sections"] = [section | {"modes": 0} for section in spec["sections"]]
    spec["material"]["E"] *= factor
    return spec


def moved(scene, rise=RISE):
    """The boom moved within `rise` (s) and left alone."""
    first = strokes_of_posture(scene, "arch")

    def drive(times):
        x = np.clip(times / rise, 0.0, 1.0)[:, None]
        shape, rate = x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * x**2 * (1.0 - x) ** 2 / rise
        return first + TRAVEL * shape, TRAVEL * rate

    return integrate_with(scene, drive, rise + 0.1, STEP, EVERY)


def distance(one, other):
    """Largest distance of two tips, m."""
    return float(np.linalg.norm(one - other, axis=-1).max())


@pytest.mark.parametrize("pins", [RODS, PINS], ids=["rods", "all"])
def test_rest_goes_to_that_on_ideal_pins(pins):
    """With the clearance at first. What remains is the penetration.

    It goes with the pins' E to the power -2/3, until it is as small as the smoothing.
    """
    spec = booms.document()
    ideal = statics(booms.scene_of(spec), posture="arch", modes=0).tip
    tips = [statics(with_pins(spec, pins, c), posture="arch", modes=0).tip for c in (1e-3, 1e-4, 1e-5, 1e-6)]
    off = np.array([distance(tip, ideal) for tip in tips])
    assert np.all(np.diff(off) < 0.0)
    rests = []
    for factor in (1.0, 8.0, 1e6):
        ideal = statics(booms.scene_of(stiff(factor)), posture="arch", modes=0).tip
        found = [statics(with_pins(stiff(factor), pins, c), posture="arch", modes=0).tip for c in (2e-6, IDEAL_BELOW)]
        rests.append(distance(2.0 * found[1] - found[0], ideal))  # on to no clearance
    assert rests[1] == pytest.approx(0.25 * rests[0], rel=0.05)
    assert rests[2] < 3e-3 * rests[0]


@pytest.mark.parametrize("pins", [RODS, PINS], ids=["rods", "all"])
def test_a_move_goes_to_that_on_ideal_pins(pins):
    off, spec = [], stiff(1e6)
    ideal = moved(booms.scene_of(spec))
    for clearance in (1e-4, 1e-5, 1e-6):
        found = moved(with_pins(spec, pins, clearance))
        assert np.isfinite(found.pins).all() and np.isfinite(found.tip_acceleration).all()
        off.append(distance(found.tip, ideal.tip))
    assert off[1] < 0.2 * off[0] and off[2] < 0.2 * off[1]


def values_of(found):
    """All results of a march, a row an instant."""
    blocks = (found.tip, found.tip_acceleration, found.joints, found.cylinder_forces, found.pins)
    return np.hstack([block.reshape(len(found.times), -1) for block in blocks])


@pytest.mark.parametrize("clearance", [1e-6, 1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("treatment", ["contact", "spring-damper"])
def test_all_pins_at_once_with_friction(treatment, clearance):
    """All 21 pins of the default boom, in a move of one second."""
    found = moved(with_pins(booms.document(), PINS, clearance, treatment, friction=0.1), 1.0)
    assert found.status == "ok" and np.isfinite(values_of(found)).all()


@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize("clearance", [1e-6, 1e-3])
def test_a_move_that_is_too_much_is_told(clearance, friction):
    """Accelerations of the tip of 19 g: a boom that cannot be followed says so, and leaves no row half done."""
    found = moved(with_pins(booms.document(), PINS, clearance, friction=friction))
    finite = np.isfinite(values_of(found)).all(axis=1)
    last = int(finite.sum())
    assert finite[:last].all() and (found.status == "ok") == (last == len(finite))
    assert np.abs(found.tip[:last]).max() < 20.0
    assert found.status == "ok" or "did not converge" in found.status


@pytest.mark.parametrize("clearance", [1e-3, 2e-3])
@pytest.mark.parametrize("posture", ["horizontal", "arch", "high", "low"])
def test_rest_is_found_however_wide_the_clearance(posture, clearance):
    """All pins at once; the wider, the more the boom sags."""
    tips = [statics(with_pins(booms.document(), PINS, c), posture=posture, modes=0).tip for c in (0.5 * clearance, clearance)]
    assert tips[1][1] < tips[0][1] < statics(booms.scene_of(booms.document()), posture=posture, modes=0).tip[1]
