"""Replays whose stamps or log times step: memory goes by samples, and the order is that of the node."""

from __future__ import annotations

import json
import resource
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from default_boom import joint_angles_of_strokes, strokes_of_posture
from fuzz.mcap_files import write as write_file
from mcap.reader import make_reader
from mcap.writer import IndexType
from recordings import MessageWriter, read, scan, sensor_message
from ros_messages import jazzy, load_topics, stamp_of

from boom_twin import Sample, Stream, Twin, load_scene

SECOND, START, ROWS = 10**9, 1_700_000_000 * 10**9, 1600
DAY = 86_400 * SECOND
"""ns"""


def samples(shift: Callable[[int], int] = lambda row: 0, rows: int = ROWS) -> list[Sample]:
    """Strokes, angles and IMU of a gentle move at 200 Hz, with each row's stamp shifted (ns)."""
    scene, found = load_scene(), []
    for row in range(rows):
        time = 0.005 * row
        strokes = strokes_of_posture(scene, "arch") + 0.01 * (1.0 - np.cos(time))
        stamp = START + round(time * SECOND) + shift(row)
        found.append(Sample(Stream.STROKES, stamp, strokes))
        found.append(Sample(Stream.ANGLES, stamp, np.array(joint_angles_of_strokes(scene, strokes))))
        found.append(Sample(Stream.IMU, stamp, np.array([0.0, 9.81]) + 0.01 * np.sin(40.0 * time)))
    return found


def write(folder: Path, found: list[Sample], logs: list[int] | None = None) -> Path:
    """A bag of samples in their order, with other log times (ns) than their stamps if given."""
    inputs = load_topics().inputs
    with MessageWriter(folder, {stream.value: inputs[stream] for stream in inputs}, {}) as bag:
        for sample, log in zip(found, logs or [sample.stamp for sample in found], strict=True):
            bag.write(sample.stream.value, log, sensor_message(sample))
    return folder


def replayed(folder: Path) -> dict[str, Any]:
    """The summary of a replay by the command line."""
    assert main(["replay", str(folder), "--out", str(folder) + "_out", "--report"]) == 0
    return dict(json.loads((Path(str(folder) + "_out") / "summary.json").read_text()))


@pytest.fixture
def little_memory() -> Iterator[None]:
    """Limit the address space to a GiB more than is in use."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2**30, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.parametrize("days", [10, 5000])
def test_memory_of_a_replay_goes_by_its_samples(tmp_path: Path, days: int, little_memory: None) -> None:
    bag = write(tmp_path / "bag", samples(lambda row: days * DAY * (row >= ROWS // 2)))
    assert replayed(bag)["samples"] == ROWS


def recorded(path: Path, found: list[Sample], logs: list[int], **options: Any) -> Path:
    """One file of samples in their order, by the mcap library."""
    topics, encode = load_topics().inputs, jazzy().serialize_cdr
    own = [(topics[sample.stream], sensor_message(sample), log) for sample, log in zip(found, logs, strict=True)]
    rows = ((topic.absolute, topic.type, "cdr", log, bytes(encode(message, topic.type))) for topic, message, log in own)
    return write_file(path, rows, **options)


def as_database(source: Path, path: Path) -> Path:
    """The messages of an .mcap file in their order, as rosbag2 stores them with sqlite3."""
    with path.open("xb"), source.open("rb") as file, closing(sqlite3.connect(path)) as database:
        database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            assert schema is not None
            database.execute("INSERT OR IGNORE INTO topics VALUES (?, ?, ?, 'cdr')", (channel.id, channel.topic, schema.name))
            row = channel.id, message.log_time, message.data
            database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", row)
        database.commit()
    return path


STORED: dict[str, dict[str, Any]] = {
    "one chunk": {"chunk_size": 2**30},
    "no index": {"index_types": IndexType.NONE, "chunk_size": 4000},
    "no chunks": {"use_chunking": False},
    "database": {},
}


@pytest.mark.parametrize("step", [int(0.05 * SECOND), 3 * SECOND, 3600 * SECOND])
@pytest.mark.parametrize("kind", STORED)
def test_messages_come_as_they_were_recorded_where_the_clock_was_set_back(
    tmp_path: Path, kind: str, step: int, capsys: pytest.CaptureFixture[str]
) -> None:
    found = samples(rows=800)
    logs = [sample.stamp + row % 3 * 1000 - step * (row >= 1200) for row, sample in enumerate(found)]
    path = recorded(tmp_path / "bag.mcap", found, logs, **STORED[kind])
    path = as_database(path, tmp_path / "bag.db3") if kind == "database" else path
    inputs = load_topics().inputs.values()
    wanted = {topic.absolute: topic.type for topic in inputs if scan(path).find(topic.name)}
    read_back = [(name, stamp_of(message)) for name, _, message in read(scan(path), wanted)]
    assert read_back == [(load_topics().inputs[sample.stream].absolute, sample.stamp) for sample in found]
    assert main(["info", str(path)]) == 0
    said = capsys.readouterr().out
    assert f"log times step back 1 time, by {(step - 5_000_000 + 2000) * 1e-9:.3f} s in all" in said


def test_files_after_a_clock_that_was_set_back_follow(tmp_path: Path) -> None:
    found = samples(rows=800)
    logs = [sample.stamp - SECOND * (row >= 600) for row, sample in enumerate(found)]
    (folder := tmp_path / "bag").mkdir()
    for number, part in enumerate((slice(0, 1200), slice(1200, None))):
        recorded(folder / f"bag_{number}.mcap", found[part], logs[part], chunk_size=4000)
    topic = load_topics().inputs[Stream.STROKES]
    stamps = [stamp_of(message) for _, _, message in read(scan(folder), {topic.absolute: topic.type})]
    assert stamps == [sample.stamp for sample in found if sample.stream is Stream.STROKES]


def test_samples_that_wait_for_the_first_strokes_are_dropped_when_their_stamps_come_again() -> None:
    """A bag that is played again begins anew: its first round had no strokes."""
    first, twin = samples(rows=400), Twin(load_scene())
    for sample in [each for each in first if each.stream is not Stream.STROKES]:
        twin.update(sample)
    stamps = [
        (residual.stream, residual.stamp)
        for sample in first
        for report in twin.update(sample).all
        for residual in report.residuals
        if residual.stream is not Stream.STROKES
    ]
    assert len(stamps) - len(set(stamps)) <= 4 and len(set(stamps)) > 780  # until their step is confirmed
    assert twin.counts["unmatched"] >= 796
