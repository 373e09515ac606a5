"""Leaving a part out is the limit of its parameter, and the way there has order one, at rest and in a move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from oracle import booms

from boom_twin import Scene, statics
from boom_twin.reduction.deviation import Response, answer, course_of
from boom_twin.reduction.search import KINDS, without

SHORT = {"rise": 0.3, "duration": 0.6}


def scaled(keys, factor, block):
    """The default scene with some numbers of all sections or joints times `factor`; "cylinder.k" goes one deeper."""
    spec = DEFAULT.model_dump(exclude_none=True)
    for item in spec[block]:
        for key in keys:
            owner, last = item, key.split(".")
            for name in last[:-1]:
                owner = owner.get(name, {})
            if last[-1] in owner:
                owner[last[-1]] *= factor
    return booms.scene_of(spec)


def distances(lean: Scene, family, factors) -> tuple[np.ndarray, np.ndarray]:
    """Largest distance of the tip from that of `lean` at rest and in a move, m, of every model of a family; (k,) each."""
    course = course_of(DEFAULT)
    course = replace(course, motion=replace(course.motion, **SHORT))
    limit = answer(lean, course)
    models: list[Response] = [answer(family(factor), course) for factor in factors]
    assert all(one.status == "ok" for one in (limit, *models))
    rest = np.array([np.linalg.norm(one.rest - limit.rest, axis=1).max() for one in models])
    return rest, np.array([np.linalg.norm(one.tip - limit.tip, axis=1).max() for one in models])


def orders(errors, factors):
    """Slopes of log(error) over log(factor) between neighbours."""
    return np.diff(np.log(errors)) / np.diff(np.log(factors))


def left_out(scene, name):
    """The scene without a kind of part."""
    variant = without(scene, next(kind for kind in KINDS if kind.name == name), range(4))
    assert variant is not None
    return variant.of(scene)


DEFAULT = booms.scene_of(booms.document())
# kind: (keys that go to their limit, the block they are in, factors on the way there)
WAYS = {
    "bending": (("A", "I"), "sections", (1e1, 1e2, 1e3, 1e4)),
    "axial coordinate": (("A",), "sections", (1e1, 1e2, 1e3, 1e4)),
    "cylinder compliance": (("cylinder.k",), "joints", (1e1, 1e2, 1e3, 1e4)),
    "rotary inertia": (("rho_I",), "sections", (1e-1, 1e-2, 1e-3)),
    "beam damping": (("beta",), "sections", (1e-1, 1e-2, 1e-3)),
    "cylinder damping": (("cylinder.d",), "joints", (1e-1, 1e-2, 1e-3)),
    "link masses": (("mL", "mR"), "joints", (1e-1, 1e-2, 1e-3)),
    "barrel masses": (("cylinder.barrel.mass", "cylinder.barrel.inertia"), "joints", (1e-1, 1e-2, 1e-3)),
    "rod masses": (("cylinder.rod.mass", "cylinder.rod.inertia"), "joints", (1e-1, 1e-2, 1e-3)),
}
MOVE_ONLY = {"rotary inertia", "beam damping", "cylinder damping"}


@pytest.mark.parametrize("name", WAYS)
def test_the_limit_is_the_part_left_out(name):
    keys, block, factors = WAYS[name]
    rest, move = distances(left_out(DEFAULT, name), lambda factor: scaled(keys, factor, block), factors)
    sign = 1.0 if factors[0] < 1.0 else -1.0
    assert orders(move, factors) == pytest.approx(sign, abs=0.05)
    if name in MOVE_ONLY:
        assert np.all(rest < 1e-12)
    else:
        assert orders(rest, factors) == pytest.approx(sign, abs=0.01)


def test_geometric_stiffness_goes_with_the_square_of_the_load():
    """The sag goes with the load, what bending finitely adds to it with its square."""
    factors = (0.2, 0.1, 0.05, 0.025)
    off = []
    for factor in factors:
        scene = DEFAULT.model_copy(update={"gravity": (0.0, -9.81 * factor)})
        both = scene, left_out(scene, "geometric stiffness")
        tips = [statics(one, posture="arch", modes=0).tip for one in both]
        off.append(np.linalg.norm(tips[0] - tips[1]))
    assert orders(off, factors) == pytest.approx(2.0, abs=0.05)


def test_a_stiff_base_becomes_rigid():
    factors = (1e1, 1e2, 1e3, 1e4)
    rest, move = distances(DEFAULT, lambda factor: booms.on_elastic_base(DEFAULT, 5.0e6 * factor), factors)
    assert orders(rest, factors) == pytest.approx(-1.0, abs=0.01)
    assert orders(move, factors) == pytest.approx(-1.0, abs=0.05)
