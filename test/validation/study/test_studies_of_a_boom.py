"""Studies of a boom: the error report of the default scene, which methods hold in which cases, what each part costs."""

from __future__ import annotations

import io
import json
from contextlib import redirect_stderr

import numpy as np
import pytest
from command import main
from default_boom import joint_angles_of_strokes, motion_of
from oracle import booms

from boom_twin import load_scene
from boom_twin.analysis.methods import TURN
from boom_twin.reduction import deviation
from boom_twin.reduction.search import variants
from boom_twin.validation.study import parts
from boom_twin.validation.study.stability import one, run
from boom_twin.validation.study.stability_cases import METHODS, cases


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    """Of the quick report, made by the command."""
    pytest.importorskip("exudyn")
    out = tmp_path_factory.mktemp("report")
    with redirect_stderr(io.StringIO()) as told:
        assert main(["study", "error", "--quick", "--out", str(out)]) == 0
    assert "\r" not in told.getvalue()  # no bar, for this is no terminal
    return json.loads((out / "error.json").read_text())


def rows_of(content, **wanted):
    return [row for row in content["rows"] if all(row.get(key) == value for key, value in wanted.items())]


def test_witnesses_agree(content):
    """Exudyn extrapolated and the transfer-matrix boom with many shapes: one motion."""
    assert content["references_differ"]["tip_mm"] < 0.005  # shear as of GA = 10 EA would be 0.016 mm
    assert content["references_differ"]["acceleration"] < 1e-3
    assert min(row["own_mm"] for row in rows_of(content, program="exudyn")) < 1.5


@pytest.mark.parametrize(("method", "expected"), [("generalised-alpha 0.8", 2.0), ("newmark 0.6", 1.0)])
def test_errors_fall_with_the_order_of_the_scheme(content, method, expected):
    rows = [row for row in rows_of(content, method=method) if row["step"] >= 2e-3]
    steps, errors = np.array([[row["step"], row["own_mm"]] for row in rows]).T
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(expected, abs=0.15)


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


def test_every_variant_of_a_part_is_there_ascending_in_error() -> None:
    scene = booms.short_boom(2)
    rows = parts.measure(scene, deviation.course_of(scene), rounds=1)["variants"]
    assert {part["name"] for part in rows} == {variant.name for variant in variants(scene)}
    errors = [max(part["rest_error_m"], part["move_error_max_m"]) for part in rows]
    assert errors == sorted(errors) and all(np.isfinite(errors))
    assert all(part["status"] == "ok" and part["step_time_s"] > 0.0 for part in rows)


@pytest.mark.parametrize("make", [booms.random_boom, booms.milder_boom])
@pytest.mark.parametrize("seed", range(10))
def test_motion_stays_inside(make, seed):
    scene = make(seed)
    motion = motion_of(scene)
    moved = np.flatnonzero(motion.travel)
    assert len(moved) and not np.any(moved % 2)
    strokes, _ = motion(np.linspace(0.0, motion.duration, 50))
    for i, joint in enumerate(scene.joints):
        assert strokes[0, i] == motion.first[i]
        assert strokes[:, i].min() >= -1e-9 and strokes[:, i].max() <= joint.cylinder.max_stroke + 1e-9
    turned = joint_angles_of_strokes(scene, strokes[-1], near=motion.angles) - motion.angles
    assert np.all(np.abs(turned[motion.travel == 0.0]) < 1e-7)
    halvings = np.log2(TURN / np.abs(turned[moved]))
    assert halvings == pytest.approx(np.round(halvings), abs=1e-4) and np.all(halvings < 3.5)
