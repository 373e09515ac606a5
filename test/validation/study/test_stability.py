"""Cases of the stability study: their motions, the default method in the quick ones, the files."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest

from boom_twin import load_scene
from boom_twin.analysis.methods import Method
from boom_twin.validation.study.stability import report as stability
from boom_twin.validation.study.stability.cases import Case, cases, long_holds
from boom_twin.validation.study.stability.runner import METHODS, limit_of, one, run
from boom_twin.validation.study.stability.setups import DeadStop, smooth, to_the_ends

COARSE = {"dt 2e-2 s", "dt 5e-2 s", "dt 5e-2 s, fast"}
QUICK = [case for case in cases(load_scene()) if case.quick]


# -- motions ----------------------------------------------------------------------------------------------------------


def test_rates_are_the_derivative_of_strokes_until_the_dead_stop():
    drive = DeadStop(np.array([0.1, 0.2]), np.array([0.04, -0.02]), 0.3, 0.8)
    times = np.linspace(0.0, 1.2, 1201)
    strokes, rates = drive(times)
    slopes = np.gradient(strokes, times, axis=0)
    apart = np.abs(times - 0.8) > 2e-3
    assert rates[apart] == pytest.approx(slopes[apart], abs=3e-6)
    assert rates[times < 0.799][-1] == pytest.approx([0.04, -0.02]) and not rates[times > 0.801].any()


@pytest.mark.parametrize("longest", [False, True])
def test_the_ends_are_within_the_cylinders(longest):
    scene = load_scene()
    move = to_the_ends(scene, longest).drive(np.array([0.0, 1.0]))[0]
    most = np.array([joint.cylinder.max_stroke for joint in scene.joints])
    assert (move >= 0.0).all() and (move <= most).all()
    assert ((move[1] > move[0]) == longest).all()


# -- cases ------------------------------------------------------------------------------------------------------------


@pytest.mark.slow  # those of the quick cases are made below
def test_all_setups_can_be_made():
    found = [*cases(load_scene()), *long_holds(load_scene())]
    assert len({(case.group, case.name) for case in found}) == len(found)
    for case in found:
        setup = case.make()
        steps = setup.duration / (setup.step * setup.every)
        assert abs(steps - round(steps)) < 1e-6 and 0.0 < setup.still < setup.duration


@pytest.mark.parametrize("case", QUICK, ids=lambda case: f"{case.group}: {case.name}")
def test_default_method_holds(case):
    """Or, where there is no solution, says so; the coarsest steps may cost accuracy."""
    found = one(case, {"default": METHODS["default"]}).cells["default"]
    allowed = {"none": ("refuses",)}.get(case.truth, ("holds", "degrades") if case.name in COARSE else ("holds",))
    assert found.verdict.word in allowed, found
    assert not found.verdict.silent


def test_failures_of_other_methods_are_seen():
    """The undamped trapezoid does not survive a hold without damping; its sentence is the symptom."""
    case = next(case for case in QUICK if case.name == "10 min, undamped")
    found = one(case, {"Newmark 0.5": METHODS["Newmark 0.5"]}).cells["Newmark 0.5"]
    assert found.verdict.word == "fails"


def test_a_boom_beyond_the_dead_centre_loses_its_stiffness():
    case = next(case for case in QUICK if case.group == "dead centre" and case.name == "beyond")
    found = limit_of(case.make())
    assert 0.3 < found.share < 0.7 and found.frequency < 0.1 * found.unloaded


# -- files ------------------------------------------------------------------------------------------------------------


def test_files_hold_the_verdicts_and_their_symptoms(tmp_path, two_sections):
    short = partial(smooth, two_sections, None, 1.0, 0.1, 0.2)
    beyond = next(case for case in QUICK if case.name == "beyond")
    methods = {"default": METHODS["default"], "hasty": Method(passes=1, tolerance=1e-30)}
    rows = run([Case("scene", "short", "nothing", short), beyond], methods)
    limits = {"dead centre: beyond": limit_of(beyond.make())}
    stability.write_files(tmp_path, rows, [], limits, "2 sections")
    found = json.loads((tmp_path / "stability.json").read_text())
    assert [case["methods"]["default"]["word"] for case in found["cases"]] == ["holds", "refuses"]
    text = (tmp_path / "stability.md").read_text()
    assert "| default | 1 | 0 | 0 | 0 | 1 |" in text and "dead centre: beyond (weight on the wrong side): refuses;" in text
    assert "no equilibrium" in text and "carries 0.48" in text
    assert (tmp_path / "stability.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_no_case_of_the_default_method_is_silent():
    rows = run(cases(load_scene()), {"default": METHODS["default"]})
    assert [row.case.name for row in rows if row.cells["default"].verdict.silent] == []
    assert [row.case.name for row in rows if row.cells["default"].verdict.word == "fails"] == []
