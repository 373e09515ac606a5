"""The life of rclpy in a process: started, stopped by a signal, shut down."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import rclpy
from rclpy.exceptions import ROSInterruptException
from rclpy.executors import ExternalShutdownException
from rclpy.signals import SignalHandlerOptions

from ..errors import UsageError

STOPPED = (KeyboardInterrupt, ExternalShutdownException, ROSInterruptException)
"""What ends a spinning process in order."""
NO_PROFILES = "SKIP_DEFAULT_XML_FILE"
"""Set to 1: Fast DDS does not take ``DEFAULT_FASTRTPS_PROFILES.xml``, which may name log files, from the working directory."""


@contextmanager
def ros(arguments: Sequence[str] | None = None) -> Iterator[None]:
    """rclpy, started with the process's or the given ROS arguments, and shut down at the end.

    rclpy's own signal handlers are left out: they close the context at once, and then a node can no longer say that it
    is going. What a signal does is up to Python, see `boom_twin.ros.stop`. Fast DDS takes its profiles from the file that
    ``FASTRTPS_DEFAULT_PROFILES_FILE`` names, and none from the working directory, which may be a received session's.

    Raises
    ------
    UsageError
        The arguments after ``--ros-args`` cannot be used.
    """
    os.environ.setdefault(NO_PROFILES, "1")
    try:
        rclpy.init(args=None if arguments is None else list(arguments), signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy raises types of its C++ part here
        raise UsageError(f"ROS arguments: {one_line(error)}. Check what follows --ros-args.") from error
    try:
        yield
    finally:
        rclpy.try_shutdown()


def one_line(error: BaseException) -> str:
    """The text of an error of rclpy without line breaks and what its C parts append."""
    return " ".join(str(error).split(", at ./")[0].split()).rstrip(".") or type(error).__name__
