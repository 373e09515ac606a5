"""Messages that wait for their turn: order, who gives way, what is counted. No DDS."""

from __future__ import annotations

import time

import pytest

from boom_twin.ros.node.receive_queue import ReceiveQueue


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
