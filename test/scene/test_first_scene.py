"""A first scene from a table: its numbers against formulas written down here, its checks, refusals."""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from default_boom import examine, stroke_curve

from boom_twin import Scene, SceneError
from boom_twin.scene.boom_table import read_table
from boom_twin.scene.first_scene import first_scene

EXAMPLE = (files("boom_twin") / "msg_config" / "boom_table.yaml").read_text(encoding="utf-8")


def scene_of(folder: Path, text: str) -> tuple[str, Scene, list[Any]]:
    path = folder / "table.yaml"
    path.write_text(text, encoding="utf-8")
    return first_scene(*read_table(path), "table.yaml")


def test_what_is_worked_out_is_what_the_formulas_give(tmp_path: Path) -> None:
    text, scene, oddities = scene_of(tmp_path, EXAMPLE)
    (tmp_path / "scene.yaml").write_text(text, encoding="utf-8")
    assert oddities == [] and examine(tmp_path / "scene.yaml") == (scene, [])
    section, cylinder = scene.sections[1], scene.joints[1].cylinder
    assert pytest.approx(2 * 0.34 * 0.006 + 2 * (0.45 - 0.012) * 0.006, rel=1e-5) == section.A
    flanges = 2 * (0.34 * 0.006**3 / 12 + 0.34 * 0.006 * 0.222**2)
    assert pytest.approx(flanges + 2 * 0.006 * 0.438**3 / 12, rel=1e-5) == section.I
    assert section.rho_A == pytest.approx(7850 * section.A + 25, rel=1e-5)
    assert section.height == 0.45 and section.section_modulus == pytest.approx(2 * section.I / 0.45)
    assert section.root is not None and section.root.mass == pytest.approx(1.2 * section.rho_A * 0.55, rel=1e-5)
    piston, ring, middle = math.pi * 0.1**2, math.pi * (0.1**2 - 0.06**2), 0.5 * cylinder.max_stroke
    k = 1.4e9 * (piston**2 / (5e-4 + piston * middle) + ring**2 / (5e-4 + ring * middle))
    assert cylinder.k is None and cylinder.middle_stiffness == pytest.approx(k, rel=1e-5)
    assert all(f"# {formula}" in text for formula in ("[b h^3 - (b - 2 t)(h - 2 t)^3] / 12", "rho A + pipe", "[estimate]"))


def test_cylinders_cover_the_range_and_postures_are_in_it(tmp_path: Path) -> None:
    _, scene, _ = scene_of(tmp_path, EXAMPLE)
    for i, joint in enumerate(scene.joints):
        strokes = stroke_curve(scene, i, np.radians(np.linspace(*joint.range_deg, 500)))
        assert 0.0 < strokes.min() < 0.04 * joint.cylinder.max_stroke
        assert 0.96 * joint.cylinder.max_stroke < strokes.max() < joint.cylinder.max_stroke
    assert list(scene.postures) == ["stretched", "middle"]
    assert scene.postures["stretched"] == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("old", "new", "path", "words"),
    [
        ("wall: 6 mm", "wall: 6", "sections[1].wall", "two walls fill the box"),
        ("wall: 6 mm", "wall: 6 kg", "sections[1].wall", "`kg` is no unit of this key, which is in m"),
        ("bore: 180 mm", "bore: 180", "joints[0].bore", "less than or equal to 1"),
        ("rod: 120 mm", "rod: 220 mm", "joints[1].rod", "thinner than the bore"),
        ("height: 450 mm", "hight: 450 mm", "sections[1].hight", "nearest known key here is `height`"),
        ("lL: 974 mm", "lL: 97.4 mm", "joints[1].range_deg", "do not meet at any angle"),
        ("D: [-362 mm, -55 mm],", "", "joints[1].D", "needs it"),
        ("rho: 7850 kg/m^3", "nu: 0.3", "material.rho", "masses are computed from it"),
        ("kind: B1", "kind: A", "joints[1].kind", "only joint 1"),
        ("bulk_modulus: 1.4 GPa", "bulk_modulus: 14000", "bulk_modulus", "it must be greater than or equal to 10000000"),
        ("damping_ratio: 0.01", "damping_ratio: 1", "damping_ratio", "it must be less than 1."),
        (
            "range_deg: [-165, 10], bore: 140 mm",
            "range_deg: [-10, 165], bore: 140 mm",
            "joints[2].range_deg",
            "give `side: right`, C, D, E and R with the other sign",
        ),
        ("kind: B1, range", "kind: B1, side: right, range", "joints[1].range_deg", "give `side: left`, if it folds that way"),
    ],
)
def test_a_fault_of_the_table_names_its_line(tmp_path: Path, old: str, new: str, path: str, words: str) -> None:
    assert old in EXAMPLE
    with pytest.raises(SceneError) as caught:
        scene_of(tmp_path, EXAMPLE.replace(old, new))
    faults = {fault.path: fault for fault in caught.value.faults}
    assert path in faults and words in str(faults[path]), str(caught.value)
    line = EXAMPLE.replace(old, new).splitlines()[(faults[path].line or 0) - 1]
    assert path.rpartition(".")[2] in line or "- {kind: B1" in line or "material:" in line


SLIPS = [
    ("wall: 8 mm", "wall: 8 cm", "sections[0].wall", "with walls of 8"),
    ("bore: 200 mm, rod: 120 mm", "bore: 100 mm, rod: 60 mm", "joints[1].bore", "not radii"),
    ("height: 450 mm, width: 340 mm", "height: 340 mm, width: 450 mm", "sections[1].height", "bends 1.53 times as much"),
    ("width: 340 mm", "width: 34 mm", "sections[1].width", "expected at least 0.135 m"),
    ("pipe: 25 kg/m", "pipe: 190 kg/m", "pipe", "sections[2].rho_A"),
    ("1.4 GPa", "1400 bar", "bulk_modulus", "14000 bar"),
    ("range_deg: [-165, 10], bore: 200", "range_deg: [-16.5, 1], bore: 200", "joints[1].range_deg", "turns by 17.5 deg"),
    (
        "bore: 180 mm, rod: 125 mm",
        "bore: 180 mm, rod: 125 mm, cap_line: 0.5 ml",
        "joints[0].cap_line",
        "what the chamber takes",
    ),
    ("rod: 125 mm", "rod: 125 mm, max_stroke: 4.5 m", "joints[0].max_stroke", "not the open length"),
    ("-2750 mm]}", "-2750 mm], inclination: 0.3 rad}", "base.inclination", "degrees?"),
]
"""A newcomer's slips in the table: what is there, what was written, where and with which words it is told; all load."""


@pytest.mark.parametrize(("old", "new", "path", "words"), SLIPS)
def test_a_slip_in_the_table_is_warned_of_where_it_is(tmp_path: Path, old: str, new: str, path: str, words: str) -> None:
    assert EXAMPLE.count(old) == 1
    oddities = scene_of(tmp_path, EXAMPLE.replace(old, new))[2]
    told = [str(oddity) for oddity in oddities if oddity.path == path]
    assert len(told) == 1 and words in told[0] and len(oddities) <= 4, [str(oddity) for oddity in oddities]
