"""Named tuples by reference: kernels read the fields that Python, or another kernel, put there."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest
from compiled import compile_scene

from boom_twin import load_scene
from boom_twin.kernels import references
from boom_twin.kernels.jit import _kind, by_reference, kernel


class Pair(NamedTuple):
    first: float
    second: int


@by_reference
class Inside(NamedTuple):
    values: np.ndarray


@by_reference
class Fields(NamedTuple):
    flag: bool
    pair: Pair
    inside: Inside
    table: np.ndarray


@kernel
def total(fields):
    found = 0.0
    for i in range(fields.table.shape[0]):
        for j in range(fields.table.shape[1]):
            found += fields.table[i, j] * fields.inside.values[j]
    if fields.flag:
        found += fields.pair.first * fields.pair.second
    return found


def fields(flag=True):
    return Fields(flag, Pair(0.5, 3), Inside(np.array([1.0, 10.0])), np.arange(6.0).reshape(3, 2))


def test_a_kernel_reads_fields_of_every_kind():
    assert total(fields()) == 96.0 + 1.5
    assert total(fields(flag=False)) == 96.0
    assert total(fields()._replace(table=np.ones((1, 2)))) == 11.0 + 1.5


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda given: pickle.loads(pickle.dumps(given))])
def test_a_copy_has_fields_of_its_own(copied):
    """Also of a tuple whose fields a kernel has read, as in a twin that is copied."""
    given = fields()
    total(given)
    other = copied(given)
    given.inside.values[:] = 1e9
    assert total(other) == 96.0 + 1.5
    other.inside.values[:] = 1.0
    assert total(other) == 15.0 + 1.5


def test_a_numba_that_keeps_arrays_in_another_order_is_refused(monkeypatch):
    monkeypatch.setattr(references, "ARRAY", ("data", *references.ARRAY))

    @by_reference
    class Other(NamedTuple):
        values: np.ndarray

    with pytest.raises(ImportError, match=r"numba .* keeps arrays otherwise than the versions that were tested"):
        kernel(lambda other: other.values[0])(Other(np.zeros(1)))


def test_a_twin_starts_without_the_slow_parts_of_scipy():
    """They took longer to import than all else."""
    program = (
        "import sys; from boom_twin import Twin, load_scene; Twin(load_scene()).warm_up();"
        "print([name for name in ('scipy.special', 'scipy.optimize', 'scipy.stats') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], env=os.environ, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]", done.stdout


def test_what_types_are_known_by_tells_apart_all_that_numba_does() -> None:
    """Code compiled for one is never given the other."""
    import numba

    grid = np.arange(12.0).reshape(3, 4)
    fixed = grid.copy()
    fixed.flags.writeable = False
    arrays = [grid, grid.copy(), grid.T, grid[:, ::2], fixed, grid[0], grid.astype(np.float32), grid.astype(np.int64)]
    arrays += [np.zeros(2, [("a", "f8")]), np.zeros(2, [("b", "f8")]), np.zeros((0, 4)), grid.astype(bool)]
    plan = compile_scene(load_scene())
    given = [*arrays, 1, 2, 1.0, True, None, (grid, 1), (grid.T, 1), (grid.copy(), 2), plan.state(), plan.state(), plan.work()]
    types = [numba.typeof(each) for each in given]
    for one, kind in zip(given, types, strict=True):
        for other, its in zip(given, types, strict=True):
            assert kind == its or _kind(one) != _kind(other)
            assert (_kind(one) == _kind(other)) or one is not other
    assert _kind(grid) == _kind(grid.copy()) and _kind(plan.state()) == _kind(plan.state())
