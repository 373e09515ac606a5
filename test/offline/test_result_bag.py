"""The result bag of a replay: every number of a prediction."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from default_boom import strokes_of_posture
from drive_twin import drive_twin

from boom_twin import Sample, Stream, load_scene
from boom_twin.predictions import Prediction
from boom_twin.scene.schema import Clearance, Pin
from boom_twin.twin.blocks import report_block


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
