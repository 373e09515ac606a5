"""Derivations beside formulas, against plain linear algebra: condensed systems, friction's couple, weights of integrators."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from boom_twin.kernels.elements.cylinder import END_C, END_R
from boom_twin.kernels.elements.pin_contact import BARREL_END_PIN, HOLD_COLUMNS, HOLD_X, K_XX, K_XY, K_YY, ROD_END_PIN
from boom_twin.kernels.integrators import PARK, WILSON, A, V, X, finish_step, new_weights, prepare, start_step
from boom_twin.kernels.transfer.clearance_pins import SECTION, _turn_back, condense_ends
from boom_twin.kernels.transfer.six_bar import _condense_loop, _condense_loop_forces

STEP = 0.01


def symmetric(rng: np.random.Generator, size: int) -> np.ndarray:
    matrix = rng.normal(size=(size, size))
    return matrix + matrix.T


@pytest.mark.parametrize(("count", "size"), [(6, 11), (6, 13), (8, 13), (14, 20)])
def test_a_condensed_loop_is_the_schur_complement(count: int, size: int) -> None:
    rng, others = np.random.default_rng(size), size - count
    h, g = symmetric(rng, size), rng.normal(size=size)
    room = np.zeros
    work = SimpleNamespace(s=room((others, others)), p=room(others), g=g, h=np.tril(h), right=room((count, others + 1)))
    found = SimpleNamespace(
        blocks=room((1, count, count)), gains=room((1, count, others)), free=room((1, count)),
        factors=room((1, count, count)), order=np.zeros((1, count), np.int64),
    )  # fmt: skip
    assert _condense_loop(work, found, 0, 0, count, size)
    q = np.arange(SECTION, SECTION + count)
    x = np.setdiff1d(np.arange(size), q)
    gains, free = np.linalg.solve(h[np.ix_(q, q)], h[np.ix_(q, x)]), np.linalg.solve(h[np.ix_(q, q)], g[q])
    assert found.gains[0] == pytest.approx(gains) and found.free[0] == pytest.approx(free)
    assert work.s == pytest.approx(h[np.ix_(x, x)] - h[np.ix_(x, q)] @ gains)
    assert work.p == pytest.approx(g[x] - h[np.ix_(x, q)] @ free)
    parts = [np.linalg.eigvalsh(part) for part in (found.blocks[0], work.s)]
    assert np.sum(np.linalg.eigvalsh(h) < 0.0) == sum(np.sum(part < 0.0) for part in parts)
    work.g = rng.normal(size=size)  # other forces, the same tangent
    _condense_loop_forces(work, found, 0, count, size)
    free = np.linalg.solve(h[np.ix_(q, q)], work.g[q])
    assert found.free[0] == pytest.approx(free) and work.p == pytest.approx(work.g[x] - h[np.ix_(x, q)] @ free)


@pytest.mark.parametrize("places", [(ROD_END_PIN,), (BARREL_END_PIN,), (ROD_END_PIN, BARREL_END_PIN)])
def test_condensed_ends_solve_the_system_with_their_offsets(places: tuple[np.int64, ...]) -> None:
    """The whole system over (C, R, N, offsets), its offsets eliminated at once."""
    rng, k = np.random.default_rng(len(places)), len(places)
    h, g, hold = symmetric(rng, 5), rng.normal(size=5), np.zeros((k, HOLD_COLUMNS))
    hold[:, [HOLD_X, HOLD_X + 1, K_XX, K_XY, K_YY]] = rng.normal(size=(k, 5))
    whole, right = np.zeros((5 + 2 * k, 5 + 2 * k)), np.zeros(5 + 2 * k)
    moved = np.zeros((5, 5 + 2 * k))  # of the ends, by the pins and all offsets
    moved[:, :5] = np.eye(5)
    for i, place in enumerate(places):
        at = END_C if place == BARREL_END_PIN else END_R
        moved[at : at + 2, 5 + 2 * i : 7 + 2 * i] = np.eye(2)
    whole, right = moved.T @ h @ moved, moved.T @ g
    for i in range(k):
        d = slice(5 + 2 * i, 7 + 2 * i)
        whole[d, d] += [[hold[i, K_XX], hold[i, K_XY]], [hold[i, K_XY], hold[i, K_YY]]]
        right[d] += hold[i, HOLD_X : HOLD_X + 2]
    inner = np.linalg.solve(whole[5:, 5:], np.column_stack([whole[5:, :5], right[5:]]))
    t = SimpleNamespace(clearances=[SimpleNamespace(place=place) for place in places])
    cylinder = SimpleNamespace(first_clearance=0, clearances=k, history=0)
    work = SimpleNamespace(hold=hold, position=np.ones(1))
    condensed = SimpleNamespace(ends=np.zeros((k, 2, 2)), end_gains=np.zeros((k, 2, 5)), end_free=np.zeros((k, 2)))
    condense_ends(t, None, work, condensed, cylinder, g, h)
    assert h == pytest.approx(whole[:5, :5] - whole[:5, 5:] @ inner[:, :5])
    assert g == pytest.approx(right[:5] - whole[:5, 5:] @ inner[:, 5])


def test_frictions_couple_is_the_gradient_of_its_work() -> None:
    """Of torque times the cylinder's angle, by the places of its ends; by central differences."""
    ends, torque, nudge = np.array([0.2, -0.1, 1.1, 0.7]), 3.0, 1e-6
    d = ends[2:] - ends[:2]
    h, g = np.zeros((5, 5)), np.zeros(5)
    h[4, END_R : END_R + 2] = d / np.hypot(*d) / 1.7  # over 1 + tau C
    _turn_back(g, h, torque / np.hypot(*d))

    def angle(at: np.ndarray) -> float:
        return float(np.arctan2(at[3] - at[1], at[2] - at[0]))

    slope = [(angle(ends + step) - angle(ends - step)) / (2.0 * nudge) for step in nudge * np.eye(4)]
    assert g == pytest.approx([*(torque * np.array(slope)), 0.0], abs=1e-8)


@pytest.mark.parametrize(("family", "parameter", "degree"), [(WILSON, 1.4, 3), (WILSON, 2.0, 3), (PARK, 0.0, 2)])
def test_a_polynomial_is_stepped_exactly(family: int, parameter: float, degree: int) -> None:
    """Linear accelerations by Wilson, constant ones by Park, from the histories that the derivations speak of."""
    path = np.polynomial.Polynomial(np.random.default_rng(3).normal(size=degree + 1))
    speed, bend = path.deriv(), path.deriv(2)
    depth = 8 if family == PARK else 4
    scheme = prepare(family, parameter, STEP, new_weights(depth))
    rows = [path(0.0), speed(0.0), bend(0.0), bend(0.0)]
    if family == PARK:
        rows = [path(-2 * STEP), speed(-2 * STEP), path(-STEP), speed(-STEP), *rows]
    history, (hat, offset, v, a) = np.array(rows)[:, None], np.zeros((4, 1))
    start_step(scheme, history, hat, offset)
    finish_step(scheme, np.array([path(scheme.reach)]), hat, offset, v, a, history)
    assert v[0] == pytest.approx(speed(scheme.reach)) and a[0] == pytest.approx(bend(scheme.reach))
    assert history[[X, V, A], 0] == pytest.approx([path(STEP), speed(STEP), bend(STEP)], rel=1e-9, abs=1e-9)
