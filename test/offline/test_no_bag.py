"""A replay that writes no result bag: everything else is as with one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import main

from boom_twin import TimeWindow, replay

SESSION = Path(__file__).parents[2] / "bags" / "arch_session"
OF_THE_RUN = {"wall_s", "realtime_factor", "output_sha256"}


def without_run(summary: dict) -> dict:
    return {name: value for name, value in summary.items() if name not in OF_THE_RUN}


def test_the_numbers_are_the_same(tmp_path: Path) -> None:
    window = TimeWindow(0.0, 3.0)
    usual = replay(SESSION, None, tmp_path / "usual", window=window)
    found = replay(SESSION, None, tmp_path / "out", window=window, with_bag=False)
    assert found.summary["output_sha256"] is None and len(usual.summary["output_sha256"]) == 64
    assert without_run(found.summary) == without_run(usual.summary)
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == found.summary
    assert [path.name for path in sorted((tmp_path / "out").iterdir())] == ["manifest.json", "summary.json"]
    one, other = found.columns(), usual.columns()
    assert all(one[name].tobytes() == other[name].tobytes() for name in other) and len(one["t_s"]) > 500


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
