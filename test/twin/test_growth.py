"""Nothing that is kept grows: as many objects live after twice as many samples."""

from __future__ import annotations

import gc
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from drive_twin import drive_twin

from boom_twin import Sample, Stream, load_scene, statics
from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.sensor_status import sensors_of
from boom_twin.diagnostics.topic_status import Peers
from boom_twin.diagnostics.twin_status import TwinWatch, all_pieces
from boom_twin.health.baseline import load_baseline
from boom_twin.messages.report_encoder import ReportEncoder
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.types import Array

RATE, SPAN = 32, 240  # Hz, of which times are sums without rounding; s: all windows are full after three minutes
GRAVITY = 9.81


class Live:
    """What the node does with a sample, without ROS; the boom stands still, its sensors have their noise."""

    def __init__(self) -> None:
        scene, self.now, self.random = load_scene(), 0.0, np.random.default_rng(5)
        self.twin = drive_twin(scene, baseline=load_baseline())
        self.encoder = ReportEncoder(scene, self.twin.settings, "base_link")
        sensors = sensors_of(scene, self.twin.settings, dict.fromkeys(Stream, False), self.twin.mounts)
        self.watch = TwinWatch(sensors, {stream: stream.value for stream in Stream}, Thresholds(), lambda: self.now)
        strokes = strokes_of_posture(scene, "arch")
        prediction = drive_twin(scene).update(Sample(Stream.STROKES, 0, strokes)).prediction
        assert prediction is not None
        up = GRAVITY * np.array([np.sin(prediction.tip_angle), np.cos(prediction.tip_angle)])
        self.rest: dict[Stream, tuple[Array, float]] = {
            Stream.STROKES: (strokes, 2e-5),
            Stream.ANGLES: (statics(scene, "arch").joints, 1.7e-4),
            Stream.IMU: (up, 0.05),
        }

    def second(self) -> None:
        """Of samples of all streams, and the look at everything after it."""
        for _ in range(RATE):
            self.now += 1.0 / RATE
            for stream, (values, sigma) in self.rest.items():
                self._take(Sample(stream, round(self.now * 1e9), values + self.random.normal(0.0, sigma, len(values))))
        peers = dict.fromkeys(Stream, Peers())
        all_pieces(self.watch.look({}, True, peers, peers.values(), self.now))

    def _take(self, sample: Sample) -> None:
        self.watch.seen(sample.stream, sample.stamp)
        report = self.twin.update(sample, judged=False)
        self.watch.took(sample, report, 0.0)
        for each in report.all:
            self.encoder.fill(each, lambda _: True)
        if self.twin.is_health_due:
            self.watch.judged(self.twin.judge_health(), 0.0)


def alive() -> tuple[Counter[str], int]:
    """Objects of the package by class, and blocks of memory of all objects."""
    gc.collect()
    kinds = (type(each) for each in gc.get_objects())
    return Counter(kind.__name__ for kind in kinds if str(kind.__module__).startswith("boom_twin")), sys.getallocatedblocks()


def grown() -> dict[str, int]:
    """Objects of the package, by class, and blocks of memory that a span has added to those of two spans before it.

    Two, for calls of compiled code keep some blocks of the first thousand calls, and no more.
    """
    live = Live()
    for _ in range(2 * SPAN):
        live.second()
    before, blocks = alive()
    for _ in range(SPAN):
        live.second()
    after, later = alive()
    return {**(after - before), **(before - after), "blocks": later - blocks}


def test_as_many_objects_live_after_more_samples() -> None:
    # In a process of its own, for blocks of memory are counted for all that a process does.
    command = [sys.executable, "-m", "twin.test_growth"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=500, cwd=Path(__file__).parents[1])
    found = json.loads(done.stdout)
    blocks = found.pop("blocks")
    assert not found
    assert blocks < SPAN, "an object every second"


if __name__ == "__main__":
    sys.stdout.write(json.dumps(grown()))
