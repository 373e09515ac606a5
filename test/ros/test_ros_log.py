"""What files and other nodes put into names and texts is shown in the log and on /diagnostics, and obeyed by no terminal."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

from boom_twin.diagnostics.levels import Level, Status
from boom_twin.messages.topic_table import Output, load_topics
from boom_twin.ros.node.diagnostics import DiagnosticsPublisher
from boom_twin.scene.load import default_text

HOSTILE = "/rig\x1b[2J\n[INFO] [boom_twin]: all is well\u202e\x9b31m"
ESCAPED = r"/rig\x1b[2J\n[INFO] [boom_twin]: all is well\u202e\x9b31m"


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


def test_a_path_with_escapes_is_told_as_they_are_written(tmp_path: Path, spawn_node: Callable[..., Any]) -> None:
    scene = tmp_path / "sc\x1b[2Jene.yaml"
    scene.write_text(default_text())
    path, given = str(scene).replace("\x1b", "\\e"), tmp_path / "given.yaml"
    given.write_text(f'/**: {{ros__parameters: {{scene: "{path}"}}}}\n')
    node = spawn_node("--params-file", str(given))
    node.wait_for("preparing the model")
    assert r"sc\x1b[2Jene.yaml" in node.said() and "\x1b[2J" not in node.said()
