"""What a running twin says of itself: its parameters, and the texts of its scene and its baseline."""

from __future__ import annotations

from collections.abc import Mapping

from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.task import Future
from std_srvs.srv import Trigger

from ..io.topics import NODE
from ..settings import Settings

NAMES = ("scene", *Settings.model_fields)


class RemoteParameters:
    """Asks the node ``boom_twin`` once, as soon as it is there; `node` is the one that asks."""

    def __init__(self, node: Node) -> None:
        self._client = AsyncParameterClient(node, NODE)
        self._answer: Future | None = None
        self._is_told = False

    def look(self) -> Mapping[str, object]:
        """The values by name, once; empty at any other time. Never waits."""
        if self._answer is None:
            if self._client.services_are_ready():
                self._answer = self._client.get_parameters(list(NAMES))
            return {}
        if self._is_told or not self._answer.done():
            return {}
        self._is_told = True
        pairs = zip(NAMES, self._answer.result().values, strict=False)
        return {name: value for name, each in pairs if (value := parameter_value_to_python(each)) is not None}


class RemoteText:
    """Asks the node ``boom_twin`` once, as soon as it is configured, for a text that its model was built from.

    Parameters
    ----------
    node : Node
        That asks.
    name : str
        Of the service: scene or baseline, see `boom_twin.ros.services.Services`.
    """

    def __init__(self, node: Node, name: str) -> None:
        self._client = node.create_client(Trigger, f"{NODE}/{name}")
        self._answer: Future | None = None
        self._is_told = False

    def look(self) -> str:
        """The text, once; empty at any other time. Never waits."""
        if self._answer is None:
            if self._client.service_is_ready():
                self._answer = self._client.call_async(Trigger.Request())
            return ""
        if self._is_told or not self._answer.done():
            return ""
        self._is_told = True
        return str(self._answer.result().message)
