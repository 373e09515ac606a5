"""What files and names hold is shown on the terminal, and never obeyed by it."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import main
from default_boom import default_text

from boom_twin import BoomTwinError
from boom_twin.system.terminal_text import printable

SCENES = {
    "description": 'description: "\\e[2J\\e]0;owned\\a\\u202Egnp \\x9b31m"\n' + default_text(),
    "key": '"\\e[2Jx\\ny": 3\n' + default_text(),
    "value": default_text().replace("kind: B1", 'kind: "\\e[31mB1"'),
    "posture": default_text().replace("  arch:", '  "\\e[2Jarch":'),
    "pin": default_text() + 'clearance: {pins: [{at: "\\e[2J", pin_radius: .1, radial_clearance: 1e-4}]}\n',
}


@pytest.mark.parametrize("name", SCENES)
def test_escapes_of_a_scene_are_shown(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(SCENES[name])
    main(["check", str(path)])
    main(["statics", str(path), "--posture", "nowhere"])
    text = "".join(capsys.readouterr())
    assert printable(text) == text and "\\x1b[" in text


def test_escapes_of_a_path_and_of_an_option_are_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "\x1b[2Jbag"
    folder.mkdir()
    assert main(["info", str(folder)]) == 1
    with pytest.raises(SystemExit):
        main(["check", "--\x1b[2Jnix"])
    text = "".join(capsys.readouterr())
    assert "\\x1b[2Jbag" in text and "\x1b" not in text


def test_errors_are_printable_for_everyone_who_prints_them() -> None:
    assert str(BoomTwinError("a\x1b[2J\u202e\ud800")) == "a\\x1b[2J\\u202e\\ud800"
    assert printable("\u00e4 \u03c7 \U0001f600\n\tx") == "\u00e4 \u03c7 \U0001f600\n\tx"
