"""Messages of the rig to samples in the scene's order."""

from __future__ import annotations

from math import inf, isnan, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ros_messages import SampleDecoder, Topics, imu, joint_state, load_topics, new_message

from boom_twin import Stream, load_scene
from boom_twin.messages.mapping import mapping_from
from boom_twin.messages.sample_decoder import MOST_NAMES, ODDITIES
from boom_twin.messages.topic_table import Sensor, usual
from boom_twin.types import SENSORS

SCENE, RANGES = load_scene(), [(-165.0, 10.0), (-5.0, 85.0)]
FINITE = st.floats(-1e6, 1e6)
OTHER_NAMES = st.text(max_size=12).filter(lambda name: not name.startswith(("joint_", "cylinder_")))


@settings(deadline=None)
@given(
    values=st.lists(FINITE, min_size=1, max_size=6), others=st.lists(st.tuples(OTHER_NAMES, FINITE), max_size=4), data=st.data()
)
def test_any_order_and_extra_names(values: list[float], others: list[tuple[str, float]], data: st.DataObject) -> None:
    pairs = [(f"joint_{i}", value) for i, value in enumerate(values, 1)] + others
    mixed = data.draw(st.permutations(pairs))
    decoder = SampleDecoder(len(values))
    sample = decoder.sample_of(Stream.ANGLES, 12, joint_state([n for n, _ in mixed], [v for _, v in mixed]))
    assert sample is not None and (sample.stream, sample.stamp) == (Stream.ANGLES, 12)
    assert sample.values.tolist() == values
    assert not decoder.oddities


@settings(deadline=None)
@given(
    values=st.lists(st.one_of(FINITE, st.sampled_from([nan, inf, -inf, 1.1e7, -1e300])), min_size=3, max_size=3),
    present=st.sets(st.integers(0, 2)),
    cut=st.integers(0, 3),
)
def test_what_is_left_is_right_and_the_rest_is_nan(values: list[float], present: set[int], cut: int) -> None:
    """Whatever is wrong with a message: a value in the sample is the one under that name, or NaN."""
    names = [f"cylinder_{i + 1}" for i in sorted(present)]
    positions = [values[i] for i in sorted(present)][:cut]
    sample = SampleDecoder(3).sample_of(Stream.STROKES, 1, joint_state(names, positions))
    usable = {i: values[i] for i in sorted(present)[:cut] if abs(values[i]) <= 1e7}
    if not usable:
        assert sample is None
    else:
        assert sample is not None and sample.values.dtype == np.float64
        assert {i: value for i, value in enumerate(sample.values.tolist()) if not isnan(value)} == usable


@pytest.mark.parametrize(
    ("names", "positions", "expected", "oddities"),
    [
        (["cylinder_1", "cylinder_2"], [0.1], [0.1, nan], {"unequal arrays": 1}),
        (["cylinder_1"], [0.1, 0.2], [0.1, nan], {"unequal arrays": 1}),
        (["cylinder_2"], [0.2], [nan, 0.2], {}),
        (["cylinder_1", "cylinder_2"], [nan, 0.2], [nan, 0.2], {"not finite": 1}),
        (["cylinder_1", "cylinder_2"], [0.1, -inf], [0.1, nan], {"not finite": 1}),
        (["cylinder_1", "cylinder_2"], [0.1, 2e7], [0.1, nan], {"absurd magnitude": 1}),
        (["cylinder_1", "cylinder_2"], [nan, 2e7], None, {"not finite": 1, "absurd magnitude": 1, "no usable value": 1}),
        (["joint_1", "joint_2"], [0.1, 0.2], None, {"unknown names only": 1}),
        ([], [], None, {}),
        (["cylinder_1", "cylinder_2"], [], None, {"unequal arrays": 1, "no usable value": 1}),
        (["cylinder_2", "cylinder_1", "cylinder_2"], [0.2, 0.1, 0.9], [0.1, nan], {"name twice": 1}),
        (["cylinder_2", "cylinder_2"], [0.2, 0.2], None, {"name twice": 1, "no usable value": 1}),
    ],
)
def test_oddities_are_counted_by_name(
    names: list[str], positions: list[float], expected: list[float] | None, oddities: dict[str, int]
) -> None:
    decoder = SampleDecoder(2)
    for number in (1, 2):
        sample = decoder.sample_of(Stream.STROKES, 5, joint_state(names, positions))
        assert decoder.oddities == {name: number * count for name, count in oddities.items()}
        assert (sample is None) == (expected is None)
        if sample is not None:
            np.testing.assert_array_equal(sample.values, expected)


def test_names_that_are_not_the_scenes_are_noted_beside_those_that_are_not_there() -> None:
    decoder = SampleDecoder(2)
    decoder.sample_of(Stream.STROKES, 1, joint_state(["cylinder_1", "cylinder2", "swing"], [0.1, 0.2, 0.3]))
    decoder.sample_of(Stream.ANGLES, 1, joint_state(["joint_1"], [0.1]))
    assert decoder.strange_names == {Stream.STROKES: (["cylinder_2"], ["cylinder2", "swing"])}
    decoder.sample_of(Stream.ANGLES, 2, joint_state(["a", "b"], [0.1, 0.2]))
    assert decoder.strange_names[Stream.ANGLES] == (["joint_1", "joint_2"], ["a", "b"])


@pytest.mark.parametrize(
    ("x", "covariance", "values", "oddities"),
    [(0.25, 0.0, [0.25, 9.81], {}), (0.25, -1.0, None, {"no measurement": 1}), (nan, 0.0, [nan, 9.81], {"not finite": 1})],
)
def test_an_imu_gives_x_and_z(x: float, covariance: float, values: list[float] | None, oddities: dict[str, int]) -> None:
    decoder = SampleDecoder(4)
    sample = decoder.sample_of(Stream.IMU, 9, imu(x, 9.81, covariance=covariance))
    assert (sample is None) == (values is None) and dict(decoder.oddities) == oddities
    if sample is not None:
        np.testing.assert_array_equal(sample.values, values)


@pytest.mark.parametrize(("stamp", "name"), [(-1, "impossible stamp"), (2**31 * 10**9, "impossible stamp"), (0, "no stamp")])
def test_impossible_stamps_give_no_sample(stamp: int, name: str) -> None:
    decoder = SampleDecoder(1)
    assert decoder.sample_of(Stream.STROKES, stamp, joint_state(["cylinder_1"], [0.1])) is None
    assert decoder.oddities == {name: 1}


def test_a_flood_of_names_is_not_looked_through() -> None:
    decoder = SampleDecoder(1)
    names = [*(f"x{i}" for i in range(MOST_NAMES)), "cylinder_1"]
    assert decoder.sample_of(Stream.STROKES, 1, joint_state(names, [0.1] * len(names))) is None
    assert decoder.oddities == {"too many names": 1} and f"more than {MOST_NAMES}" in ODDITIES["too many names"]
    assert decoder.sample_of(Stream.STROKES, 2, joint_state(names[1:], [0.1] * MOST_NAMES)) is not None


def mapped(sensors: dict[str, Any], **names: str) -> Topics:
    topics = load_topics()
    named = {stream: {"name": names.get(stream.value, topic.name)} for stream, topic in topics.inputs.items()}
    inputs = {stream: topic.model_copy(update=named[stream]) for stream, topic in topics.inputs.items()}
    made = {channel: Sensor(**(usual(channel) | given)) for channel, given in sensors.items()}
    return topics.model_copy(update={"inputs": inputs, "sensors": made})


@pytest.mark.parametrize(
    ("channel", "given", "reading", "expected"),
    [
        ("cylinder_2", {"name": "b", "unit": "mm", "zero": 12.5}, 112.5, 0.1),
        ("cylinder_2", {"name": "b", "unit": "in"}, 10.0, 0.254),
        ("cylinder_2", {"name": "b", "sign": -1, "scale": 1.01, "zero": 0.5}, 0.2, 0.303),
        ("joint_1", {"name": "pitch", "unit": "deg", "sign": -1, "zero": 90.0}, 180.0, -np.pi / 2),
        ("joint_1", {"name": "pitch", "unit": "gon"}, -50.0, -np.pi / 4),
        ("joint_1", {"name": "pitch", "unit": "mrad"}, 250.0, 0.25),
    ],
)
def test_a_sensor_reads_as_it_is_mapped(channel: str, given: dict[str, Any], reading: float, expected: float) -> None:
    stream = Stream.STROKES if channel.startswith("cyl") else Stream.ANGLES
    other = {"cylinder_2": "cylinder_1", "joint_1": "joint_2"}[channel]
    sample = SampleDecoder(2, mapped({channel: given})).sample_of(
        stream, 1, joint_state([given["name"], other], [reading, 0.7])
    )
    assert sample is not None
    values = dict(zip(SENSORS[stream].channels(2), sample.values.tolist(), strict=True))
    assert values == {channel: pytest.approx(expected, rel=1e-12), other: 0.7}


def test_one_topic_for_both_kinds() -> None:
    """A message feeds the streams that it has values of, and a stream without any is nothing odd."""
    decoder = SampleDecoder(1, mapped({"joint_1": {"name": "a"}}, cylinder_strokes="/rig", joint_angles="/rig"))
    both = joint_state(["other", "a", "cylinder_1"], [9.0, 0.1, 0.2])
    angles, strokes, neither = joint_state(["a"], [0.3]), joint_state(["cylinder_1"], [0.4]), joint_state(["joint_1"], [1.0])
    samples = [
        decoder.sample_of(stream, 1, msg) for msg in (both, angles, strokes) for stream in (Stream.STROKES, Stream.ANGLES)
    ]
    found = [None if sample is None else sample.values.tolist() for sample in samples]
    assert found == [[0.2], [0.1], None, [0.3], [0.4], None] and not decoder.oddities
    assert decoder.sample_of(Stream.STROKES, 1, neither) is None and decoder.oddities == {"unknown names only": 1}


MS = 1_000_000


def cycles(decoder: SampleDecoder, messages: list[tuple[int, dict[str, float]]], stream: Stream = Stream.ANGLES) -> list[Any]:
    """What samples are made of messages, each a stamp and values by name: stamps and values."""
    found = [decoder.samples([stream], t, joint_state(list(m), list(m.values()))) for t, m in messages]
    return [(sample.stamp, sample.values.tolist()) for each in found for sample in each]


@pytest.mark.parametrize("gap", [0, MS])
def test_names_in_messages_of_their_own_are_one_sample_of_each_cycle(gap: int) -> None:
    decoder = SampleDecoder(3)
    apart = [(5 * MS * k + i * gap + 1, {f"joint_{i + 1}": k + 0.1 * i}) for k in range(3) for i in range(3)]
    whole = [(100 * MS, {"joint_3": 3.0, "joint_1": 1.0, "joint_2": 2.0})]
    expected = [(5 * MS * k + 1, [k, k + 0.1, k + 0.2]) for k in range(3)]
    assert cycles(decoder, apart + whole) == [*expected, (100 * MS, [1.0, 2.0, 3.0])]
    assert decoder.oddities == {"names apart": 6} and decoder.refused == 0


@pytest.mark.parametrize("gap", [0, MS])
@pytest.mark.parametrize("lost", [0, 1, 2])
def test_a_cycle_that_lacks_a_name_does_not_mix_with_the_next(gap: int, lost: int) -> None:
    decoder = SampleDecoder(3)
    messages = [(5 * MS * k + i * gap + 1, {f"joint_{i + 1}": 10.0 * k + i}) for k in range(4) for i in range(3)]
    found = cycles(decoder, [each for place, each in enumerate(messages) if place != 3 + lost])
    begin = 5 * MS + 1 + (gap if lost == 0 else 0)
    assert [stamp for stamp, _ in found] == [1, begin, 10 * MS + 1, 15 * MS + 1]
    np.testing.assert_array_equal(found[1][1], [nan if i == lost else 10.0 + i for i in range(3)])
    assert found[2:] == [(10 * MS + 1, [20.0, 21.0, 22.0]), (15 * MS + 1, [30.0, 31.0, 32.0])]
    assert decoder.oddities["missing names"] == 1


def test_messages_that_always_lack_a_name_are_samples_once_the_next_one_comes() -> None:
    decoder = SampleDecoder(2)
    found = cycles(decoder, [(t, {"joint_1": 0.1 * t}) for t in (1, 2, 3)])
    assert [(stamp, values[0], isnan(values[1])) for stamp, values in found] == [(1, 0.1, True), (2, 0.2, True)]
    (left,) = decoder.assembler.rest()
    assert left.stamp == 3 and not list(decoder.assembler.rest())
    absent = SampleDecoder(2, load_topics().model_copy(update={"absent": frozenset({"joint_2"})}))
    assert len(cycles(absent, [(1, {"joint_1": 0.1})])) == 1 and not absent.oddities  # a sensor that is not there


@pytest.mark.parametrize(
    ("reading", "expected"),
    [(-41.0, -41.0), (319.0, -41.0), (-401.0, -41.0), (139.0, 139.0), (679.0, 679.0), (-41.0 * 57.3, -41.0 * 57.3)],
)
def test_an_encoder_a_turn_off_is_taken_modulo_a_turn_where_its_range_decides(reading: float, expected: float) -> None:
    """Half a turn off is an offset, and what is many turns off is in degrees: neither is hidden."""
    joints = [joint.model_copy(update={"range_deg": each}) for joint, each in zip(SCENE.joints, RANGES, strict=False)]
    decoder = SampleDecoder(2, load_topics().of_scene(joints))
    ((_, values),) = cycles(decoder, [(1, {"joint_1": np.radians(reading), "joint_2": np.radians(60.0)})])
    np.testing.assert_allclose(np.degrees(values), [expected, 60.0], atol=1e-9)
    inclinometer = SampleDecoder(1, mapped({"joint_1": {"absolute": "root"}}).of_scene(joints[:1]))
    assert cycles(inclinometer, [(1, {"joint_1": 5.0})]) == [(1, [5.0])]


def test_two_sources_of_one_topic_are_told_and_neither_is_used() -> None:
    """Zeros of a joint_state_publisher beside the encoders, with the same names and stamps; when they end, the encoders are."""
    decoder, encoders = SampleDecoder(2), np.random.default_rng(1).normal(0.5, 1e-4, (400, 2))
    both = [(5 * MS * (k + 1), {"joint_1": a, "joint_2": b}) for k, (a, b) in enumerate(encoders.tolist())]
    zeros = [(t, {"joint_1": 0.0, "joint_2": 0.0}) for t, _ in both[:100]]
    mixed = [each for pair in zip(zeros, both, strict=False) for each in pair] + both[100:]
    found = cycles(decoder, mixed)
    assert len(found) < 4 + 100 and found[-1][0] == both[-1][0] and decoder.oddities["two sources"] == decoder.refused > 300


def test_coarse_stamps_of_one_source_are_no_second_source() -> None:
    decoder, values = SampleDecoder(1), np.random.default_rng(1).normal(0.5, 1e-4, 100).tolist()
    assert len(cycles(decoder, [(10 * MS * (1 + k // 2), {"joint_1": value}) for k, value in enumerate(values)])) == 100


@pytest.mark.parametrize(("frame_id", "taken"), [("boom_2", 2), ("boom_3", 0)])
def test_messages_of_another_frame_are_left_out_and_counted(frame_id: str, taken: int) -> None:
    topics = mapping_from({"inputs": {"imu_2": {"place": {"section": 2}, "frame_id": "boom_2"}}}, "mapping", 2)
    decoder, msg = SampleDecoder(2, topics), new_message("sensor_msgs/msg/Imu")
    msg.header.frame_id, msg.linear_acceleration.z = frame_id, 9.8
    assert len(decoder.samples(topics.streams_by_topic["imu_2"], 10**9, msg)) == taken
    assert decoder.oddities["another frame"] == decoder.refused == (not taken)


def test_a_delay_may_be_unknown() -> None:
    topics = mapping_from({"inputs": {"joint_angles": {"delay": "auto"}, "tip_imu": {"delay": "auto"}}}, "mapping")
    assert topics.lagging == [Stream.ANGLES, Stream.IMU] and topics.delay(Stream.ANGLES) == 0
