"""The whitening filter against data simulated from its own model, dense Gaussians, and matrix exponentials."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from health.gaussian import covariance_of, is_white, log_density
from scipy.linalg import expm

from boom_twin import load_scene
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.modal import StrokeSpectrum, joint_increments, stroke_noise
from boom_twin.compiler.compile import compile_scene
from boom_twin.config.settings import Settings
from boom_twin.deviation.sensor_model import Mounting, Reading
from boom_twin.estimation.stroke_filter import corners
from boom_twin.health.inference.fault_catalogue import parameters
from boom_twin.health.inference.innovation_filter import (
    HIGHEST,
    KEEPS_STEP,
    LOAD_TIME,
    REACH,
    REST,
    SHAPE,
    SHIFTED,
    InnovationFilter,
    ModalStates,
    modes_of,
    oscillation,
    out_of_step,
    read_modes,
    shaken_by,
)
from boom_twin.health.inference.sensitivities import Signatures
from boom_twin.health.suspicion import load_levels
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture
from boom_twin.types import G

BLOCK, CHANNELS, DETUNING = 0.1, 3, 0.02
ERRORS2 = np.array([0.5, 1.0, 2.0]) ** 2


@pytest.mark.parametrize("omega, decay", [(3.0, 0.0), (3.0, 0.4), (40.0, 1.0), (2.0, 4.0), (2.0, 9.0), (1e-3, 1e-4)])
def test_oscillation_is_a_matrix_exponential(omega, decay):
    generator = np.array([[0.0, 1.0], [-omega * omega, -decay]])
    assert oscillation(omega, decay, BLOCK) == pytest.approx(expm(BLOCK * generator), abs=1e-12)


# -- modes of a boom ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def boom():
    scene, settings = load_scene(), Settings()
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, strokes_of_posture(scene, "arch"), posture_angles(scene, "arch"))
    variance, quiet = settings.stroke_variance, np.tile([1.0, 0.0, 0.0], (plan.joints, 1))
    spectrum = StrokeSpectrum(variance, 0.005, corners(variance, 0.005, 1.0), quiet, np.zeros(plan.joints))
    noise = stroke_noise(plan, state, work, spectrum)
    reading = Reading(plan, Mounting(plan, 0.0, (None,) * plan.joints))
    return noise, plan, state, work, reading, BLOCK


def modes_in(boom, before=None):
    """The modes of a boom at rest, of the signs of those `before`."""
    noise, *there, block = boom
    return modes_of(noise, read_modes(noise.modes, *there), block, before)


def test_stroke_noise_keeps_its_own_covariance(boom):
    modes = modes_in(boom)
    assert len(modes.frequencies) >= 2 and modes.frequencies.max() < HIGHEST
    assert modes.turn @ modes.rest @ modes.turn.T + modes.least == pytest.approx(modes.rest, rel=1e-9, abs=1e-20)
    assert np.linalg.eigvalsh(modes.least).min() > 0.0
    kept = [mode.frequency < HIGHEST for mode in boom[0].modes]
    assert np.diag(modes.rest)[::2] == pytest.approx(boom[0].collected[kept])


def test_modes_under_other_noise_are_those_made_for_it(boom):
    """Of the same modes, to the bit; a filter that goes on with them innovates as one that takes them for others does."""
    noise = boom[0]
    louder = replace(noise, collected=3.0 * noise.collected)
    before, anew = modes_in(boom), modes_in((louder, *boom[1:]))
    again = shaken_by(louder, before)
    assert all(one.tobytes() == other.tobytes() for one, other in zip(again, anew, strict=True))
    assert not np.array_equal(again.rest, before.rest)
    tables = np.random.default_rng(4).normal(0.0, 1e-4, (20, 6, 1))
    going_on, told = (filtered(InnovationFilter(6, 1, BLOCK, 0.01), [before, each], tables) for each in (again, anew))
    assert going_on.tobytes() == told.tobytes() != filtered(InnovationFilter(6, 1, BLOCK, 0.01), [before] * 2, tables).tobytes()


def test_what_angles_read_of_modes(boom):
    """The mode's own increments of the joints, averaged over a block; velocities are not read."""
    noise, plan, state, work, *_ = boom
    modes = modes_in(boom)
    for k, frequency in enumerate(modes.frequencies):
        x = math.pi * frequency * BLOCK
        wanted = math.sin(x) / x * joint_increments(plan, state, work, noise.modes[k].increments)
        assert modes.shown[:4, 2 * k] == pytest.approx(wanted, rel=1e-4, abs=1e-9)
    assert not modes.shown[:, 1::2].any()


@pytest.mark.parametrize("posture", ["arch", "horizontal"])
def test_a_load_at_rest_bends_the_boom_as_its_weight_does(posture):
    """What a lasting force at the tip does to the channels, by modes: as the same weight in the boom's own equilibrium."""
    scene = load_scene()
    known = tuple(each for each in parameters(scene) if each.cause == "tip.payload")
    strokes = strokes_of_posture(scene, posture)
    signatures = Signatures(scene, known, (None,) * len(scene.joints))
    signature = signatures.at(strokes)
    assert signature is not None
    boom = signatures.nominal
    variance, quiet = Settings().stroke_variance, np.tile([1.0, 0.0, 0.0], (boom.plan.joints, 1))
    spectrum = StrokeSpectrum(variance, 0.005, corners(variance, 0.005, 1.0), quiet, np.zeros(boom.plan.joints))
    noise = stroke_noise(boom.plan, boom.state, boom.work, spectrum)
    modes = modes_in((noise, boom.plan, boom.state, boom.work, boom.reading, BLOCK))
    still = np.linalg.solve(np.eye(len(modes.turn)) - modes.turn, modes.pushed)
    by_force = (modes.shown @ still + modes.lifted)[:, 1]
    by_weight = -signature.channels[:, 0] / G
    assert np.abs(by_force - by_weight).max() < 0.03 * np.abs(by_weight).max()
    assert np.abs(by_force[-2:] - by_weight[-2:]).max() < 0.1 * np.abs(by_weight[-2:]).max()


def test_wrong_frequencies_shake_by_the_predicted_vibration(boom):
    """Density detuning^2 omega^4 A^2, A^2 of the coordinate whose acceleration gives the tip 1 (m/s^2)^2: in the limit, h S."""
    noise, plan, state, work, reading, _ = boom
    short, tip = 1e-6, plan.tables.tip
    modes = modes_in((noise, plan, state, work, reading, short))
    for k in range(len(modes.frequencies)):
        swing2 = float((noise.modes[k].motion[tip : tip + 2] ** 2).sum())
        assert modes.driven[2 * k + 1, 2 * k + 1] == pytest.approx(KEEPS_STEP * short / swing2)


def test_modes_keep_their_signs(boom):
    """A mode's shape comes with any sign; that of the modes before is kept, so that coordinates go on."""
    before, noise = modes_in(boom), boom[0]
    flipped = tuple(replace(m, increments=-m.increments, motion=-m.motion) for m in noise.modes)
    other = (replace(noise, modes=flipped, motions=-noise.motions, loads=-noise.loads), *boom[1:])
    assert modes_in(other).shown == pytest.approx(-before.shown, rel=1e-6, abs=1e-12)
    again = modes_in(other, before)
    assert again.shown == pytest.approx(before.shown, rel=1e-6, abs=1e-12)
    tables = np.random.default_rng(1).normal(0.0, 1e-4, (20, 6, 1))
    one, two = (filtered(InnovationFilter(6, 1, BLOCK, 0.01), [before, each], tables) for each in (before, again))
    assert one == pytest.approx(two, rel=1e-6)


def test_levels_in_one_filter_are_those_of_each_alone(boom):
    """To the bit: the posture's modes change, and one channel is not measured all the time."""
    modes = [modes_in(boom), modes_in(boom)]
    tables = np.random.default_rng(2).normal(0.0, 1e-4, (20, 6, 5))
    tables[7:9, 2, 0], tables[12, :, 0] = np.nan, np.nan
    levels = np.array([0.0, 15.0, 170.0])
    together = InnovationFilter(6, 5, BLOCK, 0.15, levels)
    alone = [InnovationFilter(6, 5, BLOCK, 0.15, float(level)) for level in levels]
    for k, table in enumerate(tables):
        for each in (together, *alone):
            each.tune(modes[k // 10])
        found, *ones = (each.step(table, 1e-10 * np.eye(6), np.full(6, 1e-9), 0.1, 0.01) for each in (together, *alone))
        assert found.white.shape == (3, int(np.isfinite(table[:, 0]).sum()), 5)
        assert found.white.tobytes() == np.array([one.white for one in ones]).tobytes()
        assert found.log.tolist() == [float(one.log) for one in ones]
    assert len(set(found.log.tolist())) == len(levels)


@pytest.mark.parametrize("size", [4.0, 8.0, 15.0, 27.0, 50.0, 92.0, 170.0])
def test_a_load_of_any_size_suits_a_level(boom, size):
    """A Gauss-Markov force at the tip, N: one of the levels is about as probable as its own, within e^0.6 for each block.

    Between 0 and 15 N there was none: wind of 4 N was less probable by e^2.4 for each block, and passed for a fault.
    """
    modes, kept, count = modes_in(boom), math.exp(-BLOCK / LOAD_TIME), 300
    whitening = InnovationFilter(len(modes.shown), 1, BLOCK, DETUNING, np.append(load_levels(load_scene()), size))
    whitening.tune(modes)
    rng, sigma = np.random.default_rng(3), np.array([*(4e-5,) * (len(modes.shown) - 2), 5e-3, 5e-3])
    eta, force, logs = np.zeros(len(modes.turn)), np.zeros(2), np.zeros(6)
    for _ in range(count):
        force = kept * force + size * math.sqrt(1.0 - kept**2) * rng.normal(size=2)
        eta = modes.turn @ eta + modes.pushed @ force
        row = modes.shown @ eta + modes.lifted @ force + sigma * rng.normal(size=len(sigma))
        found = whitening.step(row[:, None], np.diag(sigma**2), np.full(len(row), 1e-12), whitening.vibration(0.0), 0.0)
        logs += found.log
    assert logs[:-1].max() > logs[-1] - 0.6 * count


def filtered(whitening: InnovationFilter, modes, tables):
    """Innovations of all tables, the modes changed in the middle."""
    size, found = tables.shape[1], []
    whitening.tune(modes[0])
    for k, table in enumerate(tables):
        if k == len(tables) // 2:
            whitening.tune(modes[1])
        found.append(whitening.step(table, 1e-10 * np.eye(size), np.full(size, 1e-9), 0.1, 0.0).white)
    return np.array(found)


def test_vibration_that_nobody_predicted_is_found_and_forgotten(boom):
    """Free vibration of the first mode, 2 m/s^2 at the tip: its mean square is found; 8 s after it hardly any is left."""
    modes = modes_in(boom)
    whitening, omega = InnovationFilter(6, 1, BLOCK, 0.15, 50.0), 2.0 * math.pi * modes.frequencies[0]
    whitening.tune(modes)
    size = 2.0 / np.hypot(*modes.shown[-2:, 0])
    noise, found = 1e-6 * np.eye(6), []
    for k in range(180):
        table = (k < 100) * size * math.cos(omega * BLOCK * k) * modes.shown[:, :1]
        whitening.step(table, noise, np.full(6, 1e-8), whitening.vibration(0.01), 0.0)
        found.append(float(whitening.vibration(0.01)[0]))
    assert found[99] == pytest.approx(2.0, rel=0.2)
    assert found[-1] < 0.1
    assert float(whitening.vibration(3.0)[0]) == 3.0


# -- the filter on made-up modes -----------------------------------------------------------------------------------------


def made(*frequencies: float) -> ModalStates:
    """Modes that three channels read, of unit variance at rest."""
    size, rng = len(frequencies), np.random.default_rng(9)
    turn, least, driven, rest = (np.zeros((2 * size, 2 * size)) for _ in range(4))
    for k, frequency in enumerate(frequencies):
        omega, at = 2.0 * math.pi * frequency, slice(2 * k, 2 * k + 2)
        turn[at, at] = own = oscillation(omega, 0.3, BLOCK)
        rest[at, at] = np.diag([1.0, omega**2])
        least[at, at] = rest[at, at] - own @ rest[at, at] @ own.T
        driven[at, at] = 100.0 * np.array([[BLOCK**3 / 3.0, BLOCK**2 / 2.0], [BLOCK**2 / 2.0, BLOCK]])
    shown = np.zeros((CHANNELS, 2 * size))
    shown[:, ::2] = rng.normal(size=(CHANNELS, size))
    shaken, pushed, lifted = rng.uniform(1.0, 2.0, CHANNELS), rng.normal(size=(2 * size, 2)), rng.normal(size=(CHANNELS, 2))
    return ModalStates(np.array(frequencies), turn, least, driven, rest, shown, shaken, pushed, lifted)


class Source:
    """The very model of the filter."""

    def __init__(self, modes: ModalStates, seed: int, travel: float, shaking: float) -> None:
        self.modes, self.rng, self.travel, self.shaking = modes, np.random.default_rng(seed), travel, shaking
        self.noise = covariance_of(np.random.default_rng(8), CHANNELS, 0.7)
        self.kept = math.exp(-(travel + REST * BLOCK) / REACH)
        self.driven = modes.least + shaking * DETUNING**2 * modes.driven
        late = out_of_step(modes, np.full((1, 1), DETUNING**2), BLOCK)[0]
        self.began = modes.rest + shaking * np.diag(late)
        self.own = self.noise + np.diag(shaking * (SHAPE**2 + SHIFTED**2 * DETUNING**2) * modes.shaken)

    def rows(self, count: int) -> np.ndarray:
        """Means of the channels, shape (count, CHANNELS)."""
        draw = self.rng.multivariate_normal
        eta = draw(np.zeros(len(self.driven)), self.began)
        error, found = draw(np.zeros(CHANNELS), np.diag(ERRORS2)), []
        for k in range(count):
            eta = self.modes.turn @ eta + draw(np.zeros(len(eta)), self.driven)
            if k:
                error = self.kept * error + math.sqrt(1.0 - self.kept**2) * draw(np.zeros(CHANNELS), np.diag(ERRORS2))
            found.append(self.modes.shown @ eta + error + draw(np.zeros(CHANNELS), self.own))
        return np.array(found)

    def covariance(self, count: int) -> np.ndarray:
        """Of `rows`, all in one vector: from the variances and what carries over, without a filter."""
        c, shown, turn = CHANNELS, self.modes.shown, self.modes.turn
        found, spread = np.zeros((count * c, count * c)), self.began
        for k in range(count):
            spread = turn @ spread @ turn.T + self.driven
            carried = spread
            for later in range(k, count):
                block = shown @ carried @ shown.T + self.kept ** (later - k) * np.diag(ERRORS2)
                block = block + self.own if later == k else block
                found[later * c : (later + 1) * c, k * c : (k + 1) * c] = block
                found[k * c : (k + 1) * c, later * c : (later + 1) * c] = block.T
                carried = turn @ carried
        return found

    def whitening(self, columns: int = 1) -> InnovationFilter:
        whitening = InnovationFilter(CHANNELS, columns, BLOCK, DETUNING)
        whitening.tune(self.modes)
        return whitening

    def innovations(self, whitening: InnovationFilter, table: np.ndarray):
        return whitening.step(table, self.noise, ERRORS2, self.shaking, self.travel)


# the first two are limits of the others: no shaking, at rest or not
LIMITS = [pytest.param(travel, 0.0, marks=pytest.mark.slow) for travel in (0.0, 0.02)]


@pytest.mark.parametrize("travel, shaking", [*LIMITS, (0.005, 30.0), (1.0, 3.0)])
def test_innovations_are_white_and_of_unit_variance(travel, shaking):
    source = Source(made(0.7, 2.3), 1, travel, shaking)
    whitening = source.whitening()
    white = [source.innovations(whitening, row[:, None]).white[:, 0] for row in source.rows(6000)]
    is_white(np.array(white))


@pytest.mark.parametrize("travel, shaking", [(0.0, 0.0), (0.02, 5.0)])
def test_probability_is_that_of_all_rows_at_once(travel, shaking):
    source = Source(made(0.7, 2.3), 2, travel, shaking)
    whitening, rows = source.whitening(), source.rows(8)
    log = sum(source.innovations(whitening, row[:, None]).log for row in rows)
    assert log == pytest.approx(log_density(rows.ravel(), np.zeros(rows.size), source.covariance(8)), abs=1e-8)


def test_signatures_are_filtered_as_residuals_are():
    """A fault in the residuals adds its filtered signature to the innovations, whatever else they hold."""
    source = Source(made(0.7), 3, 0.001, 1.0)
    whitening, signature = source.whitening(4), np.random.default_rng(4).normal(size=(50, CHANNELS, 2))
    for row, columns in zip(source.rows(50), signature, strict=True):
        white = source.innovations(whitening, np.column_stack([row, columns, row + columns @ [2.0, -3.0]])).white
        assert white[:, 3] == pytest.approx(white[:, 0] + white[:, 1:3] @ [2.0, -3.0], abs=1e-9)


def test_channels_that_were_not_measured():
    """They give no innovation; the others' are those of a joint density without them."""
    source, lost = Source(made(0.7, 2.3), 5, 0.01, 1.0), {(1, 0), (2, 0), (2, 2), (4, 1), (3, 0), (3, 1), (3, 2)}
    whitening, rows, log = source.whitening(), source.rows(6), 0.0
    for k, row in enumerate(rows):
        for channel in range(CHANNELS):
            if (k, channel) in lost:
                row[channel] = np.nan
        found = source.innovations(whitening, row[:, None])
        assert found.white.shape == (np.isfinite(row).sum(), 1)
        log += found.log
    there = np.isfinite(rows.ravel())
    wanted = log_density(rows.ravel()[there], np.zeros(there.sum()), source.covariance(6)[np.ix_(there, there)])
    assert log == pytest.approx(wanted, abs=1e-8)


def test_a_mode_that_is_missing_for_a_while():
    """Without the second mode the filter goes on, and with it again it is as unsure of it as at rest; still white."""
    both, one = made(0.7, 2.3), made(0.7)
    source = Source(both, 6, 0.0, 0.0)
    whitening = source.whitening()
    for row in source.rows(30):
        source.innovations(whitening, row[:, None])
    whitening.tune(one)
    alone = Source(one, 7, 0.0, 0.0)
    for row in alone.rows(200):
        alone.innovations(whitening, row[:, None])
    whitening.tune(both)
    is_white(np.array([source.innovations(whitening, row[:, None]).white[:, 0] for row in source.rows(4000)]))


def test_slow_errors_are_forgotten_by_travel():
    """A constant is learnt at rest, and is new again after 10 times the reach."""
    source = Source(made(0.7), 6, 0.0, 0.0)
    whitening, table = source.whitening(), np.full((CHANNELS, 1), 5.0)
    first = np.abs(source.innovations(whitening, table).white).max()
    for _ in range(100):
        last = np.abs(source.innovations(whitening, table).white).max()
    assert last < 0.2 * first
    moved = whitening.step(table, source.noise, ERRORS2, 0.0, 10.0 * REACH).white
    assert np.abs(moved).max() > 0.5 * first
