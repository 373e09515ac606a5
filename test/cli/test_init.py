"""`boom_twin init`: from the example table, from answers, and what it refuses."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

from boom_twin.cli.main import main
from boom_twin.scene import load_scene
from boom_twin.scene.load import default_text

ANSWERS = """Small boom
0, 0
0.40, -1100 mm
12 kg/m
25


2
4000 mm
0.55, 3.75
200 kg
200 mm
120 mm
6 mm
0.55, -0.12

0, 75
100 mm
70 mm
3.5
0.25, 3.5
150 mm
90 mm
6 mm
B1
-150, 0
80 mm
50 mm
-0.82, 0.18
-0.14, -0.04
0.12, 0.062
0.42
0.377
4
3
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_example_table_makes_a_scene_that_passes_strict(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "--example-table"]) == 0
    Path("table.yaml").write_text(capsys.readouterr().out, encoding="utf-8")
    assert main(["init", "--table", "table.yaml", "--out", "boom.yaml"]) == 0
    out, err = capsys.readouterr()
    assert "Next: boom_twin check boom.yaml --strict --picture boom.png" in out and err == ""
    assert main(["check", "boom.yaml", "--strict"]) == 0


def test_nothing_is_written_over(capsys: pytest.CaptureFixture[str]) -> None:
    Path("boom.yaml").write_text("mine", encoding="utf-8")
    main(["init", "--example-table"])
    Path("table.yaml").write_text(capsys.readouterr().out, encoding="utf-8")
    assert main(["init", "--table", "table.yaml", "--out", "boom.yaml"]) == 1
    assert "boom.yaml: is there already. Name another file, or give --force to replace it." in capsys.readouterr().err
    assert main(["init", "--table", "table.yaml", "--out", "table.yaml"]) == 1
    assert Path("boom.yaml").read_text(encoding="utf-8") == "mine"
    with pytest.raises(SystemExit) as ended:
        main(["init", "--table", "table.yaml"])
    assert ended.value.code == 2 and "one of the arguments --out --example-table is required" in capsys.readouterr().err


def test_links_that_cannot_meet_end_with_exit_code_1_and_no_scene(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    main(["init", "--example-table"])
    table = capsys.readouterr().out
    assert "range_deg: [-165, 10], bore: 200 mm" in table
    wider = table.replace("range_deg: [-165, 10], bore: 200", "range_deg: [-200, 10], bore: 200")
    Path("table.yaml").write_text(wider, encoding="utf-8")
    assert main(["init", "--table", "table.yaml", "--out", "boom.yaml"]) == 1
    out, err = capsys.readouterr()
    assert out == "" and "joints[1].range_deg = [-200.0, 10.0]" in err and "Narrow range_deg to [" in err
    assert [file.name for file in folder.iterdir()] == ["table.yaml"]


def test_a_warned_table_is_mended_and_written_anew(capsys: pytest.CaptureFixture[str]) -> None:
    main(["init", "--example-table"])
    table = capsys.readouterr().out
    Path("table.yaml").write_text(table.replace("7100 mm]", "6550 mm]"), encoding="utf-8")
    assert main(["init", "--table", "table.yaml", "--out", "boom.yaml"]) == 0
    out, err = capsys.readouterr()
    assert err.startswith("warning: table.yaml: line ") and "sections[1].beam" in err
    again = out.rpartition("then ")[2].split()
    assert again[0] == "boom_twin" and again[-1] == "--force"
    Path("table.yaml").write_text(table, encoding="utf-8")
    assert main(again[1:]) == 0
    assert "sections[1].beam" not in capsys.readouterr().err
    assert main(["check", "boom.yaml", "--strict"]) == 0


def test_answers_make_a_scene_and_are_kept(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(ANSWERS))
    assert main(["init", "--out", "boom.yaml"]) == 0
    out = capsys.readouterr().out
    assert "sections[0].height = '200 kg': `kg` is no unit of this key, which is in m" in out
    scene = load_scene("boom.yaml")
    assert [joint.kind for joint in scene.joints] == ["A", "B1"]
    assert pytest.approx(3.696e-3) == scene.sections[0].A and scene.base.cylinder_pin == (0.4, -1.1)
    assert main(["init", "--table", "boom.table.yaml", "--out", "again.yaml"]) == 0
    assert load_scene("again.yaml") == scene


def test_answers_that_end_too_early_write_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("Small boom\n0, 0\n"))
    assert main(["init", "--out", "boom.yaml"]) == 1
    assert "the answers end at `base.cylinder_pin" in capsys.readouterr().err
    assert list(folder.iterdir()) == []


def test_a_faulty_table_is_refused_with_its_lines(capsys: pytest.CaptureFixture[str]) -> None:
    Path("table.yaml").write_text("base: {pivot: [0, 0]}\nsections: []\n", encoding="utf-8")
    assert main(["init", "--table", "table.yaml", "--out", "boom.yaml"]) == 1
    err = capsys.readouterr().err
    assert "base.cylinder_pin is absent" in err and "sections" in err and not Path("boom.yaml").exists()


COLUMNS = {
    "length": 8.3, "beam_start": 1.32, "beam_end": 7.8, "height": 0.56, "width": 0.42, "wall": 0.008, "rod_pin_x": 1.32,
    "rod_pin_y": -0.264, "kind": "A", "range_deg_low": -5, "range_deg_high": 85, "bore": 0.18, "rod": 0.125, "pivot_x": 0,
    "pivot_y": 0, "cylinder_pin_x": 0.99, "cylinder_pin_y": -2.75,
}  # fmt: skip


@pytest.mark.parametrize(("name", "mark"), [("table.csv", ","), ("table.csv", ";"), ("table.csv", "\t"), ("table.tsv", "\t")])
def test_a_table_as_spreadsheets_write_it(name: str, mark: str) -> None:
    rows = mark.join(COLUMNS), mark.join(map(str, COLUMNS.values()))
    Path(name).write_text("\n".join(rows), encoding="utf-8-sig")
    assert main(["init", "--table", name, "--out", "boom.yaml"]) == 0
    assert load_scene("boom.yaml").sections[0].length == 8.3


def test_a_table_without_columns_of_the_pivot_has_it_in_the_origin(capsys: pytest.CaptureFixture[str]) -> None:
    columns = {name: value for name, value in COLUMNS.items() if not name.startswith("pivot")}
    Path("table.csv").write_text(f"{','.join(columns)}\n{','.join(map(str, columns.values()))}\n", encoding="utf-8")
    assert main(["init", "--table", "table.csv", "--out", "boom.yaml"]) == 0
    assert load_scene("boom.yaml").base.pivot == (0.0, 0.0)
    assert "boom.yaml, 1 section, 8.30 m" in capsys.readouterr().out


def test_a_scene_in_place_of_a_table_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    Path("scene.yaml").write_text(default_text(), encoding="utf-8")
    assert main(["init", "--table", "scene.yaml", "--out", "boom.yaml"]) == 1
    err = capsys.readouterr().err
    assert "1 fault" in err and "gravity = [0.0, -9.81]: only a scene has it" in err


SLIPS = {
    "a line in litres": ("rod: 125 mm}", "rod: 125 mm, cap_line: 0.5}", "joints[0].cap_line", "twice what the chamber takes"),
    "a rod as radius": ("bore: 140 mm, rod: 90 mm", "bore: 140 mm, rod: 45 mm", "joints[2].rod", "not one as a radius"),
    "links in N": ("mL: 30 kg, mR: 22 kg", "mL: 300, mR: 22 kg", "joints[2].mL", "not N"),
    "aluminium with the density of steel": ("E: 210 GPa", "E: 70 GPa", "material.E", "with the density of steel"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_in_a_table_is_warned_of_at_its_key(slip: str, capsys: pytest.CaptureFixture[str]) -> None:
    old, new, key, told = SLIPS[slip]
    main(["init", "--example-table"])
    table = capsys.readouterr().out
    assert table.count(old) == 1
    Path("table.yaml").write_text(table.replace(old, new), encoding="utf-8")
    assert main(["init", "--table", "table.yaml", "--out", "boom.yaml"]) == 0
    warnings = [line for line in capsys.readouterr().err.splitlines() if line.startswith("warning: table.yaml: line ")]
    assert len(warnings) == 1 and f": {key} = " in warnings[0] and told in warnings[0], warnings


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"PK\x03\x04\x14\x00\xff\xfe", "a spreadsheet's own or an archive. Save a spreadsheet as `CSV UTF-8`."),
        ("length\nGroßer\n".encode("latin-1"), "line 2 has a character that is not UTF-8, byte 0xdf. Save the file with"),
        (b"\xff\xfel\x00e\x00", "this is not a text file in UTF-8"),
    ],
)
def test_a_file_of_another_kind_is_refused_by_what_it_is(content: bytes, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("table.csv").write_bytes(content)
    assert main(["init", "--table", "table.csv", "--out", "boom.yaml"]) == 1
    assert told in capsys.readouterr().err


def test_a_list_with_faulty_entries_is_not_called_empty(capsys: pytest.CaptureFixture[str]) -> None:
    Path("table.csv").write_text("length,height\n8.3,0.56\n", encoding="utf-8")
    assert main(["init", "--table", "table.csv", "--out", "boom.yaml"]) == 1
    err = capsys.readouterr().err
    assert "sections[0].wall is absent" in err and "at least one entry" not in err


@pytest.mark.parametrize("text", [None, "", "\xff"])
def test_an_unusable_table_is_refused_as_a_table(text: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Not as a scene, whose remedies are others."""
    path = tmp_path / "table.yaml"
    if text is not None:
        path.write_bytes(text.encode("latin-1"))
    assert main(["init", "--table", str(path), "--out", str(tmp_path / "boom.yaml")]) == 1
    told = capsys.readouterr().err
    assert "table file = " in told and "scene" not in told.lower()
