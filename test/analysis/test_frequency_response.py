"""Frequency response against dense solves, natural frequencies, statics and a sine sweep through `simulate`."""

from __future__ import annotations

import numpy as np
import pytest
from analysis.resting import at_rest
from default_boom import posture_angles, strokes_of_posture
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins
from oracle.response import DenseModel, extrapolated
from scipy.optimize import brentq

from boom_twin import UsageError, frequency_response, load_scene, simulate, statics
from boom_twin.analysis.frequency_response import linearised_boom, with_all_shapes
from boom_twin.analysis.modal import drive_at_rest

BAND = np.geomspace(0.05, 30.0, 40)  # Hz
FORCES = ([1.0, 0.0], [0.0, 1.0])


def apart(found, expected):
    """Largest distance of rows, over the rows' size."""
    return np.max(np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1))


def in_time(amplitudes, spectrum, within, count, rows):
    """Motion (rows, c) whose `amplitudes` (k, c) are per unit of a signal, of whose `spectrum` the part `within` counts."""
    whole = np.zeros((len(spectrum), amplitudes.shape[1]), complex)
    whole[within] = amplitudes * spectrum[within, None]
    return np.fft.irfft(whole, count, axis=0)[:rows]


def undamped(spec):
    """Plain dicts of a scene without any damping."""
    for section in spec["sections"]:
        section.pop("beta", None)
    for joint in spec["joints"]:
        joint["cylinder"].pop("d", None)
    return spec


DENSE = [
    pytest.param(load_scene(), "arch", id="default"),
    pytest.param(booms.random_boom(31), "test", id="rigid section, rigid cylinder"),
    pytest.param(booms.on_elastic_base(load_scene(), 5.0e6, 5.0e4), "arch", id="elastic base"),
]


@pytest.mark.parametrize("scene, posture", DENSE)
def test_sweeps_solve_the_dense_equations(scene, posture):
    """Every unknown under every load, between and at natural frequencies; what is left is of the dense model's differences."""
    scene = with_all_shapes(scene)
    plan, state, work = at_rest(scene, posture)
    dense = DenseModel(plan, state.z.copy(), drive_at_rest(plan, state, work))
    boom = linearised_boom(scene, posture=posture)
    frequencies = np.sort(np.concatenate([BAND, statics(scene, posture=posture).frequencies[:3]]))
    for load in np.eye(2 + plan.joints):
        unknowns = dense.unknowns(frequencies, load)
        found = boom.respond(frequencies, load)
        assert apart(found.tip, unknowns @ dense.tip.T) < 5e-5
        assert apart(found.cylinder_forces, unknowns[:, plan.tables.cylinders.z]) < 5e-5


@pytest.mark.parametrize("modes, stiffness", [(1, None), (3, None), (3, 5.0e6)])
def test_tip_force_against_finite_segments(modes, stiffness):
    """An independent model, by energy: 0.05 % up to 30 Hz, however few shapes the scene has for its time steps."""
    scene = booms.on_elastic_base(load_scene().model_copy(update={"modes": modes}), stiffness)
    load = np.array([0.6, 0.8, 0.0, 0.0, 0.0, 0.0])
    expected = extrapolated(scene, posture_angles(scene, "arch"), BAND, load)
    found = frequency_response(scene, BAND, posture="arch", tip_force=(0.6, 0.8))
    for own, other in (
        (found.tip, expected[:, :2]),
        (found.joints, expected[:, 2:6]),
        (found.cylinder_forces, expected[:, 6:]),
    ):
        assert apart(own, other) < 5e-4


def test_drive_against_finite_segments():
    """Of a cylinder with oil, whose stiffness the drive changes, too."""
    scene = booms.random_boom(2)
    n = len(scene.joints)
    load = np.eye(2 + n)[2 + n // 2]
    expected = extrapolated(scene, posture_angles(scene, "test"), BAND, load)
    found = frequency_response(scene, BAND, posture="test", drive=1 + n // 2)
    assert apart(found.tip, expected[:, :2]) < 1e-3
    assert apart(found.joints, expected[:, 2 : 2 + n]) < 1e-3


@pytest.mark.parametrize("scene, posture", [(booms.scene_of(undamped(booms.document())), p) for p in ("arch", "horizontal")])
def test_poles_are_the_natural_frequencies(scene, posture):
    boom = linearised_boom(scene, posture=posture)
    for natural in statics(with_all_shapes(scene), posture=posture).frequencies:
        gain = [lambda f, load=load: 1.0 / boom.respond(np.array([f]), load).tip[0].real.sum() for load in np.eye(6)[:2]]
        around = natural * np.array([1.0 - 1e-4, 1.0 + 1e-4])
        passing = next(g for g in gain if g(around[0]) * g(around[1]) < 0.0)
        assert brentq(passing, *around, xtol=1e-12) == pytest.approx(natural, rel=1e-8)


def test_a_boom_with_play_in_its_pins_is_refused():
    with pytest.raises(UsageError, match=r"clearance.pins = cylinder_1.rod, .* or simulate"):
        frequency_response(with_pins(booms.document(), RODS, 1e-4), BAND, posture="arch")


def richardson(of, size):
    """Derivative at 0 of a function, from central differences over `size`, half and a quarter of it."""
    d = [(of(h) - of(-h)) / (2.0 * h) for h in (size, size / 2.0, size / 4.0)]
    a, b = d[1] + (d[1] - d[0]) / 3.0, d[2] + (d[2] - d[1]) / 3.0
    return b + (b - a) / 15.0


def test_static_limit_is_that_of_statics():
    """A little more payload; a little more of every stroke."""
    spec = booms.document() | {"tip": {"payload": 40.0}}
    scene, strokes = booms.scene_of(spec), strokes_of_posture(booms.scene_of(spec), "arch")

    def loaded(more):
        rest = statics(booms.scene_of(spec | {"tip": {"payload": 40.0 + more}}), strokes=strokes, modes=0)
        return np.concatenate([rest.tip, rest.joints, 1e-6 * rest.cylinder_forces])

    def of(response):
        row = np.concatenate([response.tip, response.joints, 1e-6 * response.cylinder_forces], axis=1)[0]
        assert np.all(row.imag == 0.0)
        return row.real

    at_rest = np.zeros(1)
    expected = richardson(loaded, 8.0) / -9.81
    found = of(frequency_response(scene, at_rest, strokes=strokes))
    assert np.linalg.norm(found - expected) < 1e-9 * np.linalg.norm(expected)
    for i in range(4):

        def moved(more, i=i):
            rest = statics(scene, strokes=strokes + more * np.eye(4)[i], modes=0)
            return np.concatenate([rest.tip, rest.joints, 1e-6 * rest.cylinder_forces])

        found = of(frequency_response(scene, at_rest, strokes=strokes, drive=i + 1))
        expected = richardson(moved, 1e-2)
        assert np.linalg.norm(found - expected) < 1e-9 * np.linalg.norm(expected)


def test_forces_and_drives_are_reciprocal():
    """What a force at the tip does to cylinder i, the drive of cylinder i does to the tip (Betti)."""
    scene = load_scene()
    by_drive = [frequency_response(scene, BAND, posture="high", drive=i + 1).tip for i in range(4)]
    for axis, force in enumerate(FORCES):
        forces = frequency_response(scene, BAND, posture="high", tip_force=force).cylinder_forces
        for i in range(4):
            assert forces[:, i] == pytest.approx(by_drive[i][:, axis], rel=1e-8, abs=1e-8 * np.abs(forces).max())


def test_sine_sweep_through_simulate():
    """A slow sweep of cylinder 2 from 0.3 to 4 Hz, through two resonances: the response to its spectrum, within 1 %."""
    scene, dt, span = load_scene(), 0.0025, 100.0
    strokes = strokes_of_posture(scene, "arch")
    times = np.arange(0.0, span, dt)
    phase = 2.0 * np.pi * 0.3 * span / np.log(4.0 / 0.3) * ((4.0 / 0.3) ** (times / span) - 1.0)
    sweep = 1e-5 * np.sin(phase) * np.clip(np.minimum(times, span - times) / 3.0, 0.0, 1.0) ** 2
    moved = simulate(scene, times, strokes + np.outer(sweep, np.eye(4)[1]), dt=dt, estimate_errors=False)
    count = 4 * len(times)  # silence behind the sweep, in which it dies away
    spectrum, frequencies = np.fft.rfft(sweep, count), np.fft.rfftfreq(count, dt)
    within = frequencies < 12.0
    response = frequency_response(scene, frequencies[within], posture="arch", drive=2)
    for own, seen in (
        (response.tip, (moved.tip - moved.tip[0])[:, :2]),
        (response.tip_acceleration, moved.tip_acceleration[:, :2]),
        (response.joints, moved.joints - moved.joints[0]),
        (response.cylinder_forces, moved.cylinder_forces - moved.cylinder_forces[0]),
    ):
        expected = in_time(own, spectrum, within, count, len(times))
        assert np.sqrt(np.mean((seen - expected) ** 2)) < 0.01 * np.sqrt(np.mean(expected**2))
