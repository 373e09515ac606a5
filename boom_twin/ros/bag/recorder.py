"""Record topics over DDS into a session bag, message bytes untouched, with the parameters of the running twin."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
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
from ...diagnostics.topic_status import TopicCount, recording_status
from ...errors import BagError, BoomTwinError
from ...messages.topic_table import NODE, Output, load_topics
from ...types import NANO
from ..receive import CallbackTurns, with_information
from ..runtime import DiagnosticsPublisher
from .subscriptions import RequestedTopic, subscription_of

NAMES = ("scene", "mapping", "frame_prefix", *Settings.model_fields)


NAME = "boom_twin_recorder"
LOOK = 0.5  # seconds between looks for new topics, publishers and the disk
LOOKS = 2  # looks from one state on ``/diagnostics`` to the next
COMPLETE = "every required topic has a publisher"


class _TwinValues:
    """Values that the node ``boom_twin`` is asked for once: its ``parameters``, and its ``scene``."""

    def __init__(self, node: Node) -> None:
        client = AsyncParameterClient(node, NODE)
        self._services = {"parameters": (client.services_are_ready, partial(client.get_parameters, list(NAMES)))}
        service = node.create_client(Trigger, f"{NODE}/scene")
        self._services["scene"] = service.service_is_ready, partial(service.call_async, Trigger.Request())
        self._answers: dict[str, Future] = {}

    def poll(self) -> dict[str, object]:
        """Call the services that are there by now; return the values that have come since the last call."""
        for name in [name for name, (is_ready, _) in self._services.items() if is_ready()]:
            self._answers[name] = self._services.pop(name)[1]()
        come = {name: self._answers.pop(name).result() for name in [*self._answers] if self._answers[name].done()}
        return {name: _parameters(answer) if name == "parameters" else str(answer.message) for name, answer in come.items()}


def _parameters(response: Any) -> dict[str, object]:
    pairs = zip(NAMES, response.values, strict=False)
    return {name: value for name, each in pairs if (value := parameter_value_to_python(each)) is not None}


class _Channel:
    """One topic while it is recorded."""

    def __init__(self, wanted: RequestedTopic, node: Any, storage: Storage, tell: Callable[[str], None]) -> None:
        self.wanted, self._node, self._storage, self._tell = wanted, node, storage, tell
        self._subscription: Any = None
        self._key, self._type = -1, ""
        self._other_types: set[str] = set()
        self._number: int | None = None
        self._received = self._missed = self._left_out = 0
        self._has_one = True

    def look(self) -> int:
        """Subscribe if the type is known by now; return the number of publishers.

        With more than one, their sequence numbers are not used.
        """
        if self._subscription is None:
            found = subscription_of(self._node, self.wanted)
            if found is None:
                return 0
            kind, qos, recorded = found
            self._key, self._type = self._storage.add(recorded), recorded.type
            take = with_information(self._store)
            self._subscription = self._node.create_subscription(kind, self.wanted.name, take, qos, raw=True)
        self._tell_other_types()
        number: int = self._subscription.get_publisher_count()
        self._has_one = self._has_one and number <= 1
        return number

    def _tell_other_types(self) -> None:
        """Warn once of each type that is published beside the recorded one: DDS never connects its publishers."""
        published = {each.topic_type for each in self._node.get_publishers_info_by_topic(self._subscription.topic_name)}
        new = published - self._other_types - {self._type, ""}
        for other in sorted(new):
            told = f"is published as {other}, of which nothing is recorded: {self._type} is"
            self._tell(f"warning: {self.wanted.name}: {told}")
        self._other_types |= new

    def count(self, written: Sequence[int] = ()) -> TopicCount:
        """Return the counts so far; `written` is by the storage's numbers."""
        is_known = self._has_one and self._number is not None
        missed = self._missed + self._left_out if is_known else None
        own = written[self._key] if written and self._subscription is not None else 0
        return TopicCount(self.wanted.name, self._received, own, missed)

    def _store(self, data: bytes, info: Mapping[str, Any]) -> None:
        number = info["publication_sequence_number"]
        if number is not None:
            if self._number is not None and number > self._number:
                self._missed += number - self._number - 1
            self._number = number
        if len(data) > LARGEST_MESSAGE:
            self._leave_out(len(data))
            return
        self._received += 1
        sent, number = max(info["source_timestamp"], 0), (number or self._received) % 2**32
        self._storage.put(self._key, info["received_timestamp"], data, sent, number)

    def _leave_out(self, size: int) -> None:
        """Leave out a message that could not be read again and would end the reading of all others; warn once."""
        if not self._left_out:
            told = f"a message of {size} bytes is left out, as all above {LARGEST_MESSAGE} are: they could not be read again"
            self._tell(f"warning: {self.wanted.name}: {told} (told once)")
        self._left_out += 1


@contextmanager
def recorder_node() -> Iterator[Any]:
    """Provide the recorder's node within a context; needs an initialised rclpy."""
    node = rclpy.create_node(NAME)
    try:
        yield node
    finally:
        node.destroy_node()


class Recorder:
    """Recording of topics, with its state on ``/diagnostics``. Log times are those of the reception.

    `tell` is told in words when recording begins, once every required topic has a publisher (`COMPLETE`), and what is left
    out.
    """

    def __init__(
        self, node: Any, storage: Storage, wanted: Sequence[RequestedTopic], thresholds: Thresholds, tell: Callable[[str], None]
    ) -> None:
        self._node, self._storage, self._thresholds, self._tell = node, storage, thresholds, tell
        self._channels = [_Channel(each, node, storage, tell) for each in wanted]
        self._publisher = DiagnosticsPublisher(node, load_topics().outputs[Output.DIAGNOSTICS])
        self._judge, self._twin_values = ComponentJudge("recording"), _TwinValues(node)

    def run(self, stopped: Callable[[], bool], on_twin: Callable[[Mapping[str, object]], None]) -> list[TopicCount]:
        """Record until `stopped`, which is asked every `boom_twin.ros.receive.WAKE` s; return the counts by topic.

        `on_twin` is told what the twin says of itself, if there is one: its ``parameters``, and the text of its ``scene``.
        Raise BagError if the bag cannot be written, or not all that was received was written. Raise UsageError if the type of
        a topic is not installed.
        """
        try:
            try:
                self._receive(stopped, on_twin)
            finally:
                written = self._storage.close()
            counts = [channel.count(written) for channel in self._channels]
            if wrong := [count for count in counts if count.written != count.received]:
                told = "; ".join(f"{count.topic}: {count.received} received, {count.written} written" for count in wrong)
                raise BagError(f"not all that was received was written ({told}). Report this fault.")
            self._publish(end="")
        except BoomTwinError as error:
            self._publish(end=str(error))
            raise
        return counts

    def _receive(self, stopped: Callable[[], bool], on_twin: Callable[[Mapping[str, object]], None]) -> None:
        self._look()
        self._tell(f"recording {len(self._channels)} topics; Ctrl-C ends it")
        due, looks, is_complete = time.monotonic() + LOOK, 0, False
        with CallbackTurns(self._node, lambda: stopped() or time.monotonic() >= due) as turns:
            while not stopped():
                turns.run()
                if time.monotonic() < due:
                    continue
                due, looks = time.monotonic() + LOOK, looks + 1
                if self._look() and not is_complete:
                    is_complete = True
                    self._tell(COMPLETE)
                if told := self._twin_values.poll():
                    on_twin(told)
                if looks % LOOKS == 0:
                    self._publish()

    def _look(self) -> bool:
        """Subscribe to new topics; return True if every required topic has a publisher. Raises BagError if the disk fails."""
        self._storage.check()
        publishers = [(channel.look(), channel.wanted.required) for channel in self._channels]
        return all(number for number, is_required in publishers if is_required)

    def _publish(self, end: str | None = None) -> None:
        """Publish the recording's state; `end` as for `boom_twin.diagnostics.topic_status.recording_status`."""
        counts = [channel.count() for channel in self._channels]
        at = Evaluation(self._thresholds, time.monotonic(), self._node.get_clock().now().nanoseconds * NANO)
        self._publisher.show([recording_status(self._judge.begin(at), counts, self._storage.state(), end)])
        if end is not None:
            self._publisher.settle()
