"""A replay that writes no result bag: everything else is as with one."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import main

SESSION = Path(__file__).parents[2] / "bags" / "arch_session"


def test_the_command_says_so_and_writes_the_same_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--out", str(tmp_path / "out"), "--no-pictures", "--table", "csv", "--duration", "2"]
    tables, told = [], []
    for given in ([], ["--no-bag"]):  # the second replaces the first: its bag must not stay beside the new numbers
        assert main(["replay", str(SESSION), *options, *given]) == 0
        tables.append((tmp_path / "out" / "samples.csv").read_bytes())
        told.append(capsys.readouterr().out)
    assert tables[0] == tables[1]
    assert "result bag         not written (--no-bag)" in told[1] and "not written" not in told[0]
    assert str(tmp_path / "out" / "bag") in told[0].splitlines() and str(tmp_path / "out" / "bag") not in told[1].splitlines()
    assert not (tmp_path / "out" / "bag").exists()
