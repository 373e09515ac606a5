"""Levels of reception and of publishers."""

from __future__ import annotations

from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import ComponentJudge, Evaluation, Level, Status
from boom_twin.diagnostics.topic_status import Peers, Reception, ReceptionWatch, publishers_status
from boom_twin.types import Stream

T = Thresholds()


def received(*looks: Reception) -> Status:
    """The state after looks that are two seconds apart."""
    watch, judge = ReceptionWatch(), ComponentJudge("reception")
    for second, each in enumerate(looks):
        status = watch.status(judge.begin(Evaluation(T, 2.0 * second, 0.0)), {"cylinder_strokes": each}, {})
    return status


def test_all_is_read() -> None:
    status = received(*(Reception(200 * k, 0, 0, 0, 0.001) for k in range(4)))
    assert (status.level, status.message) == (Level.OK, "all that arrives is read at once")
    assert status.values["cylinder_strokes received"] == 600


def test_messages_that_never_arrive_or_give_way() -> None:
    some = received(*(Reception(1000 * k, 20 * k, 30 * k, 0, 0.001) for k in range(4)))
    assert some.level == Level.WARN and "5% of the messages were not read (20 never arrived, 30 gave way" in some.message
    most = received(*(Reception(1000 * k, 0, 900 * k, 4, 0.001) for k in range(4)))
    assert most.level == Level.ERROR and most.values["cylinder_strokes dropped"] == 2700


def test_messages_that_wait_long() -> None:
    status = received(*(Reception(1000 * k, 0, 0, 100, 0.4) for k in range(4)))
    assert status.level == Level.WARN and "messages wait 0.400 s" in status.message


def test_counts_that_begin_anew_are_no_loss() -> None:
    status = received(Reception(1000, 0, 900), Reception(2000, 0, 1800), Reception(10, 0, 0, 0, 0.001))
    assert status.values["cylinder_strokes unread_share"] == 0.0


def test_numbers_of_several_publishers_are_said_to_tell_nothing() -> None:
    assert "unknown" in str(received(Reception(10, is_numbered=False)).values["cylinder_strokes lost"])


def judge(now: float = 0.0) -> ComponentJudge:
    return ComponentJudge("component").begin(Evaluation(T, now, 0.0))


def publishers(**names: tuple[str, ...]) -> Status:
    peers = {stream: Peers(f"/{stream.value}", names.get(stream.value, ("/driver",))) for stream in Stream}
    followed = dict.fromkeys(Stream, "12.500000000")
    return publishers_status(judge(), peers, followed)


def test_one_source_for_each_topic() -> None:
    assert publishers().level == publishers(tip_imu=()).level == Level.OK


def test_a_second_source_is_an_error_at_once() -> None:
    status = publishers(joint_angles=("/driver", "/other"))
    assert status.level == Level.ERROR
    assert "2 publishers of /joint_angles: /driver, /other" in status.message and "whose stamps go on" in status.message
    assert status.values["/joint_angles newest_stamp_s"] == "12.500000000"


def test_streams_that_share_a_topic_may_have_a_publisher_each() -> None:
    def status(names: tuple[str, ...]) -> Status:
        peers = dict.fromkeys((Stream.STROKES, Stream.ANGLES), Peers("/joint_states", names))
        return publishers_status(judge(), peers, dict.fromkeys(Stream, "1.0"))

    assert status(("/cylinders", "/encoders")).level == Level.OK
    assert status(("/cylinders", "/encoders", "/other")).level == Level.ERROR


def test_what_is_left_out_is_told_at_once_and_only_what_is_new() -> None:
    watch, counts = ReceptionWatch(), ({"shapes": 0}, {"shapes": 7}, {"shapes": 7}, {"shapes": 7})
    reception = ComponentJudge("reception")
    found = [watch.status(reception.begin(Evaluation(T, 10.0 * k, 0.0)), {}, each) for k, each in enumerate(counts)]
    assert [status.level for status in found] == [Level.OK, Level.WARN, Level.OK, Level.OK]
    assert found[1].message == "too many messages for the time there is: 7 shapes left out, no prediction"
    assert [status.values["shapes left_out"] for status in found] == [0, 7, 0, 0]


def test_latency_is_told_beside_the_wait() -> None:
    values = received(Reception(100, 0, 0, 0, 0.001, 0.004)).values
    assert (values["cylinder_strokes wait_s"], values["cylinder_strokes latency_s"]) == (0.001, 0.004)
