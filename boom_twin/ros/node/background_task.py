"""Work in a thread beside the callbacks of a node."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread
from typing import Generic, TypeVar

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

Result = TypeVar("Result")

LOOK = 0.05  # s of steady time between checks for the end of the work


class BackgroundTask(Generic[Result]):
    """Work that takes too long for a callback, done in a thread; a callback of `node` takes its result.

    The thread is a daemon: a compiler that works in it cannot be interrupted, see `boom_twin.ros.startup.end_with_threads`.

    Parameters
    ----------
    node : Node
    work : callable
        Is called in the thread.
    use : callable
        Takes what `work` returned, in the thread of the executor.
    give_up : callable
        Takes what `work` raised, in the thread of the executor.
    """

    def __init__(
        self,
        node: Node,
        work: Callable[[], Result],
        use: Callable[[Result], None],
        give_up: Callable[[Exception], None],
    ) -> None:
        self._node, self._work, self._use, self._give_up = node, work, use, give_up
        self._ended: Callable[[], None] | None = None
        self._timer = node.create_timer(LOOK, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        Thread(target=self._run, name="preparation", daemon=True).start()

    def abandon(self) -> None:
        """Let the thread end by itself; its result is not used."""
        self._node.destroy_timer(self._timer)

    def _run(self) -> None:
        try:
            result = self._work()
        except Exception as error:
            reason = error  # the name `error` ends with this block
            self._ended = lambda: self._give_up(reason)
        else:
            self._ended = lambda: self._use(result)

    def _look(self) -> None:
        if self._ended is not None:
            self.abandon()
            self._ended()
