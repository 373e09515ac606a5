"""What files and names hold is shown on the terminal, and never obeyed by it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from boom_twin.errors import UsageError
from boom_twin.scene.load import default_text
from boom_twin.system.terminal_text import printable

SCENES = {
    "description": 'description: "\\e[2J\\e]0;owned\\a\\u202Egnp \\x9b31m"\n' + default_text(),
    "key": '"\\e[2Jx\\ny": 3\n' + default_text(),
    "value": default_text().replace("kind: B1", 'kind: "\\e[31mB1"'),
    "posture": default_text().replace("  arch:", '  "\\e[2Jarch":'),
    "pin": default_text() + 'clearance: {pins: [{at: "\\e[2J", pin_radius: .1, radial_clearance: 1e-4}]}\n',
}


def shown(*given: str) -> str:
    """Both streams of a command, as a process."""
    done = subprocess.run([sys.executable, "-m", "boom_twin.cli.main", *given], capture_output=True, check=False)
    return (done.stdout + done.stderr).decode()


@pytest.mark.parametrize("name", SCENES)
def test_escapes_of_a_scene_are_shown(tmp_path: Path, name: str) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENES[name])
    text = shown("check", str(path)) + shown("statics", str(path), "--posture", "nowhere")
    assert printable(text) == text and "Traceback" not in text
    assert "\\x1b[" in text


def test_escapes_of_a_path_are_shown(tmp_path: Path) -> None:
    folder = tmp_path / "\x1b[2Jbag"
    folder.mkdir()
    assert "\\x1b[2Jbag" in shown("info", str(folder))
    assert "\x1b" not in shown("info", str(folder)) + shown("check", "--\x1b[2Jnix")


def test_errors_are_printable_for_everyone_who_prints_them() -> None:
    assert str(UsageError("a\x1b[2J\u202e\ud800")) == "a\\x1b[2J\\u202e\\ud800"
    assert printable("\u00e4 \u03c7 \U0001f600\n\tx") == "\u00e4 \u03c7 \U0001f600\n\tx"
