"""One loop drives every twin: what it asks for, in what order, and that nobody in the package has another one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from default_boom import strokes_of_posture
from drive_twin import drive_twin
from ros_messages import Output, ReportEncoder

from boom_twin import Report, Sample, Settings, Stream, load_scene, statics
from boom_twin.twin.twin import drive
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


def driven(given: Iterable[Sample | Change]) -> list[Report]:
    twin = drive_twin(load_scene(), health=True)
    return [found[1] for found in drive(twin, twin.update, given) if found is not None]


def bits(reports: list[Report]) -> list[bytes]:
    """What is predicted and estimated."""
    found = [each for report in reports for each in (report.prediction, report.estimate) if each is not None]
    return [each.tip_acceleration.tobytes() if hasattr(each, "tip_acceleration") else each.tip.tobytes() for each in found]


def test_a_twin_that_began_anew_is_repeated_by_one_that_does() -> None:
    """A node that was started again, or activated again, knew nothing of before; its zeros it has from the change alone."""
    again, anew = (replace(CHANGE, settings=Settings().live, is_new=is_new) for is_new in (False, True))
    samples = [item for item in items() if isinstance(item, Sample)]
    kept, reports = (driven([*samples[:40], change, *samples[40:]]) for change in (again, anew))
    other = drive_twin(load_scene(), health=True)
    other.requests.zero(CHANGE.zeros)
    fresh = [other.update(sample) for sample in samples[40:]]
    assert len(bits(fresh)) > 15 and bits(reports[40:]) == bits(fresh)
    assert [report.change.is_new for report in reports if report.change] == [True, True]
    assert [report.change.is_new for report in kept if report.change] == [True, False]
    other.renew()
    later = [other.update(sample) for sample in samples[40:]]
    assert bits(later) == bits(fresh) and later[0].change is not None and later[0].change.is_new


def spoilt_samples(seconds: float, noise: float = 1.0) -> Iterator[Sample]:
    """A boom at rest at 100 Hz whose third encoder stands still from 2 s on: its sensor gets masked.

    All encoders have so many times the noise that is stated.
    """
    random, angles = np.random.default_rng(3), statics(None, "arch").joints
    stuck = angles[2]
    for k in range(round(seconds * 100)):
        stamp = 10**18 + 2 * k * RATE
        yield Sample(Stream.STROKES, stamp, STROKES + random.normal(0.0, 2e-5, 4))
        read = angles + random.normal(0.0, noise * 1.7e-4, 4)
        stuck = read[2] if k < 200 else stuck
        yield Sample(Stream.ANGLES, stamp, np.array([*read[:2], stuck, read[3]]))


def test_health_judged_after_a_sample_was_told_is_the_same() -> None:
    """Every message of the two ways, to the bit; what was told first lacks nothing but the health."""
    whole, apart, encoder = {}, {}, ReportEncoder(load_scene(), Settings())
    for report in driven(spoilt_samples(6.0)):
        for key, data in encoder.fill(report):
            whole.setdefault(key, []).append(data)
    twin, told = drive_twin(load_scene(), health=True), set()
    for sample in spoilt_samples(6.0):
        report = twin.update(sample, judged=False)
        assert report.health is None
        messages = encoder.fill(report)
        if (health := twin.judge_health()) is not None:
            assert report.prediction is not None
            messages += encoder.fill(Report(sample.stamp, True, health=health))
            told |= {alarm.cause for alarm in health.alarms}
        assert twin.judge_health() is None
        for key, data in messages:
            apart.setdefault(key, []).append(data)
    assert told == {"joint_3.sensor"} and len(whole[Output.HEALTH]) >= 5
    assert apart == whole
