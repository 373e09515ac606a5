"""The slider-crank with play: its phases, its accuracy, and Exudyn as a witness."""

from __future__ import annotations

from cmath import exp
from dataclasses import replace
from math import cos, pi

import numpy as np
import pytest
from oracle.clearance.slider_crank import demonstration, phases

TOUCHES = 5  # compared; the motion is chaotic, and later ones differ by what the first ones differ, grown


def test_a_turn_shows_impacts_following_and_free_flight():
    mechanism = demonstration()
    period = 2.0 * pi / mechanism.speed
    found = phases(mechanism.run(2.0, 11), since=period)
    assert found["impacts"] > 5
    assert all(found[name] > 0.02 * period for name in ("impact", "following", "free flight"))
    assert sum(found[name] for name in ("impact", "following", "free flight")) == pytest.approx(period)


@pytest.mark.parametrize("law, restitution", [("lankarani-nikravesh", 0.9), ("flores", 0.5), ("hertz", 1.0)])
def test_first_touches_do_not_depend_on_solver(law, restitution):
    mechanism = demonstration(law, restitution)
    runs = [mechanism.run(0.15, 11, 1e-9, method) for method in ("DOP853", "Radau")]
    first, second = ([(e.start * mechanism.speed, e.entry) for e in run.episodes[:TOUCHES]] for run in runs)
    assert len(first) >= 2
    assert np.array(first) == pytest.approx(np.array(second), rel=1e-4)


def test_free_flight_keeps_the_energy_seen_from_the_crank():
    """A rod without contact swings about its crank pin as a pendulum in the centrifugal field."""
    mechanism = demonstration()
    free = replace(mechanism, contact=replace(mechanism.contact, clearance=1.0))
    run = free.run(0.5, 101)
    pull = 0.5 * free.rod_mass * free.rod * free.crank * free.speed**2
    turning = free.rod_inertia + 0.25 * free.rod_mass * free.rod**2
    energy = [
        0.5 * turning * (turn - free.speed) ** 2 - pull * cos(psi - free.speed * time)
        for time, (psi, _, turn, _) in zip(run.times, run.states, strict=True)
    ]
    assert not run.episodes
    assert np.ptp(energy) < 1e-7 * abs(pull)
    assert np.ptp(run.states[:, 3]) == 0.0


def test_contact_keeps_the_pin_near_the_bush():
    mechanism = demonstration("flores", 0.5)
    run = mechanism.run(1.0, 501)
    gaps = [mechanism.gap(time, state)[0] for time, state in zip(run.times, run.states, strict=True)]
    assert max(gaps) < 0.2 * mechanism.contact.clearance
    closed = mechanism.crank * exp(1j * mechanism.speed * run.times[-1]).real + mechanism.rod
    assert run.states[-1, 1] == pytest.approx(closed, abs=1.5 * mechanism.contact.clearance)


@pytest.mark.parametrize("law, restitution", [("lankarani-nikravesh", 0.9), ("flores", 0.5), ("hertz", 1.0)])
def test_exudyn_agrees(law, restitution):
    """Two touches within 0.06 turns; the offset to 2 um, of a clearance of 500 um, and the greatest depth to 0.5 %."""
    pytest.importorskip("exudyn")
    from oracle.clearance.exudyn_slider_crank import simulate

    mechanism = demonstration(law, restitution)
    angle = 2.0 * pi * 0.06
    times, offsets, places = simulate(mechanism, angle, 5e-7)
    run = mechanism.run(0.06, 2001)
    expected = [abs(mechanism.pin(time, state)[0]) for time, state in zip(run.times, run.states, strict=True)]
    assert np.abs(offsets) == pytest.approx(np.interp(times, run.times, expected), abs=2e-6)
    assert places == pytest.approx(np.interp(times, run.times, run.states[:, 1]), abs=2e-6)
    assert np.abs(offsets).max() - mechanism.contact.clearance == pytest.approx(run.episodes[0].depth, rel=5e-3)


def test_tighter_tolerances_converge():
    """Time and speed of the fourth touch, against the run at 1e-11."""
    touches = [demonstration().run(0.1, 11, tolerance).episodes[3] for tolerance in (1e-5, 1e-7, 1e-9, 1e-11)]
    errors = [abs(touch.entry / touches[-1].entry - 1.0) for touch in touches[:-1]]
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-5
