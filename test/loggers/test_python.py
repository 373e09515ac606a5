"""Readings from Python, without ROS and without files: tables, samples by name, sessions of a live source."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from loggers.logger_files import readings
from recordings import scan

from boom_twin import (
    BagError,
    BoomTwinError,
    Sample,
    SessionWriter,
    Settings,
    Stream,
    TimeWindow,
    Twin,
    UsageError,
    load_scene,
    replay,
    statics,
)

Rows = list[tuple[int, dict[str, np.ndarray]]]
MAPPING = """
sensors:
  cylinder_1: {name: lift, unit: mm, zero: 1012.5, sign: -1}
  joint_2: {unit: deg, scale: 2.0}
  tip_imu_x: {name: y, unit: g}
inputs:
  joint_angles: {delay: 0.02}
"""


@pytest.fixture(scope="module")
def rows() -> Rows:
    """Stamps (ns) and readings by stream of the first seconds of the bundled session."""
    found = readings(3.0)
    stamps = found["cylinder_strokes"][0].tolist()
    return [(stamp, {name: values[row] for name, (_, values) in found.items()}) for row, stamp in enumerate(stamps)]


def columns_of(rows: Rows) -> dict[str, np.ndarray]:
    stems = {"cylinder_strokes": "cylinder_{}", "joint_angles": "joint_{}", "tip_imu": "tip_imu_{}"}
    table: dict[str, Any] = {"stamp_ns": np.array([stamp for stamp, _ in rows])}
    for name, stem in stems.items():
        for i in range(len(rows[0][1][name])):
            table[stem.format("xz"[i] if name == "tip_imu" else i + 1)] = np.array([values[name][i] for _, values in rows])
    return table


@pytest.fixture(scope="module")
def expected(rows: Rows) -> np.ndarray:
    """Tip by a twin that is given one sample after the other."""
    twin, tips = Twin(load_scene()), []
    for stamp, values in rows:
        reports = [
            twin.update(Sample(stream, stamp, values[stream.value])) for stream in (Stream.STROKES, Stream.ANGLES, Stream.IMU)
        ]
        tips.append(reports[0].prediction.tip_position)
    return np.array(tips)


def test_readings_by_name_give_what_samples_give(rows: Rows, expected: np.ndarray) -> None:
    twin = Twin(load_scene())
    reports = []
    for stamp, values in rows:
        strokes = {f"cylinder_{i + 1}": value for i, value in enumerate(values["cylinder_strokes"])}
        others = {name: values[name] for name in ("joint_angles", "tip_imu")}
        reports.append(twin.update(strokes | others, stamp_ns=stamp))
    assert np.array([report.prediction.tip_position for report in reports]).tolist() == expected.tolist()
    assert [part.stream for part in reports[-1].residuals] == [Stream.STROKES, Stream.ANGLES, Stream.IMU]
    assert all(report.accepted and report.status == "ok" for report in reports)


def test_a_table_is_replayed_and_kept_as_a_session(rows: Rows, expected: np.ndarray, tmp_path: Path) -> None:
    done = replay(columns_of(rows), load_scene(), tmp_path / "out", health=False)
    assert np.column_stack([done.columns()[f"tip_{axis}_m"] for axis in "xy"]) == pytest.approx(expected, abs=1e-12)
    assert done.session.path == tmp_path / "out" / "session" and scan(done.session.path).topics == done.session.topics
    again = replay(columns_of(rows), load_scene(), tmp_path / "out", health=False)
    assert again.summary["output_sha256"] == done.summary["output_sha256"]


def test_a_data_frame_with_units_and_an_index_of_times(rows: Rows, expected: np.ndarray, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    table = columns_of(rows)
    times = pandas.DatetimeIndex(table["stamp_ns"].astype("datetime64[ns]"), tz="UTC").tz_convert("Europe/Berlin")
    frame = pandas.DataFrame({f"Zylinder {i} [mm]": 1e3 * table[f"cylinder_{i}"] for i in range(1, 5)}, index=times)
    frame.iloc[50:60, 1] = None
    done = replay(frame, None, tmp_path / "out", health=False, with_bag=False)
    assert done.summary["samples"] == len(rows) and done.summary["events"] == {"not finite": 10, "partial": 10}
    assert done.columns()["tip_x_m"][:50] == pytest.approx(expected[:50, 0], abs=1e-9)


def test_a_session_writer_writes_what_a_replay_takes(
    rows: Rows, expected: np.ndarray, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rig.yaml").write_text(MAPPING)
    with SessionWriter(tmp_path / "s", load_scene(), tmp_path / "rig.yaml", origin="synthetic, a test") as session:
        for stamp, values in rows:
            session.write(Sample(Stream.STROKES, stamp, values["cylinder_strokes"]))
            session.write({name: values[name] for name in ("joint_angles", "tip_imu")}, stamp_ns=stamp)
    assert main(["info", str(tmp_path / "s")]) == 0
    assert "replay     nothing is missing" in capsys.readouterr().out
    done = replay(tmp_path / "s", None, tmp_path / "out", health=False, with_bag=False)
    assert done.summary["events"] == {} and not done.session.incomplete
    columns = done.columns()
    assert np.column_stack([columns["tip_x_m"], columns["tip_y_m"]]) == pytest.approx(expected, abs=1e-8)
    measured = [columns[f"measured_{name}"] for name in ("joint_2_rad", "tip_imu_x_m_s2")]
    assert measured[0] == pytest.approx([values["joint_angles"][1] for _, values in rows], abs=1e-12)
    assert measured[1] == pytest.approx([values["tip_imu"][0] for _, values in rows], abs=1e-12)


def test_a_session_whose_source_failed_is_said_to_be_incomplete(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ZeroDivisionError), SessionWriter(tmp_path / "s") as session:
        session.write({"cylinder_strokes": statics(load_scene(), "arch").strokes}, stamp_ns=10**9)
        raise ZeroDivisionError
    assert main(["info", str(tmp_path / "s")]) == 0
    assert "incomplete: the recorder was ended by force" in capsys.readouterr().out
    assert scan(tmp_path / "s").find("cylinder_strokes").count == 1
    with pytest.raises(BagError, match="nothing is overwritten"):
        SessionWriter(tmp_path / "s")


def update(given: Mapping[str, Any], stamp: Any = 1) -> Callable[[], Any]:
    return lambda: Twin(load_scene()).update(given, stamp_ns=stamp)


MISUSES: dict[str, tuple[Callable[[], Any], str]] = {
    "name": (update({"cylnder_1": 0.6}), "'cylnder_1': no channel of this boom, which has 4 joints. Did you mean cylinder_1?"),
    "number": (update({"cylinder_5": 0.6}), "'cylinder_5': no channel of this boom"),
    "unit": (update({"cylinder_strokes": [628.8, 168.0, 236.0, 187.0]}), "all above 20 m. Give SI units: m."),
    "shape": (update({"joint_angles": [1.0, 2.0]}), "joint_angles: shape (2,), and this boom has 4 channels there"),
    "array": (update({"joint_1": [1.0, 2.0]}), "joint_1: shape (2,). Give one number"),
    "text": (update({"joint_1": "1,5"}), "joint_1 is '1,5'. Give a number, NaN where there is none."),
    "no stamp": (update({"joint_1": 1.5}, None), "stamp_ns is not given."),
    "seconds": (update({"joint_1": 1.5}, 1.5), "give a whole number of nanoseconds"),
    "no sample": (lambda: Twin().update(3), "sample is 3. Give Sample(Stream.STROKES, stamp_ns"),  # type: ignore[arg-type]
    "settings": (lambda: Twin(None, {"health": False}), "give Settings(name=value, ..)"),  # type: ignore[arg-type]
    "setting": (lambda: Settings(gap=-1.0), "Settings: gap = -1.0: Input should be greater than or equal to"),
    "unknown setting": (lambda: Settings(gpa=1.0), "gpa = 1.0: unknown. The nearest is `gap`"),  # type: ignore[call-arg]
    "sensor": (lambda: Twin().rezero("joint_9"), "'joint_9': no sensor of this boom. Give tip_imu, or one of cylinder_1,"),
    "start": (lambda: TimeWindow(float("nan"), 2.0), "start = nan: must be a number of seconds, at least 0."),
    "duration": (lambda: TimeWindow(0.0, -1.0), "duration = -1.0: must be a number of seconds, at least 0."),
}


@pytest.mark.parametrize("misuse", MISUSES)
def test_misuse_of_the_api_is_told_with_its_remedy(misuse: str) -> None:
    call, words = MISUSES[misuse]
    with pytest.raises(UsageError) as error:
        call()
    assert words in str(error.value)


def test_a_session_writer_refuses_what_no_replay_would_read(rows: Rows, tmp_path: Path) -> None:
    lengths = rows[0][1]["cylinder_strokes"]
    with SessionWriter(tmp_path / "s") as session:
        session.write(Sample(Stream.STROKES, np.int64(10**9), lengths))  # type: ignore[arg-type]
        for stamp, values in ((0, lengths), (2**61, lengths), (1.5, lengths), (2 * 10**9, lengths[:2])):
            with pytest.raises(UsageError, match=r"[Gg]ive"):
                session.write(Sample(Stream.STROKES, stamp, values))
    assert scan(tmp_path / "s").find("cylinder_strokes").count == 1
    with pytest.raises(UsageError, match="the session is closed"):
        session.write(Sample(Stream.STROKES, 2 * 10**9, lengths))


TABLES: dict[str, tuple[Callable[[dict[str, np.ndarray]], Any], str]] = {
    "no table": (lambda table: 5, "int is no table. Give a path, a data frame, or a dict of arrays"),
    "lengths": (lambda table: {**table, "joint_1": table["joint_1"][1:]}, "columns of different lengths"),
    "shape": (lambda table: {**table, "joint_1": np.zeros((3, 2))}, "joint_1 has shape (3, 2). Give one number for each time"),
    "texts": (lambda table: {**table, "joint_1": np.array(["a"] * len(table["joint_1"]))}, "joint_1 holds <U1, as ['a']"),
    "no time": (lambda table: {k: v for k, v in table.items() if k != "stamp_ns"}, "no column of times among cylinder_1"),
    "missing": (lambda table: {k.replace("cylinder_3", "cylnder_3"): v for k, v in table.items()}, "as 'cylnder_3 [m]'"),
}


@pytest.mark.parametrize("fault", TABLES)
def test_tables_that_cannot_be_read_are_refused(fault: str, rows: Rows, tmp_path: Path) -> None:
    change, words = TABLES[fault]
    with pytest.raises(BoomTwinError) as error:
        replay(change(columns_of(rows)), None, tmp_path / "out")
    assert words in str(error.value) and not (tmp_path / "out").exists()


def test_a_rig_with_encoders_alone_replays_from_a_table(rows: Rows, tmp_path: Path) -> None:
    mapping = tmp_path / "rig.yaml"
    mapping.write_text("drive: angles\n")
    columns = {name: column for name, column in columns_of(rows).items() if not name.startswith("cylinder")}
    found = replay(columns, load_scene(), tmp_path / "out", mapping=mapping, with_bag=False)
    assert found.summary["strokes"] == "angle" and found.summary["samples"] > 0
    with pytest.raises(BagError, match="a mapping with `drive: angles` needs all angles instead"):
        replay(columns, load_scene(), tmp_path / "other", with_bag=False)
