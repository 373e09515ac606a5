"""A pin that is lifted off and hits: the boom on a worn pin against equations written by hand in other coordinates."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from compiled import compile_scene
from default_boom import strokes_of_posture
from oracle.clearance.scenes import RODS, rigid_document, smooth_move, with_pins
from reference.contact_law import HYSTERESIS, Contact
from reference.worn_pin import geometry
from reference.worn_pin.motion import freed

from boom_twin.analysis.methods import integrate_with
from boom_twin.kernels.elements.pin_contact import SMOOTH

MOVE, END = 0.2, 0.3  # s
TRAVEL = (0.03, 0.02, 0.02, 0.02)  # m
HEADINGS = np.array([0.5, -0.3, -0.6, -1.0])


def both(count, step, treatment="contact", clearance=1e-4, end=END, rows=4e-3):
    """The model in steps of `step`, and the oracle at the same rows, every `rows` s."""
    index, headings = count - 1, HEADINGS[:count]
    spec = rigid_document(count, index) | {"postures": {"test": np.degrees(headings).tolist()}}
    scene = with_pins(spec, [RODS[index]], clearance, treatment)
    lengths = np.array([geometry.cylinder_length(spec, headings, i) for i in range(count)])
    own, first = smooth_move(lengths[index], TRAVEL[index], MOVE), strokes_of_posture(scene, "test")

    def drive(times):
        strokes, rates = np.tile(first, (len(times), 1)), np.zeros((len(times), count))
        found = [own(time)[:2] for time in times]
        strokes[:, index] += [length - lengths[index] for length, _ in found]
        rates[:, index] = [rate for _, rate in found]
        return strokes, rates

    every = round(rows / step)
    moved = integrate_with(scene, drive, end, step, every, angles=np.diff(headings, prepend=0.0))
    row = compile_scene(scene).tables.clearances[0]
    assert moved.status == "ok"
    return moved, oracle(count, float(row.stiffness), float(row.gap), tuple(np.round(moved.times, 9).tolist()))


@cache
def oracle(count, stiffness, gap, times):
    """The oracle's motion at `times` (s); the same for every step of the model."""
    index, headings = count - 1, HEADINGS[:count]
    spec = rigid_document(count, index)
    length = geometry.cylinder_length(spec, headings, index)
    own = smooth_move(length, TRAVEL[index], MOVE)
    contact = Contact(stiffness, HYSTERESIS["lankarani-nikravesh"](0.9), gap, smoothing=SMOOTH)
    boom = freed(spec, headings, index, contact)
    return boom.follow(lambda t: own(t)[:2], boom.rest(length, headings[index]), np.array(times), [MOVE])


# the six-bar's first flights are in the orbits below, and it takes as long as all else here
@pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_the_path_is_the_oracles(count):
    """Slider-crank and six-bar. The stop lifts the pin, which flies, hits, and follows; later flights hang on grazing hits."""
    moved, found = both(count, 1e-3)
    assert np.abs(moved.tip - found.tip).max() < 5e-5 * np.ptp(found.tip[:, 1])
    flying = np.flatnonzero(moved.pins[:, 0, 3] == 0.0)
    first = flying[flying - flying[0] == np.arange(len(flying))]
    assert np.hypot(*(moved.pins[first, 0, :2] - found.offset[first]).T).max() < 2e-6
    assert len(flying) > len(first)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_the_orbit_of_the_journal_is_the_oracles(count):
    """Every kind of joint, from rest through the first flights (joint 1: up to them).

    They differ by where contact is taken to begin: 4 um before the rim.
    """
    moved, found = both(count, 1e-3, end=0.044, rows=1e-3)
    off = np.hypot(*(moved.pins[:, 0, :2] - found.offset).T)
    assert off.max() < 5e-6
    assert np.median(off) < 5e-7
    assert np.abs(moved.tip - found.tip).max() < 4e-6


def test_the_error_falls_with_the_step():
    """As its square where the boom's motion is what errs; impacts set a floor, and are resolved by sub-steps throughout."""
    errors = []
    for step in (4e-3, 2e-3, 1e-4):
        moved, found = both(1, step)
        errors.append(np.abs(moved.tip - found.tip).max())
    assert errors[0] > 3.0 * errors[1]
    assert errors[2] < 2e-6


def test_linearised_pins_follow_contact_while_they_stay_pressed():
    """The beginning of a move, in which the force falls by a third."""
    contact, _ = both(1, 1e-3, end=0.04)
    linear, _ = both(1, 1e-3, treatment="spring-damper", end=0.04)
    assert np.ptp(contact.pins[:, 0, 2]) > 0.02 * contact.pins[0, 0, 2]
    shift = np.abs(contact.tip - contact.tip[0]).max()
    assert np.abs(linear.tip - contact.tip).max() < 5e-3 * shift
    assert linear.pins[0] == pytest.approx(contact.pins[0], rel=1e-4, abs=1e-9)
