"""What `simulate` says of a drive that is likely meant otherwise, before it simulates it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import strokes_of_posture

from boom_twin import load_scene
from boom_twin.scene.pump_pulses import ease

HEADER = "t_s,stroke_1_m,stroke_2_m,stroke_3_m,stroke_4_m\n"
TIMES = np.arange(0.0, 2.0, 0.01)
STROKES = strokes_of_posture(load_scene(), "arch") + 0.01 * np.sin(np.pi * TIMES)[:, None]


def drive_file(path: Path, times: np.ndarray, strokes: np.ndarray) -> str:
    rows = "\n".join(",".join(map(repr, row)) for row in np.column_stack([times, strokes]).tolist())
    path.write_text(f"{HEADER}{rows}\n", encoding="utf-8")
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
        (1000.0 * TIMES[:4], STROKES[:4], "t_s goes on by 10 s from row to row, 30 s in all"),
    ],
)
def test_a_drive_likely_meant_otherwise_is_told_and_followed(
    times: np.ndarray, strokes: np.ndarray, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = drive_file(tmp_path / "drive.csv", times, strokes)
    given = ["--drive", drive, "--out", str(tmp_path / "out.csv"), "--no-error-estimate", "--dt", "0.01"]
    assert main(["simulate", *given]) == 0
    assert (f"warning: {drive}: {told}" if told else "") in (err := capsys.readouterr().err) and (told or "warning" not in err)


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


def written(path: Path, stem: str, rows: np.ndarray) -> str:
    names = ",".join(f"{stem}_{i + 1}_m" for i in range(rows.shape[1]))
    np.savetxt(
        path, np.column_stack([TIMES[: len(rows)], rows]), fmt="%.12g", delimiter=",", header=f"t_s,{names}", comments=""
    )
    return str(path)


def test_the_lengths_of_a_result_give_the_same_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """They are its last columns; under the names of a session they are lengths too."""
    out, again = tmp_path / "out.csv", tmp_path / "again.csv"
    command = ["simulate", "--posture", "arch", "--no-error-estimate"]
    drive = STROKES[0] + 0.01 * ease(TIMES[:120])[:, None]
    assert main([*command, "--drive", written(tmp_path / "drive.csv", "stroke", drive), "--out", str(out)]) == 0
    moved = columns(out)
    lengths = [f"length_{i}_m" for i in range(1, 5)]
    assert list(moved)[-4:] == lengths and list(moved)[1] == "stroke_1_m"
    session = written(tmp_path / "session.csv", "stroke", np.column_stack([moved[name] for name in lengths]))
    for given in (str(out), session):
        assert main([*command, "--lengths", given, "--out", str(again)]) == 0
        for name, values in columns(again).items():
            off = {"_N": 200.0, "s2": 0.4}.get(name[-2:], 2e-5)  # rows of 10 ms, between which lengths are a cubic
            assert values == pytest.approx(moved[name], abs=off), name
    written(tmp_path / "late.csv", "length", STROKES[:5])
    capsys.readouterr()
    assert main([*command, "--lengths", str(tmp_path / "late.csv"), "--out", str(again)]) == 1
    assert "in the first row at rest: posture arch has" in capsys.readouterr().err


def test_statics_tells_lengths_beside_drives(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["statics", "--posture", "arch", "--json"]) == 0
    at_drives = json.loads(capsys.readouterr().out)
    lengths = ",".join(map(repr, at_drives["length_m"]))
    assert main(["statics", f"--lengths={lengths}", "--json"]) == 0
    at_lengths = json.loads(capsys.readouterr().out)
    keys = ["stroke_m", "length_m", "tip_rigid_m", "tip_m", "joint_rad", "cylinder_force_N", "frequencies_Hz"]
    assert list(at_lengths) == list(at_drives) == keys
    for key in ("stroke_m", "length_m", "tip_m", "joint_rad", "frequencies_Hz"):
        assert at_lengths[key] == pytest.approx(at_drives[key], rel=1e-9), key
    assert main(["statics", f"--lengths={lengths}"]) == 0
    assert "drive m    length m" in capsys.readouterr().out
