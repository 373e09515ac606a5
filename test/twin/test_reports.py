"""Reports of single samples: they last, can be sent to another process, and are encoded as wanted."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from default_boom import strokes_of_posture
from drive_twin import drive_twin

from boom_twin import Report, Sample, Scene, Stream, load_scene


def reports(scene: Scene, count: int = 120) -> list[Report]:
    """Of strokes, angles, accelerations and forces, which come late too."""
    twin, random, rest = drive_twin(scene), np.random.default_rng(1), strokes_of_posture(scene, "arch")
    joints, found = len(scene.joints), []
    for k in range(count):
        stamp = 10**18 + k * 5_000_000
        move = 1e-3 * np.sin(0.05 * k)
        given = [
            Sample(Stream.ANGLES, stamp + 1000, random.normal(size=joints)),
            Sample(Stream.STROKES, stamp, rest + move + random.normal(0.0, 2e-5, joints)),
            Sample(Stream.IMU, stamp, np.array([np.nan if k == 7 else 0.1, 9.8])),
            Sample(Stream.FORCES, stamp, random.normal(size=joints) * 1e4),
        ]
        found += [twin.update(each) for each in given]
    return found


@pytest.fixture(scope="module")
def given() -> list[Report]:
    return reports(load_scene())


def test_a_report_can_be_sent_to_another_process(given: list[Report]) -> None:
    for report in given[-40:]:
        assert repr(pickle.loads(pickle.dumps(report))) == repr(report)
