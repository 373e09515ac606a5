"""The executable ``twin_node``.

Exit codes: 0 stopped by SIGINT, SIGTERM or a shutdown transition; 1 the node could not start (the reason is on stderr);
2 usage.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from threading import Event
from typing import TYPE_CHECKING

from ...errors import BoomTwinError
from ...system.processes import quick_switches, use_one_blas_thread
from ...system.terminal_text import open_closed_streams
from ..startup import end_with_preparation, on_stop_signal, require_rclpy

use_one_blas_thread()

if TYPE_CHECKING:
    from .node import TwinNode


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until it is stopped; returns the exit code.

    `argv` are the arguments without the program's name; by default those of the process.
    """
    open_closed_streams()
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        require_rclpy()
        stop = Event()
        on_stop_signal(stop.set)
        return end_with_preparation(_run(arguments, stop))
    except BoomTwinError as error:
        print(f"twin_node: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 0


def _run(arguments: list[str], stop: Event) -> int:
    from rclpy.utilities import remove_ros_args

    from ..runtime import ros

    parser = ArgumentParser(prog="twin_node", description="The live boom twin, a ROS 2 lifecycle node.")
    parser.epilog = "Parameters: --ros-args -p scene:=PATH --params-file msg_config/twin.yaml"
    with ros(["twin_node", *arguments]):
        _, rest = parser.parse_known_args(remove_ros_args(["twin_node", *arguments])[1:])
        if rest:
            parser.error(f"{' '.join(rest)}: unknown. Parameters and remappings follow --ros-args.")
        from .node import TwinNode

        node = TwinNode()
        try:
            return _live(node, stop)
        finally:
            node.destroy_node()


def _live(node: TwinNode, stop: Event) -> int:
    """Start, spin, stop in order."""
    from ..receive import CallbackTurns
    from ..runtime import STOPPED

    def is_over() -> bool:
        return node.finished or stop.is_set() or (node.failed and node.autostart)

    try:
        if node.autostart and not node.start():
            return 1
        with quick_switches(), CallbackTurns(node, is_over) as turns:
            while not is_over():
                node.queue.serve(turns)
    except STOPPED:
        pass
    if node.failed and node.autostart:
        return 1
    if not node.finished:
        node.get_logger().info("stopping")
        node.leave()
    return 0


if __name__ == "__main__":
    sys.exit(main())
