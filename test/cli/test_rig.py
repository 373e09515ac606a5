"""``boom_twin rig``: sessions of wrong and faulty booms, and that they can be replayed."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drive_twin import ARCH_DRIVES
from ruamel.yaml import YAML

pytest.importorskip("exudyn")

from command import answer, main
from default_boom import anew
from oracle import booms
from recordings import read, scan

STIFFNESS = 2.0e6  # N/m


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One rigid section on an oil spring."""
    path = tmp_path_factory.mktemp("scene") / "one.yaml"
    path.write_text(anew(booms.scene_of(booms.one_rigid(k=STIFFNESS))))
    return path


def made(scene: Path, out: Path, *more: str) -> Path:
    assert main(["rig", str(scene), "--out", str(out), "--random", "up", "--duration", "3", *more]) == 0
    return out


def replayed(scene: Path, bag: Path) -> dict[str, Any]:
    assert main(["replay", str(bag), "--scene", str(scene), "--out", f"{bag}_out"]) == 0
    return dict(json.loads(Path(f"{bag}_out", "summary.json").read_text()))


@pytest.fixture(scope="module")
def healthy(scene: Path) -> tuple[Path, dict[str, Any]]:
    """A session without faults and loads, and the summary of its replay."""
    bag = made(scene, scene.with_name("healthy"))
    return bag, replayed(scene, bag)


def test_faulty_sessions_replay(scene: Path, healthy: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    faults = ["--fault", "cylinder_1.k:softer:0.5", "--fault", "joint_1.sensor:bias:0.01@1", "--fault"]
    bag = made(scene, tmp_path / "faulty", *faults, "joint_angles.delay:late:0.02@2")
    notes = scan(bag).notes
    assert notes["faults"] == "cylinder_1.k:softer:0.5, joint_1.sensor:bias:0.01@1, joint_angles.delay:late:0.02@2"
    assert "synthetic" in notes["origin"] and "wrong" not in notes
    faulty, (_, sound) = replayed(scene, bag), healthy
    assert faulty["samples"] == sound["samples"]
    assert sound["joint_residual_rms_rad"][0] < 3e-4
    assert faulty["joint_residual_rms_rad"][0] == pytest.approx(0.01 * np.sqrt(2 / 3), rel=0.2)


def test_sessions_of_lengths_and_of_drives_are_told(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = made(scene, tmp_path / "bag", "--fault", "cylinder_1.drive:drift:0.002@1")
    assert YAML(typ="safe").load((bag / "session.yaml").read_text())["strokes"] == "length"
    drives = tmp_path / "drives.yaml"
    drives.write_text("inputs: {cylinder_strokes: {reads: drive}}\n")
    for session, more, reading in ((bag, [], "length"), (bag, ["--mapping", str(drives)], "drive"), (ARCH_DRIVES, [], "drive")):
        assert answer(capsys, "info", str(session), *more)["strokes"] == reading
        assert main(["info", str(session), *more]) == 0
        assert f"strokes    are {reading}s of the cylinders (" in capsys.readouterr().out
    assert replayed(scene, bag)["strokes"] == "length"
    truth = np.genfromtxt(bag / "truth.csv.gz", delimiter=",", names=True)
    assert truth["drive_1_m"][-1] - truth["drive_1_m"][0] == pytest.approx(0.002 * (truth["t_s"][-1] - 1.0), abs=1e-6)
    extension = truth["cylinder_force_1_N"] / STIFFNESS
    assert truth["length_1_m"] - truth["drive_1_m"] == pytest.approx(extension, abs=2e-7)


def test_a_load_that_no_twin_knows(scene: Path, healthy: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    loads = ["--load", "pump:0.5:400@0.5", "--load", "wind:20"]
    bag = made(scene, tmp_path / "shaken", *loads, "--rate", "500", "--fault", "tip.payload:more:5@1+0.5..2")
    notes = scan(bag).notes
    assert notes["loads"] == "at the tip, wind seed 0: pump:0.5:400:0.1@0.5, wind:20:5" and notes["rate"] == "500 Hz"
    assert notes["faults"] == "tip.payload:more:5@1+0.5..2"
    truth, still = (np.genfromtxt(each / "truth.csv.gz", delimiter=",", names=True) for each in (bag, healthy[0]))
    assert len(truth) == 1500 and "tip_load_y_N" not in still.dtype.names
    assert truth["tip_load_y_N"].max() == pytest.approx(400.0, abs=1.0) and np.abs(truth["tip_load_x_N"]).max() > 1.0
    assert replayed(scene, bag)["tip_load_rms_N"] > 2.0 * healthy[1]["tip_load_rms_N"]


def test_only_the_sensors_that_are_asked_for(scene: Path, tmp_path: Path) -> None:
    bag = made(scene, tmp_path / "forces", "--sensors", "forces,angles", "--wrong", "0.1", "--rig-seed", "3")
    assert scan(bag).notes["wrong"] == "k, d, EI and masses off by 0.1, rig seed 3" and "faults" not in scan(bag).notes
    assert [topic.name for topic in scan(bag).topics] == ["/cylinder_forces", "/cylinder_strokes", "/joint_angles"]
    assert scan(bag).notes["forces"] == "noise 100 N, resolution 20 N"
    rows = replayed(scene, bag)
    assert rows["alarms"] == [] and rows["dropped"] == 0
    kept = read(scan(bag.with_name("forces_out") / "bag"), {"/boom_twin/residuals": "sensor_msgs/msg/JointState"})
    ratios = [msg.velocity[0] for _, _, msg in kept if msg.name == ["cylinder_force_1"]]
    assert len(ratios) == 600 and 0.7 < np.std(ratios) < 1.4


def test_no_recording_is_written_over(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = tmp_path / "bag"
    bag.mkdir()
    for name in ("session_0.mcap", "metadata.yaml", "session.yaml", "truth.csv.gz"):
        (bag / name).write_bytes(b"recorded")
    link, notes = scene.with_name("link.csv"), scene.with_name("notes.csv")
    link.symlink_to(bag / "session_0.mcap")
    notes.write_text("t_s,stroke_1_m\n0,0.5\n")
    simulate = ["simulate", str(scene), "--posture", "up", "--drive", "x.csv", "--out"]
    commands = [
        [*simulate, str(link)],
        [*simulate, str(notes)],
        ["rig", str(scene), "--random", "up", "--out", str(bag)],
        ["recover", str(bag), "--out", str(bag)],
        ["replay", str(scene), "--out", str(bag)],
        ["calibrate", str(bag), "--out", str(bag / "metadata.yaml"), "--force"],
        ["simulate", str(scene), "--posture", "up", "--drive", "x.csv", "--out", str(bag / "session_0.mcap")],
        ["simulate", str(scene), "--posture", "up", "--drive", str(scene), "--out", str(scene)],
    ]
    before = scene.read_bytes()
    for command in commands:
        assert main(command) == 1
        words = capsys.readouterr().err
        reasons = "metadata.yaml already|source|file of a recording|this file is read|no earlier result|only an earlier result"
        assert re.search(reasons, words), (command, words)
    assert {path.name: path.read_bytes() for path in bag.iterdir()} == dict.fromkeys(
        ("session_0.mcap", "metadata.yaml", "session.yaml", "truth.csv.gz"), b"recorded"
    )
    assert notes.read_text() == "t_s,stroke_1_m\n0,0.5\n"
    assert scene.read_bytes() == before and [path.name for path in tmp_path.iterdir()] == ["bag"]


def test_further_sensors_are_recorded_with_the_mapping_that_places_them(scene: Path) -> None:
    placed = "imu@1:1.5:0.5236,gyro@1:1.5:0.5236,point@1:3.0"
    more = ["--sensors", f"angles,imu,gyro,{placed}", "--pressures", "0.12:0.07"]
    bag = made(scene, scene.with_name("placed"), *more)
    summary = replayed(scene, bag)
    rows = [
        message
        for _, _, message in read(scan(Path(f"{bag}_out", "bag")), {"/boom_twin/residuals": "sensor_msgs/msg/JointState"})
    ]
    groups: dict[tuple[str, ...], list[Any]] = {}
    for message in rows:
        groups.setdefault(tuple(message.name), []).append(message.velocity)
    wanted = {("tip_imu_rate",): 600, ("imu_2_x", "imu_2_z"): 600, ("imu_2_rate",): 600, ("points_x", "points_z"): 3}
    assert {names: len(groups[names]) for names in wanted} == wanted
    assert len(groups["cylinder_force_1",]) == 600, "by pressures"
    for names, ratios in groups.items():
        assert np.sqrt(np.nanmean(np.square(ratios))) < 2.5, names
    assert summary["alarms"] == []


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--load", "wind:15@3"], "begins at 3 s, must be before the end at 3 s."),
        (["--fault", "joint_2.sensor:stuck"], "the boom has joints, cylinders and sections 1 to 1."),
        (["--rate", "20"], "rate = 20, must be from 50 to 1000 Hz"),
        (["--sensors", "imu@2:1.0"], "the boom has sections 1 to 1"),
        (["--sensors", "angles,imu@1:4"], "section 1 reaches from 0 to 3 m"),
        (["--sensors", "moment@1:1.0"], "section 1 is rigid; strain is read on a beam only"),
        (["--sensors", "point@1:1,point@1:2,point@1:3"], "at most 2 of this kind are possible on a boom"),
        (["--pressures"], "not every cylinder of the scene has `oil"),
        (["--pressures", "0.1:0.07", "--sensors", "forces"], "Leave forces out of --sensors"),
    ],
)
def test_what_cannot_be_is_told_before_anything_is_simulated(
    scene: Path, options: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["rig", str(scene), "--out", str(scene.with_name("never")), "--random", "up", "--duration", "3", *options]) == 1
    assert told in capsys.readouterr().err and not scene.with_name("never").exists()


def test_an_interrupt_while_exudyn_steps_stops_without_a_traceback(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupt(_: object, row: int) -> None:
        if row > 0:
            raise KeyboardInterrupt

    monkeypatch.setattr("boom_twin.validation.rig.stepping.ParameterChanges.hand_over", interrupt)
    assert main(["rig", str(scene), "--out", str(tmp_path / "rig"), "--random", "up", "--duration", "3"]) == 1
    assert capsys.readouterr().err.endswith("boom_twin rig: stopped\n")
    assert not (tmp_path / "rig").exists()
