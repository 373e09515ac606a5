"""`boom_twin check`, `boom_twin scene`, and the exit codes of the console script."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from command import answer, main
from default_boom import default_text


def _scene(folder: Path, old: str, new: str) -> str:
    """Path of the default scene with one text replaced."""
    assert old in default_text()
    path = folder / "scene.yaml"
    path.write_text(default_text().replace(old, new), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(("end", "code"), [("\n", 0), ("", 1)], ids=["whole line", "cut line"])
def test_a_scene_without_end_mark_is_noted_and_strict_lets_it_pass(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], end: str, code: int
) -> None:
    """As a scene that was written by hand; but not where even the end of the last line is missing."""
    path = tmp_path / "scene.yaml"
    kept = [line for line in default_text().splitlines() if "end of scene" not in line]
    path.write_text("\n".join(kept).rstrip() + end, encoding="utf-8")
    assert main(["check", str(path), "--strict"]) == code
    out, err = capsys.readouterr()
    assert ("Note: line" in out and "Warnings: none" in out) if code == 0 else "it may have been cut off" in err
    values = answer(capsys, "check", str(path))
    assert [len(values[key]) for key in ("notes", "warnings")] == [1 - code, code]
    assert main(["statics", str(path), "--posture", "arch"]) == 0
    assert capsys.readouterr().err.startswith(f"{'warning' if code else 'note'}: {path}: line ")


def test_check_warns_in_words_and_in_one_flat_object(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _scene(tmp_path, "k: 40.0e+6", "k: 40.0")
    assert main(["check", path]) == 0
    out = capsys.readouterr().out
    assert out.startswith(f"{path}: this scene can be used")
    assert "Warnings: 1\n" in out and "joints[0].cylinder.k = 40.0: expected from 1e6 to 1e9 N/m: kN/mm?" in out
    assert main(["check", "--json", path]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    values = json.loads(out)
    assert not any(isinstance(value, dict) for value in values.values())
    assert values["length_m"] == pytest.approx(13.46) and values["mass_kg"] == pytest.approx(665.5)
    assert values["unknowns"] == 48 and values["section_unknowns"] == [8, 8, 8, 4]
    assert len(values["warnings"]) == 1 and "kN/mm" in values["warnings"][0]


def test_check_of_a_bad_scene_exits_with_1_and_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = _scene(tmp_path, "mass: 36.0", "mass: -36.0")
    assert main(["check", "--json", path]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"boom_twin check: {path}: 1 fault\n")
    assert "sections[0].root.mass = -36.0: it must be greater than or equal to 0. Give the mass in kg." in err
    assert main(["check", str(tmp_path / "nowhere.yaml")]) == 1
    assert "No such file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "redirection", "code", "told"),
    [
        ("scene", "| head -c 1 > /dev/null", 0, ""),
        ("check nothing.yaml", "2>&1 | true", 1, ""),
        ("--help", "| true", 0, ""),
        ("scene", ">&-", 0, ""),
        ("scene", ">&- 2>&- <&-", 0, ""),
        ("check nothing.yaml", "2>&-", 1, ""),
        ("check nothing.yaml", ">&- 2>/dev/full", 1, ""),
        ("scene --nix", "2>&-", 2, ""),
        ("scene", "> /dev/full", 1, "boom_twin scene: standard output: No space left on device\n"),
    ],
)
@pytest.mark.system
def test_as_a_process_whose_streams_are_closed_or_full(command: str, redirection: str, code: int, told: str) -> None:
    shell = f"{sys.executable} -m boom_twin.cli.main {command} {redirection}; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (code, told)
