"""Sessions as sqlite3, ROS 1 bag and CSV: the same samples as from MCAP, the same replay, clear refusals; nothing written."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from gate_sessions import write, write_csv
from recordings import Session, read_both, recover, scan
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_typestore

from boom_twin import BagError, TimeWindow, replay
from boom_twin.batch.folder import sessions_of

Content = Callable[[Session], list[tuple[Any, ...]]]
JAZZY, NOETIC = get_typestore(Stores.ROS2_JAZZY), get_typestore(Stores.ROS1_NOETIC)
KINDS = ("db3", "db3 file", "ros1", "ros1 bz2", "ros1 lz4")


def messages(session: Session) -> list[tuple[str, int, bytes, Any]]:
    return list(read_both(session, {topic.name: topic.type for topic in session.topics}))


def stored(source: Path, kind: str, out: Path) -> Path:
    """The session at `source` in another storage, written by rosbags."""
    session = scan(source)
    types = {topic.name: topic.type for topic in session.topics}
    if kind.startswith("db3"):
        write(out / "two", types, [row[:3] for row in messages(session)], StoragePlugin.SQLITE3)
        return out / "two" / "two.db3" if kind == "db3 file" else out / "two"
    writer = Ros1Writer(out / "one.bag")
    if kind != "ros1":
        writer.set_compression(Ros1Writer.CompressionFormat[kind.split()[1].upper()])
    with writer as old:
        one = {name: old.add_connection(name, kind, typestore=NOETIC) for name, kind in types.items()}
        for name, time, data, _ in messages(session):
            old.write(one[name], time, JAZZY.cdr_to_ros1(data, types[name]))
    return out / "one.bag"


@pytest.mark.parametrize("kind", KINDS)
def test_every_message_is_read_as_from_mcap(bag: Path, tmp_path: Path, content: Content, kind: str) -> None:
    other = stored(bag, kind, tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    session = scan(other)
    assert content(session) == content(scan(bag))
    assert session.topics == scan(bag).topics
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_csv_is_read_as_the_samples_that_it_holds(bag: Path, tmp_path: Path, content: Content) -> None:
    write_csv(bag, tmp_path / "s.csv")
    assert content(scan(tmp_path / "s.csv")) == content(scan(bag))


CSV = "t_s,stroke_1_m,stroke_2_m,joint_1_rad\n0,0.1,0.2,0.3\n0.1,0.1,0.2,\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no table found"),
        (CSV.replace("joint_1_rad", "wind_m_s"), "no channel's name is in it. Take it out. `boom_twin import` reads files"),
        (CSV.replace("joint_1_rad", "stroke_2_m"), "one of several columns that may be cylinder_2"),
        (CSV.replace("0.1,0.1", "0.1,x"), "line 3: stroke_1_m = 'x' is not a number"),
        (CSV.replace("0.1,0.2,\n", "0.1,0."), "line 3 was cut off (3 of 4 cells)"),
        (CSV.replace("\n0.1,", "\n1700000000000,"), "t_s goes beyond 2.147e+09 s: not in s"),
        (CSV.replace("\n0.1,", "\nnan,"), "line 3: t_s = 'nan' is not a time"),
        ("t_s,stroke_1_m\n" + "".join(f"{5 * k},0.1\n" for k in range(30)), "by 5 s from row to row: t_s in seconds is needed"),
        (CSV.replace("t_s,", "date,").replace("\n0", "\n2026-01-01 00:00:00"), "local date and time"),
        (CSV.replace("joint_1_rad", "joint_3_rad"), "no column for cylinder_3"),
        ("t_s,stroke_1_m\n0,0.1\n0.1,0.1" + " " * 70_000 + "\n", "line 3 is longer than 65536 characters"),
    ],
)
def test_a_csv_that_cannot_be_read_is_refused_by_line_and_column(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "s.csv"
    file.write_text(text)
    with pytest.raises(BagError, match=r"s\.csv") as error:
        scan(file)
    assert words in str(error.value) and file.read_text() == text


def test_rows_of_one_time_with_other_columns_are_messages_of_one_stamp(tmp_path: Path) -> None:
    """A plot program exports a row for each topic; cells without a value are written in many ways."""
    rows = "".join(f"{0.005 * k:.3f},0.1,,NaN\n{0.005 * k:.3f},-,0.2,null\n{0.005 * k:.3f},,,0.3\n" for k in range(3000))
    (tmp_path / "s.csv").write_text("t_s,stroke_1_m,stroke_2_m,joint_1_rad\n" + rows)
    session = scan(tmp_path / "s.csv")
    assert [topic.count for topic in session.topics] == [6000, 3000]
    stamps = {(message.header.stamp.sec, message.header.stamp.nanosec) for *_, message in messages(session)}
    assert len(stamps) == 3000


@pytest.mark.parametrize("kind", ["db3 file", "ros1"])
@pytest.mark.parametrize("damage", ["empty", "cut", "noise"])
def test_damage_is_one_error_that_names_the_file(bag: Path, tmp_path: Path, content: Content, kind: str, damage: str) -> None:
    file = stored(bag, kind, tmp_path)
    data = bytearray(file.read_bytes())
    if damage == "noise":
        data[5000:9000] = np.random.default_rng(1).bytes(4000)
    file.write_bytes({"empty": b"", "cut": data[: len(data) * 2 // 3], "noise": bytes(data)}[damage])
    with pytest.raises(BagError, match=file.name):
        content(scan(file))


def test_a_database_with_a_log_beside_it_is_refused(bag: Path, tmp_path: Path) -> None:
    file = stored(bag, "db3 file", tmp_path)
    open_one = sqlite3.connect(file)
    open_one.execute("PRAGMA journal_mode = WAL")
    open_one.execute("DELETE FROM messages WHERE id = 1")
    open_one.commit()
    with pytest.raises(BagError, match=r"was not closed: two\.db3-wal"):
        scan(file)
    open_one.close()


def test_no_link_is_followed_and_no_other_database_is_taken(bag: Path, tmp_path: Path) -> None:
    folder = stored(bag, "db3", tmp_path)
    (folder / "two.db3").rename(tmp_path / "elsewhere.db3")
    (folder / "two.db3").symlink_to(tmp_path / "elsewhere.db3")
    with pytest.raises(BagError, match="symbolic link"):
        scan(folder)
    other = sqlite3.connect(tmp_path / "other.db3")
    other.execute("CREATE TABLE accounts (id INTEGER)")
    other.commit()
    other.close()
    with pytest.raises(BagError, match="no tables messages and topics, but accounts"):
        scan(tmp_path / "other.db3")


def test_recover_says_what_it_reads_and_batch_and_info_find_all(
    bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = stored(bag, "db3 file", tmp_path)
    with pytest.raises(BagError, match=r"only \.mcap files are recovered"):
        recover(file, tmp_path / "saved")
    assert not (tmp_path / "saved").exists()
    (tmp_path / "s.csv").write_text(CSV)
    stored(bag, "ros1", tmp_path)
    assert [path.name for path in sessions_of([f"{tmp_path}/*"])] == ["bag", "one.bag", "s.csv", "two"]
    assert main(["info", str(tmp_path / "one.bag")]) == 0
    assert "stored     ros1, 1 file" in capsys.readouterr().out


def test_a_window_is_a_part_of_the_session_and_starts_at_rest(
    moving: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["replay", str(moving), "--no-pictures", "--no-health", "--out", str(tmp_path / "out"), "--table", "csv"]
    assert main([*arguments, "--start", "1", "--duration", "0.5"]) == 0
    assert "the model starts at rest at 1 s" in capsys.readouterr().err
    rows = np.genfromtxt(tmp_path / "out" / "samples.csv", delimiter=",", names=True)
    assert len(rows) == 100 and rows["t_s"][0] == 0.0
    whole = [message.position[0] for name, _, _, message in messages(scan(moving)) if name == "/cylinder_strokes"]
    assert np.allclose(rows["measured_cylinder_1_m"], whole[200:300], rtol=1e-8)
    assert rows["tip_ax_m_s2"][0] == pytest.approx(0.0, abs=0.05)
    assert main([*arguments, "--start", "5"]) == 1
    assert "no message from 5 s on; the session lasts 2.0 s" in capsys.readouterr().err
    assert main(["info", str(moving), "--json", "--start", "1", "--duration", "0.5"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["counts"] == [100] * 3 and told["start_ns"] == 1_700_000_001_000_000_000
    assert [told["duration_s"], told["session_duration_s"]] == pytest.approx([0.495, 1.995])


def test_the_truth_goes_with_the_window(tmp_path: Path) -> None:
    session = Path(__file__).parents[2] / "bags" / "arch_session"
    part = replay(session, None, tmp_path / "part", health=False, window=TimeWindow(20.0, 5.0))
    assert part.summary["window_start_s"] == 20.0 and part.summary["samples"] == 1000
    columns = part.columns()
    assert columns["t_s"][-1] == pytest.approx(4.995, abs=1e-3) and len(columns) == 79
    assert np.isfinite([columns["measured_cylinder_1_m"], columns["estimate_tip_x_m"]]).all()
    assert part.summary["tip_error_rms_m"] < 0.03  # the boom was moving, the model begins at rest; by another time decimetres
