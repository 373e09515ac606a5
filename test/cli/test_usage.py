"""The command line as its user meets it: nearest names, one option for the scene, help, quiet, completion, progress.

What files and names hold is shown on the terminal, and never obeyed by it.
"""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import pytest
from command import answer, main
from default_boom import default_text

from boom_twin import BoomTwinError
from boom_twin.cli.replay import flat
from boom_twin.offline.progress import ProgressLine
from boom_twin.offline.recording import noise_told
from boom_twin.system.terminal_text import printable

STROKES = "0.63,0.165,0.235,0.187"


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "near"),
    [
        (["replya", "bag"], "replay"),
        (["statics", "--posture", "arch", "--jsn"], "--json"),
        (["replay", "bag", "--out", "x", "--tabel", "csv"], "--table"),
        (["replay", "bag", "--out", "x", "--table", "cvs"], "csv"),
        (["study", "stabilty", "--out", "x"], "stability"),
    ],
)
def test_a_wrong_word_is_told_with_the_nearest(capsys: pytest.CaptureFixture[str], arguments: list[str], near: str) -> None:
    assert refused(capsys, *arguments).strip().endswith(f"Did you mean {near}?")
    assert "Did you mean" not in refused(capsys, "statics", "--posture", "arch", "--qqqqqq")


@pytest.mark.parametrize(
    "arguments, bound",
    [
        (["views", "--out", "x", "--namespace", "a b"], "'a b': each part must begin with a letter"),
        (["monitor", "--port", "99999"], "99999: must be a whole number from 0 to 65535"),
        (["simulate", "--drive", "x.csv", "--out", "y.csv", "--rho", "1"], "1: must be below 1"),
        (["check", "--need", "tip=1"], "a number of mm, cm or m is needed, with its unit"),
    ],
)
def test_a_value_out_of_its_bound_is_told(capsys: pytest.CaptureFixture[str], arguments: list[str], bound: str) -> None:
    assert bound in refused(capsys, *arguments)


def test_the_scene_is_one_option_and_a_positional_argument(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "heavy.yaml"
    scene.write_text(default_text().replace("postures:", "tip: {payload: 100.0}\npostures:", 1))
    told = []
    for arguments in (["--scene", str(scene)], [str(scene)], []):
        told.append(answer(capsys, "statics", *arguments, f"--strokes={STROKES}")["tip_m"])
    assert told[0] == told[1] != told[2]
    assert "not allowed with argument" in refused(capsys, "statics", "--scene", "a", "b", f"--strokes={STROKES}")


@pytest.mark.parametrize("posture", ["-2,-160,-200,-210", "[-2, -160, -200, -210]", " -2., -160.0,-200,-210"])
def test_section_angles_are_a_posture(posture: str, capsys: pytest.CaptureFixture[str]) -> None:
    """As `init` and `envelope` print them, also from a minus on."""
    found = answer(capsys, "statics", "--posture", posture.strip())
    again = answer(capsys, "statics", "--strokes", ",".join(map(str, found["stroke_m"])))
    assert again["tip_m"] == pytest.approx(found["tip_m"], abs=1e-9)
    assert main(["response", "--posture", posture.strip(), "--tip", "-100,0", "--json"]) == 0


def test_quiet_leaves_out_what_is_no_result_and_no_failure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    session = str(Path(__file__).parents[2] / "bags" / "arch_session")
    assert main(["info", session]) == 0
    loud = capsys.readouterr()
    assert main(["info", session, "--quiet"]) == 0
    quiet = capsys.readouterr()
    assert loud.out == quiet.out and loud.err.startswith("scene: ") and quiet.err == ""
    odd = tmp_path / "odd.yaml"
    odd.write_text(default_text().replace("gravity: [0.0, -9.81]", "gravity: [0.0, -1.62]"))
    assert main(["info", session, "--scene", str(odd), "--quiet"]) == 0
    assert capsys.readouterr().err.startswith(f"warning: {odd}: ")
    assert main(["info", str(tmp_path), "--quiet"]) == 1
    assert capsys.readouterr().err.startswith("boom_twin info: ")


def test_a_summary_as_json_is_flat_and_has_its_alarms() -> None:
    alarm = {"channel": "joint_2", "kind": "residual", "from_s": 4.0, "to_s": None, "cause": "cylinder_2.k", "ranked": []}
    found = flat({"samples": 3, "events": {"not followed": 2}, "alarms": [alarm, {**alarm, "channel": "joint_3"}]})
    assert found == {
        "samples": 3, "events_not_followed": 2, "alarm_channel": ["joint_2", "joint_3"], "alarm_kind": ["residual"] * 2,
        "alarm_from_s": [4.0] * 2, "alarm_to_s": [None] * 2, "alarm_cause": ["cylinder_2.k"] * 2,
    }  # fmt: skip


def test_no_setting_is_advised_for_readings_in_another_unit() -> None:
    found = {"read_out": ["joint angles: readings come in steps"], "alarms": [{"kind": "jump"}]}
    assert noise_told(found) == found["read_out"] and noise_told({**found, "alarms": [{"kind": "wiring"}]}) == []


@pytest.mark.parametrize("is_terminal", [True, False])
def test_progress_is_a_line_on_a_terminal_only(
    is_terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: is_terminal)
    with closing(ProgressLine(8, "messages", "replay")) as line:
        for _ in range(8):
            line.update(1)
    lines = capsys.readouterr().err.split("\r")[1:]
    assert [each[:31] for each in lines[:: len(lines) - 1]] == [
        "replay:  12%, 1 of 8 messages, ", "replay: 100%, 8 of 8 messages, ",
    ] if is_terminal else not lines  # fmt: skip


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
