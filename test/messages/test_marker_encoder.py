"""What ``shape`` draws: by name, number, place, colour, words and time."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from drive_twin import drive_twin

from boom_twin import Sample, Stream, load_scene
from boom_twin.messages.marker_encoder import TRACE, ShapeMarkers, force_colour
from boom_twin.messages.sample_decoder import stamp_of
from boom_twin.messages.topic_table import TYPES, Output
from boom_twin.messages.type_store import jazzy
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.types import Prediction

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


def drawn(predictions: list[Prediction]) -> list[dict[tuple[str, int], dict[str, Any]]]:
    """By namespace and id what the messages hold."""
    markers = ShapeMarkers(FACTOR, FULL)
    messages = [jazzy().deserialize_cdr(markers.fill(prediction), TYPES[Output.SHAPE]) for prediction in predictions]
    return [{(m.ns, m.id): snapshot(m) for m in message.markers} for message in messages]


def snapshot(m: Any) -> dict[str, Any]:
    assert all(point.y == 0.0 for point in m.points) and m.pose.orientation.w == 1.0 and m.action == m.ADD
    return {
        "type": m.type,
        "points": np.array([(point.x, point.z) for point in m.points]),
        "colour": (m.color.r, m.color.g, m.color.b, m.color.a),
        "place": (m.pose.position.x, m.pose.position.z),
        "text": m.text,
        "size": (m.scale.x, m.scale.z),
        "lifetime": m.lifetime.sec + 1e-9 * m.lifetime.nanosec,
        "frame": m.header.frame_id,
        "stamp": stamp_of(m),
    }


@pytest.fixture(scope="module")
def messages(predictions: list[Prediction]) -> list[dict[tuple[str, int], dict[str, Any]]]:
    return drawn(predictions)


def test_names_and_numbers_are_the_same_in_every_message(messages: Any) -> None:
    line, text = 4, 9
    expected = {
        ("boom", 0): line, ("boom_exaggerated", 0): line, ("boom_exaggerated", 1): text, ("boom_undeflected", 0): line,
        **{("cylinders", i): line for i in (1, 2, 3, 4)}, ("tip_trace", 0): line,
    }  # fmt: skip
    assert len(messages) == 60
    for message in messages:
        assert {key: marker["type"] for key, marker in message.items()} == expected


def test_every_marker_goes_when_no_other_comes(messages: Any, predictions: list[Prediction]) -> None:
    for message, prediction in zip(messages, predictions, strict=True):
        for marker in message.values():
            assert (marker["frame"], marker["stamp"], marker["lifetime"]) == ("base_link", prediction.stamp, 1.0)
            assert max(marker["size"]) > 0.0 and marker["colour"][3] > 0.0


def test_the_boom_is_true_to_scale(messages: Any, predictions: list[Prediction]) -> None:
    for message, prediction in zip(messages, predictions, strict=True):
        np.testing.assert_array_equal(message["boom", 0]["points"], prediction.shape)
        np.testing.assert_array_equal(message["boom", 0]["points"][-1], prediction.tip_position)


def test_the_ghost_is_the_rigid_boom(messages: Any, predictions: list[Prediction], scene: Any) -> None:
    """Its tip is where no displacement leaves it; every point lies on a straight section."""
    reach = np.cumsum([0.0, *(section.length for section in scene.sections)])
    for message, prediction in zip(messages, predictions, strict=True):
        ghost = message["boom_undeflected", 0]["points"]
        np.testing.assert_allclose(ghost[-1], prediction.tip_position - prediction.tip_displacement, atol=1e-12)
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ghost, axis=0).T))])
        assert along[-1] == pytest.approx(reach[-1], abs=1e-9)
        assert all(np.min(np.abs(along - pivot)) < 1e-9 for pivot in reach)


def test_the_large_boom_has_the_factor_in_points_and_words(messages: Any) -> None:
    for message in messages:
        true, straight = message["boom", 0]["points"], message["boom_undeflected", 0]["points"]
        large, label = message["boom_exaggerated", 0]["points"], message["boom_exaggerated", 1]
        np.testing.assert_allclose(large - straight, FACTOR * (true - straight), atol=1e-12)
        assert label["text"] == "displacements x 7.5"
        assert np.hypot(*(label["place"] - large[-1])) < 1.0


def test_cylinders_reach_from_pin_to_pin(messages: Any, predictions: list[Prediction], scene: Any) -> None:
    """Their lengths are closed length, stroke, and what the force does to the oil."""
    for message, prediction in zip(messages, predictions, strict=True):
        for i, joint in enumerate(scene.joints):
            ends = message["cylinders", i + 1]["points"]
            free = joint.cylinder.closed_length + prediction.strokes[i]
            oil = prediction.cylinder_forces[i] / joint.cylinder.k
            assert np.hypot(*(ends[1] - ends[0])) == pytest.approx(free + oil, abs=2e-4)
        np.testing.assert_allclose(message["cylinders", 1]["points"][0], scene.base.cylinder_pin)


def test_cylinders_are_red_in_tension_and_blue_in_compression(messages: Any, predictions: list[Prediction]) -> None:
    for message, prediction in zip(messages, predictions, strict=True):
        for i, force in enumerate(prediction.cylinder_forces, start=1):
            colour = message["cylinders", i]["colour"]
            assert colour == pytest.approx(force_colour(force / FULL), abs=1e-7)
            assert (colour[0] > colour[2]) == (force > 0.0)
    assert {bool(force > 0.0) for force in predictions[0].cylinder_forces} == {True, False}


def test_colours_saturate_and_survive_nan() -> None:
    assert force_colour(1.0) == force_colour(5.0) and force_colour(-1.0) == force_colour(-np.inf)
    assert force_colour(0.0)[:3] == (0.75, 0.75, 0.75)
    assert all(0.0 <= value <= 1.0 for share in np.linspace(-2, 2, 41) for value in force_colour(share))
    assert np.isfinite(force_colour(np.nan)).all()


def test_the_trace_is_the_tip_of_the_last_seconds(messages: Any, predictions: list[Prediction]) -> None:
    for k, message in enumerate(messages):
        past = [p.tip_position for p in predictions[: k + 1] if p.stamp >= predictions[k].stamp - TRACE]
        np.testing.assert_array_equal(message["tip_trace", 0]["points"], past)
    assert len(messages[-1]["tip_trace", 0]["points"]) == 51


def test_the_trace_starts_anew_where_time_was_set_back(predictions: list[Prediction]) -> None:
    back = replace(predictions[-1], stamp=predictions[2].stamp)
    traces = [message["tip_trace", 0]["points"] for message in drawn([*predictions[:5], back])]
    np.testing.assert_array_equal(traces[-1], [p.tip_position for p in (*predictions[:2], back)])
    far = replace(predictions[-1], stamp=0)
    assert len(drawn([*predictions[:5], far])[-1]["tip_trace", 0]["points"]) == 1
