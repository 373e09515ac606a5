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

from boom_twin import load_scene
from boom_twin.compiler.compile import compile_scene
from boom_twin.deviation.posture import Posture
from boom_twin.deviation.states import Filters
from boom_twin.kernels.jit import HeldFields, _kind, by_reference, hold, kernel
from boom_twin.kernels.tables import Condensed, State, Tables, Work
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.twin.state import Limits, Ring, TwinState, UpdateOutput


class Pair(NamedTuple):
    first: float
    second: int


class Late(NamedTuple):
    """Taken by reference from the middle of a test on."""

    values: np.ndarray


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


@kernel
def other(fields):
    return fields.nothing


def fields(flag=True):
    return Fields(flag, Pair(0.5, 3), Inside(np.array([1.0, 10.0])), np.arange(6.0).reshape(3, 2))


def test_a_kernel_reads_fields_of_every_kind():
    assert total(fields()) == 96.0 + 1.5
    assert total(fields(flag=False)) == 96.0
    assert total(fields()._replace(table=np.ones((1, 2)))) == 11.0 + 1.5


def test_fields_that_were_written_once_are_read_where_they_stand():
    """Also those of the tuple inside; what its arrays hold changes with them, and nothing of it is let go of."""
    given = fields()
    held = hold(given)
    assert isinstance(held, HeldFields) and held.fields is given
    del given
    others = [hold(fields(flag=False)) for _ in range(100)]
    assert total(held) == total.for_types_of(held)(held) == total.for_types_of(fields())(held) == 96.0 + 1.5
    assert {total(each) for each in others} == {96.0}
    held.fields.inside.values[:] = 1.0
    assert total(held) == total(fields()._replace(inside=Inside(np.ones(2)))) == 15.0 + 1.5


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda held: pickle.loads(pickle.dumps(held))])
def test_a_copy_of_what_is_held_has_fields_of_its_own(copied):
    """Also beside the tuple that it stands for, as in a twin that is copied."""
    given = fields()
    both = copied([given, hold(given)])
    assert both[1].fields is both[0] and both[0].table is not given.table
    given.inside.values[:] = 1e9
    assert total(both[1]) == 96.0 + 1.5
    both[0].inside.values[:] = 1.0
    assert total(both[1]) == 15.0 + 1.5


def test_a_class_that_came_after_the_first_was_held_is_held_too():
    hold(fields())
    assert isinstance(hold(by_reference(Late)(np.ones(2))), HeldFields)


def test_only_what_goes_by_reference_is_held():
    for value in (Pair(0.5, 3), np.zeros(2), 1, (fields(),)):
        assert hold(value) is value


def test_what_is_held_is_of_the_type_of_its_fields():
    import numba

    held = hold(fields())
    assert numba.typeof(held) == numba.typeof(fields()) and _kind(held) == _kind(fields())


def test_neither_a_tuple_nor_held_is_refused():
    """An address that somebody made up would be read."""
    with pytest.raises(TypeError):
        total.for_types_of(fields())("fields")


def test_what_is_no_field_is_told():
    with pytest.raises(Exception, match="nothing"):
        other(fields())


def test_a_field_of_another_kind_is_another_kernel():
    assert total(fields()._replace(table=np.ones((1, 2), dtype=np.int64))) == 11.0 + 1.5


@pytest.mark.parametrize("kind", [Tables, State, Work, Condensed, Posture, Filters, TwinState, Ring, Limits, UpdateOutput])
def test_what_kernels_pass_on_often_goes_by_reference(kind):
    import numba

    from boom_twin.kernels.jit import _register_references

    _register_references()
    assert type(numba.typeof(kind(*np.zeros((len(kind._fields), 1))))).__name__ == "Reference"


def test_a_twin_starts_without_the_slow_parts_of_scipy():
    """They took longer to import than all else."""
    program = (
        "import sys; from boom_twin import Twin, load_scene; Twin(load_scene()).warm_up();"
        "print([name for name in ('scipy.special', 'scipy.optimize', 'scipy.stats') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], env=os.environ, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]", done.stdout


def test_compiled_code_for_known_types_gives_what_the_kernel_gives() -> None:
    """It is that of the very types, though the kernel is compiled for others too."""

    plan = compile_scene(load_scene())
    places = []
    for put in (place, place.for_types_of(plan.tables, plan.state(), plan.work())):
        state, work = plan.state(), plan.work()
        state.z[:] = np.linspace(-0.01, 0.01, len(state.z))
        put(plan.tables, state, work)
        places.append(work.position.copy())
    assert places[0].tobytes() == places[1].tobytes() and np.ptp(places[0]) > 1.0


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
