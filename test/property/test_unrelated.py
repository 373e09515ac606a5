"""What has nothing to do with a motion changes no bit of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from default_boom import motion_of
from oracle import booms

from boom_twin import statics
from boom_twin.analysis.methods import integrate_with
from boom_twin.reduction.deviation import answer, course_of

PLAY_OF_0 = [{"at": at, "pin_radius": 0.02, "radial_clearance": 0.0} for at in ("cylinder_2.rod", "joint_3.link_L")]
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


def _off(spec):
    spec |= {"axial": False, "geometric": False}


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
    "axial, geometric named": (both(), lambda spec: spec.update(axial=True, geometric=True)),
    "axial, geometric of sections, for none": (both(), both(each("sections", axial=True, geometric=True), _off)),
    "axial, geometric of rigid sections": (RIGID, both(RIGID, each("sections", axial=False, geometric=False))),
    "modes of all sections, for none": (RIGID, both(RIGID, lambda spec: spec.update(modes=5))),
    "A, I, beta of rigid sections": (RIGID, both(RIGID, each("sections", A=1.0, I=1.0, beta=0.5))),
    "links of mass 0": (without("joints", "mL", "mR"), each("joints", mL=0.0, mR=0.0)),
    "barrels of mass 0": (without("cylinder", "barrel"), cylinders(barrel=ZERO)),
    "rods of mass 0": (without("cylinder", "rod"), cylinders(rod=ZERO)),
    "d of 0": (without("cylinder", "d"), cylinders(d=0.0)),
    "beta of 0": (without("sections", "beta"), each("sections", beta=0.0)),
    "clearance without pins": (both(), lambda spec: spec.update(clearance={})),
    "contact law for no pins": (both(), lambda spec: spec.update(clearance={"contact": {"law": "hertz"}, "pins": []})),
    "clearance of 0": (both(), lambda spec: spec.update(clearance={"pins": PLAY_OF_0})),
    "rho_I of 0": (without("sections", "rho_I"), each("sections", rho_I=0.0)),
}
ZEROS = [name for name in PAIRS if name.endswith("of 0")]


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


def test_all_that_is_zero_at_once_changes_no_bit():
    move = motion_of(edited(both()))
    absent, zero = (
        integrate_with(edited(both(*(PAIRS[name][k] for name in ZEROS))), move, 0.4, 1e-3, every=400, angles=move.angles)
        for k in (0, 1)
    )
    assert absent.status == zero.status == "ok"
    assert np.array_equal(absent.tip, zero.tip) and np.array_equal(absent.cylinder_forces, zero.cylinder_forces)
