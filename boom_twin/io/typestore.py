"""The message definitions of ROS 2 Jazzy, generated once."""

from __future__ import annotations

from functools import cache

from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore


@cache
def jazzy() -> Typestore:
    """The store that encodes, decodes and describes every message here; nothing is ever registered in it."""
    return get_typestore(Stores.ROS2_JAZZY)
