"""The Riccati sweeps against the same equations written out at once, and Newton's method by its order."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from compiled import compile_scene, set_undeformed, settle
from default_boom import posture_angles, strokes_of_posture
from kernels.dense import Dense, riccati_pass
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins

from boom_twin import load_scene
from boom_twin.kernels.integrators import GENERALISED_ALPHA, REST, X, prepare
from boom_twin.kernels.tables import DIGITS_LOST, NOT_CONVERGED, NOT_FINITE, OK, SINGULAR, Motion
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.matrix_product import new_product
from boom_twin.kernels.transfer.time_step import advance

SEEDS = [2, 3, 4, 8, 14, 18, 25]


def boom_beside_equilibrium(scene, posture, seed=0, size=2e-3):
    """Plan, state and work with every unknown a little off: angles by `size` rad, forces by a million N/rad."""
    rng, plan = np.random.default_rng(seed), compile_scene(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, strokes_of_posture(scene, posture), posture_angles(scene, posture))
    still = work.position.copy()
    state.z[:] += rng.normal(size=len(state.z)) * size * np.where(plan.tables.moving > 0, 1.0, 1e6)
    place(plan.tables, state, work)
    return plan, state, work, still


@pytest.mark.parametrize("name, seed", [("default", None), ("boom 4", 4), ("boom 8", 8)])
def test_plain_product_solves_the_same_step(name, seed):
    """A long step, where the product still has digits: the same increments as the Riccati form; a short one says it has not."""
    scene, posture = (load_scene(), "arch") if seed is None else (booms.random_boom(seed), "test")
    plan = compile_scene(scene)
    drive, still = plan.closed_lengths + strokes_of_posture(scene, posture), np.zeros(plan.joints)
    ends = []
    for product in (None, new_product(plan.tables)):
        state, work = plan.state(), plan.work()
        settle(plan, state, work, drive - plan.closed_lengths, posture_angles(scene, posture))
        scheme = prepare(GENERALISED_ALPHA, 0.8, 0.02, work.weights)
        for k in range(5):
            moved = drive + 1e-4 * (k + 1)
            status, _, _ = advance(plan.tables, state, work, scheme, moved, still, 1e-7, np.int64(20), 0.5, product, False)
            assert status == OK
        ends.append(state.history[X, plan.tables.tip : plan.tables.tip + 2].copy())
    assert ends[1] == pytest.approx(ends[0], abs=1e-7)
    scheme = prepare(GENERALISED_ALPHA, 0.8, 1e-6, work.weights)
    status, _, _ = advance(plan.tables, state, work, scheme, moved, still, 1e-7, np.int64(20), 0.5, product, False)
    assert status in (DIGITS_LOST, NOT_CONVERGED, SINGULAR, NOT_FINITE)


def rod_pin_outboard_of_c():
    """Cylinder 1 holds section 1 outboard of where cylinder 2 starts: the other order of carried columns."""
    spec = booms.document()
    spec["sections"][0]["rod_pin"] = [3.2, -0.2]
    spec["base"]["cylinder_pin"] = [1.2, -1.0]
    return booms.scene_of(spec)


SCENES = [pytest.param(load_scene(), "arch", id="default")]
SCENES += [
    pytest.param(load_scene().model_copy(update={key: value}), "arch", id=f"{key} {value}")
    for key, value in (("modes", 2), ("modes", 5), ("axial", False), ("geometric", False))
]
SCENES += [pytest.param(rod_pin_outboard_of_c(), "arch", id="rod pin outboard of C")]
SCENES += [
    pytest.param(booms.on_elastic_base(scene, 5.0e6, 2.0e5), posture, id=f"elastic base, {name}")
    for scene, posture, name in (
        (load_scene(), "arch", "default"),
        (rod_pin_outboard_of_c(), "arch", "rod pin outboard of C"),
        (booms.random_boom(14), "test", "boom 14"),
    )
]
SCENES += [pytest.param(booms.random_boom(seed), "test", id=f"boom {seed}") for seed in SEEDS]


@pytest.mark.parametrize("scene, posture", SCENES)
@pytest.mark.parametrize("gain, rate", [(0.0, 0.0), (1.5e6, 2e3)], ids=["statics", "step"])
def test_increments_solve_the_equations_of_all_unknowns_at_once(scene, posture, gain, rate):
    """What the sweeps' step leaves falls with the square of the distance from the solution.

    Not to rounding: bending already condensed enters the tangent of what lies inboard with its predicted force.
    """
    drive = strokes_of_posture(scene, posture)
    left = []
    for size in (1e-3, 1e-4):  # rad; larger ones are not near any more where short parts bend
        plan, state, work, rested = boom_beside_equilibrium(scene, posture, size=size)
        motion, still = Motion(gain, rate, rested, -rate * rested), np.zeros(plan.joints)
        z = state.z.copy()
        riccati_pass(plan, state, work, motion, plan.closed_lengths + drive, still)
        left.append(Dense(plan, motion, plan.closed_lengths + drive, still).left_by(z, work.dz))
    (far, before), (near, _) = left
    moving = plan.tables.moving > 0
    assert np.abs(near[moving]).max() < np.abs(far[moving]).max() / 50.0 + 1e-4  # N m; rounding of differences
    assert np.abs(far[moving]).max() < 0.05 * np.abs(before[moving]).max()
    assert np.abs(far[~moving]).max() < 1e-5 * np.abs(before[~moving]).max()


@pytest.mark.parametrize("scene, posture", SCENES)
def test_newton_converges_quadratically(scene, posture):
    """A tangent with any term missing or wrong in sign converges linearly at best."""
    plan, state, work, _ = boom_beside_equilibrium(scene, posture, seed=3)
    drive, still = plan.closed_lengths + strokes_of_posture(scene, posture), np.zeros(plan.joints)
    scheme, sizes = prepare(REST, 0.0, 0.0, work.weights), []
    state.history[X, : len(state.z)] = state.z
    for _ in range(6):
        _, _, size = advance(plan.tables, state, work, scheme, drive, still, 0.0, np.int64(1), 10.0, None, False)
        sizes.append(size)
    factors = [b / a**2 for a, b in pairwise(sizes) if b > 1e-11]
    assert sizes[-1] < 1e-12 and len(factors) >= 1
    assert max(factors) < 100.0


def rested():
    scene = load_scene()
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, strokes_of_posture(scene, "arch"), posture_angles(scene, "arch"))
    return plan, state, work, plan.closed_lengths + strokes_of_posture(scene, "arch")


@pytest.mark.parametrize(
    "drive, passes, expected",
    [(np.array([np.nan, 1.0, 1.0, 1.0]), 20, NOT_FINITE), (np.array([9.0, 9.0, 9.0, 9.0]), 2, NOT_CONVERGED)],
)
def test_failed_step_says_so_and_leaves_the_histories(drive, passes, expected):
    plan, state, work, _ = rested()
    before, scheme = state.history.copy(), prepare(GENERALISED_ALPHA, 0.8, 1e-3, work.weights)
    status, _, _ = advance(plan.tables, state, work, scheme, drive, np.zeros(4), 1e-9, np.int64(passes), 0.5, None, False)
    assert status == expected
    assert np.array_equal(state.history, before)


def test_massless_boom_without_stiffness_is_singular():
    """A single massless section whose cylinder stands along its arm: nothing resists turning."""
    spec = booms.document()
    spec |= {"sections": [{"length": 2.0, "rod_pin": [0.0, -1.0]}], "joints": [spec["joints"][0]], "modes": 0}
    spec["base"] = {"pivot": [0.0, 0.0], "cylinder_pin": [0.0, -2.2]}
    del spec["joints"][0]["cylinder"]["barrel"], spec["joints"][0]["cylinder"]["rod"]
    plan = compile_scene(booms.scene_of(spec))
    state, work = plan.state(), plan.work()
    set_undeformed(plan, state, np.zeros(1))
    drive, scheme = np.array([1.2]), prepare(REST, 0.0, 0.0, work.weights)
    status, _, _ = advance(plan.tables, state, work, scheme, drive, np.zeros(1), 1e-9, np.int64(20), 0.1, None, False)
    assert status in (SINGULAR, NOT_FINITE)
    assert status != OK


def scratch(work):
    """All arrays of work, also those of what is condensed, but for inputs: weights of the schemes, the load at the tip."""
    for name, value in work._asdict().items():
        if isinstance(value, tuple):
            yield from value
        elif name not in ("weights", "finer", "load"):
            yield value


@pytest.mark.parametrize("worn, stiffness", [(False, None), (True, None), (True, 5.0e6)])
def test_work_means_nothing_between_steps(worn, stiffness):
    """What a step leaves in it, or a boom beside, is not what the next step starts from: not a number there changes no bit."""
    document = booms.document()
    scene = with_pins(document, [*RODS, "joint_3.Q"], friction=0.1) if worn else booms.scene_of(document)
    scene = booms.on_elastic_base(scene, stiffness)
    plan, ends = compile_scene(scene), []
    first = strokes_of_posture(scene, "arch")
    for spoilt in (False, True):
        state, work = plan.state(), plan.work()
        settle(plan, state, work, first, posture_angles(scene, "arch"))
        scheme = prepare(GENERALISED_ALPHA, 0.8, 1e-3, work.weights)
        for k in range(20):
            for array in scratch(work) if spoilt else ():
                array[...] = np.nan if array.dtype == float else 77
            drive = plan.closed_lengths + first + 1e-4 * k
            status, _, _ = advance(plan.tables, state, work, scheme, drive, np.zeros(4), 1e-7, np.int64(20), 0.5, None, False)
            assert status == OK
        ends.append(state)
    for clean, other in zip(*ends, strict=True):
        assert np.array_equal(clean, other)
