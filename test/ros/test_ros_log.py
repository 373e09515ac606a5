"""What files and other nodes put into names and texts is shown in the log and on /diagnostics, and obeyed by no terminal."""

from __future__ import annotations

from collections.abc import Callable

import pytest

pytest.importorskip("rclpy")

from ros_messages import Output, load_topics
from ros_rig import Rig

from boom_twin.diagnostics.levels import Level, Status
from boom_twin.ros.diagnostics_publisher import DiagnosticsPublisher

HOSTILE = "/rig\x1b[2J\n[INFO] [boom_twin]: all is well\u202e\x9b31m"
ESCAPED = r"/rig\x1b[2J\n[INFO] [boom_twin]: all is well\u202e\x9b31m"


class Lines(list[str]):
    """A log whose lines are kept."""

    info = warning = list.append


def test_states_with_foreign_names_are_escaped_and_those_that_come_and_go_do_not_fill_the_log(
    new_rig: Callable[..., Rig], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Four lines in ten minutes; then what is so now. An error is always told, and that it has ended."""
    rig = new_rig()
    board = DiagnosticsPublisher(rig.node, load_topics().outputs[Output.DIAGNOSTICS])
    state = Status("publishers", Level.WARN, f"followed: {HOSTILE}", {"names": HOSTILE, "count": 2})
    rig.until(lambda: bool(rig.diagnostics), lambda: board.show([state]))
    (heard,) = rig.diagnostics[-1].status
    assert heard.message == f"followed: {ESCAPED}"
    assert {pair.key: pair.value for pair in heard.values} == {"names": ESCAPED, "count": "2"}
    logged = "".join(capfd.readouterr())
    assert logged.count(f"publishers: followed: {ESCAPED}") == 1 and HOSTILE not in logged

    now, lines = [1000.0], Lines()
    monkeypatch.setattr("boom_twin.ros.diagnostics_publisher.time.monotonic", lambda: now[0])
    board._logger = lines  # type: ignore[assignment]

    def shown(*levels: Level) -> list[str]:
        """The lines of those levels, a second after one another."""
        lines.clear()
        for level in levels:
            now[0] += 1.0
            board.show([Status("reception", level, f"level {level.value}", {})])
        return [line.removeprefix("reception: level ") for line in lines]

    assert shown(*[Level.WARN, Level.OK] * 50) == ["1", "0"] * 2
    assert shown(Level.ERROR, Level.OK, Level.WARN) == ["2", "0"]
    now[0] += 600.0
    assert shown(Level.WARN) == ["1"]
