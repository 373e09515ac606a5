"""Cases of the stability study: their motions, the default method in the quick ones, the files."""

from __future__ import annotations

import pytest

from boom_twin import load_scene
from boom_twin.validation.study.stability import one, run
from boom_twin.validation.study.stability_cases import METHODS, cases

COARSE = {"dt 2e-2 s", "dt 5e-2 s", "dt 5e-2 s, fast"}
QUICK = [case for case in cases(load_scene()) if case.quick]


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


@pytest.mark.slow
def test_no_case_of_the_default_method_is_silent():
    rows = run(cases(load_scene()), {"default": METHODS["default"]})
    assert [row.case.name for row in rows if row.cells["default"].verdict.silent] == []
    assert [row.case.name for row in rows if row.cells["default"].verdict.word == "fails"] == []
