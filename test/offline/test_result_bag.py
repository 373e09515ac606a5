"""The result bag of a replay: every number of a prediction, the same bytes from blocks and from single reports."""

from __future__ import annotations

import os
from dataclasses import fields
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from drive_twin import drive_twin
from messages.random_reports import Told, boom, random_reports

from boom_twin import Report, Sample, Settings, Stream, load_scene
from boom_twin.bag.writer import FILE_NAME, RESULT_CHUNK_SIZE, SessionWriter
from boom_twin.messages.report_encoder import ReportEncoder
from boom_twin.messages.topic_table import Output, load_topics
from boom_twin.offline.threads import result_bag
from boom_twin.predictions import Prediction
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.scene.schema import Clearance, Pin
from boom_twin.twin.blocks import ReportBlock, report_block


def test_a_prediction_with_clearance_comes_through_whole() -> None:
    """With shape and without; clearances and moments were dropped before."""
    scene = load_scene()
    worn = Pin(at="cylinder_1.rod", pin_radius=0.025, radial_clearance=1e-4)
    scene = scene.model_copy(update={"clearance": Clearance(pins=(worn,))})
    twin, strokes = drive_twin(scene), strokes_of_posture(scene, "arch")
    given = [twin.update(Sample(Stream.STROKES, k * 5_000_000, strokes)) for k in range(30)]
    got = report_block(given, 4).reports(len(scene.joints))
    assert sum(report.prediction is not None and report.prediction.shape is not None for report in got) == 2
    for one, other in ((a.prediction, b.prediction) for a, b in zip(given, got, strict=True)):
        assert one is not None and other is not None
        assert one.clearances is not None and one.clearances.shape == (1, 4) and one.moments is not None and one.moments.size
        for name in (field.name for field in fields(Prediction)):
            left, right = getattr(one, name), getattr(other, name)
            assert (left is None) == (right is None), name
            assert left is None or (np.shape(left) == np.shape(right) and np.array_equal(left, right)), name


@pytest.mark.parametrize("size", [0, 37])
def test_the_bag_has_the_bytes_of_message_by_message(tmp_path: Path, size: int) -> None:
    """From reports (0), and from blocks of so many with single reports of changes between them."""
    reports = random_reports(size, 1500, Told(3, pins=1, changes=0.01))
    scene, notes = boom(3), {"origin": "synthetic, a test"}
    outputs = {key: topic for key, topic in load_topics().outputs.items() if key is not Output.DIAGNOSTICS}
    encoder = ReportEncoder(scene, Settings())
    with SessionWriter(tmp_path / "expected", outputs, notes, chunk_size=RESULT_CHUNK_SIZE) as expected:
        for report in reports:
            for key, data in encoder.fill(report):
                expected.write_encoded(key, report.stamp, data)
    with result_bag(tmp_path / "bag", notes, load_topics(), scene, Settings()) as put:
        for item in _items(reports, size, 3):
            put([item])
    for name in (FILE_NAME, "metadata.yaml"):
        assert (tmp_path / "bag" / name).read_bytes() == (tmp_path / "expected" / name).read_bytes()
    assert os.listdir(tmp_path / "bag") == os.listdir(tmp_path / "expected")


def _items(reports: list[Report], size: int, joints: int) -> list[ReportBlock | Report]:
    found: list[ReportBlock | Report] = []
    for has_change, run in groupby(reports, lambda report: report.change is not None):
        own = list(run)
        is_single = has_change or size == 0
        found += own if is_single else [report_block(own[k : k + size], joints) for k in range(0, len(own), size)]
    return found
