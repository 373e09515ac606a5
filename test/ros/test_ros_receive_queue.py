"""Messages that wait for their turn: order, who gives way, what is counted. No DDS."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from typing import Any

import pytest

from boom_twin.ros.node.receive_queue import LARGEST, ReceiveQueue

MS = 1_000_000


class Bus:
    """A queue with topics ``a`` (4 may wait) and ``b`` (100), and a clock that is set here."""

    def __init__(self) -> None:
        self.now, self.read = 10**18, list[bytes]()
        self.queue = ReceiveQueue(lambda: self.now)
        self.put = {name: self.queue.open(name, depth, self.read.append) for name, depth in (("a", 4), ("b", 100))}

    def send(self, name: str, data: bytes, number: int | None = None, age: int = 0) -> None:
        info = {"received_timestamp": self.now - age, "publication_sequence_number": number}
        self.put[name](data, info)


@pytest.fixture
def bus() -> Bus:
    return Bus()


def test_messages_of_all_topics_are_read_in_the_order_of_arrival(bus: Bus) -> None:
    for name, data in (("b", b"1"), ("a", b"2"), ("a", b"3"), ("b", b"4")):
        bus.send(name, data)
    assert bus.queue
    bus.queue.work(1.0)
    assert bus.read == [b"1", b"2", b"3", b"4"] and not bus.queue


def test_the_oldest_of_a_flooded_topic_gives_way_and_the_other_topic_suffers_nothing(bus: Bus) -> None:
    bus.send("b", b"kept")
    for number in range(10):
        bus.send("a", bytes([number]), number)
    bus.queue.work(1.0)
    assert bus.read == [b"kept", bytes([6]), bytes([7]), bytes([8]), bytes([9])]
    found = bus.queue.look()
    assert (found["a"].received, found["a"].dropped, found["a"].lost) == (10, 6, 0)
    assert (found["b"].received, found["b"].dropped) == (1, 0)


def test_a_message_that_would_take_long_to_read_is_left_out_at_once(bus: Bus) -> None:
    bus.send("b", bytes(LARGEST + 1), 1)
    assert not bus.queue and bus.queue.oddities == {"too large": 1}
    bus.send("b", bytes(LARGEST), 2)
    bus.queue.work(1.0)
    assert bus.read == [bytes(LARGEST)] and bus.queue.look()["b"].lost == 0


def test_work_ends_when_its_time_is_over_and_goes_on_later() -> None:
    queue, read = ReceiveQueue(), list[bytes]()

    def slowly(data: bytes) -> None:
        read.append(data)
        time.sleep(0.02)

    put = queue.open("a", 10, slowly)
    for number in range(5):
        put(bytes([number]), {"received_timestamp": 0, "publication_sequence_number": None})
    queue.work(0.01)
    assert len(read) == 1 and queue  # the first one took all of the time
    queue.work(60.0)
    assert len(read) == 5 and not queue


def test_messages_are_read_as_they_come_until_one_had_to_wait(bus: Bus) -> None:
    class Turns:
        """Have three messages in one turn."""

        has_ended = False

        def end(self) -> None:
            self.has_ended = True

        def poll(self) -> None:
            """No more wait."""

        def run(self) -> None:
            bus.send("b", b"1")
            assert bus.read == [b"1"] and not self.has_ended
            bus.send("b", b"2", age=30 * MS)
            bus.send("b", b"3")
            assert bus.read == [b"1"] and self.has_ended

    turns: Any = Turns()
    bus.queue.serve(turns)
    assert bus.read == [b"1", b"2", b"3"]
    bus.send("b", b"4")
    assert bus.read == [b"1", b"2", b"3"] and bus.queue


def test_numbers_tell_what_never_arrived_but_not_those_of_two_publishers(bus: Bus) -> None:
    for number in (5, 6, 9, 10):
        bus.send("b", b"", number)
    found = bus.queue.look()["b"]
    assert (found.lost, found.is_numbered) == (2, True)
    bus.send("b", b"", 13)
    assert bus.queue.look()["b"].lost == 4
    for number in (5, 1000, 6, 1001, 7):
        bus.send("a", b"", number)
    found = bus.queue.look()["a"]
    assert (found.lost, found.is_numbered) == (0, False)


def test_waiting_and_age(bus: Bus) -> None:
    bus.send("b", b"")
    assert not bus.queue.is_behind
    bus.send("b", b"", age=30 * MS)
    assert bus.queue.is_behind and bus.queue.look()["b"].waiting == 2
    bus.now += 50 * MS
    bus.queue.work(1.0)
    found = bus.queue.look()["b"]
    assert found.waiting == 0 and found.wait == pytest.approx(0.08)


def test_nothing_is_taken_after_listening_ended_though_it_still_stood_in_the_executors_row(bus: Bus) -> None:
    old = bus.put["a"]
    bus.send("a", b"1")
    bus.queue.close()
    bus.queue.work(1.0)
    assert not bus.queue and bus.read == [] and bus.queue.look() == {}
    bus.put["a"] = bus.queue.open("a", 4, bus.read.append)
    old(b"0", {"received_timestamp": bus.now, "publication_sequence_number": 1})
    bus.send("a", b"2")
    bus.queue.work(1.0)
    assert bus.read == [b"2"]


@pytest.mark.parametrize("as_one", [True, False], ids=["events executor of rclpy 7.1", "single-threaded executor"])
def test_both_ways_in_which_rclpy_calls_back(bus: Bus, as_one: bool) -> None:
    put: Callable[..., Any] = bus.put["a"]
    assert len(inspect.signature(put).parameters) == 2
    message = (b"1", {"received_timestamp": 0, "publication_sequence_number": 1})
    put(message) if as_one else put(*message)
    bus.queue.work(1.0)
    assert bus.read == [b"1"]
