"""Alarms of the rig's health to and from their message."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from boom_twin.messages.report_encoder import decode_health, encode_health
from boom_twin.messages.topic_table import TYPES, Output
from boom_twin.messages.type_store import jazzy
from boom_twin.types import Alarm, Health, Ranked

BEGIN = 1_700_000_000_123_000_000
RANKED = (
    Ranked("cylinder_1.k", 0.75, (("softer", 0.3, 0.01, ""),)),
    Ranked("joint_1.sensor", 0.25, (("bias", 0.01, 0.001, "rad"),)),
)
OPEN = Alarm("joint_1", "residual", BEGIN, None, None, "cannot be told apart", RANKED)
STUCK = Alarm("joint_3", "stuck", BEGIN, BEGIN + 1_500_000_000, "joint_3.sensor", "repeats one value")


def sent(*alarms: Alarm):
    data = encode_health(Health(BEGIN + 2_000_000_000, alarms, np.zeros(2)))
    return jazzy().deserialize_cdr(data, TYPES[Output.HEALTH])


def test_alarms_come_back_to_the_millisecond_without_the_sizes_of_what_may_be():
    found = decode_health(sent(OPEN, STUCK))
    bare = tuple(replace(each, parts=()) for each in RANKED)
    assert [abs(a.since - b.since) < 1000 for a, b in zip(found, (OPEN, STUCK), strict=True)] == [True, True]
    assert found[0].until is None and abs(found[1].until - STUCK.until) < 1000
    assert replace(found[0], since=BEGIN) == replace(OPEN, ranked=bare)
    assert replace(found[1], since=BEGIN, until=STUCK.until) == STUCK


def test_a_status_that_is_no_alarm_is_left_out():
    message = sent(OPEN, STUCK, OPEN, STUCK)
    message.status[0].values = []
    for status, text in zip(message.status[1:], ("nan", "1e400", "soon"), strict=True):
        status.values[2].value = text
    assert decode_health(message) == ()
