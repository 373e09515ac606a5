"""What files and other nodes put into names and texts is shown in the log and on /diagnostics, and obeyed by no terminal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

from boom_twin.diagnostics.levels import Level, Status
from boom_twin.messages.topic_table import Output, load_topics
from boom_twin.ros.diagnostics_publisher import DiagnosticsPublisher
from boom_twin.ros.node.diagnostics import ClockCheck
from boom_twin.ros.node.services import StartLog
from boom_twin.scene.load import default_text
from boom_twin.types import Change, Report

HOSTILE = "/rig\x1b[2J\n[INFO] [boom_twin]: all is well\u202e\x9b31m"
ESCAPED = r"/rig\x1b[2J\n[INFO] [boom_twin]: all is well\u202e\x9b31m"


class Lines(list[str]):
    """A log whose lines are kept."""

    info = warning = list.append


def test_a_state_with_a_foreign_name_is_escaped_in_log_and_diagnostics(bench: Any, capfd: pytest.CaptureFixture[str]) -> None:
    board = DiagnosticsPublisher(bench.node, load_topics().outputs[Output.DIAGNOSTICS])
    capfd.readouterr()
    level = iter([Level.WARN, Level.OK])

    def is_told() -> bool:
        board.show([Status("publishers", next(level, Level.OK), f"followed: {HOSTILE}", {"names": HOSTILE, "count": 2})])
        return bool(bench.diagnostics)

    bench.until(is_told)
    (state,) = bench.diagnostics[-1].status
    assert state.message == f"followed: {ESCAPED}"
    assert {pair.key: pair.value for pair in state.values} == {"names": ESCAPED, "count": "2"}
    logged = "".join(capfd.readouterr())
    assert logged.count(f"publishers: followed: {ESCAPED}") == 2 and HOSTILE not in logged  # as a warning, then as well


def test_a_state_that_comes_and_goes_does_not_fill_the_log(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Four lines in ten minutes; then what is so now. An error is always told, and that it has ended."""
    now, lines = [1000.0], Lines()
    monkeypatch.setattr("boom_twin.ros.diagnostics_publisher.time.monotonic", lambda: now[0])
    board = DiagnosticsPublisher(bench.node, load_topics().outputs[Output.DIAGNOSTICS])
    board._logger = lines  # type: ignore[assignment]

    def show(level: Level) -> None:
        now[0] += 1.0
        board.show([Status("reception", level, f"level {level.value}", {})])

    for _ in range(50):
        show(Level.WARN)
        show(Level.OK)
    assert lines == ["reception: level 1", "reception: level 0"] * 2
    show(Level.ERROR)
    show(Level.OK)
    assert lines[4:] == ["reception: level 2", "reception: level 0"]
    show(Level.WARN)
    assert len(lines) == 6
    now[0] += 600.0
    show(Level.WARN)
    assert lines[6:] == ["reception: level 1"]


def test_a_path_with_escapes_is_told_as_they_are_written(tmp_path: Path, spawn_node: Callable[..., Any]) -> None:
    scene = tmp_path / "sc\x1b[2Jene.yaml"
    scene.write_text(default_text())
    path, given = str(scene).replace("\x1b", "\\e"), tmp_path / "given.yaml"
    given.write_text(f'/**: {{ros__parameters: {{scene: "{path}"}}}}\n')
    node = spawn_node("--params-file", str(given))
    node.wait_for("preparing the model")
    assert r"sc\x1b[2Jene.yaml" in node.said() and "\x1b[2J" not in node.said()


def test_a_change_to_what_was_so_before_is_not_an_empty_line() -> None:
    lines = Lines()
    log = StartLog(lines)  # type: ignore[arg-type]
    start = Change(10**18, True, {"payload": 40.0}, {})
    log.tell(Report(start.stamp, True, events=()), start)
    again = replace(start, stamp=10**18 + 5_000_000, from_rest=False)
    log._told = -inf
    log.tell(Report(again.stamp, True, events=()), again)
    other = replace(again, settings={"payload": 41.0})
    log.tell(Report(again.stamp, True, events=()), other)
    assert lines == ["at 1000000000.000000000: started from rest (first strokes)", "at 1000000000.005000000: payload 41"]


def test_another_clock_is_told_if_it_lasts() -> None:
    """A bag that begins again is a jump of stamps and of clock, one after the other."""
    check = ClockCheck()
    found = [check.apart(1e9 + 2.0, 10**18, tolerance, 0.0) for tolerance in (1.0, 2.5, 1.0, 1.0)]
    assert found == pytest.approx([0.0, 0.0, 0.0, 2.0])


def test_a_session_that_ended_is_not_stamped_by_another_clock() -> None:
    """The newest stamp grows old while nothing comes."""
    check = ClockCheck()
    assert not any(check.apart(1e9 + silent, 10**18, 1.0, float(silent)) for silent in range(5))
