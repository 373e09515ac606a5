"""What `load_scene` accepts, how it reads the text, and what is refused; a file that was cut off never goes by."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from command import main
from default_boom import clearance_text, default_text, examine
from scene.editing import put

from boom_twin import SceneError, SceneWarning, load_scene
from boom_twin.config.yaml_text import plain


def test_the_default_scene_loads_without_warnings_from_everywhere_and_is_frozen(bench: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = load_scene()
    assert [joint.kind for joint in scene.joints] == ["A", "B1", "B2", "B3"]
    assert scene.material.E == 2.06e11 and scene.sections[1].head.com == (3.18, 0.0)
    path = bench.text(default_text())
    assert load_scene(path) == load_scene(str(path)) == scene
    with pytest.raises(ValueError, match="frozen"):
        scene.line_fill = 10.0
    scene = load_scene(bench.text(default_text().replace("length: 3.86", "length: 4")))
    assert type(scene.sections[0].length) is float, "numbers keep their type whatever YAML made of them"


# -- spellings of numbers ---------------------------------------------------------------------------------------------

READ = {
    "2E+11": 2e11, "200_000_000_000": 2e11, "+.5e12": 5e11, "0x1F": 31.0, "0o17": 15.0, "017": 17.0, "1_000": 1000.0,
    "0b101": 5.0, "&a 5": 5.0, "!!float 5": 5.0, "!!int 5": 5.0,
}  # fmt: skip
NO_VALUES = ["!!bool maybe", "!!bool ''", "!!int x", "!!int 0x", "!!int 1:30", "!!float x", "!!float _", "9" * 5000]
REFUSED = [
    *NO_VALUES, "!!float 1e400", "-1e400", ".inf", ".nan", "1:30", "!!binary aGk=", "!!set {a}", "!!omap [a: 1]", "!!int [1]",
    "!foo 3", "&a [*a]", "1e-400", "1e31", "yes", '"\\uD800"',
]  # fmt: skip


def with_modulus(text: str) -> str:
    return default_text().replace("E: 2.06e+11", f"E: {text}")


@pytest.mark.parametrize(("text", "value"), READ.items())
def test_every_spelling_of_a_number_is_a_number(bench: Any, text: str, value: float) -> None:
    with warnings.catch_warnings(action="ignore"):
        assert value == load_scene(bench.text(with_modulus(text))).material.E


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: text[:16])
def test_what_is_no_number_is_refused(bench: Any, text: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(bench.text(with_modulus(text)))
    assert {(fault.path.split("[")[0], fault.line) for fault in caught.value.faults} == {("material.E", 15)}
    str(caught.value).encode()
    assert max(map(len, str(caught.value).splitlines())) < 300
    if text in NO_VALUES:  # nor does a text take it
        (fault,) = bench.faults_of(bench.text(default_text() + f"description: {text}\n"))
        assert fault.path == "description"
        with pytest.raises(ValueError, match="line 1"):
            plain(f"a: {text}")


# -- what the format allows -------------------------------------------------------------------------------------------

RIGID = {"length": 3.1, "root": {"mass": 80, "com": [1.5, 0], "inertia": 60}}


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


def test_what_the_format_allows_loads_without_a_warning(bench: Any) -> None:
    for edit in (lambda values: put(values, "sections[3]", RIGID), _empty, _all_options, _one_section):
        assert bench.oddities(edit) == []
    scene = load_scene(bench.edited(_empty))
    assert scene.tip is None and scene.sections[2].head is None and scene.sections[2].beta is None
    assert scene.joints[2].cylinder.barrel is None, "an empty key is an absent key"
    scene = load_scene(bench.edited(_all_options))
    assert [scene.of_section(i, "modes") for i in range(4)] == [2, 0, 2, 2]
    assert [scene.is_flexible(i) for i in range(4)] == [True, False, True, True]


def test_six_bars_come_in_any_order_and_aliases_are_read(bench: Any) -> None:
    def edit(values: dict[str, Any]) -> None:
        values["joints"] = [values["joints"][i] for i in (0, 3, 1, 2)]
        values["postures"] = {}

    with warnings.catch_warnings(action="ignore"):
        assert [joint.kind for joint in load_scene(bench.edited(edit)).joints] == ["A", "B3", "B1", "B2"]
    text = default_text().replace("kind: B1, range_deg: [-165, 10]", "kind: B1, range_deg: &range [-165, 10]")
    text = text.replace("kind: B2, range_deg: [-165, 10]", "kind: B2, range_deg: *range")
    assert load_scene(bench.text(text)) == load_scene()


# -- what is refused --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("# only a comment\n", "empty"),
        ("just text", "a block of keys is needed, not text"),
        ("[1, 2]", "a block of keys is needed, not a list"),
        ("gravity: [0, -9.81", "not valid YAML"),
        ("a: 1\n---\na: 2\n", "not valid YAML"),
        ("base:\n\tpivot: [0, 0]\n", "Indent with spaces"),
        ("gravity: *nowhere", "undefined alias"),
        ("gravity: \x00", "not valid YAML"),
        ("[" * 500, "nested too deeply"),
        ("a: &a [*a]", "nested too deeply"),
        ("? [1, 2]\n: 3", "kind of key"),
        ("<<: {modes: 3}", "kind of key"),
    ],
)
def test_what_is_no_scene_at_all(bench: Any, text: str, words: str) -> None:
    with pytest.raises(SceneError, match="fault") as caught:
        load_scene(bench.text(text))
    assert words in str(caught.value)


def test_many_aliases_do_not_grow_without_bound(bench: Any) -> None:
    rows = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 9)]
    with pytest.raises(SceneError, match="too many values"):
        load_scene(bench.text("\n".join(rows)))


def test_a_tag_is_refused_and_cannot_execute_code(bench: Any, tmp_path: Path) -> None:
    trap = tmp_path / "trap"
    faults = bench.faults_of(bench.text(with_modulus(f"!!python/object/apply:os.mkdir [{trap}]")))
    assert any(fault.path == "material.E" for fault in faults) and not trap.exists()
    (fault,) = bench.faults_of(bench.text(default_text().replace("name: Q345B", "name: !secret Q345B")))
    assert (fault.path, fault.line) == ("material.name", 15) and "Remove the tag" in fault.remedy


def test_files_that_cannot_be_read_are_refused(bench: Any, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"nowhere\.yaml.*\n?.*No such file.*boom_twin scene"):
        load_scene(tmp_path / "nowhere.yaml")
    for source, words in ((tmp_path, "directory"), ("a\0b", "null")):
        with pytest.raises(SceneError, match=words):
            load_scene(source)
    bench.path.write_bytes(b"\xff\xfe\x00binary\x80")
    with pytest.raises(SceneError, match="UTF-8"):
        load_scene(bench.path)
    with pytest.raises(SceneError, match="4 MB"):
        load_scene(bench.text(default_text() + "#" * 4_000_000))


def silent_cuts(bench: Any, text: str, places: Iterable[int]) -> list[int]:
    """Return where the text can be cut so that it loads as another scene without a fault or a warning."""
    whole, found = examine(bench.text(text))[0], []
    for place in places:
        bench.path.write_bytes(text.encode()[:place])
        try:
            scene, oddities = examine(bench.path)
        except SceneError as error:
            assert error.faults
        else:
            if scene != whole and not oddities:
                found.append(place)
    return found


@pytest.mark.parametrize("given", [(), ("--clearance",)], ids=["default", "clearance"])
@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["ends of lines", "every byte"])
def test_no_cut_of_a_printed_scene_goes_by(
    bench: Any, capsys: pytest.CaptureFixture[str], given: tuple[str, ...], every: bool
) -> None:
    """Cut at ends of lines, where YAML is most likely to be whole, and around the mark and the promise of it."""
    assert main(["scene", *given]) == 0
    text = capsys.readouterr().out.encode()
    ends = [place for place, byte in enumerate(text) if byte == ord("\n")]
    places = {end + more for end in ends for more in (0, 1)} | set(range(ends[1])) | set(range(ends[-4], len(text)))
    assert silent_cuts(bench, text.decode(), range(len(text)) if every else sorted(places - {len(text)})) == []


def test_cuts_of_a_scene_without_the_mark_are_told(bench: Any) -> None:
    text = "\n".join(line for line in default_text().splitlines() if "end of scene" not in line) + "\n"
    with pytest.warns(SceneWarning, match="end of the file"):
        assert load_scene(bench.text(text)) == load_scene()
    assert silent_cuts(bench, text, range(text.index("postures:"), len(text) - 1, 7)) == []
    text = default_text()
    (fault,) = bench.faults_of(bench.text(text[: text.index("  high:")]))
    assert fault.path == "end of the file" and "cut off" in fault.bound and "Fetch the whole file" in fault.remedy


def test_a_block_behind_the_mark_is_read_and_told_and_blanks_do_not_matter(bench: Any) -> None:
    scene, oddities = examine(bench.text(default_text() + "\n" + clearance_text()))
    assert scene.clearance is not None and [oddity.path for oddity in oddities] == ["end of the file"]
    bench.path.write_bytes((default_text() + "\n  \n").replace("\n", "\r\n").encode())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_scene(bench.path) == load_scene()
