"""Many messages at once: the same bytes in the same order as one report after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from messages.random_reports import Told, boom, random_reports

from boom_twin import Report, Settings
from boom_twin.messages.encoded_block import EncodedBlock
from boom_twin.messages.report_encoder import ReportEncoder
from boom_twin.messages.topic_table import Output
from boom_twin.twin.blocks import report_block

Messages = list[tuple[str, int, bytes]]


def one_by_one(encoder: ReportEncoder, reports: list[Report]) -> Messages:
    """Key, log time, data."""
    return [(key, report.stamp, data) for report in reports for key, data in encoder.fill(report)]


def told(block: EncodedBlock) -> Messages:
    """The same of a block."""
    found = {
        place: (rows.key, data.tobytes())
        for rows in block.rows
        for place, data in zip(rows.places.tolist(), rows.data, strict=True)
    }
    return [(found[place][0], log_time, found[place][1]) for place, log_time in enumerate(block.log_times.tolist())]


def in_blocks(encoder: ReportEncoder, reports: list[Report], size: int, joints: int) -> Messages:
    found: Messages = []
    for first in range(0, len(reports), size):
        found += told(encoder.fill_block(report_block(reports[first : first + size], joints)))
    return found


@pytest.mark.parametrize("size", [1, 3, 64, 500])
@pytest.mark.parametrize("rig", [Told(2, health=0.0), Told(3, imu=False, pins=2, health=0.1), Told(4, pins=1)])
def test_a_block_gives_the_messages_of_its_reports(rig: Told, size: int) -> None:
    reports = random_reports(size + rig.joints, 500, rig)
    one, many = (ReportEncoder(boom(rig.joints), Settings()) for _ in range(2))
    expected = one_by_one(one, reports)
    assert {key for key, _, _ in expected} >= {Output.SHAPE, Output.RESIDUALS, Output.TIP_ACCELERATION}
    assert in_blocks(many, reports, size, rig.joints) == expected


def test_a_block_without_messages() -> None:
    encoded = ReportEncoder(boom(3), Settings()).fill_block(report_block([Report(5, True), Report(6, True)], 3))
    assert encoded.rows == [] and len(encoded.log_times) == 0


def test_a_block_says_the_same_as_its_reports() -> None:
    """Less events and status, which are not written."""
    reports = random_reports(2, 300, Told(3, pins=2, health=0.1))
    block = report_block([replace(report, events=("deflected",), status="no") for report in reports], 3)
    encoder, other = (ReportEncoder(boom(3), Settings()) for _ in range(2))
    back = block.reports(3)
    assert one_by_one(encoder, back) == one_by_one(other, reports)
    for given, got in zip(reports, back, strict=True):
        if given.prediction is not None and got.prediction is not None:
            for name in ("clearances", "moments", "tip_velocity", "tip_angle"):
                np.testing.assert_array_equal(getattr(given.prediction, name), getattr(got.prediction, name))
        assert (given.prediction is None) == (got.prediction is None)
