"""What goes down the pipe to the writer comes out of it: every number of a prediction, whatever it has."""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from boom_twin import Sample, Stream, Twin, load_scene
from boom_twin.offline.writer_process import ARRAYS, NUMBERS, pack, unpack
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.scene.schema import Clearance, Pin
from boom_twin.types import Prediction, Report


def test_every_field_of_a_prediction_has_its_place() -> None:
    assert sorted(["stamp", *NUMBERS, *ARRAYS]) == sorted(field.name for field in fields(Prediction))


def test_a_prediction_with_clearance_comes_through_whole() -> None:
    """With shape and without; clearances and moments were dropped before."""
    scene = load_scene()
    worn = Pin(at="cylinder_1.rod", pin_radius=0.025, radial_clearance=1e-4)
    scene = scene.model_copy(update={"clearance": Clearance(pins=(worn,))})
    twin, strokes, shapes = Twin(scene), strokes_of_posture(scene, "arch"), 0
    for k in range(30):
        given = twin.update(Sample(Stream.STROKES, k * 5_000_000, strokes)).prediction
        assert given is not None and given.clearances is not None and given.moments is not None
        assert given.clearances.shape == (1, 4) and given.moments.size > 0
        got = unpack(pack(Report(given.stamp, True, given))).prediction
        assert got is not None
        shapes += got.shape is not None
        for name in (field.name for field in fields(Prediction)):
            one, other = getattr(given, name), getattr(got, name)
            assert (one is None) == (other is None), name
            assert one is None or (np.shape(one) == np.shape(other) and np.array_equal(one, other)), name
    assert shapes == 2
