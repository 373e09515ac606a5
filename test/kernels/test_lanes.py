"""Numbers of several booms in one: each lane is what the same kernel makes of its number alone, to the bit."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest

from boom_twin.compiler.lanes import WIDTH, lanes_of, room_for
from boom_twin.kernels.jit import LANES, by_reference, kernel, select, some
from boom_twin.kernels.plane_algebra import cosine_and_sine, factorise, substitute

SIZE = 5


@by_reference
class System(NamedTuple):
    matrix: np.ndarray
    right: np.ndarray
    order: np.ndarray


@by_reference
class Pairs(NamedTuple):
    x: np.ndarray
    found: np.ndarray


@kernel
def solve(system):
    factorise(system.matrix, SIZE, system.order)
    substitute(system.matrix, system.order, system.right, SIZE, 2)


@kernel
def turns(pairs):
    for i in range(pairs.x.shape[0]):
        pairs.found[i, 0], pairs.found[i, 1] = cosine_and_sine(pairs.x[i])


@kernel
def arithmetic(pairs):
    """Every operation once, with numbers that all lanes share on either side."""
    for i in range(pairs.x.shape[0]):
        x, f = pairs.x[i], pairs.found[i]
        f[0] = 2 * x - x / 3.0 + (1.0 - x) * -x
        f[1] = max(x, 0.5) + min(x, -0.5, -x) + abs(x)
        f[2] = math.sqrt(abs(x)) + round(x) + np.floor(x)
        f[3] = math.atan2(x, 0.3) + math.hypot(x, 0.3)
        f[4] = select(((x > 0.25) & (x <= 1.0)) | (x == 2.0), x, 7)
        f[5] = 1.0
        if some((x < -1.5) | (x >= 50.0)) and math.pi > 3:
            f[5] += select(x != x, 0.0, x)
        f[6] = select(math.isfinite(1.0 / x), x.real, 0.0)


@kernel
def careless(pairs):
    if pairs.x[0] > 0.0:
        pairs.found[0, 0] = 1.0


def each_lane(lanes):
    return np.moveaxis(lanes[LANES], -1, 0)


def test_booms_that_take_other_pivots_are_solved_side_by_side():
    rng = np.random.default_rng(0)
    matrix, right = rng.normal(size=(WIDTH, SIZE, SIZE)), rng.normal(size=(WIDTH, SIZE, 2))
    matrix[0] = np.eye(SIZE)[::-1]
    together = System(lanes_of(matrix)[0], lanes_of(right)[0], room_for((SIZE,)))
    solve(together)
    orders = set()
    for i in range(WIDTH):
        alone = System(matrix[i].copy(), right[i].copy(), np.zeros(SIZE, np.int64))
        solve(alone)
        assert np.array_equal(each_lane(together.right)[i], alone.right)
        assert np.array_equal(each_lane(together.order)[i], alone.order)
        assert alone.right == pytest.approx(np.linalg.solve(matrix[i], right[i]), rel=1e-9)
        orders.add(tuple(alone.order))
    assert len(orders) == WIDTH


def test_a_singular_lane_leaves_the_others():
    matrix, right = np.tile(np.diag([4.0, 3.0, 2.0, 1.0, 5.0]), (WIDTH, 1, 1)), np.ones((WIDTH, SIZE, 2))
    matrix[1, 2, 2] = 0.0
    together = System(lanes_of(matrix)[0], lanes_of(right)[0], room_for((SIZE,)))
    solve(together)
    found = each_lane(together.right)
    assert not np.isfinite(found[1]).all()
    assert found[[0, 2, 3]] == pytest.approx(
        np.broadcast_to((1.0 / np.array([4.0, 3.0, 2.0, 1.0, 5.0]))[:, None], (3, SIZE, 2))
    )


@pytest.mark.parametrize("function", [turns, arithmetic])
def test_each_lane_is_what_its_number_alone_gives(function):
    rng = np.random.default_rng(1)
    numbers = np.concatenate(
        [rng.uniform(-7.0, 7.0, 400), [0.25, -0.5, 1.5, 2.5, 1e6, -3e5, 1e-300, 0.78, -0.78, 2.0, 60.0, -2.0]]
    )
    numbers = rng.permutation(numbers).reshape(WIDTH, -1)
    together = Pairs(lanes_of(numbers)[0], room_for((numbers.shape[1], 7)))
    function(together)
    for i in range(WIDTH):
        alone = Pairs(numbers[i].copy(), np.zeros((numbers.shape[1], 7)))
        function(alone)
        lane = each_lane(together.found)[i]
        if function is turns:
            assert alone.found[:, 0] == pytest.approx(np.cos(numbers[i]), abs=2e-16)
            assert alone.found[:, 1] == pytest.approx(np.sin(numbers[i]), abs=2e-16)
        else:  # that lane of column 5 asks whether there is some other lane
            lane[:, 5] = np.where((numbers[i] < -1.5) | (numbers[i] >= 50.0), lane[:, 5], 1.0)
        assert np.array_equal(lane, alone.found)


def test_a_branch_by_lanes_does_not_compile():
    from numba.core.errors import NumbaError

    with pytest.raises(NumbaError, match="mask4"):
        careless(Pairs(room_for((1,)), room_for((1, 1))))


FIRST_USE_IN_THREADS = """
import sys
import threading
from typing import NamedTuple

import numpy as np

from boom_twin.compiler.lanes import room_for
from boom_twin.kernels.jit import by_reference, kernel


@by_reference
class Numbers(NamedTuple):
    x: np.ndarray


@kernel
def double(numbers):
    for i in range(numbers.x.shape[0]):
        numbers.x[i] = 2.0 * numbers.x[i]


def use():
    together.wait()
    double(Numbers(room_for((3,))))
    done.append(True)


sys.setswitchinterval(1e-6)
together, done = threading.Barrier(24), []
threads = [threading.Thread(target=use) for _ in range(24)]
for each in threads:
    each.start()
for each in threads:
    each.join()
print(len(done))
"""


def test_threads_may_meet_the_first_lanes_at_once(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(FIRST_USE_IN_THREADS)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, str(program)], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "24", done.stderr
