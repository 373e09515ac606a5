"""Loggers' files become a session that replays as the rig's own recording would."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from command import main
from loggers.logger_files import SESSION, readings, three_german_files
from recordings import kept, read, scan, write_samples
from ros_messages import stamp_of
from ruamel.yaml import YAML

from boom_twin import Sample, Stream, load_scene, replay, statics
from boom_twin.loggers.assignment import load_columns

STREAMS = {"cylinder_strokes": Stream.STROKES, "joint_angles": Stream.ANGLES, "tip_imu": Stream.IMU}


def recorded(found: dict[str, tuple[np.ndarray, np.ndarray]], folder: Path) -> Path:
    """The session that a recorder would have written of the same readings."""
    samples = [
        Sample(STREAMS[name], stamp, values)
        for name, (stamps, rows) in found.items()
        for stamp, values in zip(stamps.tolist(), rows, strict=True)
    ]
    samples.sort(key=lambda sample: (sample.stamp, [*Stream].index(sample.stream)))
    write_samples(folder, samples, STREAMS.values(), {"origin": "synthetic, a test"})
    return folder


def test_three_german_files_replay_as_the_recording_of_the_same_session(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files, found = three_german_files(tmp_path)
    scene = tmp_path / "boom.yaml"
    scene.write_text(kept(SESSION, "scene", "").text)
    arguments = [*map(str, files), "--out", str(tmp_path / "session"), "--timezone", "Europe/Berlin", "--scene", str(scene)]
    assert main(["import", *arguments]) == 0
    told = capsys.readouterr()
    assert "cylinder_1  Zylinder 1 [mm]     mm    628.8, 628.775, 628.78" in told.out
    assert "zylinder.csv: cp1252, separator ;, decimal comma, header in line 4" in told.err
    assert "winkel.csv: 1001 rows, 20.000 s, 20 empty cells" in told.out and "not used: 'Öltemperatur [°C]'" in told.out
    one = replay(tmp_path / "session", None, tmp_path / "out")
    other = replay(recorded(found, tmp_path / "bag"), scene, tmp_path / "other")
    assert one.session.find("/joint_angles").count == 1001
    assert one.summary["scene"] == f"{tmp_path / 'session' / 'session.yaml'}, scene"
    assert one.summary["events"] == other.summary["events"]
    for name in ("joint_residual_rms_rad", "joint_residual_normalised_std"):
        assert one.summary[name] == pytest.approx(other.summary[name], rel=1e-4)
    a, b = one.columns(), other.columns()
    assert a.keys() == b.keys() and a["t_s"].tolist() == b["t_s"].tolist()
    for name in a:
        if name.startswith("measured_"):
            np.testing.assert_allclose(a[name], b[name], atol=1e-7, err_msg=name)
        if name.startswith("residual_joint"):
            np.testing.assert_allclose(a[name], b[name], atol=1e-6, err_msg=name)
    np.testing.assert_allclose(a["tip_x_m"], b["tip_x_m"], atol=1e-5)
    assert np.isnan(a["measured_joint_2_rad"][200:240]).sum() >= 20 and len(readings(20.0)["tip_imu"][0]) > 3900


STROKES = (628.8, 168.06, 236.075, 187.08)
NAMES = [f"Zylinder {i} [mm]" for i in range(1, 5)]
AT_14 = 1_795_784_602_125_000_000  # 2026-11-27 13:03:22.125 UTC
ROWS = 60
Cells = Callable[[int], list[str]]


def numbers(mark: str = ".", digits: int = 3, factor: float = 1.0) -> Cells:
    return lambda row: [f"{factor * (value + row):.{digits}f}".replace(".", mark) for value in STROKES]


def table(
    head: list[str], time: Callable[[int], str], cells: Cells, separator: str = ";", rows: int = ROWS, end: str = ""
) -> str:
    return "\n".join([*head, *(separator.join([time(row), *cells(row)]) + end for row in range(rows)), ""])


def clock(row: int, mark: str = ".") -> str:
    return f"{22 + (125 + 10 * row) // 1000:02d}{mark}{(125 + 10 * row) % 1000:03d}"


LOGS = Path(__file__).parents[1] / "data" / "loggers"
STYLES = {  # first stamp (ns) and options of made-up files as these programs write them
    "unix_time_in_ms": (AT_14, []),
    "catman": (10**9, []),
    "grouped_header": (10**9, []),
    "matlab": (AT_14, ["--timezone", "UTC"]),
    "excel": (AT_14, ["--timezone", "Europe/Berlin"]),
    "labview": (10**9, []),
    "units_row": (10**9, []),
    "utf-16_without_mark": (AT_14, []),
    "american": (AT_14, ["--timezone", "UTC"]),
    "data_frame": (AT_14, ["--timezone", "UTC"]),
}


def messages(session: Path, topic: str = "cylinder_strokes") -> list[tuple[int, dict[str, float]]]:
    """Stamps (ns) and values by name."""
    found = read(scan(session), {topic: "sensor_msgs/msg/JointState"})
    return [(stamp_of(msg), dict(zip(msg.name, msg.position.tolist(), strict=True))) for _, _, msg in found]


@pytest.mark.parametrize("style", STYLES)
def test_files_of_many_programs_are_read_without_options(tmp_path: Path, style: str) -> None:
    first, options = STYLES[style]
    assert main(["import", str(LOGS / f"{style}.csv"), "--out", str(tmp_path / "s"), *options]) == 0
    found = messages(tmp_path / "s")
    assert [stamp for stamp, _ in found] == [first + 10_000_000 * row for row in range(ROWS)]
    for row, (_, values) in enumerate(found):
        expected = {f"cylinder_{i + 1}": 1e-3 * (value + row) for i, value in enumerate(STROKES)}
        assert values == pytest.approx(expected, abs=1e-8)


def test_a_table_of_simulate_is_imported_by_its_lengths_and_strokes_alone_are_not_called_right(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table has drives and lengths; strokes within their travels were told to be as declared, whatever their order."""
    rest, motion = statics(load_scene(), "arch"), tmp_path / "motion.csv"
    drive = [f"{0.05 * row:g}," + ",".join(f"{stroke:.6f}" for stroke in rest.strokes) for row in range(60)]
    (tmp_path / "drive.csv").write_text("\n".join(["t_s," + ",".join(f"stroke_{i}_m" for i in range(1, 5)), *drive, ""]))
    assert main(["simulate", "--drive", str(tmp_path / "drive.csv"), "--out", str(motion), "--no-error-estimate"]) == 0
    capsys.readouterr()
    assert main(["import", str(motion), "--out", str(tmp_path / "session"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [column for column in told["columns"] if "joint" not in column and "force" not in column] == [
        f"length_{i}_m" for i in range(1, 5)
    ]
    lengths = dict(zip(told["columns"], told["first_values"], strict=True))
    assert [lengths[f"length_{i}_m"] for i in range(1, 5)] == pytest.approx(rest.lengths, abs=1e-5)
    assert main(["import", str(tmp_path / "drive.csv"), "--out", str(tmp_path / "alone")]) == 0
    capsys.readouterr()
    assert main(["mapping", "--check", str(tmp_path / "alone")]) == main(["info", str(tmp_path / "alone")]) == 0
    told = capsys.readouterr().out
    assert "cylinder_1  cylinder_1, m  within the travel" in told and "as declared\n" not in told
    assert told.count("swapped or shifted ones show only beside angles, forces or an IMU") == 2


def test_signals_of_a_bus_come_row_by_row_and_are_one_sample_a_cycle(tmp_path: Path) -> None:
    names = ",".join(f"Boom::CylPos_{i}[mm]" for i in range(1, 5))
    rows = [
        f"{0.01 * cycle + 0.001 * i:.6f},"
        + ",".join(f"{value:.3f}" if i == k else "" for k, value in enumerate(STROKES))
        + ",40"
        for cycle in range(ROWS)
        for i in range(4)
    ]
    (tmp_path / "can.csv").write_text("\n".join(["// export of a CAN trace", f"Time[s],{names},Boom::OilTemp[degC]", *rows]))
    assert main(["import", str(tmp_path / "can.csv"), "--out", str(tmp_path / "s")]) == 0
    assert [list(values) for _, values in messages(tmp_path / "s")[:4]] == [[f"cylinder_{i}"] for i in range(1, 5)]
    done = replay(tmp_path / "s", None, tmp_path / "out", health=False, with_bag=False)
    assert (done.summary["samples"], done.summary["events"]["names apart"]) == (ROWS, 3 * ROWS)


def test_a_proposal_is_edited_and_given_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    head = "t;Lift;" + ";".join(NAMES[1:]) + ";Neigung 2 (deg);Kraft"
    text = table([head], lambda row: f"{0.02 * row:.2f}", numbers(",", 4), end=";41,5;7,0")
    (tmp_path / "log.csv").write_text(text)
    arguments = ["import", str(tmp_path / "log.csv")]
    assert main([*arguments, "--out", str(tmp_path / "s")]) == 1
    assert "no column for cylinder_1. Not used: 'Lift'" in capsys.readouterr().err
    assert main([*arguments, "--propose"]) == 0
    proposed = capsys.readouterr().out
    assert '# CHANNEL: {column: "Neigung 2 (deg)", unit: "deg"' in proposed and "an inclinometer" in proposed
    edited = proposed.replace('# CHANNEL: {column: "Lift", unit: GIVE_ONE', "cylinder_1: {column: Lift, unit: mm")
    edited = edited.replace('# CHANNEL: {column: "Neigung', 'joint_2: {column: "Neigung')
    (tmp_path / "columns.yaml").write_text(edited)
    (tmp_path / "rig.yaml").write_text(
        "sensors: {joint_2: {unit: deg, absolute: root}, cylinder_1: {name: lift, unit: mm, zero: 12.5}}"
    )
    options = [f"--columns={tmp_path / 'columns.yaml'}", f"--mapping={tmp_path / 'rig.yaml'}", f"--out={tmp_path / 's'}"]
    assert main([*arguments, *options]) == 0
    assert messages(tmp_path / "s")[0][1] == pytest.approx(
        {"lift": 628.8, "cylinder_2": 0.16806, "cylinder_3": 0.236075, "cylinder_4": 0.18708}
    )
    assert messages(tmp_path / "s", "joint_angles")[0][1] == {"joint_2": 41.5}
    sensors = YAML(typ="safe").load(kept(tmp_path / "s", "mapping", "").text)["sensors"]
    assert sensors["joint_1"] == "none" and sensors["cylinder_1"]["zero"] == 12.5


def test_rows_that_repeat_or_step_back_keep_their_order_and_stamps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    times = [0.00, 0.01, 0.02, 0.02, 0.01, 0.03, *(0.01 * k for k in range(4, 23)), *(0.01 * k for k in range(-495, -475))]
    rows = iter(times)
    text = table(["Zeit [s];" + ";".join(NAMES)], lambda _: f"{next(rows):.2f}", numbers(",", 4), rows=len(times))
    (tmp_path / "log.csv").write_text(text)
    assert main(["import", str(tmp_path / "log.csv"), "--out", str(tmp_path / "s")]) == 0
    shift = messages(tmp_path / "s")[0][0]
    assert [(stamp - shift) / 1e9 for stamp, _ in messages(tmp_path / "s")] == pytest.approx(times)
    logs = [log for _, log, _ in read(scan(tmp_path / "s"), {"cylinder_strokes": "sensor_msgs/msg/JointState"})]
    assert logs == sorted(logs) and logs[-1] - logs[0] == pytest.approx(0.42e9)
    assert "stamps step back 2 times" in (told := capsys.readouterr().err) and "stamps equal the one before" in told


def test_the_hour_that_comes_twice_in_autumn_is_two_hours(tmp_path: Path) -> None:
    def time(row: int) -> str:
        minute, tenths = ("02:59", 550 + row) if row < 50 else ("02:00", row - 50)  # then it is 02:00 again
        return f"25.10.2026 {minute}:{tenths // 10:02d},{tenths % 10}"

    (tmp_path / "log.csv").write_text(table(["Zeit;" + ";".join(NAMES)], time, numbers(",", 4), rows=100))
    arguments = ["import", str(tmp_path / "log.csv"), "--timezone", "Europe/Berlin", "--out", str(tmp_path / "s")]
    assert main(arguments) == 0
    stamps = np.array([stamp for stamp, _ in messages(tmp_path / "s")])
    assert np.diff(stamps) == pytest.approx(1e8)


HEAD, TIMELESS = ("".join([time, *(f";{name}" for name in NAMES)]) for time in ("Zeit [s]", "Zeit"))


def seconds(row: int) -> str:
    return f"{0.01 * row:.2f}"


GOOD = table([HEAD], seconds, numbers(",", 4))
GROUPED = table([HEAD], seconds, numbers(",", 3))
TIMES = {  # unit, first stamp (ns), time of a row
    "spreadsheet days": ("", AT_14, lambda row: f"{25569 + Decimal(AT_14 + 10_000_000 * row) / (86_400 * 10**9):.12f}"),
    "given days": (" [d]", AT_14, lambda row: f"{25569 + Decimal(AT_14 + 10_000_000 * row) / (86_400 * 10**9):.12f}"),
    "seconds since 1904": (" [s]", AT_14, lambda row: f"{Decimal(AT_14 + 10_000_000 * row) / 10**9 + 2_082_844_800}"),
    "minutes and seconds": (
        "",
        3_599_500_000_000,
        lambda row: f"{(59 + (595 + row) // 600) % 60:02d}:{(59.5 + 0.1 * row) % 60:06.3f}",
    ),
}


@pytest.mark.parametrize("style", TIMES)
def test_times_of_spreadsheets_and_labview(tmp_path: Path, style: str) -> None:
    unit, first, time = TIMES[style]
    (tmp_path / "log.csv").write_text(table([TIMELESS.replace("Zeit", f"Zeit{unit}")], time, numbers(digits=4)))
    options = ["--timezone", "UTC", "--out", str(tmp_path / "s")]
    assert main(["import", str(tmp_path / "log.csv"), *options]) == 0
    stamps = np.array([stamp for stamp, _ in messages(tmp_path / "s")])
    assert stamps[0] == pytest.approx(first, abs=1e5)
    assert np.diff(stamps) == pytest.approx(1e7 if first == AT_14 else 1e8, abs=1e5)


FAULTS = {
    "a word": (GOOD.replace("\n0.30;658,8000", "\n0.30;OVL"), "line 32: Zylinder 1 [mm] = 'OVL' is not a number"),
    "a word as time": (GOOD.replace("\n0.30;", "\nPause;"), "line 32: Zeit [s] = 'Pause' is not a time"),
    "decimal commas between commas": (GOOD.replace(";", ","), "9 cells, and the header has 5 names"),
    "thousands or decimals": (GROUPED, "the comma in '628,800' is a separator of thousands or a decimal mark, beside '0.00'"),
    "grouped or not": (GOOD.replace("658,8000", "1.250"), "'1.250' is a separator of thousands or a decimal mark"),
    "no unit": (GOOD.replace(" [mm]", ""), "cylinder_1: no unit is given ('Zylinder 1' of"),
    "unknown unit": (GOOD.replace("[mm]", "[inkr]"), "unit inkr, not m, cm, mm, um, in)"),
    "two for one": (GOOD.replace("Zylinder 4", "Hub 3"), "cylinder_3: it may be 'Hub 3 [mm]' of"),
    "equal names": (GOOD.replace("Zylinder 4", "Zylinder 3"), "\n  cylinder_3: several columns 'Zylinder 3 [mm]' of"),
    "one is missing": (GOOD.replace("Zylinder 3", "Kran"), "no column for cylinder_3. Not used: 'Kran [mm]'"),
    "two times": (GOOD.replace("Zylinder 4 [mm]", "Zeit [s]"), "several columns 'Zeit [s]'"),
    "no header": (GOOD.partition("\n")[2], "numbers stand in its first line"),
    "numbers above": ("\n".join([*GOOD.splitlines()[1:20], GOOD]), "rows of numbers stand above the header in line 20. Cut"),
    "no table": ("nothing\nto see", "no table found. The file begins with 'nothing'"),
    "a gyro": (
        "\n".join(f"{row};{'0,1' if k else 'tip_imu_rate'}" for k, row in enumerate(GOOD.splitlines())),
        "tip_imu_rate: has no topic.",
    ),
    "no time": (GOOD.replace("Zeit", "Nr"), "no column of times among"),
    "ms or s": (table([TIMELESS], lambda row: f"{0.15 * row:.2f}", numbers(",", 4)), "the times may be in s or ms"),
    "some times with an offset": (
        table([TIMELESS], lambda row: f"2026-04-03 10:00:{clock(row)}{'+02:00' * (row < 30)}", numbers(",", 4)),
        "line 32: Zeit = '2026-04-03 10:00:22.425' and '2026-04-03 10:00:22.125+02:00': only one of them has an offset",
    ),
    "day or month": (table([TIMELESS], lambda row: f"03/04/2026 10:00:{clock(row)}", numbers(",", 4)), "or month/day"),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_what_cannot_be_known_is_refused_with_its_place(tmp_path: Path, fault: str, capsys: pytest.CaptureFixture[str]) -> None:
    text, words = FAULTS[fault]
    (tmp_path / "log.csv").write_text(text)
    assert main(["import", str(tmp_path / "log.csv"), "--out", str(tmp_path / "s")]) == 1
    assert words in capsys.readouterr().err and not (tmp_path / "s").exists()


def test_a_proposal_asks_for_a_column_of_times_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "log.csv").write_text("cylinder_1 [mm];cylinder_2 [mm]\n1,5;2,5\n1,6;2,6\n")
    assert main(["import", str(tmp_path / "log.csv"), "--propose"]) == 0
    assert '  - {column: "GIVE_ONE", file: "log.csv"}' in capsys.readouterr().out


LINES = GOOD.splitlines()
BETWEEN = {  # lines of files, and how many of them are no readings
    "a comment": ([*LINES[:40], "pump on", *LINES[40:]], 1),
    "a header": ([*LINES[:20], LINES[0], *LINES[20:50], "#EOF", LINES[0], *LINES[50:]], 3),
    "a trailer": ([*LINES, "End of file"], 1),
    "a power cut": ([*LINES[:40], "\0" * 900, *LINES[40:]], 1),
    "channel numbers": ([HEAD.replace(" [mm]", ""), "1;2;3;4;5", "s;mm;mm;mm;mm", *LINES[1:]], 0),
}  # fmt: skip


@pytest.mark.parametrize("between", BETWEEN)
def test_lines_between_the_readings_cost_no_reading_and_are_told(
    tmp_path: Path, between: str, capsys: pytest.CaptureFixture[str]
) -> None:
    lines, count = BETWEEN[between]
    (tmp_path / "log.csv").write_text("\n".join([*lines, ""]))
    assert main(["import", str(tmp_path / "log.csv"), "--out", str(tmp_path / "s")]) == 0
    told = capsys.readouterr()
    assert f"log.csv: {ROWS} rows, 0.590 s;" in told.out and ("lines left out" in told.err) == bool(count)
    assert not count or f"repeated headers or NULs: {count}, the first is line " in told.err


@pytest.mark.parametrize("second", [LINES[0].replace("4", "5"), LINES[0] + ";Winkel 1 [deg];Winkel 2 [deg]"])
def test_blocks_of_other_columns_are_refused_with_the_line(
    tmp_path: Path, second: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "log.csv").write_text("\n".join([*LINES[:20], second, *LINES[20:], ""]))
    assert main(["import", str(tmp_path / "log.csv"), "--out", str(tmp_path / "s")]) == 1
    assert "log.csv, line 21: another header, 'Zeit [s];Zylinder 1" in capsys.readouterr().err


def test_files_without_a_common_time_and_parts_of_one_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    angles = table(["Zeit [s];Winkel 1 [deg]"], lambda row: f"{100 + 0.01 * row:.2f}", lambda _: ["1"])
    second = table([HEAD], lambda row: f"{0.6 + 0.01 * row:.2f}", numbers(",", 4))
    for name, text in (("a", GOOD), ("b", second), ("late", angles)):
        (tmp_path / f"{name}.csv").write_text(text)
    a, b, late = (str(tmp_path / f"{name}.csv") for name in ("a", "b", "late"))
    out = ["--out", str(tmp_path / "s")]
    assert main(["import", a, late, *out]) == 1
    assert "late.csv: 100 to 100.59 s: no time in common with the strokes" in capsys.readouterr().err
    assert main(["import", a, a, *out]) == 1
    assert " overlap. Leave one out" in capsys.readouterr().err
    (tmp_path / "b.csv").write_text(second + "1.20;62")  # the logger was switched off
    assert main(["import", b, a, *out, "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["counts"] == [2 * ROWS] and "line 62 was cut off (2 of 5 cells) and is left out" in told.err
    (tmp_path / "b.csv").write_text(second + "\0" * 900)  # the power was cut
    assert main(["import", str(tmp_path / "b.csv"), "--out", str(tmp_path / "t")]) == 0
    assert "line 62 was cut off (1 of 5 cells) and is left out" in capsys.readouterr().err


def write_parquet(path: Path, times: np.ndarray, values: np.ndarray) -> None:
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    frame = pandas.DataFrame(
        {f"Zylinder {i + 1} [mm]": values[:, i] for i in range(4)}, index=pandas.DatetimeIndex(times, tz="UTC")
    )
    frame.tz_convert("Europe/Berlin").rename_axis("Zeit").to_parquet(path)


def test_a_parquet_file_gives_the_same_session(tmp_path: Path) -> None:
    times = np.datetime64(AT_14, "ns") + np.arange(ROWS) * np.timedelta64(10_000_000, "ns")
    write_parquet(tmp_path / "log.parquet", times, np.array(STROKES) + np.arange(ROWS)[:, None])
    assert main(["import", str(tmp_path / "log.parquet"), "--out", str(tmp_path / "s")]) == 0
    for row, (stamp, values) in enumerate(messages(tmp_path / "s")):
        assert stamp == AT_14 + 10_000_000 * row
        assert list(values.values()) == pytest.approx([1e-3 * (value + row) for value in STROKES], abs=1e-12)


def test_a_damaged_parquet_file_is_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "log.parquet"
    write_parquet(path, np.datetime64(AT_14, "ns") + np.arange(ROWS), np.ones((ROWS, 4)))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3] + b"\xff" * 40)
    assert main(["import", str(path), "--out", str(tmp_path / "s")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{path}: cannot be read (" in line and "Export it as CSV." in line


def test_the_columns_file_of_the_page_is_one_and_faults_are_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = (Path(__file__).parents[2] / "docs" / "import.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "columns.yaml").write_text(block)
    assert load_columns(tmp_path / "columns.yaml").columns["joint_1"].file == "winkel*.csv"
    (tmp_path / "log.csv").write_text(GOOD)
    (tmp_path / "wrong.yaml").write_text("columns: {cylinder_1: {column: a, unit: furlong}, boom: {column: b}}")
    assert main(["import", str(tmp_path / "log.csv"), "--columns", str(tmp_path / "wrong.yaml"), "--propose"]) == 1
    told = capsys.readouterr().err
    assert "2 faults" in told and "columns.cylinder_1.unit = 'furlong': it must be one of m, cm" in told
    assert main(["import", str(tmp_path / "log.csv"), "--column", "cylinder_1=Zylindr 1 [mm]", "--propose"]) == 1
    assert "no column 'Zylindr 1 [mm]'. Did you mean 'Zylinder 1 [mm]'?" in capsys.readouterr().err
