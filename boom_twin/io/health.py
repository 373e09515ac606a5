"""What is known of the rig's health to and from a message: a status for each alarm."""

from __future__ import annotations

from typing import Any

from ..alarms import alarm_of, values_of
from ..records import Alarm, Health
from .factory import RosbagsTypes
from .places import fill_header
from .topics import TYPES, Output
from .typestore import jazzy

OK, WARN, ERROR = range(3)
"""Of diagnostic_msgs/DiagnosticStatus: the alarm has ended; its cause cannot be told; its cause is named."""


def encode_health(health: Health) -> bytes:
    """A diagnostic_msgs/DiagnosticArray in CDR, with the stamp of `health`; see ``topics.yaml`` for its values."""
    types = RosbagsTypes()
    msg = types.make(TYPES[Output.HEALTH])
    fill_header(msg.header, health.stamp)
    msg.status = [_status(alarm, types) for alarm in health.alarms]
    return bytes(jazzy().serialize_cdr(msg, TYPES[Output.HEALTH]))


def decode_health(msg: Any) -> tuple[Alarm, ...]:
    """The alarms of such a message, see `boom_twin.alarms.alarm_of`; a status that is none is left out."""
    found = []
    for status in msg.status:
        try:
            found.append(alarm_of(status.name, status.message, {pair.key: pair.value for pair in status.values}))
        except (KeyError, ValueError, ArithmeticError):
            continue
    return tuple(found)


def _status(alarm: Alarm, types: RosbagsTypes) -> Any:
    status = types.make("diagnostic_msgs/msg/DiagnosticStatus")
    status.level = OK if alarm.until is not None else WARN if alarm.cause is None else ERROR
    status.name, status.message = alarm.channel, alarm.told
    for key, value in values_of(alarm).items():
        pair = types.make("diagnostic_msgs/msg/KeyValue")
        pair.key, pair.value = key, value
        status.values.append(pair)
    return status
