"""Loads at the tip: how they are written, what they are over time, and that the boom bears them."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("exudyn")

from default_boom import strokes_of_posture, with_parameters

from boom_twin import UsageError, load_scene, statics
from boom_twin.validation.rig import Programme, simulate
from boom_twin.validation.rig.motion import PumpLoad, WindLoad, check_loads, ease, parse_load, tip_load


@pytest.mark.parametrize(
    "text, load",
    [
        ("pump:0.43:130:0.1", PumpLoad(0.43, 130.0)),
        ("pump:0.3:60:0.25@12", PumpLoad(0.3, 60.0, 0.25, 12.0)),
        ("wind:15:5", WindLoad(15.0)),
        ("wind:40:2.5@3", WindLoad(40.0, 2.5, 3.0)),
    ],
)
def test_text_and_back(text, load):
    assert parse_load(text) == load and str(load) == text
    assert parse_load("pump:0.43:130") == PumpLoad(0.43, 130.0, 0.1, 0.0) and parse_load("wind:15") == WindLoad(15.0, 5.0, 0.0)


@pytest.mark.parametrize(
    "text, told",
    [
        ("rain:3", "rain is no kind of load. Write pump:FREQUENCY:HEIGHT"),
        ("pump:9:130", "frequency = 9, must be from 0.05 to 2 Hz"),
        ("pump:0.43:130@20", "begins at 20 s, must be before the end at 20 s"),
        ("wind:15@-1", "onset = -1 s, must be finite and at least 0"),
    ],
)
def test_refused(text, told):
    with pytest.raises(UsageError, match=told):
        check_loads([parse_load(text)], 20.0)


def test_pulses_are_on_for_half_of_each_period():
    load, times = PumpLoad(0.4, 100.0, 0.2, 3.0), np.arange(0.0, 43.0, 1e-3)
    force = load.force(times, 43.0, [0, 0])
    assert not force[times < 3.0].any() and force.min() == 0.0 and force.max() == pytest.approx(100.0)
    on = force > 50.0
    rising = times[1:][on[1:] & ~on[:-1]]
    assert np.diff(rising) == pytest.approx(2.5, abs=2e-3) and rising[0] == pytest.approx(3.1, abs=2e-3)
    assert force[times >= 3.0].mean() == pytest.approx(50.0, abs=0.1)
    assert np.count_nonzero((force > 1e-9) & (force < 100.0 - 1e-9)) * 1e-3 == pytest.approx(32 * 0.2, rel=0.03)


def test_wind_has_the_spectrum_of_von_karman():
    """Periodograms of many winds, averaged over bands; each value has a relative deviation of 1/sqrt(lines)."""
    load, rate, length = WindLoad(20.0, 2.0), 20.0, 400.0
    times = 5.0 + np.arange(round(length * rate)) / rate
    winds = np.array([load.force(times, 405.0, [seed, 0]) for seed in range(40)])
    assert winds.std() == pytest.approx(20.0, rel=0.05) and abs(winds.mean()) < 2.0
    assert np.mean((winds / 20.0) ** 4) == pytest.approx(3.0, abs=0.4)
    power = np.abs(np.fft.rfft(winds * np.hanning(len(times)) * math.sqrt(8 / 3)) / rate) ** 2 * 2.0 / length
    lines = np.fft.rfftfreq(len(times), 1.0 / rate)
    for low, high in ((0.01, 0.03), (0.03, 0.1), (0.1, 0.3), (0.3, 1.0), (1.0, 3.0)):
        band = (lines >= low) & (lines < high)
        expected = 4.0 * 20.0**2 * 2.0 / (1.0 + 70.8 * (2.0 * lines[band]) ** 2) ** (5.0 / 6.0)
        assert power[:, band].mean() == pytest.approx(expected.mean(), rel=0.15), (low, high)


def test_wind_is_drawn_by_its_seed():
    scene, times = load_scene(), np.linspace(0.0, 20.0, 400)
    loads = [parse_load("wind:15"), parse_load("wind:15")]
    one, same, other = (tip_load(scene, loads[:1], 20.0, seed)(times) for seed in (3, 3, 4))
    assert np.array_equal(one, same) and np.abs(one - other).max() > 5.0 and not one[0].any()
    both = tip_load(scene, loads, 20.0, 3)(times)
    assert np.abs(both - 2.0 * one).max() > 5.0  # two winds, not one twice
    assert tip_load(scene, loads, 20.0, 3)(times[::7]) == pytest.approx(both[::7], abs=1e-9)


def test_directions_are_those_of_the_earth():
    scene = load_scene()
    tilted = scene.model_copy(update={"base": scene.base.model_copy(update={"inclination": 0.3})})
    pushed = tip_load(tilted, [PumpLoad(0.5, 100.0)], 2.0, 0)(np.array([0.5]))[0]
    assert pushed == pytest.approx([100.0 * math.sin(0.3), 100.0 * math.cos(0.3)])
    blown = tip_load(tilted, [WindLoad(50.0)], 2.0, 0)(np.array([1.5]))[0]
    assert blown @ pushed == pytest.approx(0.0, abs=1e-9) and np.hypot(*blown) > 0.1


def test_a_constant_load_is_borne_as_a_payload_is():
    """The twin's equilibrium with 20 kg more at the tip is the witness: it shares no equation with the rig."""
    scene = load_scene()
    strokes = strokes_of_posture(scene, "arch")
    rows = simulate(
        scene, Programme(tuple(strokes), ()), 12.0, 5e-3, 5e-3, 8,
        load=lambda times: np.outer(ease(times / 6.0), [0.0, -20.0 * 9.81]),
    )  # fmt: skip
    held = rows["t"] > 8.0
    tip = rows["tip"]
    forces = rows["forces"]
    loaded, bare = (statics(each, strokes) for each in (with_parameters(scene, {"tip.payload": 20.0}), scene))
    moved, more = loaded.tip - bare.tip, loaded.cylinder_forces - bare.cylinder_forces
    assert np.hypot(*moved) > 0.02 and np.abs(more).max() > 5000.0
    assert tip[held].mean(axis=0) - tip[0] == pytest.approx(moved, abs=0.01 * np.hypot(*moved))
    assert forces[held].mean(axis=0) - forces[0] == pytest.approx(more, abs=0.01 * np.abs(more).max())
