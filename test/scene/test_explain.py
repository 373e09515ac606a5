"""The bookkeeping of the model: masses, strokes, and what is left out."""

from __future__ import annotations

from typing import Any

import pytest
from scene.editing import GONE, put

from boom_twin import load_scene
from boom_twin.scene.summary import Account, explain


def account(bench: Any, **edits: Any) -> Account:
    """Return the bookkeeping of the default scene with other keys at the top."""
    return explain(load_scene(bench.edited(lambda values: values.update(edits))))


def test_masses_and_strokes_of_the_default_scene(bench: Any) -> None:
    found = account(bench)
    beams = [52 * 3.0, 41 * 2.8, 33 * 2.7, 26 * 2.85]
    roots, heads = [36, 12, 10, 8], [16, 13, 10, 12]
    drives = [22 + 14, 16 + 10 + 7, 12 + 8 + 7, 8 + 5 + 5.5]
    assert [section.section.beam_mass for section in found.sections] == pytest.approx(beams)
    assert [joint.joint.mass for joint in found.joints] == pytest.approx(drives)
    assert found.mass == pytest.approx(sum(beams) + sum(roots) + sum(heads) + sum(drives))
    assert list(found.left_out) == ["tip.payload", "line_fill", "base.inclination", "base.stiffness", "clearance"]
    for joint in found.joints:
        assert (
            0 <= joint.stroke_low < 0.02
            and 0.95 * joint.joint.cylinder.max_stroke < joint.stroke_high <= joint.joint.cylinder.max_stroke
        )
    loaded = account(bench, line_fill=10.0, tip={"payload": 40.0})
    assert loaded.mass == pytest.approx(found.mass + 134.6 + 40.0)
    assert list(loaded.left_out) == ["base.inclination", "base.stiffness", "clearance"]


def test_what_is_not_named_is_listed(bench: Any) -> None:
    def edit(values: Any) -> None:
        put(values, "sections[3]", {"length": 3.1, "root": {"mass": 80, "com": [1.5, 0], "inertia": 60}})
        put(values, "sections[2].modes", 0)
        gone = ["sections[0].beta", "sections[1].beta", *(f"joints[{i}].cylinder.barrel" for i in range(4)), "joints[1].mL"]
        for path in (*gone, "joints[2].cylinder.d", "joints[3].cylinder.k", "joints[3].cylinder.d"):
            put(values, path, GONE)

    told = explain(load_scene(bench.edited(edit))).left_out
    words = {
        "sections[3].beam": "rigid, all of it described by root", "sections[2].modes": "keeps its mass",
        "sections[0, 1].beta": "damping", "joints[*].cylinder.barrel": "massless", "joints[1].mL": "massless",
        "joints[2].cylinder.d": "no damping", "joints[3].cylinder.k": "incompressible",
    }  # fmt: skip
    assert all(word in told[key] for key, word in words.items()), told
