"""`mapping --check`: what is wired otherwise in a session, and the mapping that mends it; then nothing is left to mend."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import yaml
from command import answer, main
from recordings import MessageWriter, load_mapping, samples_in_rows, sensor_message, write_session
from session_readings import rows_in

from boom_twin import Stream
from boom_twin.scene.load import default_text

BAGS = Path(__file__).parents[2] / "bags"
G = 9.80665
SECONDS = "24"


class Rows(NamedTuple):
    stamps: np.ndarray
    strokes: np.ndarray
    joints: np.ndarray
    imu: np.ndarray


@pytest.fixture(scope="module")
def rows() -> Rows:
    strokes, joints, imu = (each[::4] for each in rows_in(BAGS / "arch_session")[1:])
    return Rows(10**18 + 20_000_000 * np.arange(len(strokes)), strokes, joints, imu)


def swapped(values: np.ndarray, i: int, j: int) -> np.ndarray:
    order = list(range(values.shape[1]))
    order[i], order[j] = j, i
    return values[:, order]


def scaled(values: np.ndarray, *factors: float) -> np.ndarray:
    return values * np.array(factors)


LONGEST = 0.49  # m, travel of cylinder 4
WIRINGS: dict[str, tuple[Callable[[Rows], Rows], dict[str, Any]]] = {
    "sound": (lambda r: r, {}),
    "encoders swapped": (
        lambda r: r._replace(joints=swapped(r.joints, 1, 3)),
        {"joint_2": {"name": "joint_4"}, "joint_4": {"name": "joint_2"}},
    ),
    "strokes swapped, in mm": (
        lambda r: r._replace(strokes=1e3 * swapped(r.strokes, 0, 2)),
        {
            "cylinder_1": {"name": "cylinder_3", "unit": "mm"},
            "cylinder_2": {"unit": "mm"},
            "cylinder_3": {"name": "cylinder_1", "unit": "mm"},
            "cylinder_4": {"unit": "mm"},
        },
    ),
    "angles in gon, one of the other sign": (
        lambda r: r._replace(joints=scaled(r.joints * 200.0 / np.pi, 1, 1, -1, 1)),
        {f"joint_{i}": {"unit": "gon"} | ({"sign": -1} if i == 3 else {}) for i in range(1, 5)},
    ),
    "a stroke from its far end": (
        lambda r: r._replace(strokes=np.column_stack([r.strokes[:, :3], LONGEST - r.strokes[:, 3]])),
        {"cylinder_4": {"sign": -1, "zero": LONGEST}},
    ),
    "inclinometers at the roots": (
        lambda r: r._replace(joints=np.cumsum(r.joints, axis=1)),
        {f"joint_{i}": {"absolute": "root"} for i in range(2, 5)},
    ),
    "IMU without gravity": (lambda r: r._replace(imu=0.02 * r.imu), {"tip_imu_x": "none", "tip_imu_z": "none"}),
    "IMU in g, its axes swapped": (
        lambda r: r._replace(imu=r.imu[:, ::-1] / G),
        {"tip_imu_x": {"name": "z", "unit": "g"}, "tip_imu_z": {"name": "x", "unit": "g"}},
    ),
}


def written(rows: Rows, path: Path, **more: Any) -> Path:
    write_session(path, rows.stamps, rows.strokes, rows.joints, rows.imu, {"origin": "synthetic, rewired by a test"}, **more)
    return path


def checked(capsys: pytest.CaptureFixture[str], bag: Path, *more: str) -> dict[str, Any]:
    assert main(["mapping", "--check", str(bag), "--duration", SECONDS, *more, "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


@pytest.mark.parametrize("wiring", WIRINGS)
def test_the_mapping_that_is_proposed_mends_the_session(
    wiring: str, rows: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, sensors = WIRINGS[wiring]
    bag, out = written(change(rows), tmp_path / "bag"), tmp_path / "mapping.yaml"
    found = checked(capsys, bag, "--out", str(out))
    assert all(found["sure"]) and out.exists() == bool(sensors)
    if not sensors:
        assert found["mapping"] is None and not any(found["wrong"])
        return
    proposed = yaml.safe_load(out.read_text())["sensors"]
    for channel in proposed.keys() | sensors.keys():  # where on its section an inclinometer is, bending hardly tells
        given, right = proposed.get(channel, {}), sensors.get(channel, {})
        if "none" in (given, right):
            assert given == right
            continue
        assert given.keys() == right.keys()
        assert all(given[key] == pytest.approx(right[key]) for key in right if key != "absolute"), channel
    again = checked(capsys, bag, "--mapping", str(out))
    assert again["mapping"] is None and not any(again["wrong"])


def test_a_session_of_a_node_in_a_namespace(rows: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    values = {Stream.STROKES: rows.strokes, Stream.ANGLES: scaled(rows.joints, 1, 1, -1, 1), Stream.IMU: rows.imu}
    topics = load_mapping().in_namespace("front").inputs
    with MessageWriter(tmp_path / "bag", {stream: topics[stream] for stream in values}) as bag:
        for sample in samples_in_rows(rows.stamps, values):
            bag.write(sample.stream, sample.stamp, sensor_message(sample))
    given = "--namespace", "front"
    assert "joint_3: {sign: -1}" in checked(capsys, tmp_path / "bag", *given)["mapping"]
    told = answer(capsys, "info", str(tmp_path / "bag"), *given)
    assert not told["missing_for_replay"] and "joint_3" in told["wiring"]


def test_a_late_stream_and_its_delay(rows: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    late = rows.stamps + 60_000_000
    bag, out = written(rows, tmp_path / "bag", angle_stamps_ns=late), tmp_path / "mapping.yaml"
    found = checked(capsys, bag, "--out", str(out))
    lags = dict(zip(found["lag_streams"], found["lags_s"], strict=True))
    assert lags["joint_angles"] == pytest.approx(0.06, abs=0.003) and abs(lags["tip_imu"]) < 0.005
    assert yaml.safe_load(out.read_text()) == {"inputs": {"joint_angles": {"delay": "auto"}}}
    late = rows.stamps + 150_000_000  # more than the twin itself finds
    assert "delay: 0.1" in checked(capsys, written(rows, tmp_path / "later", angle_stamps_ns=late))["mapping"]


@pytest.mark.parametrize("stream", [Stream.IMU, Stream.IMU_2])
def test_a_turned_imu_gets_the_turn_of_its_place(
    stream: Stream, rows: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The readings are those of the tip IMU; its axes are turned by 0.52 rad."""
    turned = (rows.imu @ np.array([1.0, 1.0j])) * np.exp(-0.52j)
    readings, own, out = np.column_stack([turned.real, turned.imag]), tmp_path / "own.yaml", tmp_path / "mapping.yaml"
    bag = written(rows._replace(imu=None), tmp_path / "bag", placed={stream: readings})
    place = {"section": 4} if stream is Stream.IMU_2 else {}
    own.write_text(yaml.safe_dump({"inputs": {stream.value: {"place": place}}}))
    found = checked(capsys, bag, "--mapping", str(own), "--out", str(out))
    assert {channel for channel, wrong in zip(found["channels"], found["wrong"], strict=True) if wrong} == {
        f"{stream.value}_x",
        f"{stream.value}_z",
    }
    right = place | {"turned": pytest.approx(0.52, abs=0.02)}
    assert yaml.safe_load(out.read_text()) == {"inputs": {stream.value: {"place": right}}}
    assert not any(checked(capsys, bag, "--mapping", str(out))["wrong"])


def test_a_boom_at_rest_leaves_open_what_it_cannot_tell(rows: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    still = Rows(*(each[:100] for each in rows))
    bag = written(still._replace(joints=scaled(still.joints, 1, 1, -1, 1)), tmp_path / "bag")
    assert main(["mapping", "--check", str(bag)]) == 0
    told = capsys.readouterr().out
    assert "joint_3" in told and "not determined: the boom stood still" in told and "nothing to propose" in told
    assert main(["info", str(bag)]) == 0
    (line,) = (each for each in capsys.readouterr().out.splitlines() if each.startswith("wiring "))
    assert "joint_3 not as declared" in line and f"boom_twin mapping --check {bag}" in line


def test_info_says_of_a_table_what_it_lacks(rows: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Joint 3 has no sensor. Joint 4 reads degrees; then it has none either, and the boom is at rest."""
    columns = [(rows.stamps - rows.stamps[0]) * 1e-9, *rows.strokes.T, *rows.joints.T[:2], np.degrees(rows.joints.T[3])]
    names = ["t_s", *(f"stroke_{i}_m" for i in range(1, 5)), *(f"joint_{i}_rad" for i in (1, 2, 4))]
    told = []
    for used, count in ((8, None), (7, 100)):
        path, table = tmp_path / f"{used}.csv", np.column_stack(columns[:used])[:count]
        np.savetxt(path, table, delimiter=",", header=",".join(names[:used]), comments="")
        assert main(["info", str(path)]) == 0
        told.append(capsys.readouterr().out)
    assert "joint_4: declared as `joint_4, rad`, found `joint_4, deg`" in told[0]
    assert "joint_3 is in no message" in told[1] and "else as expected, as far as a boom at rest shows" in told[1]
    assert "`boom_twin import` makes a session with both" in told[1] and "4 sections" in told[1]


def test_a_session_of_another_boom_is_refused(rows: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fewer = rows._replace(strokes=rows.strokes[:, :2], joints=rows.joints[:, :2])
    assert main(["mapping", "--check", str(written(fewer, tmp_path / "bag"))]) == 1
    assert "no time in which all 4 cylinders" in capsys.readouterr().err
    for option, value in (("--out", "x.yaml"), ("--namespace", "front")):
        assert main(["mapping", option, value]) == 1
        assert f"{option} {value}: only with --check BAG" in capsys.readouterr().err


@pytest.mark.parametrize("has_imu", [True, False])
def test_linkages_of_another_boom_are_no_zeros(
    has_imu: bool, rows: Rows, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Linkages are larger by 15 %: all angles but the first are 8 deg off what the strokes say, and the IMU their sum."""
    scene, other = yaml.safe_load(default_text()), tmp_path / "other.yaml"
    for joint in scene["joints"][1:]:
        joint |= {key: [1.15 * each for each in joint[key]] for key in "RCDE" if key in joint}
        joint |= {key: 1.15 * joint[key] for key in ("lL", "lR")}
        joint["cylinder"] |= {key: 1.15 * joint["cylinder"][key] for key in ("closed_length", "max_stroke")}
    other.write_text(yaml.safe_dump(scene))
    bag = written(rows if has_imu else rows._replace(imu=None), tmp_path / "bag")
    assert main(["mapping", "--check", str(bag), "--scene", str(other)]) == has_imu
    told = capsys.readouterr()
    if has_imu:
        assert "joint_2, joint_3, joint_4 and the IMU agree" in told.err and f"({other}) is of another boom" in told.err
    else:
        assert told.out.count("not determined") == 3 and "nothing to propose" in told.out
