"""Two sessions side by side."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import answer, main

from boom_twin.report.quantities import ComparedSession, Quantity, rows_of

ONE = ComparedSession(
    "one", "s", [Quantity("x", 1.0, 0.1, "m"), Quantity("y", 1.0, None, "m"), Quantity("only", 2.0, 0.1, "m")], []
)


def other(x: float) -> ComparedSession:
    alarm = {"channel": "joint_1", "kind": "bias", "from_s": -0.03, "to_s": None, "cause": "joint_1.sensor", "told": "bias"}
    return ComparedSession("other", "s", [Quantity("x", x, 0.1, "m"), Quantity("y", 3.0, None, "m")], [alarm])


def test_what_is_no_chance_and_what_nobody_can_say() -> None:
    for x, differs in ((1.0, False), (1.5, False), (1.6, True), (0.4, True)):
        row, y, only = rows_of(ONE, other(x))
        assert row.sigma == pytest.approx(0.1 * 2**0.5) and row.difference == pytest.approx(x - 1.0)
        assert row.is_significant is differs
    assert (y.difference, y.sigma, y.is_significant) == (2.0, None, None)
    assert (only.a, only.b, only.difference) == (2.0, None, None)


def test_a_session_and_a_replay_of_it_are_the_same(
    sessions: tuple[Path, Path], replays: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    found = answer(capsys, "compare", str(sessions[0]), str(replays[0]))
    assert found["same_scene"] and set(found["difference"]) == {0.0} and True not in found["is_significant"]


def test_a_fault_shows(replays: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", *map(str, replays)]) == 0
    lines = capsys.readouterr().out.splitlines()
    differing = {line.split()[0] for line in lines if line.endswith(" differs")}
    assert differing <= {"residual_mean_joint_3", "residual_rms_joint_3"} and differing
    assert any("Angle sensor of joint 3" in line for line in lines)


def test_what_is_no_session_and_no_whole_replay_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(tmp_path / "nothing"), str(tmp_path)]) == 1
    assert "no such file or directory" in capsys.readouterr().err
    (tmp_path / "summary.json").write_text("{}")
    assert main(["compare", str(tmp_path), str(tmp_path)]) == 1
    assert "Replay the session again" in capsys.readouterr().err
