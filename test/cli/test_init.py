"""`boom_twin init`: from the example table, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import main
from default_boom import default_text

MADE = ["init", "--table", "table.yaml", "--out", "boom.yaml"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def table(capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["init", "--example-table"]) == 0
    text = capsys.readouterr().out
    Path("table.yaml").write_text(text, encoding="utf-8")
    return text


def test_the_example_table_makes_a_scene_that_passes_strict(table: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(MADE) == 0
    out, err = capsys.readouterr()
    assert "Next: boom_twin check boom.yaml --strict --picture boom.png" in out and err == ""
    assert main(["check", "boom.yaml", "--strict"]) == 0


def test_nothing_is_written_over(table: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("boom.yaml").write_text("mine", encoding="utf-8")
    assert main(MADE) == 1
    assert "boom.yaml: is there already. Name another file, or give --force to replace it." in capsys.readouterr().err
    assert main([*MADE[:-1], "table.yaml"]) == 1
    assert [Path(name).read_text(encoding="utf-8") for name in ("boom.yaml", "table.yaml")] == ["mine", table]
    with pytest.raises(SystemExit) as ended:
        main(["init", "--table", "table.yaml"])
    assert ended.value.code == 2 and "one of the arguments --out --example-table is required" in capsys.readouterr().err
    assert main(["init", "--out", "new.yaml"]) == 1 and "--example-table prints one" in capsys.readouterr().err


def test_a_warned_table_is_mended_and_written_anew(table: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("table.yaml").write_text(table.replace("7100 mm]", "6550 mm]"), encoding="utf-8")
    assert main(MADE) == 0
    out, err = capsys.readouterr()
    assert err.startswith("warning: table.yaml: line ") and "sections[1].beam" in err
    again = out.rpartition("then ")[2].split()
    assert again[0] == "boom_twin" and again[-1] == "--force"
    Path("table.yaml").write_text(table, encoding="utf-8")
    assert main(again[1:]) == 0
    assert "sections[1].beam" not in capsys.readouterr().err
    assert main(["check", "boom.yaml", "--strict"]) == 0


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("table.yaml", None, ["table file = "]),
        ("table.yaml", b"", ["table file = "]),
        ("table.yaml", b"base: {pivot: [0, 0]}\nsections: []\n", ["base.cylinder_pin is absent", "sections"]),
        ("table.yaml", default_text().encode(), ["1 fault", "gravity = [0.0, -9.81]: only a scene has it"]),
        ("table.yaml", b"PK\x03\x04\x14\x00\xff\xfe", ["line 1 has bytes that are no text in UTF-8"]),
        ("table.yaml", "length\nGroßer\n".encode("latin-1"), ["line 2 has bytes that are no text in UTF-8"]),
    ],
)
def test_what_is_no_table_is_refused_by_what_it_is(
    name: str, content: bytes | None, told: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    if content is not None:
        Path(name).write_bytes(content)
    assert main(["init", "--table", name, "--out", "boom.yaml"]) == 1
    err = capsys.readouterr().err
    assert all(words in err for words in told) and "at least one entry" not in err and not Path("boom.yaml").exists()
