"""Steady states under periodic loads at the tip, and the resonance map."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import posture_angles, strokes_of_posture
from oracle import booms

from boom_twin import UsageError, frequency_response, load_scene, simulate, statics
from boom_twin.analysis.steady_state import (
    INSTANTS,
    PeriodicLoad,
    load_of_rows,
    pump_load,
    resonance_map,
    steady_state,
)
from boom_twin.scene.pump_pulses import upward

SCENE = load_scene()


def well_damped():
    """The default scene with eight times the damping in its cylinders: what begins with a load dies away in half a minute."""
    spec = booms.document()
    for joint in spec["joints"]:
        joint["cylinder"]["d"] *= 8.0
    return booms.scene_of(spec)


@pytest.mark.parametrize("rate", [0.43, 0.36])
def test_pump_pulses_against_the_last_periods_of_a_long_motion(rate):
    """Away from resonance, and with the third harmonic on the first mode: displacement within 0.5 %."""
    scene, periods, height = well_damped(), 16, 20.0
    found = steady_state(scene, pump_load(scene, rate, height), posture="arch")
    per_period = 600
    step = 1.0 / (rate * per_period)
    load = found.load.forces[:, 1]
    times = step * np.arange(periods * per_period + 1)
    force = np.interp(times, np.append(found.times, found.load.period), np.append(load, load[0]), period=found.load.period)
    strokes, loads = np.tile(strokes_of_posture(scene, "arch"), (len(times), 1)), np.outer(force, [0.0, 1.0])
    moved = simulate(scene, times, strokes, step, rho=0.9, estimate_errors=False, force=loads).tip[:, :2]
    last = moved[-per_period:] - statics(scene, "arch").tip
    expected = np.stack([np.interp(times[-per_period:], found.times, column, period=1.0 / rate) for column in found.tip.T], 1)
    assert np.linalg.norm(last - expected) < 5e-3 * np.linalg.norm(expected)
    assert np.ptp(last, axis=0) == pytest.approx(np.ptp(found.tip, axis=0), rel=5e-3)


def test_a_sine_is_the_frequency_response():
    times = np.arange(INSTANTS) / (INSTANTS * 0.9)
    load = PeriodicLoad(1.0 / 0.9, np.outer(np.sin(2.0 * np.pi * 0.9 * times), [3.0, 4.0]))
    found = steady_state(SCENE, load, posture="low")
    response = frequency_response(SCENE, np.array([0.9]), posture="low", tip_force=(3.0, 4.0))
    turning = np.exp(2j * np.pi * 0.9 * times)[:, None]
    assert found.tip == pytest.approx((turning * response.tip).imag, abs=1e-12)
    assert found.cylinder_forces == pytest.approx((turning * response.cylinder_forces).imag, abs=1e-5)
    assert found.tip_acceleration == pytest.approx((turning * response.tip_acceleration).imag, abs=1e-9)
    assert found.harmonics[0] == pytest.approx(np.linalg.norm(response.tip)) and np.all(found.harmonics[1:] == 0.0)


def test_a_constant_load_is_the_static_limit():
    load = PeriodicLoad(2.0, np.tile([0.0, -50.0], (64, 1)))
    still = steady_state(SCENE, load, posture="arch")
    expected = frequency_response(SCENE, np.zeros(1), posture="arch", tip_force=(0.0, -50.0)).tip.real
    assert still.tip == pytest.approx(np.tile(expected, (64, 1)), rel=1e-12) and still.swing < 1e-15


def test_a_fast_part_of_a_long_load_is_not_taken_for_a_slow_one():
    """5.76 Hz in a period of 300 s, rows of 10 ms: 2048 instants had shown it to the first mode, as 1.5 m of swing."""
    rate, step = 5.76, 0.01
    times = step * np.arange(30_001)
    rows = np.outer(np.sin(2.0 * np.pi * rate * times), [0.0, 100.0])
    rows[-1] = rows[0]
    found = steady_state(SCENE, load_of_rows(times, rows), posture="arch")
    straight = np.sinc(rate * step) ** 2  # of the sine's amplitude is left where it goes straight from row to row
    expected = frequency_response(SCENE, np.array([rate]), posture="arch", tip_force=(0.0, 100.0 * straight)).tip[0]
    assert found.harmonics[round(300.0 * rate) - 1] == pytest.approx(np.linalg.norm(expected), rel=1e-3)
    assert np.ptp(found.tip, axis=0) == pytest.approx(2.0 * np.abs(expected), rel=5e-3)


def test_pumps_push_up_on_an_inclined_base():
    inclined = SCENE.model_copy(update={"base": SCENE.base.model_copy(update={"inclination": 0.3})})
    peak = pump_load(inclined, 0.4, 130.0).forces.max(axis=0)
    assert peak == pytest.approx(130.0 * upward(0.3)) and peak[0] > 30.0


@pytest.mark.parametrize(
    "times, forces, told",
    [
        ([0.0, 1.0], [[0, 0], [0, 0]], "three rows"),
        ([0.0, 1.0, 1.0], [[0, 0], [0, 5], [0, 0]], "row 3"),
        ([0.0, 1.0, 2.0], [[0, 0], [0, 5], [0, 5]], "ends the period"),
        ([0.0, np.nan, 2.0], [[0, 0], [0, 5], [0, 0]], "row 2 of the load: t_s = nan"),
        ([0.0, 1.0, 2.0], [[0, 0], [0, 1e300], [0, 0]], "row 2 .* at most 1e\\+07 N"),
        ([0.0, 1e-12, 2e-12], [[0, 0], [0, 5], [0, 0]], "period of 2e-12 s must be 0.01 to 2000 s"),
    ],
)
def test_rows_refused(times, forces, told):
    with pytest.raises(UsageError, match=told):
        load_of_rows(np.array(times), np.array(forces, dtype=float))


def test_map_names_the_rates_whose_harmonics_meet_the_first_mode():
    rates = np.linspace(0.28, 0.46, 37)
    found = resonance_map(
        SCENE, {name: posture_angles(SCENE, name) for name in SCENE.postures}, rates, lambda rate: pump_load(SCENE, rate, 130.0)
    )
    assert found.postures == tuple(SCENE.postures) and found.swing.shape == (len(SCENE.postures), 37)
    for name in SCENE.postures:
        first = statics(SCENE, posture=name).frequencies[0]
        (band,) = [band for band in found.to_avoid() if band.posture == name]
        assert band.harmonic == 3 and band.low <= first / 3.0 <= band.high
        assert band.rate == pytest.approx(first / 3.0, abs=5e-3)
    at = steady_state(SCENE, pump_load(SCENE, float(rates[5]), 130.0), posture="arch")
    assert found.swing[found.postures.index("arch"), 5] == pytest.approx(at.swing)


def test_a_way_out_of_travel_is_refused():
    far = {"far": np.array([1.4, 1.4, 1.4, 1.4])}
    with pytest.raises(UsageError, match="posture far"):
        resonance_map(SCENE, far, np.array([0.4]), lambda rate: pump_load(SCENE, rate, 130.0))
