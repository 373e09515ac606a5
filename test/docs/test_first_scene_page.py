"""The page of the first scene tells the truth: its commands print what it quotes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from command import main

PAGE = (Path(__file__).parents[2] / "docs" / "your_boom_init.md").read_text(encoding="utf-8")
EXAMPLES = Path(__file__).parents[2] / "examples"
QUOTES = re.findall(r"```text\n(.*?)\n```", PAGE, re.DOTALL)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


def quoted(command: str) -> str:
    found = re.search(rf"```\n{re.escape(command)}\n```\n\n```text\n(.*?)\n```", PAGE, re.DOTALL)
    assert found, command
    return found[1]


def agrees(printed: str, told: str) -> None:
    """The same words, and numbers that agree to 0.3 %."""
    assert NUMBER.sub("#", printed).split() == NUMBER.sub("#", told).split()
    numbers = [[float(number) for number in NUMBER.findall(text)] for text in (printed, told)]
    assert numbers[0] == pytest.approx(numbers[1], rel=3e-3, abs=2e-3)


@pytest.fixture
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "--example-table"]) == 0
    path = tmp_path / "boom_table.yaml"
    path.write_text(capsys.readouterr().out, encoding="utf-8")
    return path


def init(table: Path, capsys: pytest.CaptureFixture[str], *slips: tuple[str, str]) -> str:
    """What `init` prints with some slips in the table."""
    text = table.read_text(encoding="utf-8")
    for right, wrong in slips:
        assert text.count(right) == 1
        text = text.replace(right, wrong)
    (table.parent / "my_boom.yaml").unlink(missing_ok=True)
    own = table.read_text(encoding="utf-8")
    table.write_text(text, encoding="utf-8")
    main(["init", "--table", "boom_table.yaml", "--out", "my_boom.yaml"])
    table.write_text(own, encoding="utf-8")
    captured = capsys.readouterr()
    return (captured.err + captured.out).strip()


def test_init_prints_what_is_quoted(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert init(table, capsys, ("wall: 5 mm", "wall: 5")) == quoted("boom_twin init --table boom_table.yaml --out my_boom.yaml")
    assert "[x0, x1] leave a rigid head" in init(table, capsys, ("beam: [550 mm, 7100 mm]", "beam: [550 mm, 6550 mm]"))
    assert init(table, capsys) in QUOTES
    lines = (table.parent / "my_boom.yaml").read_text(encoding="utf-8")
    assert any(quote in lines for quote in QUOTES if "# rho A + pipe" in quote)


def test_the_scene_has_no_warning(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    init(table, capsys)
    command = "boom_twin check my_boom.yaml --strict --picture my_boom.png"
    assert command in PAGE
    assert main(command.split()[1:]) == 0
    assert "Warnings: none" in capsys.readouterr().out and Path("my_boom.png").is_file()


def test_a_range_that_pins_do_not_allow_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = (EXAMPLES / "zr_fold_20m_table.yaml").read_text(encoding="utf-8")
    table = tmp_path / "zr_fold_table.yaml"
    table.write_text(text.replace("[-174, 0]", "[-205, 0]"), encoding="utf-8")
    assert main(["init", "--table", table.name, "--out", "zr_fold.yaml"]) == 1
    assert capsys.readouterr().err.strip() in QUOTES
    table.write_text(text, encoding="utf-8")
    assert main(["init", "--table", table.name, "--out", "zr_fold.yaml"]) == 0
    assert main(["check", "zr_fold.yaml", "--strict"]) == 0


@pytest.mark.slow
def test_envelope_prints_what_is_quoted(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    init(table, capsys)
    command = "boom_twin envelope my_boom.yaml --out envelope"
    assert main(command.split()[1:]) == 0
    told = quoted(command).removesuffix("\n..").splitlines()
    printed = capsys.readouterr().out.splitlines()[: len(told)]
    agrees(*(re.sub(r"\S+,\S+", "posture", "\n".join(lines)) for lines in (printed, told)))
