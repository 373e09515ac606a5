"""Work in a thread beside the callbacks of a node."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread
from typing import Generic, TypeVar

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from ..startup import PREPARATION

Result = TypeVar("Result")

LOOK = 0.05  # period of the checks for the end of the work, s


class BackgroundTask(Generic[Result]):
    """Work too long for a callback, done in a thread. A callback of `node` receives its result.

    The thread is a daemon, because a compiler in it cannot be interrupted, see `boom_twin.ros.startup.end_with_preparation`.

    Parameters
    ----------
    use : callable
        Receiver of the result of `work`, in the executor's thread.
    give_up : callable
        Receiver of an exception of `work`, in the executor's thread.
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
