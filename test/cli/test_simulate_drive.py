"""What `simulate` reads, writes and says: drives likely meant otherwise, lengths, worn pins."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from command import answer, main
from default_boom import strokes_of_posture

from boom_twin import load_scene
from boom_twin.scene.pump_pulses import ease

HEADER = "t_s,stroke_1_m,stroke_2_m,stroke_3_m,stroke_4_m\n"
TIMES = np.arange(0.0, 2.0, 0.01)
STROKES = strokes_of_posture(load_scene(), "arch") + 0.01 * np.sin(np.pi * TIMES)[:, None]


def written(path: Path, times: np.ndarray, rows: np.ndarray, stem: str = "stroke") -> str:
    names = ",".join(f"{stem}_{i + 1}_m" for i in range(rows.shape[1]))
    np.savetxt(path, np.column_stack([times, rows]), fmt="%.12g", delimiter=",", header=f"t_s,{names}", comments="")
    return str(path)


def jumped(size: float) -> np.ndarray:
    """Strokes of which the first jumps in row 10."""
    strokes = STROKES[:20].copy()
    strokes[10:, 0] += size
    return strokes


@pytest.mark.parametrize(
    ("times", "strokes", "told"),
    [
        (TIMES[:20], STROKES[:20], ""),
        (TIMES[:20], jumped(0.02), "line 12: stroke_1_m goes "),
        (1000.0 * TIMES[:4], STROKES[:4], "t_s grows by 10 s from row to row, 30 s in all"),
    ],
)
def test_a_drive_likely_meant_otherwise_is_told_and_followed(
    times: np.ndarray, strokes: np.ndarray, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = written(tmp_path / "drive.csv", times, strokes)
    given = ["--drive", drive, "--out", str(tmp_path / "out.csv"), "--no-error-estimate", "--dt", "0.01"]
    assert main(["simulate", *given]) == 0
    assert (f"warning: {drive}: {told}" if told else "") in (err := capsys.readouterr().err) and (told or "warning" not in err)


def test_lost_contacts_of_worn_pins_are_told_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scene", "--clearance"]) == 0
    scene, out = tmp_path / "play.yaml", tmp_path / "out.csv"
    scene.write_text(capsys.readouterr().out)
    drive = written(
        tmp_path / "drive.csv", np.linspace(0.0, 0.05, 6), np.tile(strokes_of_posture(load_scene(), "arch"), (6, 1))
    )
    assert main(["simulate", str(scene), "--posture", "arch", "--drive", drive, "--out", str(out)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[4:] == [*(f"cylinder_{i}.rod: contact lost 0 times" for i in range(1, 5)), str(out)]
    found = columns(out)
    names = [f"cylinder_{i}_rod_{what}" for i in range(1, 5) for what in ("dx_m", "dy_m", "force_N", "contact")]
    assert [*found][-20:] == [*names, *(f"length_{i}_m" for i in range(1, 5))] and len(found["t_s"]) == 6
    assert found["cylinder_1_rod_contact"][-1] == 1.0
    assert np.hypot(found["cylinder_1_rod_dx_m"], found["cylinder_1_rod_dy_m"])[-1] > 1e-4


def columns(path: Path) -> dict[str, np.ndarray]:
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names}


def test_a_drive_with_more_cylinders_than_the_boom_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "drive.csv").write_text(
        "t_s,stroke_1_m,stroke_2_m,stroke_3_m\n0,0.2,0.1,0.1\n1,0.2,0.1,0.1\n", encoding="utf-8"
    )
    boom = str(Path(__file__).parents[2] / "examples" / "two_section_boom.yaml")
    assert main(["simulate", boom, "--drive", str(tmp_path / "drive.csv"), "--out", str(tmp_path / "out.csv")]) == 1
    assert "column stroke_3_m, but the scene has 2 cylinders" in capsys.readouterr().err


def test_results_of_another_boom_are_replaced_and_no_drive_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, drive = tmp_path / "out.csv", tmp_path / "drive.csv"
    drive.write_text(f"{HEADER}0,{','.join(map(str, STROKES[0]))}\n")
    command = ["simulate", "--drive", str(drive), "--out", str(out)]
    out.write_text("t_s,stroke_1_m,joint_1_rad,tip_x_m,tip_y_m\n0,0.1,0,1,1\n")
    assert main(command) == 0 and len(out.read_text().splitlines()) == 2
    for other in ("t_s,stroke_1_m,joint_1_rad\n0,0.1,0\n", "t_s,stroke_1_m,tip_x_m,measured_joint_1_rad\n0,0.1,0,0\n"):
        out.write_text(other)
        assert main(command) == 1 and out.read_text() == other
        assert "is no earlier result of this command" in capsys.readouterr().err


def test_the_lengths_of_a_result_give_the_same_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are its last columns; under the names of a session they are lengths too."""
    out, again = tmp_path / "out.csv", tmp_path / "again.csv"
    command = ["simulate", "--posture", "arch", "--no-error-estimate"]
    drive = STROKES[0] + 0.01 * ease(TIMES[:120])[:, None]
    assert main([*command, "--drive", written(tmp_path / "drive.csv", TIMES[:120], drive), "--out", str(out)]) == 0
    moved = columns(out)
    lengths = [f"length_{i}_m" for i in range(1, 5)]
    assert list(moved)[-4:] == lengths and list(moved)[1] == "stroke_1_m"
    session = written(tmp_path / "session.csv", TIMES[:120], np.column_stack([moved[name] for name in lengths]))
    for given in (str(out), session):
        assert main([*command, "--lengths", given, "--out", str(again)]) == 0
        for name, values in columns(again).items():
            off = {"_N": 200.0, "s2": 0.4}.get(name[-2:], 2e-5)  # rows of 10 ms, between which lengths are a cubic
            assert values == pytest.approx(moved[name], abs=off), name
    capsys.readouterr()
    late = written(tmp_path / "late.csv", TIMES[:5], STROKES[:5], "length")
    assert main([*command, "--lengths", late, "--out", str(again)]) == 1
    assert "in the first row at rest: posture arch has" in capsys.readouterr().err


def test_statics_tells_lengths_beside_drives(capsys: pytest.CaptureFixture[str]) -> None:
    at_drives = answer(capsys, "statics", "--posture", "arch")
    lengths = ",".join(map(repr, at_drives["length_m"]))
    at_lengths = answer(capsys, "statics", f"--lengths={lengths}")
    keys = ["stroke_m", "length_m", "tip_rigid_m", "tip_m", "joint_rad", "cylinder_force_N", "frequencies_Hz"]
    assert list(at_lengths) == list(at_drives) == keys
    for key in ("stroke_m", "length_m", "tip_m", "joint_rad", "frequencies_Hz"):
        assert at_lengths[key] == pytest.approx(at_drives[key], rel=1e-9), key
    assert main(["statics", f"--lengths={lengths}"]) == 0
    assert "drive m    length m" in capsys.readouterr().out


def test_a_drive_may_have_semicolons_and_decimal_commas_and_no_gaps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive = tmp_path / "drive.csv"
    written(drive, TIMES[:20], STROKES[:20])
    text, outs = drive.read_text(), [tmp_path / "out.csv", tmp_path / "other.csv"]
    for out, given in zip(outs, (text, text.replace(",", ";").replace(".", ",")), strict=True):
        drive.write_text(given)
        assert main(["simulate", "--drive", str(drive), "--out", str(out), "--no-error-estimate"]) == 0
    assert outs[0].read_bytes() == outs[1].read_bytes()
    for cell, told in (("", "stroke_1_m has no value"), ("x", "stroke_1_m = 'x' is not a number")):
        drive.write_text(re.sub(r"(?m)^0.01,[^,]*", f"0.01,{cell}", text))
        assert main(["simulate", "--drive", str(drive), "--out", str(outs[0])]) == 1
        assert f"line 3: {told}" in capsys.readouterr().err
