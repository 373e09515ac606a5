"""Record topics over DDS into a session bag, message bytes untouched, with the parameters of the running twin."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future
from std_srvs.srv import Trigger

from ...bag.async_writer import Storage
from ...bag.writer import LARGEST_MESSAGE
from ...config.settings import Settings, Thresholds
from ...diagnostics.levels import ComponentJudge, Evaluation
from ...diagnostics.recorder_status import TopicState, recording_status
from ...errors import BagError, BoomTwinError
from ...messages.topic_table import NODE, Output, load_topics
from ...types import NANO
from ..node.diagnostics import DiagnosticsPublisher
from ..runtime import CallbackTurns, with_information
from .subscriptions import RequestedTopic, subscription_of

NAMES = ("scene", "mapping", "frame_prefix", *Settings.model_fields)


class RemoteValue:
    """Value that is asked of another node once, as soon as its service is there, without waiting.

    Parameters
    ----------
    is_ready : callable
        Whether the service is there.
    ask : callable
        Sends the request.
    read : callable
        Gives the value of the response.
    """

    def __init__(self, is_ready: Callable[[], bool], ask: Callable[[], Future], read: Callable[[Any], Any]) -> None:
        self._is_ready, self._ask, self._read = is_ready, ask, read
        self._answer: Future | None = None
        self._is_told = False

    def poll(self) -> Any:
        """Return the value once, as soon as it is known; None at any other time."""
        if self._answer is None:
            self._answer = self._ask() if self._is_ready() else None
        if self._is_told or self._answer is None or not self._answer.done():
            return None
        self._is_told = True
        return self._read(self._answer.result())


def twin_values(node: Node) -> dict[str, RemoteValue]:
    """Return the values to ask of the node ``boom_twin``: its ``parameters``, and by the services' names its `TEXTS`."""

    def read_parameters(response: Any) -> dict[str, object]:
        pairs = zip(NAMES, response.values, strict=False)
        return {name: value for name, each in pairs if (value := parameter_value_to_python(each)) is not None}

    client = AsyncParameterClient(node, NODE)
    ask = partial(client.get_parameters, list(NAMES))
    found = {"parameters": RemoteValue(client.services_are_ready, ask, read_parameters)}
    for name in TEXTS:
        service = node.create_client(Trigger, f"{NODE}/{name}")
        ask = partial(service.call_async, Trigger.Request())
        found[name] = RemoteValue(service.service_is_ready, ask, lambda response: str(response.message))
    return found


NAME = "boom_twin_recorder"
LOOK = 0.5
"""Seconds between looks for new topics, publishers and the disk."""
LOOKS = 2
"""Looks from one state on ``/diagnostics`` to the next."""
TEXTS = ("scene", "baseline")
"""Services of the twin that tell what its model was built from."""
COMPLETE = "every required topic has a publisher"


@dataclass(slots=True)
class Count:
    """Message counts of one topic.

    Attributes
    ----------
    topic : str
    received, written : int
    missed : int or None
        Published but never received, by the publisher's numbers, or left out; None where there were several publishers or none.
    """

    topic: str
    received: int = 0
    written: int = 0
    missed: int | None = None


class _Channel:
    """One topic while it is recorded."""

    def __init__(self, wanted: RequestedTopic, storage: Storage, tell: Callable[[str], None]) -> None:
        self.wanted, self._storage, self._tell = wanted, storage, tell
        self.subscription: Any = None
        self.count = Count(wanted.name)
        self._key, self._type = -1, ""
        self._other_types: set[str] = set()
        self._number: int | None = None
        self._has_one = True
        self._left_out = 0

    def open(self, node: Any) -> None:
        """Subscribe, if the type is known by now."""
        if self.subscription is not None:
            return
        found = subscription_of(node, self.wanted)
        if found is not None:
            self._key, self._type = self._storage.add(found.recorded), found.recorded.type
            take = with_information(self._store)
            self.subscription = node.create_subscription(found.kind, self.wanted.name, take, found.qos, raw=True)

    def look(self, node: Any) -> int:
        """Return the number of publishers. With more than one, their sequence numbers are not used."""
        if self.subscription is None:
            return 0
        self._tell_other_types(node)
        number: int = self.subscription.get_publisher_count()
        self._has_one = self._has_one and number <= 1
        return number

    def _tell_other_types(self, node: Any) -> None:
        """Warn once of each type that is published beside the recorded one: DDS never connects its publishers."""
        published = {each.topic_type for each in node.get_publishers_info_by_topic(self.subscription.topic_name)}
        new = published - self._other_types - {self._type, ""}
        for other in sorted(new):
            told = f"is published as {other}, of which nothing is recorded: {self._type} is"
            self._tell(f"warning: {self.wanted.name}: {told}")
        self._other_types |= new

    @property
    def missed(self) -> int | None:
        """Messages that never arrived or were left out, if that can be known."""
        if self.count.missed is None or not self._has_one:
            return None
        return self.count.missed + self._left_out

    def finish(self, written: Sequence[int]) -> Count:
        """Return the final counts."""
        self.count.written = written[self._key] if self.subscription is not None else 0
        self.count.missed = self.missed
        return self.count

    def _store(self, data: bytes, info: Mapping[str, Any]) -> None:
        received = info["received_timestamp"]
        number = info["publication_sequence_number"]
        if number is not None:
            if self._number is not None and number > self._number:
                self.count.missed = (self.count.missed or 0) + number - self._number - 1
            self._number, self.count.missed = number, self.count.missed or 0
        if len(data) > LARGEST_MESSAGE:
            self._leave_out(len(data))
            return
        self.count.received += 1
        self._storage.put(self._key, received, data, max(info["source_timestamp"], 0), (number or self.count.received) % 2**32)

    def _leave_out(self, size: int) -> None:
        """Leave out a message that could not be read again and would end the reading of all others; warn once."""
        if not self._left_out:
            told = f"a message of {size} bytes is left out, as all above {LARGEST_MESSAGE} are: they could not be read again"
            self._tell(f"warning: {self.wanted.name}: {told} (told once)")
        self._left_out += 1


class _Recording:
    """Recording in progress, with its state on ``/diagnostics``."""

    def __init__(
        self, node: Any, storage: Storage, wanted: Sequence[RequestedTopic], thresholds: Thresholds, tell: Callable[[str], None]
    ) -> None:
        self.node, self.storage, self._thresholds = node, storage, thresholds
        self.channels = [_Channel(each, storage, tell) for each in wanted]
        self._publisher = DiagnosticsPublisher(node, load_topics().outputs[Output.DIAGNOSTICS])
        self._judge = ComponentJudge("recording")
        self._twin_values = twin_values(node)

    def look(self) -> bool:
        """Subscribe to new topics; return True if every required topic has a publisher. Raises BagError if the disk fails."""
        self.storage.check()
        for channel in self.channels:
            channel.open(self.node)
        numbers = [channel.look(self.node) for channel in self.channels]
        return all(number for channel, number in zip(self.channels, numbers, strict=True) if channel.wanted.required)

    def twin(self) -> dict[str, object]:
        """Return the values that the twin has answered since the last look, by the names of `twin_values`."""
        return {name: value for name, each in self._twin_values.items() if (value := each.poll())}

    def tell(self, end: str | None = None) -> None:
        """Publish the recording's state; `end` as for `boom_twin.diagnostics.recorder_status.recording_status`."""
        topics = {each.count.topic: TopicState(each.count.received, each.missed) for each in self.channels}
        clock = self.node.get_clock().now().nanoseconds * NANO
        at = Evaluation(self._thresholds, time.monotonic(), clock)
        self._publisher.show([recording_status(self._judge.begin(at), topics, self.storage.state(), end)])
        if end is not None:
            self._publisher.settle()


@contextmanager
def recorder_node() -> Iterator[Any]:
    """Provide the recorder's node within a context; needs an initialised rclpy."""
    node = rclpy.create_node(NAME)
    try:
        yield node
    finally:
        node.destroy_node()


def record(
    node: Any,
    storage: Storage,
    wanted: Sequence[RequestedTopic],
    thresholds: Thresholds,
    stopped: Callable[[], bool],
    tell: Callable[[str], None],
    on_twin: Callable[[Mapping[str, object]], None],
) -> list[Count]:
    """Record until `stopped`. Log times are those of the reception.

    Parameters
    ----------
    node : Node
        See `recorder_node`.
    storage : Storage
        Completed at the end.
    wanted : sequence of RequestedTopic
    thresholds : Thresholds
        Of the state on ``/diagnostics``.
    stopped : callable
        Asked every `boom_twin.ros.runtime.WAKE` s.
    tell : callable
        Told in words when recording begins, once every required topic has a publisher (`COMPLETE`), and what is left out.
    on_twin : callable
        Told what the twin says of itself, if there is one: its ``parameters``, and `TEXTS` by name.

    Returns
    -------
    list of Count
        By topic.

    Raises
    ------
    BagError
        The bag cannot be written, or not all that was received was written.
    UsageError
        The type of a topic is not installed.
    """
    recording = _Recording(node, storage, wanted, thresholds, tell)
    try:
        try:
            _spin(recording, stopped, tell, on_twin)
        finally:
            written = storage.close()
        counts = [channel.finish(written) for channel in recording.channels]
        if wrong := [count for count in counts if count.written != count.received]:
            told = "; ".join(f"{count.topic}: {count.received} received, {count.written} written" for count in wrong)
            raise BagError(f"not all that was received was written ({told}). Report this fault.")
        recording.tell(end="")
    except BoomTwinError as error:
        recording.tell(end=str(error))
        raise
    return counts


def _spin(
    recording: _Recording,
    stopped: Callable[[], bool],
    tell: Callable[[str], None],
    on_twin: Callable[[Mapping[str, object]], None],
) -> None:
    """Receive until `stopped`."""
    recording.look()
    tell(f"recording {len(recording.channels)} topics; Ctrl-C ends it")
    due, looks, is_complete = time.monotonic() + LOOK, 0, False
    with CallbackTurns(recording.node, lambda: stopped() or time.monotonic() >= due) as turns:
        while not stopped():
            turns.run()
            if time.monotonic() < due:
                continue
            due, looks = time.monotonic() + LOOK, looks + 1
            if recording.look() and not is_complete:
                is_complete = True
                tell(COMPLETE)
            if told := recording.twin():
                on_twin(told)
            if looks % LOOKS == 0:
                recording.tell()
