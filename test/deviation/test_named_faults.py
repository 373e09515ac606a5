"""Named faults in the stated deviation of the tip: booms at rest by an independent statics of the faulty scene."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import EXACT, strokes_of_posture

from boom_twin import Sample, Stream, Twin, load_scene, statics
from boom_twin.health.faults import Fault, hypothesis
from boom_twin.scene.edit import loaded
from boom_twin.types import Alarm, Array, Ranked, StrokeReading

SCENE = load_scene()
ARCH = strokes_of_posture(SCENE, "arch")
LEAK = Alarm("cylinder_1", "creeps", 0, None, "cylinder_1.drive", "")
SPREAD = 0.2  # standard deviation of a size over the size


class Named:
    """Stand-in for fault twins: `alarms` are what they have named."""

    def __init__(self) -> None:
        self.alarms: list[Alarm] = []

    def news(self, stamp: int) -> list[Alarm]:
        return []


def alarm_of(fault: Fault) -> Alarm:
    part = fault.kind, fault.size, SPREAD * fault.size, ""
    return Alarm(fault.channel, fault.kind, 0, None, fault.cause, "", (Ranked(fault.cause, 0.97, (part,)),))


def run(fault: Fault, reads: StrokeReading, is_named: bool) -> tuple[Array, Array, Array]:
    """Return errors (k, 2) of the estimated tip of a boom with a fault, which is named from 1 to 2.5 s, and deviations (k, 2).

    Last, the deviations of the predicted tip, a report each.
    """
    each = hypothesis(SCENE, [fault])
    rest = statics(loaded(each.scene, **each.load(-1.0, -1.0)), ARCH)
    values = {StrokeReading.LENGTH: rest.lengths, StrokeReading.DRIVE: ARCH, StrokeReading.ANGLE: rest.joints}[reads]
    stream = Stream.ANGLES if reads is StrokeReading.ANGLE else Stream.STROKES
    twin, named, reports = Twin(SCENE, EXACT, health=True, reads=reads), Named(), []
    assert twin.judge is not None
    twin.judge.fault_twins = named  # type: ignore[assignment]
    for k in range(400):
        named.alarms = [LEAK, alarm_of(fault)] if is_named and 100 <= k < 250 else []
        reports.append(twin.update(Sample(stream, 10_000_000 * k, values)))
    tips, variances = zip(*((each.estimate.tip[:2], each.estimate.tip_covariance[[0, 3]]) for each in reports), strict=True)
    predicted = [each.health.tip_sigmas for each in reports if each.health is not None]
    return np.array(tips) - rest.tip, np.sqrt(variances), np.array(predicted)


def stated(fault: Fault, reads: StrokeReading) -> tuple[Array, Array, Array]:
    """Return the error (2,) of the estimated tip, and what a name adds to its deviation and to that of the predicted one."""
    _, usual, usual_predicted = run(fault, reads, False)
    errors, sigmas, predicted = run(fault, reads, True)
    is_named = slice(120, 240)
    assert np.array_equal(sigmas[:90], usual[:90]) and np.array_equal(sigmas[270:], usual[270:])
    added = np.sqrt(sigmas[is_named] ** 2 - usual[is_named] ** 2)
    return errors[240], added.mean(axis=0), np.sqrt(np.max(predicted**2 - usual_predicted**2, axis=0))


@pytest.mark.parametrize("reads", list(StrokeReading))
@pytest.mark.parametrize(
    "fault",
    [Fault("section_2.EI", "softer", 0.35), Fault("tip.payload", "more", 45.0), Fault("line_fill", "more", 3.0)],
    ids=lambda fault: fault.cause,
)
def test_stated_deviation_contains_a_named_fault(fault: Fault, reads: StrokeReading) -> None:
    """While the fault is named, the deviation contains what it moves the tip by, and how well its size is known."""
    error, added, predicted = stated(fault, reads)
    assert added == pytest.approx(np.abs(error) * np.hypot(1.0, SPREAD), rel=0.02)
    assert predicted == pytest.approx(added, rel=1e-6)


def test_a_softer_spring_leaves_the_tip_by_lengths_where_it_is() -> None:
    """Lengths contain the compression of the oil; drives do not."""
    fault = Fault("cylinder_2.k", "softer", 0.4)
    error, added, _ = stated(fault, StrokeReading.LENGTH)
    assert max(np.abs(error).max(), added.max()) < 1e-6
    error, added, _ = stated(fault, StrokeReading.DRIVE)
    assert added == pytest.approx(np.abs(error) * np.hypot(1.0, SPREAD), rel=0.02)
