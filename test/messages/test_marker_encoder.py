"""What ``shape`` draws: by name, number, place, colour, words and time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from default_boom import strokes_of_posture
from drive_twin import drive_twin
from ros_messages import Output, decoded, stamp_of

from boom_twin import Sample, Stream, load_scene
from boom_twin.messages.report_encoder import TRACE, ShapeMarkers, force_colours
from boom_twin.predictions import Prediction

FACTOR, FULL = 7.5, 5.0e4  # N
PERIOD = 5_000_000  # ns


@pytest.fixture(scope="module")
def scene() -> Any:
    return load_scene()


@pytest.fixture(scope="module")
def predictions(scene: Any) -> list[Prediction]:
    """Those with a shape of 6 s of the default boom, cylinders 1 and 3 moving."""
    twin, strokes, found = drive_twin(scene), strokes_of_posture(scene, "arch"), []
    for k in range(1200):
        moved = strokes + np.array([0.02, 0.0, 0.01, 0.0]) * (1.0 - np.cos(0.01 * k))
        prediction = twin.update(Sample(Stream.STROKES, 3_000_000_000 + k * PERIOD, moved)).prediction
        if prediction is not None and prediction.shape is not None:
            found.append(prediction)
    return found


def drawn(predictions: list[Prediction]) -> list[dict[tuple[str, int], Any]]:
    markers = ShapeMarkers(FACTOR, FULL)
    messages = [decoded(data, Output.SHAPE) for data in markers.fill(predictions)]
    return [{(marker.ns, marker.id): marker for marker in message.markers} for message in messages]


def points(marker: Any) -> np.ndarray:
    assert all(point.y == 0.0 for point in marker.points)
    return np.array([(point.x, point.z) for point in marker.points])


def test_every_message_draws_the_boom_in_the_same_markers(predictions: list[Prediction], scene: Any) -> None:
    """Deflected, exaggerated, rigid, cylinders from pin to pin by force, and the tip's trace."""
    line, text = 4, 9
    types = {
        ("boom", 0): line, ("boom_exaggerated", 0): line, ("boom_exaggerated", 1): text, ("boom_undeflected", 0): line,
        **{("cylinders", i): line for i in (1, 2, 3, 4)}, ("tip_trace", 0): line,
    }  # fmt: skip
    pivots = np.cumsum([0.0, *(section.length for section in scene.sections)])
    messages = drawn(predictions)
    assert len(messages) == 60
    for k, (message, prediction) in enumerate(zip(messages, predictions, strict=True)):
        assert {key: marker.type for key, marker in message.items()} == types
        for marker in message.values():
            assert (marker.header.frame_id, stamp_of(marker), marker.lifetime.sec) == ("base_link", prediction.stamp, 1)
            assert max(marker.scale.x, marker.scale.z) > 0.0 and marker.color.a > 0.0
            assert marker.pose.orientation.w == 1.0 and marker.action == marker.ADD
        true, ghost, large = (points(message[f"boom{kind}", 0]) for kind in ("", "_undeflected", "_exaggerated"))
        np.testing.assert_array_equal(true, prediction.shape)
        np.testing.assert_array_equal(true[-1], prediction.tip_position)
        np.testing.assert_allclose(ghost[-1], prediction.tip_position - prediction.tip_displacement, atol=1e-12)
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ghost, axis=0).T))])
        assert along[-1] == pytest.approx(pivots[-1], abs=1e-9)
        assert all(np.min(np.abs(along - pivot)) < 1e-9 for pivot in pivots)  # every section of the ghost is straight
        np.testing.assert_allclose(large - ghost, FACTOR * (true - ghost), atol=1e-12)
        label = message["boom_exaggerated", 1]
        assert label.text == "displacements x 7.5"
        assert np.hypot(label.pose.position.x - large[-1, 0], label.pose.position.z - large[-1, 1]) < 1.0
        colours = force_colours(prediction.cylinder_forces / FULL)
        for i, joint in enumerate(scene.joints):
            cylinder, force = message["cylinders", i + 1], prediction.cylinder_forces[i]
            ends, colour = points(cylinder), cylinder.color
            free = joint.cylinder.closed_length + prediction.strokes[i]
            assert np.hypot(*(ends[1] - ends[0])) == pytest.approx(free + force / joint.cylinder.k, abs=2e-4)
            assert (colour.r, colour.g, colour.b, colour.a) == pytest.approx(colours[i], abs=1e-7)
            assert (colour.r > colour.b) == (force > 0.0)  # red in tension
        np.testing.assert_allclose(points(message["cylinders", 1])[0], scene.base.cylinder_pin)
        past = [p.tip_position for p in predictions[: k + 1] if p.stamp >= prediction.stamp - TRACE]
        np.testing.assert_array_equal(points(message["tip_trace", 0]), past)
    assert len(past) == 51 and {bool(force > 0.0) for force in predictions[0].cylinder_forces} == {True, False}


def test_the_trace_starts_anew_where_time_was_set_back(predictions: list[Prediction]) -> None:
    back = replace(predictions[-1], stamp=predictions[2].stamp)
    last = drawn([*predictions[:5], back])[-1]
    np.testing.assert_array_equal(points(last["tip_trace", 0]), [p.tip_position for p in (*predictions[:2], back)])
    far = replace(predictions[-1], stamp=0)
    assert len(drawn([*predictions[:5], far])[-1]["tip_trace", 0].points) == 1
