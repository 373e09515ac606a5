"""The estimate of the tip: its filter against dense matrices, against Monte Carlo, against statics and kinematics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drive_twin import drive_twin
from scipy.linalg import expm

from boom_twin import load_scene, statics
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.modal import StrokeNoise, natural_modes
from boom_twin.config.settings import Settings
from boom_twin.estimation import cause_mixture as mix
from boom_twin.estimation import deviation_filter as layout
from boom_twin.estimation import deviation_readings as reading
from boom_twin.estimation import deviation_step as stepping
from boom_twin.estimation import load_level as level
from boom_twin.estimation.boom_predictor import BoomPredictor
from boom_twin.estimation.deviation_filter import DeviationFilter
from boom_twin.estimation.deviation_modes import DeviationModes
from boom_twin.estimation.posture_modes import GRID
from boom_twin.deviation.estimate_row import INEXACT
from boom_twin.health.baseline import Baseline
from boom_twin.kernels.result_row import Estimates, Results, estimates_in, results_in
from boom_twin.kernels.tables import FRAME_ANGLE, FRAME_X, FRAME_Y
from boom_twin.kernels.transfer.time_step import observe
from boom_twin.scene.edit import parameter, with_parameters
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.scene.load import examine_text, example_text
from boom_twin.scene.schema import Scene
from boom_twin.twin.blocks import ReportBlock, block_of, row_of
from boom_twin.types import Array, Estimate, Sample, Stream
from boom_twin.validation.rig.faulty_boom import wrong_by

H = 0.005  # s
STEP = 5_000_000  # ns


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene()


class Posed:
    """A boom at rest, and its filter there."""

    def __init__(self, scene: Scene, strokes: Array, settings: Settings | None = None) -> None:
        self.boom, self.strokes = BoomPredictor(scene), strokes
        self.modes = DeviationModes(scene, self.boom.plan, settings or Settings(), ())
        self.rest(strokes)
        self.modes.begin()
        self.modes.refresh(strokes, self.boom.angles, self.boom.live, NO_NOISE)
        self.follow()
        stepping.start_state(self.modes.filter)

    def rest(self, strokes: Array) -> None:
        boom = self.boom
        boom.start(strokes)
        settle(boom.plan, boom.live, boom.compiled.work, strokes, boom.angles.copy())
        observe(boom.plan.tables, boom.live, boom.compiled.row)

    def follow(self) -> None:
        boom, f = self.boom, self.modes.filter
        results, estimates = rows_of(boom)
        moments = boom.compiled.bending @ boom.live.z
        stepping.follow_posture(f, boom.live)
        stepping.follow_prediction(f, results, estimates, moments, np.array(boom.plan.tables.gravity))


def rows_of(boom: BoomPredictor) -> tuple[Results, Estimates]:
    size = boom.plan.joints, len(boom.plan.pins)
    return results_in(boom.compiled.row, *size), estimates_in(boom.compiled.row, *size)


NONE = np.zeros((0, 4))
NO_NOISE = StrokeNoise(NONE, np.zeros(0), NONE, np.zeros(0), (), np.zeros(0), NONE, np.zeros((0, 2)))


@pytest.fixture
def posed(scene: Scene) -> Posed:
    return Posed(scene, strokes_of_posture(scene, "arch"))


def dense(f: DeviationFilter) -> tuple[Array, Array]:
    """Continuous system x' = A x + white noise of density Q, from the equations in the module's text."""
    n, count, size = len(f.softness), int(f.status[layout.COUNT]), int(layout.states_of(f))
    a, q = np.zeros((size, size)), np.zeros((size, size))
    slowest, quickest = stepping.SLOWEST, stepping.QUICKEST
    for k in (0, 1):
        load, change, error = layout.LOAD + k, layout.LOAD_CHANGE + k, layout.ERROR + k
        a[load, change], a[change, load], a[change, change] = (
            1.0,
            -slowest * quickest,
            -(slowest + quickest),
        )
        q[change, change] = 2.0 * slowest * quickest * (slowest + quickest) * f.level[k] ** 2
        a[error, error], q[error, error] = -1.0 / stepping.JERK_TIME, 2.0 * f.pushes[k] / stepping.JERK_TIME
        q[layout.BIAS + k, layout.BIAS + k] = stepping.BIAS_DRIFT**2
        stays = layout.STAYING + k
        a[stays, stays] = -1.0 / layout.STAY_TIME
        q[stays, stays] = 2.0 * (layout.STAYS * f.loads[layout.USUAL_LOAD]) ** 2 / layout.STAY_TIME
    for i in range(n):
        q[layout.SHARES + i, layout.SHARES + i] = layout.SOFTENING**2
    places = [
        0,
        1,
        *range(layout.SHARES, layout.SHARES + 2 * n),
        layout.STAYING,
        layout.STAYING + 1,
    ]
    for j in range(count):
        at = layout.SHARES + 2 * n + 2 * j
        a[at, at + 1] = 1.0
        a[at + 1, at], a[at + 1, at + 1] = -(f.omega[j] ** 2), -f.decay[j]
        a[at + 1, places] = f.coupling[j]
        a[at + 1, layout.SHARES + n : layout.SHARES + 2 * n] = 0.0  # what sections sag is no part of q
        q[at + 1, at + 1] = f.density[j]
    if f.status[layout.FORCED]:
        unit = np.abs(f.pulls) + layout.LEAST_FORCE * np.abs(f.pulls).max()
        places = [layout.offset_place(f, i) for i in range(n)]
        q[places, places] = (layout.FORCE_DRIFT * unit) ** 2
    return a, q


def measure_forces(f: DeviationFilter) -> None:
    """As if forces had been measured: their offsets are states."""
    f.status[layout.FORCED] = 1
    stepping.add_offsets(f)


def discrete(a: Array, q: Array, h: float) -> tuple[Array, Array]:
    """Transition and covariance over h, exact (Van Loan 1978)."""
    size = len(a)
    big = expm(np.block([[-a, q], [np.zeros_like(a), a.T]]) * h)
    turn = big[size:, size:].T
    return turn, turn @ big[:size, size:]


@pytest.mark.parametrize("with_forces", [False, True])
def test_a_step_is_that_of_the_dense_system(posed: Posed, with_forces: bool) -> None:
    """Of order 2 in the step where inputs are held, and exact for the modes alone."""
    f = posed.modes.filter
    if with_forces:
        measure_forces(f)
    rng = np.random.default_rng(1)
    f.density[:] = rng.uniform(0.0, 1e-4, len(f.density))
    size = int(layout.states_of(f))
    scale = np.sqrt(np.diag(f.p)[:size] + 1e-12)
    start_x, start_p = scale * rng.normal(size=size), f.p[:size, :size].copy()
    a, q = dense(f)
    errors = []
    for steps in (1, 4, 16):
        f.x[:size], f.p[:size, :size] = start_x, start_p
        for _ in range(steps):
            stepping.step_state(f, 0.02 / steps)
        turn, noise = discrete(a, q, 0.02)
        x, p = turn @ start_x, turn @ start_p @ turn.T + noise
        size_p = np.sqrt(np.diag(p) + 1e-12)
        errors.append(
            [np.abs((f.x[:size] - x) / size_p).max(), np.abs((f.p[:size, :size] - p) / np.outer(size_p, size_p)).max()]
        )
    errors_x, errors_p = np.array(errors).T
    assert errors_x[2] < 2e-3 and errors_p[2] < 2e-3
    assert errors_x[2] < errors_x[0] / 8.0 and errors_p[2] < errors_p[0] / 8.0


def test_corrections_are_those_of_the_dense_filter(posed: Posed) -> None:
    f = posed.modes.filter
    measure_forces(f)
    size, rng = int(layout.states_of(f)), np.random.default_rng(2)
    x, p = np.zeros(size), f.p[:size, :size].copy()
    f.status[layout.FED] = 1
    angles, forces = (reading.read_angle, 1e-4, 1e-8), (reading.read_force, 1e3, 1e4)
    for i, (read, scale, variance) in ((0, angles), (3, angles), (1, forces), (3, forces)):
        read(f, i, f.row)
        row, value = f.row[:size].copy(), scale * rng.normal()
        reading.correct(f, value, variance, 0.0)
        gain = p @ row / (row @ p @ row + variance)
        x, p = x + gain * (value - row @ x), p - np.outer(gain, row @ p)
    scale = np.sqrt(np.diag(p) + 1e-15)
    assert np.abs((f.x[:size] - x) / scale).max() < 1e-9
    assert np.abs((f.p[:size, :size] - p) / np.outer(scale, scale)).max() < 1e-9


def test_a_late_reading_is_read_by_the_state_as_it_was(posed: Posed) -> None:
    """A row turned back by an age reads of the state now what the row read then: without noise and inputs."""
    f = posed.modes.filter
    size = int(layout.states_of(f))
    first = layout.SHARES + 8
    f.x[first:size] = np.random.default_rng(3).normal(size=size - first)
    reading.read_angle(f, 2, f.row)
    then = float(f.row[first:size] @ f.x[first:size])
    stepping.step_state(f, 0.03)
    reading.read_angle(f, 2, f.row)
    f.p[:] = 0.0
    reading.correct(f, 0.0, 1.0, 0.03)
    assert float(f.row[first:size] @ f.x[first:size]) == pytest.approx(then, rel=1e-9)


def test_a_late_reading_under_a_load_that_stays_is_what_it_is_now(posed: Posed) -> None:
    """A load that stays and a softer cylinder hold the boom at rest: 0.2 s ago the angles were the same."""
    f, place = posed.modes.filter, layout.SHARES + 8
    f.x[layout.STAYING + 1], f.x[layout.SHARES + 1] = -200.0, 0.1
    for j in range(int(f.status[layout.COUNT])):
        f.x[place + 2 * j] = (-200.0 * f.coupling[j, 11] + 0.1 * f.coupling[j, 3]) / f.omega[j] ** 2
    before = f.x.copy()
    for i in range(4):
        reading.read_angle(f, i, f.row)
        reading.correct(f, float(f.row @ f.x), 1e-12, 0.2)
        assert f.x == pytest.approx(before, rel=1e-9, abs=1e-9)


def test_a_late_reading_holds_less_while_the_load_may_have_changed(posed: Posed) -> None:
    """Its noise has the variance that the load's process gains in that time, against its exact covariance (Van Loan)."""
    f, slowest, quickest, age = posed.modes.filter, stepping.SLOWEST, stepping.QUICKEST, 0.1
    f.level[:] = 20.0, 70.0
    reading.read_angle(f, 2, f.row)
    f.x[:] = 0.0
    still = -f.row[layout.LOAD : layout.LOAD + 2].copy()
    found = reading.turn_back(f, age)
    still = still + f.row[layout.LOAD : layout.LOAD + 2]
    a = np.array([[0.0, 1.0], [-slowest * quickest, -slowest - quickest]])
    kept = expm(a * age)[0, 0]
    assert found == pytest.approx(2.0 * (1.0 - kept) * float(np.sum((f.level * still) ** 2)), rel=1e-9)


@pytest.mark.parametrize("posture", ["arch", "high"])
def test_motion_of_the_tip_follows_the_posture(scene: Scene, posture: str) -> None:
    """What modes of one posture do to the tip in another: derivative of the frames' places there."""
    posed = Posed(scene, strokes_of_posture(scene, "arch"))
    there = strokes_of_posture(scene, posture) + np.array([0.02, 0.01, -0.02, 0.015])
    posed.rest(there)
    posed.follow()
    f, frames = posed.modes.filter, posed.boom.live.frames
    for j in range(int(f.status[layout.COUNT])):
        sides = []
        for sign in (1e-6, -1e-6):
            place, heading = frames[0, [FRAME_X, FRAME_Y]].copy(), frames[0, FRAME_ANGLE]
            for k in range(1, len(frames)):
                step = frames[k, [FRAME_X, FRAME_Y]] - frames[k - 1, [FRAME_X, FRAME_Y]]
                before = frames[k - 1, FRAME_ANGLE]
                own = np.array(
                    [np.cos(before) * step[0] + np.sin(before) * step[1], np.cos(before) * step[1] - np.sin(before) * step[0]]
                )
                own = own + sign * f.relative[k, j, :2]
                c, s = math.cos(heading), math.sin(heading)
                place = place + np.array([c * own[0] - s * own[1], s * own[0] + c * own[1]])
                heading += frames[k, FRAME_ANGLE] - before + sign * f.relative[k, j, 2]
            sides.append([*place, heading])
        motion = (np.array(sides[0]) - sides[1]) / 2e-6
        assert f.tip[j] == pytest.approx(motion, rel=1e-5, abs=1e-8)


def test_angles_tell_nothing_of_a_sag_as_the_boom_moves(scene: Scene) -> None:
    """Sections may be off by 40 %: encoders that read what is predicted, in this posture and in others, rule out none of it."""
    posed = Posed(scene, strokes_of_posture(scene, "arch"), Settings(section_deviation=0.4))
    f, sags = posed.modes.filter, slice(layout.SHARES + 4, layout.SHARES + 8)
    stamp = 0
    for share in np.linspace(0.0, 1.0, 5):
        there = (1.0 - share) * strokes_of_posture(scene, "arch") + share * strokes_of_posture(scene, "high")
        posed.rest(there)
        posed.modes.refresh(there, posed.boom.angles, posed.boom.live, NO_NOISE)
        for _ in range(40):
            stamp += STEP
            posed.follow()
            f.status[layout.STAMP] = stamp
            reading.take_angles(f, np.zeros(4), 0, stamp)
            stepping.step_state(f, H)
    assert f.status[layout.FED] == 1
    assert np.diag(f.p)[sags] == pytest.approx(0.16, rel=1e-6)
    reading.read_tip(f, 1, f.row)
    sag2 = float(np.sum((0.4 * f.row[sags]) ** 2))
    assert float(f.row @ f.p @ f.row) > 0.99 * sag2 > (5e-3) ** 2


def test_fast_motion_is_predicted_to_a_share(posed: Posed) -> None:
    """The error of the predicted acceleration is taken to be 1 % of its root mean square over half a second, at least."""
    f = posed.modes.filter
    before = f.pushes.copy()
    f.status[layout.STARTED], f.now[layout.STEP] = 1, H
    results, estimates = rows_of(posed.boom)
    moments, gravity = posed.boom.compiled.bending @ posed.boom.live.z, np.array(posed.boom.plan.tables.gravity)
    for k in range(1000):
        results.tip[2, :2] = 12.0 * math.sin(2.0 * math.pi * 4.0 * k * H), 0.0
        stepping.follow_prediction(f, results, estimates, moments, gravity)
    assert f.pushes - before == pytest.approx([0.01**2 * 72.0, 0.0], rel=0.1, abs=1e-9)


def test_modes_follow_most_of_a_slow_error_of_the_strokes(posed: Posed) -> None:
    """The acceleration that errors of the newest strokes push the tip with, against an integral over their spectrum.

    That of a steady Kalman filter of white jerk with corner c: (1 + 4 u^4) / (1 + u^6) for u = omega / c, its noise's part.
    """
    f, settings, corner = posed.modes.filter, Settings(), 24.0
    count = int(f.status[layout.COUNT])
    f.variances[:] = 2.0 * settings.stroke_variance * H * corner
    f.now[layout.STEP], f.now[layout.SHAKEN : layout.SHAKEN + 2] = H, 0.0
    stepping.follow_errors(f)
    u = np.linspace(1e-3, math.pi / H / corner, 20000)
    power = (1.0 + 4.0 * u**4) / (1.0 + u**6)
    left = u**2 / (u**2 + (f.omega[:count, None] / corner) ** 2)
    for axis in (0, 1):
        pushed = (f.forces[:count].T * f.tip[:count, axis]) @ left
        mean = (pushed**2 @ power) / power.sum()
        found = math.sqrt(f.pushes[axis] - stepping.LEAST_ERROR**2)
        assert found == pytest.approx(math.sqrt(float(mean @ f.variances)), rel=0.25)
        whole = (f.forces[:count].T @ f.tip[:count, axis]) ** 2 @ f.variances
        assert found < 0.8 * math.sqrt(float(whole))


@pytest.mark.parametrize("count", [1, 4])
def test_the_level_of_one_component_follows_what_only_it_explains(posed: Posed, count: int) -> None:
    """Numbers that innovations tell of the load, against least squares; a load along y leaves the level along x."""
    f, rng = posed.modes.filter, np.random.default_rng(11)
    by = rng.normal(size=(count, 2))
    f.level[:] = 20.0
    for k in range(400):
        innovations = rng.normal(size=count) + 0.5 * by[:, 1] / float(np.linalg.norm(by[:, 1]))
        level.begin_sample(f)
        for (x, y), innovation in zip(by, innovations, strict=True):
            level.add_innovation(f, x, y, innovation)
        level.follow_levels(f, level.BY_ANGLES, H)
        if count > 1 and k == 0:
            covariance = np.linalg.inv(by.T @ by)
            found = covariance @ by.T @ innovations / np.sqrt(np.diag(covariance))
            assert f.before[level.BY_ANGLES] == pytest.approx(found, rel=1e-9)
    assert f.level[1] > 22.0
    assert (abs(f.level[0] - 20.0) < 6.0) == (count > 1)


def test_the_stated_deviation_of_the_acceleration_at_rest_is_true(scene: Scene) -> None:
    """The boom is as the scene says, with an IMU: error over stated deviation, over some sessions."""
    errors = []
    for seed in range(2):
        samples, _ = pseudo_session(scene, scene, 8.0, 20 + seed)
        twin, told = drive_twin(scene), []
        for sample in with_imu(scene, scene, samples, seed):
            report = twin.update(sample)
            told += [report.estimate] if report.estimate is not None else []
        late = told[len(told) // 3 :]
        variances = np.array([each.acceleration_covariance[[0, 3]] for each in late])
        errors.append(np.mean(np.array([each.acceleration[:2] for each in late]) ** 2 / variances))
    assert 0.7 < math.sqrt(float(np.mean(errors))) < 1.2


@pytest.mark.parametrize("example", ["", "five_section_z_fold"])
def test_sections_may_bend_by_one_percent_more(example: str) -> None:
    """What that does to the tip, by statics of scenes with each section softer, is in the variance that is stated."""
    scene = examine_text(example_text(example), example)[0] if example else load_scene()
    strokes = strokes_of_posture(scene, "arch")
    base, n = np.array(statics(scene, strokes=strokes).tip), len(scene.joints)
    names = [f"section_{i}.EI" for i in range(1, n + 1)]
    softer = [with_parameters(scene, {name: parameter(scene, name) / 1.01}) for name in names]
    spread2 = np.sum([(np.array(statics(each, strokes=strokes).tip) - base) ** 2 for each in softer], axis=0)
    stated2 = []
    for settings in (Settings(), Settings(section_deviation=0.0)):
        f = Posed(scene, strokes, settings).modes.filter
        for axis in (0, 1):
            reading.read_tip(f, axis, f.row)
            stated2.append(float(f.row @ f.p @ f.row))
    assert np.subtract(stated2[:2], stated2[2:]) == pytest.approx(spread2, rel=0.1, abs=1e-9)


def test_modes_move_the_tip_as_they_do_where_they_were_made(posed: Posed) -> None:
    """At the nearest strokes of the grid."""
    plan, f = posed.boom.plan, posed.modes.filter
    posed.rest(np.round(posed.strokes / GRID) * GRID)
    posed.follow()
    modes = natural_modes(plan, posed.boom.live, posed.boom.compiled.work, 4, 1e-6)
    for j, mode in enumerate(modes):
        motion = mode.motion[plan.tables.tip : plan.tables.tip + 3]
        assert f.tip[j] * np.sign(f.tip[j] @ motion) == pytest.approx(motion, rel=2e-3, abs=2e-5)


@pytest.mark.parametrize(
    ("name", "change", "tolerance"),
    [("cylinder_2.k", 1 / 1.04, 0.03), ("cylinder_1.k", 1 / 1.04, 0.03), ("section_2.EI", 1 / 1.04, 0.06)],
)
def test_shares_do_at_rest_what_the_changed_scene_does(scene: Scene, name: str, change: float, tolerance: float) -> None:
    """Tip and angles of a scene with one stiffness changed, from equilibria, against the rows of the filter."""
    strokes = strokes_of_posture(scene, "arch")
    posed = Posed(scene, strokes)

    changed = with_parameters(scene, {name: parameter(scene, name) * change})
    base, other = statics(scene, strokes=strokes), statics(changed, strokes=strokes)
    f, n = posed.modes.filter, 4
    place = layout.SHARES + int(name[name.index("_") + 1]) - 1 + (n if name.startswith("section") else 0)
    f.x[:] = 0.0
    f.x[place] = 1.0 / change - 1.0
    for j in range(int(f.status[layout.COUNT])):
        if name.startswith("cylinder"):
            f.x[layout.SHARES + 2 * n + 2 * j] = f.coupling[j, place - layout.SHARES + 2] * f.x[place] / f.omega[j] ** 2
    found = []
    for axis in (0, 1):
        reading.read_tip(f, axis, f.row)
        found.append(float(f.row @ f.x))
    assert found == pytest.approx(
        np.subtract(other.tip, base.tip).tolist(), abs=tolerance * float(np.hypot(*np.subtract(other.tip, base.tip)))
    )
    turns = np.subtract(other.joints, base.joints)
    for i in range(n):
        reading.read_angle(f, i, f.row)
        assert float(f.row @ f.x) == pytest.approx(turns[i], abs=tolerance * max(1e-3, float(np.abs(turns).max())))


def pseudo_session(scene: Scene, true: Scene, seconds: float, seed: int) -> tuple[list[Sample], dict[str, Array]]:
    """A boom at rest that is another one than the twin's: readings with noise."""
    strokes = strokes_of_posture(scene, "arch")
    at = statics(true, strokes=strokes)
    settings, rng = Settings(), np.random.default_rng(seed)
    samples = []
    for k in range(round(seconds / H)):
        samples.append(Sample(Stream.STROKES, k * STEP, strokes + settings.stroke_sigma * rng.normal(size=4)))
        samples.append(Sample(Stream.ANGLES, k * STEP, np.array(at.joints) + settings.angle_sigma * rng.normal(size=4)))
    return samples, {"tip": np.array(at.tip)}


def estimate_far_nearer_than_prediction(scene: Scene, samples: list[Sample], truth: Array) -> Estimate:
    """The last estimate, whose error is less than 8 % of that of the prediction (m), which is off by 20 mm or more."""
    twin, report = drive_twin(scene), None
    for sample in samples:
        told = twin.update(sample)
        report = told if told.prediction is not None else report
    assert report is not None and report.estimate is not None and report.prediction is not None
    off = np.hypot(*(report.prediction.tip_position - truth))
    assert off > 0.02
    assert np.hypot(*(report.estimate.tip[:2] - truth)) < 0.08 * off
    return report.estimate


def test_a_load_that_hangs_at_the_tip_is_found(scene: Scene) -> None:
    """20 kg more than the scene says pull by 196 N; sensors are angles only. Four softer cylinders would do the same."""
    heavy = with_parameters(scene, {"tip.payload": 60.0})
    light = with_parameters(scene, {"tip.payload": 40.0})
    samples, truth = pseudo_session(light, heavy, 6.0, 1)
    estimate = estimate_far_nearer_than_prediction(light, samples, truth["tip"])
    deviation = np.sqrt(estimate.tip_covariance[[0, 3]])
    assert (np.abs(estimate.tip[:2] - truth["tip"]) < 2.5 * deviation).all()
    assert estimate.load[1] == pytest.approx(-196.0, abs=20.0)


def test_a_soft_cylinder_is_no_load(scene: Scene) -> None:
    """Cylinder 2 has lost a quarter of its stiffness, at rest, angles only: the tip is off, and no load is told."""
    soft = with_parameters(scene, {"cylinder_2.k": 0.75 * parameter(scene, "cylinder_2.k")})
    samples, truth = pseudo_session(scene, soft, 6.0, 1)
    estimate = estimate_far_nearer_than_prediction(scene, samples, truth["tip"])
    assert np.hypot(*estimate.load) < 30.0


@pytest.mark.parametrize("is_right", [True, False])
def test_what_agrees_with_the_scene_is_stated_more_closely(scene: Scene, is_right: bool) -> None:
    """Boom at rest, angles only: a right one, and some that are 2 % wrong in stiffnesses and masses. Errors are as stated."""
    errors, stated = [], []
    for seed in range(2 if is_right else 8):
        true = scene if is_right else wrong_by(scene, 0.02, 200 + seed)
        samples, truth = pseudo_session(scene, true, 3.0, 30 + seed)
        twin = drive_twin(scene)
        told = [report.estimate for report in map(twin.update, samples) if report.estimate is not None][200:]
        variances = np.array([each.tip_covariance[[0, 3]] for each in told])
        errors.append(np.mean((np.array([each.tip[:2] for each in told]) - truth["tip"]) ** 2 / variances))
        stated.append(1e3 * math.sqrt(float(variances.sum(axis=1).mean())))
    assert 0.6 < math.sqrt(float(np.mean(errors))) < 1.6 and max(errors) < 2.0**2
    assert max(stated) < 1.2 if is_right else max(stated) > 1.5


@pytest.mark.parametrize(
    ("example", "posture"),
    [("", "arch"), ("", "high"), ("", "low"), ("five_section_z_fold", "arch"), ("five_section_z_fold", "reach")],
)
def test_a_load_at_rest_moves_the_tip_as_statics_do(example: str, posture: str) -> None:
    """Of 100 N, the modes below 25 Hz at the nearest strokes of the grid, within the share that is stated for it."""
    scene = examine_text(example_text(example), example)[0] if example else load_scene()
    strokes = strokes_of_posture(scene, posture)
    f = Posed(scene, strokes).modes.filter
    heavier = with_parameters(scene, {"tip.payload": parameter(scene, "tip.payload") + 10.0})
    moved = np.subtract(statics(heavier, strokes=strokes).tip, statics(scene, strokes=strokes).tip)
    count = int(f.status[layout.COUNT])
    found = -98.0665 * (f.tip[:count, 1] / f.omega[:count] ** 2) @ f.tip[:count, :2]
    assert np.hypot(*(found - moved)) < INEXACT * np.hypot(*moved)


def test_causes_are_weighed_as_gaussians_are(posed: Posed) -> None:
    """Chances, mean and covariance of the mixture, against Bayes' rule cause by cause in dense matrices."""
    f, rng = posed.modes.filter, np.random.default_rng(5)
    size, shares = int(layout.states_of(f)), slice(layout.SHARES, layout.SHARES + 4)
    f.status[layout.FED] = 1
    root = rng.normal(size=(size, size)) * np.sqrt(np.diag(f.p)[:size] + 1e-4)[:, None]
    f.p[:size, :size] = 0.1 * root @ root.T
    f.x[:size] = 0.0
    f.x[shares] = [0.01, 0.08, -0.02, 0.015]
    f.rows[:] = 0.0
    f.rows[:, :size] = rng.normal(size=(8, size))
    mix.weigh_causes(f)
    mix.read_covariances(f, size)

    p, x, rows = f.p[:size, :size], f.x[:size], f.rows[:, :size]
    weights, means, covariances = [], [], []
    causes = [(error, held) for error in layout.SCENE_ERRORS for held in [range(4), *(set(range(4)) - {i} for i in range(4))]]
    for error, held in [*causes, (0.0, [])]:
        error2, wide = error**2, layout.SOFT**2 + layout.SCENE_ERROR**2 + error**2
        at = layout.SHARES + np.array(sorted(held), int)
        spread = p[np.ix_(at, at)] + error2 * np.eye(len(at))
        inverse = np.linalg.inv(spread)
        prior = {
            4: (1.0 - 4.0 * mix.ONE_SOFT - mix.ALL_SOFT) / mix.LEVELS,
            3: mix.ONE_SOFT / mix.LEVELS,
            0: mix.ALL_SOFT,
        }[len(at)]
        weights.append(prior * math.exp(-0.5 * x[at] @ inverse @ x[at]) * math.sqrt(np.linalg.det(inverse) * wide ** len(at)))
        means.append(rows @ (x - p[:, at] @ inverse @ x[at]))
        covariances.append(rows @ (p - p[:, at] @ inverse @ p[at]) @ rows.T)
    chances = np.array(weights) / sum(weights)
    mean = chances @ means
    covariance = sum(
        chance * (own + np.outer(at - mean, at - mean)) for chance, own, at in zip(chances, covariances, means, strict=True)
    )
    assert f.chances == pytest.approx(chances, rel=1e-6)
    for a in range(8):
        assert mix.mean_of(f, a, size) == pytest.approx(mean[a], rel=1e-6)
        assert mix.covariance_of(f, a, a) == pytest.approx(covariance[a, a], rel=1e-6)
    assert mix.covariance_of(f, 3, 5) == pytest.approx(covariance[3, 5], rel=1e-6)


def with_imu(scene: Scene, true: Scene, samples: list[Sample], seed: int = 7) -> list[Sample]:
    """The same, and behind every sample of the angles what the IMU of the boom `true` reads, at rest."""
    posed, rng = Posed(true, strokes_of_posture(scene, "arch")), np.random.default_rng(seed)
    heading = float(rows_of(posed.boom)[0].tip[0, 2])
    c, s = math.cos(heading), math.sin(heading)
    felt, found = -np.array([[c, s], [-s, c]]) @ np.array(scene.gravity), []
    for sample in samples:
        found.append(sample)
        if sample.stream is Stream.ANGLES:
            found.append(Sample(Stream.IMU, sample.stamp, felt + Settings().imu_sigma * rng.normal(size=2)))
    return found


@pytest.mark.parametrize(("stiffness", "is_off"), [(1.0, False), (0.6, True)])
def test_a_sag_that_only_the_imu_shows_is_in_the_deviations(scene: Scene, stiffness: float, is_off: bool) -> None:
    """A section 40 % softer turns the tip and no joint: prediction and estimate are off by what they say, not by far more."""
    true = with_parameters(scene, {"section_2.EI": stiffness * parameter(scene, "section_2.EI")})
    samples, truth = pseudo_session(scene, true, 10.0, 1)
    twin = drive_twin(scene, baseline=Baseline())
    health = []
    for sample in with_imu(scene, true, samples):
        report = twin.update(sample)
        health += [report.health] if report.health is not None else []
        if report.prediction is not None and report.estimate is not None:
            prediction, estimate = report.prediction.tip_position, report.estimate
    off, left = np.hypot(*(prediction - truth["tip"])), np.hypot(*(estimate.tip[:2] - truth["tip"]))
    stated, said = np.hypot(*health[-1].tip_sigmas), math.sqrt(estimate.tip_covariance[[0, 3]].sum())
    assert (off > 0.01) == is_off
    assert off < 2.0 * stated and left < 2.0 * said
    assert is_off or (stated < 8e-3 and said < 2e-3)


def test_without_other_sensors_it_is_the_prediction(scene: Scene) -> None:
    twin, strokes = drive_twin(scene), strokes_of_posture(scene, "arch")
    for k in range(40):
        report = twin.update(Sample(Stream.STROKES, k * STEP, strokes))
    assert report.prediction is not None and report.estimate is not None
    p, e = report.prediction, report.estimate
    assert e.tip.tolist() == [*p.tip_position.tolist(), p.tip_angle]
    assert e.acceleration.tolist() == [*p.tip_acceleration.tolist(), p.tip_angular_acceleration]
    assert e.load.tolist() == [0.0, 0.0]
    assert 3e-3 < math.sqrt(e.tip_covariance[3]) < 5e-2, "nothing tells of a load there"


def test_order_of_streams_within_a_stamp_changes_little_and_blocks_nothing(scene: Scene) -> None:
    """Angles before or after the strokes of their stamp, or 40 ms late: nearly the same estimate; in blocks the very same."""
    heavy = with_parameters(scene, {"tip.payload": 60.0})
    light = with_parameters(scene, {"tip.payload": 40.0})
    samples, _ = pseudo_session(light, heavy, 5.0, 2)
    strokes = [sample for sample in samples if sample.stream is Stream.STROKES]
    angles = [sample for sample in samples if sample.stream is Stream.ANGLES]
    before = [each for pair in zip(angles, strokes, strict=True) for each in pair]
    late = [each for k in range(8, len(strokes)) for each in (strokes[k], angles[k - 8])]
    ends = []
    for order in (samples, before, [*strokes[:8], *late]):
        one, many = drive_twin(light), drive_twin(light)
        rows = [row_of(report.estimate) for report in map(one.update, order) if report.estimate is not None]

        found = []
        for part in many.update_block(block_of(order, 4)):
            if isinstance(part, ReportBlock):
                found += list(part.estimates.rows)
            elif part.estimate is not None:
                found.append(row_of(part.estimate))
        assert np.array_equal(np.array(rows), np.array(found))
        ends.append(rows[-1])
    assert np.abs(ends[0][:2] - ends[1][:2]).max() < 1e-3
    assert np.abs(ends[0][:2] - ends[2][:2]).max() < 2e-3


def test_the_covariance_stays_one(scene: Scene) -> None:
    """After a minute of readings at 200 Hz it is symmetric and positive, at rest as with late and missing readings."""
    samples, _ = pseudo_session(scene, scene, 60.0, 3)
    twin = drive_twin(scene)
    for sample in samples:
        twin.update(sample)
    f = twin._modes.filter
    size = int(layout.states_of(f))
    p = f.p[:size, :size]
    scale = np.sqrt(np.diag(p)[:, None] * np.diag(p)) + 1e-300
    normal = p / scale
    used = np.diag(p) > 0.0
    assert np.abs(normal - normal.T).max() < 1e-9
    assert np.linalg.eigvalsh(normal[np.ix_(used, used)]).min() > -1e-9


def test_offsets_of_forces_outlast_modes_that_come_and_go(posed: Posed) -> None:
    """State and covariance of everything but the modes above those that stay is the same."""
    f, rng = posed.modes.filter, np.random.default_rng(6)
    measure_forces(f)
    count, n = int(f.status[layout.COUNT]), 4
    size = int(layout.states_of(f))
    root = rng.normal(size=(size, size))
    f.x[:size], f.p[:size, :size] = rng.normal(size=size), root @ root.T
    x, p = f.x.copy(), f.p.copy()
    first = layout.SHARES + 2 * n
    stay = np.r_[: first + 2 * (count - 2), size - n : size]
    f.status[layout.COUNT] = count - 2
    posed.modes._keep_states(count, count - 2)
    assert np.array_equal(f.x[: len(stay)], x[stay]) and np.array_equal(f.p[: len(stay), : len(stay)], p[np.ix_(stay, stay)])
    assert not f.x[len(stay) :].any() and not f.p[len(stay) :].any() and not f.p[:, len(stay) :].any()
    f.status[layout.COUNT] = count
    posed.modes._keep_states(count - 2, count)
    assert np.array_equal(f.x[stay], x[stay]) and np.array_equal(f.p[np.ix_(stay, stay)], p[np.ix_(stay, stay)])
    come = np.r_[first + 2 * (count - 2) : size - n]
    assert not f.x[come].any() and not f.p[come].any()


@pytest.mark.parametrize(("factor", "zero"), [(1.1, 0.0), (0.9, 0.0), (1.0, 2e3)])
@pytest.mark.parametrize("cylinder", [0, 1, 3])
def test_a_force_that_reads_wrong_moves_the_tip_little(scene: Scene, cylinder: int, factor: float, zero: float) -> None:
    """10 % too much or 2 kN beside: loads and soft cylinders that would do it are contradicted by the angles."""
    samples, truth = pseudo_session(scene, scene, 4.0, 7)
    true, rng, settings = statics(scene, strokes=strokes_of_posture(scene, "arch")), np.random.default_rng(8), Settings()
    forces = np.array(true.cylinder_forces)
    forces[cylinder] = factor * forces[cylinder] + zero
    twin, told = drive_twin(scene), []
    for sample in samples:
        told.append(twin.update(sample).estimate)
        if sample.stream is Stream.ANGLES:
            twin.update(Sample(Stream.FORCES, sample.stamp, forces + settings.force_sigma * rng.normal(size=4)))
    estimates = [each for each in told if each is not None]
    off = np.array([each.tip[:2] for each in estimates]) - truth["tip"]
    stated = np.sqrt([each.tip_covariance[[0, 3]] for each in estimates])
    assert np.abs(off[200:]).max() < 4e-3
    assert np.sqrt(np.mean((off / stated)[200:] ** 2)) < 1.5
    assert np.abs([each.load for each in estimates[200:]]).max() < 60.0


@pytest.mark.parametrize("sensors", ["angles", "angles, imu", "angles, imu, forces"])
def test_noise_beyond_what_is_stated_is_noise_to_the_estimate_too(scene: Scene, sensors: str) -> None:
    """Strokes five times as noisy as stated shake the prediction; no load is made of it, and the deviations hold the error."""
    samples, truth = pseudo_session(scene, scene, 8.0, 9)
    rng, settings = np.random.default_rng(10), Settings()
    forces = np.array(statics(scene, strokes=strokes_of_posture(scene, "arch")).cylinder_forces)
    twin, told = drive_twin(scene), []
    for sample in with_imu(scene, scene, samples) if "imu" in sensors else samples:
        if sample.stream is Stream.STROKES:
            sample = Sample(sample.stream, sample.stamp, sample.values + 4.9 * settings.stroke_sigma * rng.normal(size=4))
        report = twin.update(sample)
        told += [report.estimate] if report.estimate is not None else []
        if sample.stream is Stream.ANGLES and "forces" in sensors:
            twin.update(Sample(Stream.FORCES, sample.stamp, forces + settings.force_sigma * rng.normal(size=4)))
    late = told[len(told) // 2 :]
    off = np.array([each.tip[:2] for each in late]) - truth["tip"]
    stated = np.sqrt([each.tip_covariance[[0, 3]] for each in late])
    assert np.sqrt(np.mean((off / stated) ** 2)) < 1.2
    assert np.abs([each.load for each in late]).max() < 150.0


def test_its_covariance_is_true_for_booms_drawn_from_it(scene: Scene) -> None:
    """Tips of scenes whose compliances differ as stated: the normalised error is near 1 over many of them."""
    errors = []
    for seed in range(8):
        rng = np.random.default_rng(100 + seed)

        values = {
            f"cylinder_{i + 1}.k": parameter(scene, f"cylinder_{i + 1}.k") / (1.0 + 0.25 * rng.uniform(-1.0, 2.0))
            for i in range(4)
        }
        samples, truth = pseudo_session(scene, with_parameters(scene, values), 3.0, seed)
        twin, estimates = drive_twin(scene), []
        for sample in samples:
            report = twin.update(sample)
            if report.estimate is not None:
                estimates.append(report.estimate)
        e = estimates[-1]
        errors.append((e.tip[:2] - truth["tip"]) / np.sqrt(e.tip_covariance[[0, 3]]))
    assert 0.3 < math.sqrt(float(np.mean(np.square(errors)))) < 1.6


def test_absurd_readings_leave_an_estimate(scene: Scene) -> None:
    """A sensor that reads millions for a while; afterwards the estimate is where it was."""
    samples, truth = pseudo_session(scene, scene, 6.0, 4)
    twin, ends = drive_twin(scene), []
    for sample in samples:
        is_spoilt = sample.stream is Stream.ANGLES and 1_000_000_000 < sample.stamp < 1_500_000_000
        report = twin.update(Sample(sample.stream, sample.stamp, sample.values + 9e6) if is_spoilt else sample)
        if report.estimate is not None:
            assert np.isfinite(row_of(report.estimate)).all()
            ends.append(report.estimate)
    assert np.abs(ends[-1].tip[:2] - truth["tip"]).max() < 5e-3


@pytest.mark.parametrize("drop", ["k", "beam"])
def test_a_boom_without_springs_or_beams_has_one_too(scene: Scene, drop: str) -> None:
    """Incompressible cylinders, or rigid sections on springs: fewer modes, no shares of what is not there."""
    content = scene.model_dump(exclude_none=True)
    if drop == "k":
        for joint in content["joints"]:
            joint["cylinder"].pop("k"), joint["cylinder"].pop("d", None)
    else:
        content["modes"] = 0
    other = Scene.model_validate(content)
    samples, _ = pseudo_session(other, other, 2.0, 5)
    twin = drive_twin(other)
    estimates = [report.estimate for report in map(twin.update, samples) if report.estimate is not None]
    f = twin._modes.filter
    assert np.isfinite(row_of(estimates[-1])).all() and (estimates[-1].tip_covariance[[0, 3, 5]] > 0.0).all()
    if drop == "k":
        assert not f.x[layout.SHARES : layout.SHARES + 4].any()
