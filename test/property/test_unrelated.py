"""What has nothing to do with a motion changes no bit of it, and what is not there costs no time."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from oracle import booms

from boom_twin.analysis.simulate import PASSES, RHO, TOLERANCE
from boom_twin.analysis.statics import settle, statics
from boom_twin.chain.step import observe, rest, run
from boom_twin.plan.compile import compile_scene
from boom_twin.study.deviation import answer, course_of
from boom_twin.study.motion import motion_of

RUNS, STEPS, ATTEMPTS = 30, 400, 3
MOST = 1.05
ZERO = {"mass": 0.0, "inertia": 0.0, "com": 0.3}


def edited(edit):
    """The default scene after `edit` of its document."""
    spec = booms.document()
    edit(spec)
    return booms.scene_of(spec)


def each(block, **values):
    """An edit that sets keys of every section or joint."""

    def edit(spec):
        for item in spec[block]:
            item |= values

    return edit


def without(block, *keys):
    """An edit that removes keys of every section, joint or ("cylinder") cylinder."""

    def edit(spec):
        for item in [joint["cylinder"] for joint in spec["joints"]] if block == "cylinder" else spec[block]:
            for key in keys:
                item.pop(key, None)

    return edit


def both(*edits):
    """All edits one after the other."""

    def edit(spec):
        for one in edits:
            one(spec)

    return edit


def cylinders(**values):
    """An edit that sets keys of every cylinder."""

    def edit(spec):
        for joint in spec["joints"]:
            joint["cylinder"] |= values

    return edit


RIGID = each("sections", modes=0)
# what is compared: (an edit, and the same with something that is zero, unused or mere words)
PAIRS = {
    "description": (both(), lambda spec: spec.update(description="another text")),
    "posture": (both(), lambda spec: spec["postures"].update(mine=[50, 10, -20, -60])),
    "material's name, nu, rho": (both(), lambda spec: spec["material"].update(name="other", nu=0.2, rho=7000.0)),
    "payload of 0": (both(), lambda spec: spec.update(tip={"payload": 0.0})),
    "tip without payload": (both(), lambda spec: spec.update(tip={})),
    "line fill of 0": (both(), lambda spec: spec.update(line_fill=0.0)),
    "inclination of 0": (both(), lambda spec: spec["base"].update(inclination=0.0)),
    "modes named": (both(), lambda spec: spec.update(modes=3)),
    "modes of all sections, for none": (RIGID, both(RIGID, lambda spec: spec.update(modes=5))),
    "A, I, beta of rigid sections": (RIGID, both(RIGID, each("sections", A=1.0, I=1.0, beta=0.5))),
    "links of mass 0": (without("joints", "mL", "mR"), each("joints", mL=0.0, mR=0.0)),
    "barrels of mass 0": (without("cylinder", "barrel"), cylinders(barrel=ZERO)),
    "rods of mass 0": (without("cylinder", "rod"), cylinders(rod=ZERO)),
    "d of 0": (without("cylinder", "d"), cylinders(d=0.0)),
    "beta of 0": (without("sections", "beta"), each("sections", beta=0.0)),
    "rho_I of 0": (without("sections", "rho_I"), each("sections", rho_I=0.0)),
}
TIMED = [name for name in PAIRS if name.endswith("of 0") and name != "inclination of 0"] + ["A, I, beta of rigid sections"]


@pytest.mark.parametrize("name", PAIRS)
def test_no_bit_changes(name):
    one, other = (edited(edit) for edit in PAIRS[name])
    course = course_of(edited(both()))
    course = replace(course, motion=replace(course.motion, rise=0.3, duration=0.4))
    first, second = answer(one, course), answer(other, course)
    assert first.status == second.status == "ok"
    assert np.array_equal(first.rest, second.rest) and np.array_equal(first.tip, second.tip)
    assert np.array_equal(
        statics(one, posture="arch", modes=3).frequencies, statics(other, posture="arch", modes=3).frequencies
    )


class Stepper:
    """A compiled boom that can be stepped again and again from the same rest."""

    def __init__(self, plan, motion):
        self.plan, self.state, self.work = plan, plan.state(), plan.work()
        settle(plan, self.state, self.work, motion.first, motion.angles)
        rest(self.state, self.work)
        self.start = [array.copy() for array in self.state]
        strokes, rates = motion(1e-3 * np.arange(1, STEPS + 1))
        self.drive = (plan.closed_lengths + strokes, rates)
        self.rows = np.empty((2, 2 * plan.joints + 9))

    def seconds(self):
        for array, first in zip(self.state, self.start, strict=True):
            array[:] = first
        steps, counts = np.array([1e-3]), np.array([STEPS])
        observe(self.plan.tables, self.state, self.rows[0])
        begun = time.perf_counter()
        status, _, _ = run(
            self.plan.tables, self.state, self.work, steps, counts, *self.drive, RHO, TOLERANCE, PASSES, self.rows[1:]
        )
        assert status == 0
        return time.perf_counter() - begun


def ratio(one, other):
    """Least time of `other` over that of `one`, 30 interleaved runs each; the first attempt within bounds, else the last."""
    for _ in range(ATTEMPTS):
        times = np.array([[stepper.seconds() for stepper in (one, other)] for _ in range(RUNS)])
        found = times[:, 1].min() / times[:, 0].min()
        if found <= MOST:
            break
    return found


@pytest.mark.parametrize("name", TIMED)
def test_what_is_zero_or_unused_costs_no_time(name):
    one, other = (edited(edit) for edit in PAIRS[name])
    motion = motion_of(one)
    assert ratio(*(Stepper(compile_scene(scene), motion) for scene in (one, other))) <= MOST


def with_unused_rows(plan, other):
    """`plan` with the tables of beams, links, bodies and cylinder parts of another boom, to which no operation points."""
    tables, full = plan.tables, other.tables
    assert len(tables.beams) == len(tables.links) == len(tables.parts) == 0
    more = {
        name: getattr(full, name)
        for name in ("beams", "psi", "weights", "stiffness", "point_mass", "point_rotary", "links", "parts")
    }
    return replace(plan, tables=tables._replace(**more))


def test_an_empty_table_costs_nothing():
    """A rigid boom with massless links and cylinders: stepped with empty tables and with tables full of rows not in use."""
    bare = both(RIGID, without("joints", "mL", "mR"), without("cylinder", "barrel", "rod", "d"))
    plan, full = compile_scene(edited(bare)), compile_scene(edited(both()))
    motion = motion_of(edited(both()))
    one, other = Stepper(plan, motion), Stepper(with_unused_rows(plan, full), motion)
    assert ratio(one, other) <= MOST and ratio(other, one) <= MOST
    assert np.array_equal(one.rows, other.rows)
