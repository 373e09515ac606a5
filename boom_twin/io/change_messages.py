"""Changes of a running twin to and from messages: a JointState serves as a stamped list of named values."""

from __future__ import annotations

from typing import Any

from ..errors import BagError, UsageError
from ..records import Change
from ..settings import Settings
from .factory import RosbagsTypes
from .intake import stamp_of
from .places import fill_header
from .topics import TYPES, Output
from .typestore import jazzy

FROM_REST = "from_rest"


def encode_changes(change: Change) -> bytes:
    """The message of a change, in CDR."""
    values = {FROM_REST: float(change.from_rest), **change.settings, **change.zeros}
    types = RosbagsTypes()
    msg = types.make(TYPES[Output.CHANGES])
    fill_header(msg.header, change.stamp)
    msg.name, msg.position = list(values), types.doubles(list(values.values()))
    return bytes(jazzy().serialize_cdr(msg, TYPES[Output.CHANGES]))


def decode_changes(msg: Any) -> Change:
    """The change of a message.

    Raises
    ------
    BagError
        It has names or values that a change cannot have.
    """
    values = dict(zip(msg.name, map(float, msg.position), strict=False))
    from_rest = bool(values.pop(FROM_REST, 0.0))
    settings = {name: values.pop(name) for name in Settings.live_names() if name in values}
    try:
        Settings().tuned(settings)
    except UsageError as error:
        raise BagError(f"a message of changes cannot be used: {error}") from None
    return Change(stamp_of(msg), from_rest, settings, {name: value for name, value in values.items() if value != 0.0})
