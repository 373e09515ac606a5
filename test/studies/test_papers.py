"""The study of the papers: matrices, boundary zeros, low speed, postures with clearance."""

from __future__ import annotations

import numpy as np
import pytest
from studies.papers import low_speed
from studies.papers.boundary_zeros import bisect, equilibrium, frequencies
from studies.papers.postures import compare, run_own, run_peer
from studies.papers.sweep_matrices import boundary_solution, chain_of, difference

from boom_twin import Scene, load_scene, statics
from boom_twin.analysis.motions import motion_of
from boom_twin.errors import UsageError

SCENE = load_scene()
LOADED = Scene.model_validate(
    SCENE.model_dump(exclude_none=True) | {"tip": {"payload": 80.0}, "line_fill": 15.0, "modes": 2, "axial": False}
)
SMALL_ROTATIONS = SCENE.model_copy(update={"geometric": False})


@pytest.mark.parametrize("scene", [SCENE, LOADED, SMALL_ROTATIONS], ids=["default", "loaded", "small rotations"])
@pytest.mark.parametrize("step", [1e-3, 2e-2])
def test_assembled_matrices_are_those_of_the_sweep(scene: Scene, step: float) -> None:
    own, swept = chain_of(scene, 0.3, step)
    assert [one.name for one in own] == ["A", "B1 of section 2", "B2 of section 3", "B3 of section 4"]
    for one, other in zip(own, swept, strict=True):
        assert difference(one.matrix, other) < 1e-9
        assert one.matrix @ np.append(one.inlet, 1.0) == pytest.approx(np.append(one.outlet, 1.0), rel=1e-6, abs=1e-3)


def test_their_product_solves_the_boundary_problem_until_digits_are_lost() -> None:
    errors = []
    for step in (0.1, 1e-3):
        own, _ = chain_of(SCENE, 0.3, step)
        found = boundary_solution(own)
        errors.append(float(np.abs(found[4:] / own[0].inlet[4:] - 1.0).max()))
    assert errors[0] < 1e-9
    assert errors[1] > 10.0 * errors[0]


def test_bisection_finds_what_newton_finds():
    zero = equilibrium(SCENE, "arch")
    assert abs(zero.bisected - zero.newton) < 1e-7
    assert zero.newton == pytest.approx(float(statics(SCENE, posture="arch", modes=0).joints[0]), abs=1e-12)
    assert abs(zero.residual) < 2.0  # N m, of 33 000: what 1e-7 rad of the oil's spring is
    for near, counted in frequencies(SCENE, "arch", 3):
        assert near == pytest.approx(counted, rel=2e-7)
    with pytest.raises(UsageError, match="no change of sign"):
        bisect(lambda x: x * x + 1.0, -1.0, 1.0, 1e-3)


def test_leaving_velocity_terms_out_errs_with_the_square_of_the_speed() -> None:
    speeds = low_speed.error_by_speed(SCENE, motion_of(SCENE), (6.0, 3.0), 5e-3)
    slopes = np.log(speeds[1, 1:] / speeds[0, 1:]) / np.log(speeds[1, 0] / speeds[0, 0])
    assert slopes == pytest.approx([2.0, 2.0], abs=0.15)
    assert 5e-4 < speeds[1, 1] < 2e-3  # m


def test_four_worn_pins_in_a_stop_are_those_of_the_independent_code():
    stop = compare(run_own(SCENE, "arch", "worn", 0.9), run_peer(SCENE, "arch", "worn", 0.9, 5e-4))
    assert stop.own.penetration.shape[1] == 4
    assert 0.65 < stop.flight < 0.9  # the drives brake from 0.6 s on; a journal flies when the boom swings back
    assert stop.tip < 1e-3 and stop.tip_throughout < 1e-3
    assert stop.forces < 0.05 and stop.penetration < 0.10
