"""The bookkeeping of the model: masses, coordinates, splits, reach, and what is left out."""

from __future__ import annotations

from typing import Any

import pytest

from boom_twin.scene import load_scene
from boom_twin.scene.segmentation import flexible_parts, splits
from boom_twin.scene.summary import explain


def test_masses_of_the_default_scene() -> None:
    account = explain(load_scene())
    beams = [52 * 3.0, 41 * 2.8, 33 * 2.7, 26 * 2.85]
    roots, heads = [36, 12, 10, 8], [16, 13, 10, 12]
    drives = [22 + 14, 16 + 10 + 7, 12 + 8 + 7, 8 + 5 + 5.5]
    assert [section.beam_mass for section in account.sections] == pytest.approx(beams)
    assert [joint.mass for joint in account.joints] == pytest.approx(drives)
    assert account.mass == pytest.approx(sum(beams) + sum(roots) + sum(heads) + sum(drives))
    assert account.length == pytest.approx(13.46)


def test_line_fill_and_payload_count(bench: Any) -> None:
    scene = load_scene(bench.edited(lambda v: v.update(line_fill=10.0, tip={"payload": 40.0})))
    assert explain(scene).mass == pytest.approx(explain(load_scene()).mass + 134.6 + 40.0)
    keys = [item.key for item in explain(scene).left_out]
    assert "line_fill" not in keys and "tip.payload" not in keys


def test_beams_are_split_where_a_cylinder_pin_sits_on_them() -> None:
    scene = load_scene()
    assert [[round(split.x, 9) for split in splits(scene, i)] for i in range(4)] == [[3.044], [2.002], [1.9], []]
    assert [len(flexible_parts(scene, i)) for i in range(4)] == [2, 2, 2, 1]
    assert flexible_parts(scene, 0) == ((0.6, 3.044), (3.044, 3.6))
    assert splits(scene, 1)[0].pin == "barrel pin C of cylinder 3"


def test_a_rod_pin_on_the_beam_splits_it_too(bench: Any) -> None:
    scene = load_scene(bench.edited(lambda v: v["sections"][0].update(beam=[0.3, 3.6])))
    assert [split.pin for split in splits(scene, 0)] == ["rod pin of cylinder 1", "barrel pin C of cylinder 2"]
    assert flexible_parts(scene, 0) == ((0.3, 0.6), (0.6, 3.044), (3.044, 3.6))


def test_two_pins_at_one_place_make_one_split(bench: Any) -> None:
    def edit(values: Any) -> None:
        values["sections"][0].update(beam=[0.3, 3.6], rod_pin=[3.044, -0.12])
        values["base"]["cylinder_pin"] = [2.6, -1.9]
        values["joints"][0].update(range_deg=[0, 10])
        values["joints"][0]["cylinder"].update(closed_length=1.5, max_stroke=1.0)
        values["postures"] = {}

    scene = load_scene(bench.edited(edit))
    assert len(splits(scene, 0)) == 2 and len(flexible_parts(scene, 0)) == 2


def test_unknowns_follow_modes_and_kinds(bench: Any) -> None:
    account = explain(load_scene())
    assert [section.unknowns for section in account.sections] == [8, 8, 8, 4]
    assert [joint.unknowns for joint in account.joints] == [2, 6, 6, 6]
    assert account.unknowns == 48
    assert explain(load_scene(bench.edited(lambda v: v.update(modes=0)))).unknowns == 20
    assert explain(load_scene(bench.edited(lambda v: v["sections"][3].update(modes=5)))).unknowns == 50


def test_strokes_reached_stay_within_the_cylinders() -> None:
    for joint in explain(load_scene()).joints:
        assert 0 <= joint.stroke_low < 0.02 and 0.95 * joint.max_stroke < joint.stroke_high <= joint.max_stroke


def test_nothing_but_options_is_left_out_of_the_default_scene() -> None:
    keys = [item.key for item in explain(load_scene()).left_out]
    assert keys == ["tip.payload", "line_fill", "base.inclination", "clearance"]


def test_what_is_not_named_is_listed(bench: Any) -> None:
    def edit(values: Any) -> None:
        values["sections"][3] = {"length": 3.1, "root": {"mass": 80, "com": [1.5, 0], "inertia": 60}}
        values["sections"][2]["modes"] = 0
        for i in (0, 1):
            del values["sections"][i]["beta"]
        for joint in values["joints"]:
            del joint["cylinder"]["barrel"]
        del values["joints"][1]["mL"]
        del values["joints"][2]["cylinder"]["d"]
        del values["joints"][3]["cylinder"]["k"], values["joints"][3]["cylinder"]["d"]

    left_out = {item.key: item.meaning for item in explain(load_scene(bench.edited(edit))).left_out}
    assert left_out["sections[3].beam"] == "rigid, all of it described by root"
    assert "keeps its mass" in left_out["sections[2].modes"]
    assert "damping" in left_out["sections[0, 1].beta"]
    assert "massless" in left_out["joints[*].cylinder.barrel"]
    assert "massless" in left_out["joints[1].mL"]
    assert "no damping" in left_out["joints[2].cylinder.d"]
    assert "incompressible" in left_out["joints[3].cylinder.k"]


def test_parts_without_axial_coordinate_have_one_unknown_less(bench: Any) -> None:
    all_of_it = explain(load_scene())
    scene = load_scene(bench.edited(lambda v: v.update(axial=False, geometric=False)))
    assert explain(scene).unknowns == all_of_it.unknowns - 7
    keys = [item.key for item in explain(scene).left_out]
    assert "sections[*].axial" in keys and "sections[*].geometric" in keys
    scene = load_scene(bench.edited(lambda v: v["sections"][3].update(axial=False)))
    assert [section.axial for section in explain(scene).sections] == [1, 1, 1, 0]
    assert "sections[3].axial" in [item.key for item in explain(scene).left_out]


def test_axial_is_true_or_false(bench: Any) -> None:
    (fault,) = bench.faults(lambda v: v.update(axial="maybe"))
    assert fault.path == "axial" and "true or false is needed, not text" in fault.bound
    (fault,) = bench.faults(lambda v: v["sections"][1].update(geometric=3))
    assert fault.path == "sections[1].geometric" and "whether flexible parts have geometric stiffness" in fault.remedy
