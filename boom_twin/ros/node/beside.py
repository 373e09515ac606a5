"""Background work of a node: a thread for long tasks, and the process of the live page."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from threading import Thread
from typing import Generic, TypeVar

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ...messages.topic_table import Topics
from ...system.processes import end_process, python_command
from ..startup import PREPARATION

Result = TypeVar("Result")


class BackgroundTask(Generic[Result]):
    """Work too long for a callback, done in a thread. A callback of `node` receives its result.

    The thread is a daemon, because a compiler in it cannot be interrupted, see `boom_twin.ros.startup.end_with_preparation`.
    `use` receives the result of `work`, and `give_up` its exception, both in the executor's thread.
    """

    def __init__(
        self,
        node: Node,
        work: Callable[[], Result],
        use: Callable[[Result], None],
        give_up: Callable[[Exception], None],
    ) -> None:
        look_for_result = 0.05  # seconds of steady time between looks at whether the work is done
        self._node, self._work, self._use, self._give_up = node, work, use, give_up
        self._ended: Callable[[], None] | None = None
        self._timer = node.create_timer(look_for_result, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        Thread(target=self._run, name=PREPARATION, daemon=True).start()

    def abandon(self) -> None:
        """Discard the result; the thread ends by itself."""
        self._node.destroy_timer(self._timer)

    def _run(self) -> None:
        try:
            result = self._work()
        except Exception as error:
            reason = error  # Python deletes `error` after this block
            self._ended = lambda: self._give_up(reason)
        else:
            self._ended = lambda: self._use(result)

    def _look(self) -> None:
        if self._ended is not None:
            self.abandon()
            self._ended()


END_TIMEOUT = 1.0  # seconds that it may take to end


class MonitorProcess:
    """Child process of the monitor, from now until `close`. If it ends before, one line reports that and nothing else changes.

    It shares no socket, lock or queue with the node: it hears the node's topics as any subscriber does. Its standard input is
    a pipe that the node holds, so it ends with the node however that ends. The page listens to the names, namespace and
    remappings of `node`. `mapping` and `scene` are paths; empty: the package's own.
    """

    def __init__(self, node: Node, topics: Topics, mapping: str, scene: str) -> None:
        look_for_end = 1.0  # seconds of steady time between looks at whether it still runs
        self._node = node
        namespace = node.get_namespace()
        there = topics.in_namespace(namespace)
        own_names, names_there = ([*each.inputs.values(), *each.outputs.values(), each.events] for each in (topics, there))
        pairs = zip(names_there, own_names, strict=True)
        names = {one.name: node.resolve_topic_name(other.name) for one, other in pairs}
        arguments = ["--until-stdin-ends"]
        for option, path in (("--mapping", mapping), ("--scene", scene)):
            arguments += [option, path] if path else []
        arguments += ["--ros-args", "-r", f"__ns:={namespace}"]
        for name, resolved in names.items():
            arguments += ["-r", f"{name}:={resolved}"] if resolved != name else []
        command = python_command("boom_twin.cli.main", "monitor", *arguments)
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE)
        self._timer = node.create_timer(look_for_end, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        """End the process."""
        self._timer.destroy()
        end_process(self._process, END_TIMEOUT)

    def _look(self) -> None:
        code = self._process.poll()
        if code is not None:
            self._timer.cancel()
            self._node.get_logger().warning(f"the monitor ended with {code}; `boom_twin monitor` starts another one")
