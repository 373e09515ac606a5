"""One loop drives every twin: what it asks for, in what order, and that nobody in the package has another one."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import boom_twin
from boom_twin import Sample, Settings, Stream, Twin, load_scene
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.twin.driver import drive
from boom_twin.types import Change

RATE = 5_000_000  # ns
STROKES = strokes_of_posture(load_scene(), "arch")
CHANGE = Change(20 * RATE, True, Settings().live | {"payload": 40.0}, {"joint_1": 0.01})


def items() -> Iterator[Sample | Change | None]:
    for k in range(30):
        if k == 20:
            yield CHANGE
        if k % 7 == 3:
            yield None
        yield Sample(Stream.STROKES, k * RATE, STROKES + 1e-3 * np.sin(0.05 * k))
        yield Sample(Stream.ANGLES, k * RATE, np.zeros(4))


def test_drive_is_update_by_update() -> None:
    """To the bit what `Twin.update` gives, with the change repeated before its stroke sample."""
    twin, other = Twin(load_scene()), Twin(load_scene())
    steps = list(drive(twin, items()))
    assert [step is None for step in steps] == [item is None for item in items() if not isinstance(item, Change)]
    residuals = 0
    for step in filter(None, steps):
        if step.sample.stream is Stream.STROKES and step.sample.stamp == CHANGE.stamp:
            other.requests.repeat(CHANGE)
            assert step.report.change is not None and step.report.change.settings["payload"] == 40.0
        report = other.update(step.sample)
        assert report.events == step.report.events and step.duration > 0.0
        for one, two in zip(report.residuals, step.report.residuals, strict=True):
            residuals += 1
            assert one.values.tobytes() == two.values.tobytes()
        if report.prediction is not None and step.report.prediction is not None:
            assert report.prediction.tip_acceleration.tobytes() == step.report.prediction.tip_acceleration.tobytes()
        assert (report.prediction is None) == (step.report.prediction is None)
    assert residuals == 30


def test_no_item_is_asked_for_before_the_last_report_was_taken() -> None:
    """A live node decodes a message only when the reports of the one before are out."""
    asked: list[int] = []

    def source() -> Iterator[Sample]:
        for k in range(4):
            asked.append(k)
            yield Sample(Stream.STROKES, k * RATE, STROKES)

    for k, step in enumerate(drive(Twin(load_scene()), source())):
        assert step.sample.stamp == k * RATE and asked == list(range(k + 1))


def test_there_is_one_loop() -> None:
    """Node, replay, live page, held-out check and baseline all drive by it; none updates a twin itself."""
    root = Path(boom_twin.__file__).parent
    texts = {file.relative_to(root).as_posix(): file.read_text() for file in root.rglob("*.py")}
    drives = re.compile(r"\bdrive(_blocks)?\(.*twin", re.I)
    users = {name for name, text in texts.items() if drives.search(text) and "twin.driver import" in text}
    assert users == {
        "calibration/baseline.py", "calibration/validation.py", "monitor/data/bag_feed.py", "offline/replay.py",
        "ros/node/node.py",
    }  # fmt: skip
    assert {name for name, text in texts.items() if re.search(r"twin\.update\(\w", text)} == {"twin/driver.py"}
