"""Health on cylinder lengths: what an angle sensor is off by is told in its units, and ends where it does."""

from __future__ import annotations

import numpy as np

from boom_twin import Sample, Stream, Twin, load_scene, statics
from boom_twin.health.baseline import Baseline
from boom_twin.types import Alarm

STEP, ONSET, END = 5_000_000, 600, 1800  # ns; samples


def alarms(shift: float) -> list[Alarm]:
    """Every alarm that began or ended while a boom rests; the transducer of cylinder 2 is off by `shift` (m) for 6 s."""
    scene, rng, found = load_scene(), np.random.default_rng(5), []
    rest = statics(scene, posture="arch")
    twin = Twin(scene, baseline=Baseline())
    for k in range(3400):
        lengths = rest.lengths + rng.normal(0.0, 2e-5, 4) + [0.0, shift if ONSET <= k < END else 0.0, 0.0, 0.0]
        joints = rest.joints + rng.normal(0.0, 1.745e-4, 4)
        for stream, values in ((Stream.STROKES, lengths), (Stream.ANGLES, joints)):
            health = twin.update(Sample(stream, 10**18 + k * STEP, values)).health
            found += [] if health is None else health.alarms
    return found


def test_a_healthy_boom_raises_none() -> None:
    assert alarms(0.0) == []


def test_a_stroke_transducer_that_is_off_is_told_and_ends() -> None:
    found = [alarm for alarm in alarms(1e-3) if alarm.kind == "deviation"]
    assert {alarm.channel for alarm in found} == {"joint_2"} and found[-1].until is not None
    since, until = ((stamp - 10**18) * 1e-9 for stamp in (found[0].since, found[-1].until))
    assert 3.0 <= since < 6.0 and 9.0 <= until < 14.0
    assert found[0].cause is None and "joint_2 reads" in found[0].told
