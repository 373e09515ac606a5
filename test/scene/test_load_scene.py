"""What `load_scene` accepts, and how it reads the text."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

import pytest

from boom_twin.errors import SceneError, SceneWarning
from boom_twin.scene import Scene, load_scene
from boom_twin.scene.load import default_text


def test_the_default_scene_loads_without_warnings() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = load_scene()
    assert [joint.kind for joint in scene.joints] == ["A", "B1", "B2", "B3"]
    assert scene.material.E == 2.06e11
    assert scene.sections[1].head is not None and scene.sections[1].head.com == (3.18, 0.0)


def test_a_path_and_a_string_give_the_same_scene(bench: Any) -> None:
    path = bench.text(default_text())
    assert load_scene(path) == load_scene()
    assert load_scene(str(path)) == load_scene()


@pytest.mark.parametrize(("text", "number"), [("2e11", 2e11), ("2E+11", 2e11), ("200_000_000_000", 2e11), ("+.5e12", 5e11)])
def test_every_spelling_of_a_number_is_a_number(bench: Any, text: str, number: float) -> None:
    path = bench.text(default_text().replace("E: 2.06e+11", f"E: {text}"))
    assert number == load_scene(path).material.E


def test_numbers_keep_their_type_whatever_yaml_made_of_them(bench: Any) -> None:
    scene = load_scene(bench.text(default_text().replace("length: 3.86", "length: 4")))
    assert type(scene.sections[0].length) is float


def _no_beam(values: dict[str, Any]) -> None:
    values["sections"][3] = {"length": 3.1, "root": {"mass": 80, "com": [1.5, 0], "inertia": 60}}


def _empty(values: dict[str, Any]) -> None:
    values["tip"] = {}
    values["sections"][2] |= {"head": {}, "root": None, "beta": None}
    values["joints"][2]["cylinder"] |= {"barrel": {}, "rod": None}


def _all_options(values: dict[str, Any]) -> None:
    values |= {"description": "text", "modes": 2, "line_fill": 10, "tip": {"payload": 40}}
    values["base"]["inclination"] = 0.02
    values["sections"][1]["modes"] = 0


def _one_section(values: dict[str, Any]) -> None:
    values |= {"sections": values["sections"][:1], "joints": values["joints"][:1], "postures": {}}


@pytest.mark.parametrize("edit", [_no_beam, _empty, _all_options, _one_section])
def test_what_the_format_allows_loads_without_a_warning(bench: Any, edit: Any) -> None:
    assert bench.oddities(edit) == []


def test_an_empty_key_is_an_absent_key(bench: Any) -> None:
    scene = load_scene(bench.edited(_empty))
    assert scene.tip is None and scene.sections[2].head is None and scene.sections[2].beta is None
    assert scene.joints[2].cylinder.barrel is None


def test_modes_of_a_section_override_those_of_the_scene(bench: Any) -> None:
    scene = load_scene(bench.edited(_all_options))
    assert [scene.modes_of(i) for i in range(4)] == [2, 0, 2, 2]
    assert [scene.is_flexible(i) for i in range(4)] == [True, False, True, True]


def test_any_order_of_six_bars(bench: Any) -> None:
    def edit(values: dict[str, Any]) -> None:
        values["joints"] = [values["joints"][i] for i in (0, 3, 1, 2)]
        values["postures"] = {}

    assert [joint.kind for joint in load_scene(bench.edited(edit)).joints] == ["A", "B3", "B1", "B2"]


def test_aliases_are_read(bench: Any) -> None:
    text = default_text().replace("kind: B1, range_deg: [-165, 10]", "kind: B1, range_deg: &range [-165, 10]")
    text = text.replace("kind: B2, range_deg: [-165, 10]", "kind: B2, range_deg: *range")
    assert load_scene(bench.text(text)) == load_scene()


def test_oddities_are_issued_as_warnings_of_their_own_category(bench: Any) -> None:
    path = bench.edited(lambda v: v.update(gravity=[0.0, -1.62]))
    with pytest.warns(SceneWarning, match=r"gravity = \[0.0, -1.62\].*9.81") as caught:
        load_scene(path)
    assert len(caught) == 1 and caught[0].filename == __file__


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("# only a comment\n", "empty"),
        ("just text", "a block of keys is needed, not text"),
        ("[1, 2]", "a block of keys is needed, not a list"),
        ("gravity: [0, -9.81", "not valid YAML"),
        ("a: 1\n---\na: 2\n", "not valid YAML"),
        ("base:\n\tpivot: [0, 0]\n", "not valid YAML"),
        ("gravity: *nowhere", "undefined alias"),
        ("gravity: \x00", "not valid YAML"),
        ("[" * 3000, "nested too deeply"),
        ("a: &a [*a]", "nested too deeply"),
        ("? [1, 2]\n: 3", "kind of key"),
        ("<<: {modes: 3}", "kind of key"),
    ],
)
def test_what_is_no_scene_at_all(bench: Any, text: str, words: str) -> None:
    with pytest.raises(SceneError, match="fault") as caught:
        load_scene(bench.text(text))
    assert words in str(caught.value)


def test_tabs_have_their_own_remedy(bench: Any) -> None:
    (fault,) = bench.faults_of(bench.text("base:\n\tpivot: [0, 0]\n"))
    assert fault.line == 2 and "spaces" in fault.remedy


def test_many_aliases_do_not_grow_without_bound(bench: Any) -> None:
    rows = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 9)]
    with pytest.raises(SceneError, match="too many values"):
        load_scene(bench.text("\n".join(rows)))


def test_yaml_cannot_execute_code(bench: Any, tmp_path: Path) -> None:
    trap = tmp_path / "trap"
    text = default_text().replace("E: 2.06e+11", f"E: !!python/object/apply:os.mkdir [{trap}]")
    faults = bench.faults_of(bench.text(text))
    assert any(fault.path == "material.E" for fault in faults)
    assert not trap.exists()


def test_a_tag_is_refused(bench: Any) -> None:
    faults = bench.faults_of(bench.text(default_text().replace("name: Q345B", "name: !secret Q345B")))
    assert [(fault.path, fault.line) for fault in faults] == [("material.name", 15)]
    assert "tag" in faults[0].bound and "Remove the tag" in faults[0].remedy


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="No such file") as caught:
        load_scene(tmp_path / "nowhere.yaml")
    assert "nowhere.yaml" in str(caught.value) and "boom_twin scene" in str(caught.value)


def test_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="directory"):
        load_scene(tmp_path)


def test_an_impossible_path_is_refused() -> None:
    with pytest.raises(SceneError, match="null"):
        load_scene("a\0b")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root reads every file")
def test_an_unreadable_file(bench: Any) -> None:
    path = bench.text(default_text())
    path.chmod(0)
    with pytest.raises(SceneError, match="Permission"):
        load_scene(path)


def test_a_binary_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_bytes(b"\xff\xfe\x00binary\x80")
    with pytest.raises(SceneError, match="UTF-8"):
        load_scene(path)


def test_a_huge_file_is_refused(bench: Any) -> None:
    with pytest.raises(SceneError, match="4 MB"):
        load_scene(bench.text(default_text() + "#" * 4_000_000))


def test_a_scene_is_frozen() -> None:
    scene: Scene = load_scene()
    with pytest.raises(ValueError, match="frozen"):
        scene.line_fill = 10.0
