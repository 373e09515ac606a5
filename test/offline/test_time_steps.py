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
from recordings import MessageWriter, sensor_message
from ros_messages import load_topics

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
