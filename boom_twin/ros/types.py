"""Messages of rclpy by type name."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from typing import Any


@cache
def message_class(type_name: str) -> Any:
    """The class of ``package/msg/Name``."""
    package, folder, name = type_name.split("/")
    return getattr(import_module(f"{package}.{folder}"), name)


class RclpyTypes:
    """What `boom_twin.io.outlet.Outlet` needs of rclpy's messages."""

    def make(self, type_name: str) -> Any:
        """A new message of ``package/msg/Name`` with its default values."""
        return message_class(type_name)()

    def doubles(self, values: Iterable[float]) -> array[float]:
        """`values` as the array type that rclpy takes without checking each element."""
        return array("d", values)
