"""Replays whose stamps or log times step: memory goes by samples, and the order is that of the node."""

from __future__ import annotations

import json
import resource
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import main
from default_boom import joint_angles_of_strokes, strokes_of_posture
from drive_twin import drive_twin
from fuzz import mcap_files
from gate_sessions import write as write_by_rosbags
from mcap.writer import IndexType
from recordings import MessageWriter, read, scan, sensor_message
from ros_messages import jazzy, load_topics, stamp_of
from rosbags.rosbag2 import StoragePlugin

from boom_twin import Sample, Stream, Twin, load_scene
from boom_twin.offline.ground_truth import TipErrors, TipTruth
from boom_twin.offline.recording import Recording
from boom_twin.twin.blocks import block_of

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
    assert ROWS - 21 <= replayed(bag)["samples"] < ROWS  # the step must be confirmed for `gap`


def entries(found: list[Sample], logs: list[int]) -> list[mcap_files.Entry]:
    """The messages of samples in their order."""
    topics = [load_topics().inputs[sample.stream] for sample in found]
    return [
        (topic.absolute, topic.type, "cdr", log, bytes(jazzy().serialize_cdr(sensor_message(sample), topic.type)))
        for sample, topic, log in zip(found, topics, logs, strict=True)
    ]


def recorded(path: Path, found: list[Sample], logs: list[int], **options: Any) -> Path:
    """Write one file of samples in their order by the mcap library."""
    return mcap_files.write(path, entries(found, logs), **options)


def order_of(path: Path) -> list[tuple[str, int]]:
    """Return topic and stamp of all messages as they are read; their log times must rise."""
    inputs = load_topics().inputs.values()
    found = list(read(scan(path), {topic.absolute: topic.type for topic in inputs if scan(path).find(topic.name)}))
    logs = [log for _, log, _ in found]
    assert logs == sorted(logs) and logs[-1] - logs[0] == pytest.approx((ROWS // 2 - 1) * 5_000_000, abs=2e7)
    return [(name, stamp_of(message)) for name, _, message in found]


def named(found: list[Sample]) -> list[tuple[str, int]]:
    return [(load_topics().inputs[sample.stream].absolute, sample.stamp) for sample in found]


@pytest.mark.parametrize("step", [int(0.05 * SECOND), 3 * SECOND, 3600 * SECOND])
@pytest.mark.parametrize(
    "options",
    [{"chunk_size": 2**30}, {"chunk_size": 4000}, {"index_types": IndexType.NONE, "chunk_size": 4000}, {"use_chunking": False}],
    ids=["one chunk", "chunks", "no index", "no chunks"],
)
def test_messages_are_in_file_order_where_the_clock_was_set_back(tmp_path: Path, options: dict[str, Any], step: int) -> None:
    found = samples(rows=ROWS // 2)
    logs = [sample.stamp + row % 3 * 1000 - step * (row >= 1201) for row, sample in enumerate(found)]
    assert order_of(recorded(tmp_path / "bag.mcap", found, logs, **options)) == named(found)


def test_a_database_is_in_the_order_in_which_its_messages_were_stored(tmp_path: Path) -> None:
    found = samples(rows=ROWS // 2)
    logs = [sample.stamp - 3 * SECOND * (row >= 1201) for row, sample in enumerate(found)]
    found_entries = entries(found, logs)
    rows = [(topic, log, data) for topic, _, _, log, data in found_entries]
    write_by_rosbags(tmp_path / "two", {topic: kind for topic, kind, *_ in found_entries}, rows, StoragePlugin.SQLITE3)
    assert order_of(tmp_path / "two") == named(found)


def test_files_follow_one_in_which_the_clock_was_set_back(tmp_path: Path) -> None:
    found = samples(rows=ROWS // 2)
    logs = [sample.stamp - SECOND * (row >= 600) for row, sample in enumerate(found)]
    for number, part in enumerate((slice(0, 1200), slice(1200, None))):
        recorded(tmp_path / f"bag_{number}.mcap", found[part], logs[part], chunk_size=4000)
    assert order_of(tmp_path) == named(found)


@pytest.mark.parametrize("kind", ["topic after topic", "random", "late messages", "one topic"])
def test_messages_that_are_not_in_file_order_are_sorted(tmp_path: Path, kind: str) -> None:
    by_time = sorted(samples(rows=ROWS // 2), key=lambda sample: sample.stamp)
    logs = [sample.stamp + row % 3 * 1000 for row, sample in enumerate(by_time)]
    rows = np.arange(len(by_time))
    keys = {
        "topic after topic": rows % 3,
        "random": np.random.default_rng(1).random(len(rows)),
        "late messages": rows + np.where(rows % 100 < 3, 30.5, 0.0),
        "one topic": np.where(rows % 3 == 0, (rows + 1200) % 2400, rows),
    }
    order = np.argsort(keys[kind], kind="stable").tolist()
    path = recorded(tmp_path / "bag.mcap", [by_time[row] for row in order], [logs[row] for row in order], chunk_size=4000)
    assert order_of(path) == named(by_time)


def test_samples_that_wait_for_the_first_strokes_are_dropped_when_their_stamps_come_again() -> None:
    """A bag that is played again begins anew: its first round had no strokes."""
    first, twin = samples(rows=400), Twin(load_scene())
    for sample in [each for each in first if each.stream is not Stream.STROKES]:
        twin.update(sample)
    stamps = [
        (residual.stream, residual.stamp)
        for sample in first
        for residual in twin.update(sample).residuals
        if residual.stream is not Stream.STROKES
    ]
    assert len(stamps) - len(set(stamps)) <= 4 and len(set(stamps)) > 780  # until their step is confirmed
    assert twin.counts["unmatched"] >= 796


def test_duration_and_errors_go_by_the_time_that_passed():
    """The truth, by the first clock, is at rest until that was set, and elsewhere then."""
    scene = load_scene()
    still, twin = strokes_of_posture(scene, "arch"), drive_twin(scene)
    stamps = [START + (5 * k + (-7_200_000 if k >= 120 else 0)) * SECOND // 1000 for k in range(200)]
    samples = block_of([Sample(Stream.STROKES, stamp, still) for stamp in stamps], 4)
    rows = twin.take(samples)
    position = np.tile(rows.predictions.tip_position[0], (200, 1)) + (np.arange(200) >= 120)[:, np.newaxis]
    errors = TipErrors(TipTruth(np.arange(200) * 0.005, position, np.zeros((200, 2))))
    recording = Recording(4, errors=errors)
    recording.add(rows, samples)
    recording.close()
    assert len(recording.whole.predictions.stamps) == 180 and len(recording.clock_sets) == 1
    assert recording.duration == pytest.approx(178 * 0.005)  # without the time until the new stamps are confirmed
    assert errors.rms["tip_error_rms_m"] == pytest.approx(0.0, abs=1e-6)
