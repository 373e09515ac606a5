"""What is left out while samples queue up: shapes, then looks at health, and never a bit of what is predicted."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture
from drive_twin import drive_twin
from ros_messages import Output, ReportEncoder

from boom_twin import Report, Sample, Settings, Stream, Twin, load_scene
from boom_twin.twin.block_update import HEALTH_ABOVE, SHAPES_ABOVE

SECONDS, RATE = 8, 100
BUSY = range(3 * RATE, 5 * RATE)
"""Strokes that are taken from a full queue."""
LEFT_OUT = {Output.SHAPE, Output.HEALTH, Output.TIP_UNCERTAINTY, Output.JOINT_STATES}  # swivels come with a shape


def run(share: float) -> tuple[Twin, list[Report], list[tuple[Output, bytes]]]:
    """A boom at rest whose encoders read what is predicted, with noise."""
    scene, random = load_scene(), np.random.default_rng(4)
    twin, encoder = drive_twin(scene, health=True), ReportEncoder(scene, Settings())
    strokes, reports = strokes_of_posture(scene, "arch"), []
    for k in range(SECONDS * RATE):
        twin.shedding.filled(share if k in BUSY else 0.0)
        stamp = 10**18 + k * 10**9 // RATE
        reports.append(twin.update(Sample(Stream.STROKES, stamp, strokes + random.normal(0.0, 2e-5, len(strokes)))))
        assert reports[-1].prediction is not None
        angles = reports[-1].prediction.joints + random.normal(0.0, 1.7e-4, len(strokes))
        reports.append(twin.update(Sample(Stream.ANGLES, stamp, angles)))
    return twin, reports, [message for report in reports for message in encoder.fill(report)]


@pytest.fixture(scope="module")
def calm() -> list[tuple[Output, bytes]]:
    return run(0.0)[2]


def of(messages: list[tuple[Output, bytes]], key: Output) -> list[bytes]:
    return [data for output, data in messages if output is key]


@pytest.mark.parametrize(
    ("share", "shapes", "health"), [(SHAPES_ABOVE + 0.01, 20, 0), (HEALTH_ABOVE + 0.01, 20, 20), (0.4, 0, 0)]
)
def test_shapes_go_first_then_health(share: float, shapes: int, health: int, calm: list[tuple[Output, bytes]]) -> None:
    twin, reports, messages = run(share)
    assert (twin.shedding.shapes, twin.shedding.health) == (shapes, health)
    for key in set(Output) - LEFT_OUT:
        assert of(messages, key) == of(calm, key), key
    assert len(of(messages, Output.JOINT_STATES)) == SECONDS * RATE
    assert len(of(messages, Output.SHAPE)) == len(of(calm, Output.SHAPE)) - shapes
    assert set(of(messages, Output.HEALTH)) <= set(of(calm, Output.HEALTH)) or health
    assert not any(report.health.alarms for report in reports if report.health is not None)  # a pause of its own is no fault
    told = [report.stamp for report in reports if report.health is not None]
    assert max(np.diff(told)) * 1e-9 == pytest.approx(3.0 if health else 1.0, abs=0.3)
    assert told[-1] > reports[-1].stamp - 2 * 10**9
