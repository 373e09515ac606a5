"""Statuses as lamps: groups, severity, silence, the limit that is told; alarms from their begin to their end."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from boom_twin.monitor.data.status import MAX_ALARMS, SILENCE, AlarmList, Severity, StatusTable, overall
from boom_twin.monitor.data.store import DroppedMessages, MalformedError, Store
from boom_twin.monitor.protocol import state
from boom_twin.types import Alarm, Ranked

OK, WARN, ERROR, STALE = range(4)


def status(name: str, level: int = OK, message: str = "well", **values: Any) -> Any:
    pairs = [SimpleNamespace(key=key, value=str(value)) for key, value in values.items()]
    return SimpleNamespace(name=name, level=level, message=message, values=pairs)


def table(*statuses: Any, now: float = 0.0, clock: float = 0.0, before: StatusTable | None = None) -> StatusTable:
    return (before or StatusTable()).updated(now, statuses, clock)


def test_every_status_lights_the_lamp_of_its_group() -> None:
    names = ["model", "sensor cylinder_1", "residual joint_1", "health", "cylinder_strokes", "outputs"]
    statuses = table(*(status(f"boom_twin: {name}") for name in names), status("boom_twin_recorder: recording"))
    assert {group: [lamp.name for lamp in lamps] for group, lamps in statuses.groups(0.0).items()} == {
        "sensors": ["sensor cylinder_1"],
        "model": ["model"],
        "residuals": ["residual joint_1", "health"],
        "timing": ["cylinder_strokes", "outputs"],
        "recorder": ["recording"],
    }
    later = table(status("boom_twin: model"), now=1.0, before=statuses)
    assert not later.groups(1.0)["sensors"], "a status that is told no more goes out"


@pytest.mark.parametrize(
    ("levels", "expected"), [([OK, OK], "OK"), ([OK, WARN], "WARN"), ([STALE, WARN], "STALE"), ([STALE, ERROR], "ERROR")]
)
def test_the_worst_lamp_is_the_state_of_all(levels: list[int], expected: str) -> None:
    sensors = [status(f"n: sensor {i}", level, f"reason {i}") for i, level in enumerate(levels)]
    level, reason = overall(table(status("n: model"), *sensors).groups(0.0))
    assert level.name == expected
    assert reason == "everything as expected" if expected == "OK" else "reason" in reason


def test_a_silent_node_is_stale_and_never_green() -> None:
    for statuses in (StatusTable(), table(status("boom_twin_recorder: recording"))):
        assert overall(statuses.groups(0.0)) == (Severity.STALE, "no message from the twin")
    statuses = table(status("n: model"), status("n: sensor 1", ERROR), now=10.0)
    assert overall(statuses.groups(10.0 + SILENCE))[0] == Severity.ERROR
    level, reason = overall(statuses.groups(10.1 + SILENCE))
    assert level == Severity.STALE and "no message from n" in reason


def judge(alarms: AlarmList, time: float, *told: Alarm) -> None:
    alarms.judge(time, told, lambda stamp: stamp * 1e-9)


def test_a_judged_alarm_is_one_from_the_first_suspicion_to_its_end() -> None:
    alarms, ranked = AlarmList(), (Ranked("a.k", 0.6, ()), Ranked("b.k", 0.4, ()))
    unknown = Alarm("joint_2", "residual", 2 * 10**9, None, None, "cannot be told apart", ranked)
    named = replace(unknown, cause="b.k", ranked=(Ranked("b.k", 0.97, ()),))
    judge(alarms, 3.0, unknown)
    (found,) = alarms.all
    assert (found.name, found.reason, found.begin) == ("joint_2", unknown.told, 2.0)
    assert found.evidence == "cannot be told apart; a.k 60 %, b.k 40 %" and set(found.words) == {"en", "de", "zh"}
    assert found.causes == (("a.k", 0.6), ("b.k", 0.4))
    assert alarms.acknowledge(found.number) is found
    judge(alarms, 4.0, unknown)
    assert found.is_acknowledged and [lamp.reason for lamp in alarms.lamps(3.5)] == [unknown.told]
    assert found.level == Severity.WARN
    judge(alarms, 5.0, named)
    assert found.level == Severity.ERROR and not found.is_acknowledged and found.causes == (("b.k", 0.97),)
    assert alarms.acknowledge(found.number) is found
    judge(alarms, 6.0, replace(named, until=round(5.5e9)))
    assert found.end == 5.5 and not found.is_acknowledged and list(alarms.lamps(5.6)) == [] and list(alarms.lamps(1.9)) == []
    judge(alarms, 7.0, replace(unknown, since=7 * 10**9))
    judge(alarms, 8.0)
    assert [(each.begin, each.end) for each in alarms.all] == [(2.0, 5.5), (7.0, 8.0)]


def test_all_is_not_well_where_messages_were_dropped() -> None:
    """They may have told of a fault: the headline says so, a fault that is known goes before it."""
    store, dropped = Store(10), DroppedMessages()
    store.set_statuses(0.0, table(status("n: model")))
    found = state(store, 0.0, 0.0, dropped)
    assert (found["level"], found["reason"], found["dropped"]) == ("OK", "everything as expected", [])
    for _ in range(2):
        with dropped.guard("/diagnostics"):
            raise MalformedError("no stamp")
    found = state(store, 0.0, 0.0, dropped)
    assert (found["level"], found["reason"]) == ("WARN", "messages dropped")
    assert found["dropped"] == [{"topic": "/diagnostics", "count": 2, "reason": "no stamp"}]
    store.set_statuses(0.0, table(status("n: model", ERROR)))
    assert state(store, 0.0, 0.0, dropped)["reason"].startswith("model: ")


def test_an_alarm_lasts_until_its_lamp_is_well_or_out_and_asks_again_when_it_gets_worse() -> None:
    alarms, well = AlarmList(), status("n: model")
    for time, level in ((1.0, OK), (2.0, WARN), (3.0, ERROR), (4.0, WARN), (5.0, OK), (6.0, STALE)):
        alarms.follow(time, table(well, status("n: sensor 1", level, f"level {level}")))
        if time == 2.0:
            assert alarms.acknowledge(alarms.all[0].number) is alarms.all[0] and alarms.all[0].is_acknowledged
    assert not alarms.all[0].is_acknowledged and alarms.acknowledge(99) is None
    alarms.follow(7.0, table(well))
    assert [(a.level, a.reason, a.begin, a.end) for a in alarms.all] == [
        (Severity.ERROR, "level 2", 2.0, 5.0),
        (Severity.STALE, "level 3", 6.0, 7.0),
    ]


def test_alarms_that_are_kept_are_bounded_and_the_newest() -> None:
    alarms = AlarmList()
    for time in range(2 * MAX_ALARMS):
        alarms.follow(time, table(status("n: model", WARN if time % 2 else OK)))
        alarms.add("event", Severity.OK, "", time, time)
    assert len(alarms.all) <= MAX_ALARMS and alarms.all[-1].begin == 2 * MAX_ALARMS - 1


def test_sensors_that_fail_together_are_one_alarm() -> None:
    alarms, names = AlarmList(), [f"sensor joint_{i}" for i in range(1, 4)]
    for time, levels in ((1.0, (OK, OK, OK)), (2.0, (WARN, WARN, OK)), (3.0, (OK, WARN, OK)), (4.0, (OK, OK, OK))):
        alarms.follow(time, table(*(status(f"n: {name}", level) for name, level in zip(names, levels, strict=True))))
        assert [each.end for each in alarms.all] == ([] if time < 2.0 else [4.0 if time == 4.0 else None])
    assert [each.name for each in alarms.all] == ["sensor joint_1, joint_2"]


def test_an_alarm_of_health_is_the_only_one_of_its_channel() -> None:
    alarms, lamp = AlarmList(), status("n: sensor joint_3", ERROR, "stuck")
    alarms.follow(1.0, table(lamp))
    judge(alarms, 2.0, Alarm("joint_3", "stuck", 10**9, None, "joint_3.sensor", ""))
    alarms.follow(3.0, table(lamp, status("n: residual joint_3", WARN)))
    assert [(each.name, each.end) for each in alarms.all] == [("joint_3", None)]


@pytest.mark.parametrize(
    ("kind", "cause", "swing", "action"),
    [
        ("stuck", "joint_3.sensor", OK, "look"), ("softer", "section_2.EI", OK, "stop"), ("exceeded", "tip.load", OK, "stop"),
        (None, None, OK, "go"), (None, None, WARN, "look"), (None, None, ERROR, "stop"),
    ],
)  # fmt: skip
def test_what_to_do_follows_from_alarms_and_the_swing_of_the_tip(
    kind: str | None, cause: str | None, swing: int, action: str
) -> None:
    store = Store(10)
    store.set_statuses(0.0, table(status("n: model"), status("n: swing", swing, "the tip swings too far", swing_m=0.4)))
    if kind is not None:
        judge(store.alarms, 0.0, Alarm("joint_3", kind, 0, None, cause, ""))
    found = state(store, 0.0, 0.0)
    assert found["action"] == action and (found["alarm"] is None) == (kind is None)
    assert found["groups"][1]["lamps"][1]["figures"] == {"swing_m": 0.4}
    assert state(store, 10.0, 10.0)["action"] in ("unknown", "look", "stop"), "a silent node is never well"
