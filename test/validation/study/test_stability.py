"""Cases of the stability study: their motions, the default method in the quick ones, the files."""

from __future__ import annotations

import json
from functools import partial

import pytest

from boom_twin import load_scene
from boom_twin.analysis.methods import Method
from boom_twin.validation.study import stability
from boom_twin.validation.study.stability import METHODS, one, run
from boom_twin.validation.study.stability_cases import Case, cases, smooth

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


def test_files_hold_the_verdicts_and_their_symptoms(tmp_path, two_sections):
    short = partial(smooth, two_sections, None, 1.0, 0.1, 0.2)
    beyond = next(case for case in QUICK if case.name == "beyond")
    methods = {"default": METHODS["default"], "hasty": Method(passes=1, tolerance=1e-30)}
    rows = run([Case("scene", "short", "nothing", short), beyond], methods)
    stability.write_files(tmp_path, rows, "2 sections")
    found = json.loads((tmp_path / "stability.json").read_text())
    assert [case["methods"]["default"]["word"] for case in found["cases"]] == ["holds", "refuses"]
    text = (tmp_path / "stability.md").read_text()
    assert "| default | 1 | 0 | 0 | 0 | 1 |" in text and "dead centre: beyond (weight on the wrong side): refuses;" in text
    assert "no equilibrium" in text and "carries 0.48" in text


@pytest.mark.slow
def test_no_case_of_the_default_method_is_silent():
    rows = run(cases(load_scene()), {"default": METHODS["default"]})
    assert [row.case.name for row in rows if row.cells["default"].verdict.silent] == []
    assert [row.case.name for row in rows if row.cells["default"].verdict.word == "fails"] == []
