"""The page is given of a session what a replay says of it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from monitor.conftest import GAP, read_all
from recordings import read, scan
from ros_messages import TYPES, Output, load_topics

from boom_twin import Settings, TimeWindow, load_scene
from boom_twin.monitor.data.bag_feed import bag_feed
from boom_twin.monitor.data.feed import Feed, Playback
from boom_twin.monitor.data.status import Severity
from boom_twin.monitor.protocol import state

ALL = 10**6


@pytest.fixture(scope="module")
def published(replayed: Path) -> Feed:
    """Return what the replay published, as the page shows it."""
    return read_all(bag_feed(replayed / "bag", load_scene(), Settings()))


def messages(replayed: Path, role: Output) -> list[Any]:
    return [message for _, _, message in read(scan(replayed / "bag"), {load_topics().outputs[role].absolute: TYPES[role]})]


def test_rows_are_those_of_the_replay(feed: Feed, replayed: Path) -> None:
    assert not feed.topic_rows.dropped.losses()
    tables, summary = feed.store.tables, json.loads((replayed / "summary.json").read_text())
    acceleration, position = messages(replayed, Output.TIP_ACCELERATION), messages(replayed, Output.TIP_POSITION)
    times, values = tables["acceleration"].rows(0, ALL)
    assert len(times) == summary["samples"] and feed.end == pytest.approx(summary["duration_s"])
    assert values == pytest.approx(np.array([(m.accel.linear.x, m.accel.linear.z) for m in acceleration]), rel=1e-6)
    assert np.hypot(*values.T.astype(float)).max() == pytest.approx(summary["tip_acceleration_max_m_s2"], rel=1e-6)
    stamps = np.array([m.header.stamp.sec * 1_000_000_000 + m.header.stamp.nanosec for m in acceleration])
    assert np.abs(np.round(times * 1e9).astype(np.int64) + feed.store.epoch - stamps).max() <= 1
    joints = tables["joints"].rows(0, ALL)[1][:, :4].astype(float)
    assert np.sqrt((joints**2).mean(axis=0)) == pytest.approx(summary["joint_residual_rms_rad"], rel=1e-5)
    forces = tables["force"].rows(0, ALL)[1]
    residuals = [m.position for m in messages(replayed, Output.RESIDUALS) if "tip_imu_x" in m.name]
    assert forces[:, :2] - forces[:, 2:4] == pytest.approx(np.array(residuals), abs=1e-5)
    roles = (Output.TIP_DISPLACEMENT, Output.ESTIMATE_POSE, Output.ESTIMATE_ACCELERATION, Output.ESTIMATE_LOAD)
    expected = [
        (
            d.vector.x + e.pose.pose.position.x - p.point.x,
            d.vector.z + e.pose.pose.position.z - p.point.z,
            *np.sqrt([e.pose.covariance[0], e.pose.covariance[14]]),
            *(a.accel.accel.linear.x, a.accel.accel.linear.z),
            *np.sqrt([a.accel.covariance[0], a.accel.covariance[14]]),
            *(f.wrench.force.x, f.wrench.force.z),
        )
        for p, d, e, a, f in zip(position, *(messages(replayed, role) for role in roles), strict=True)
        if f.wrench.force.x or f.wrench.force.z
    ]
    values = tables["estimate"].rows(0, ALL)[1]
    assert len(values) == len(expected) > 0.99 * len(position)
    assert values == pytest.approx(np.array(expected), rel=1e-5, abs=1e-6)


def test_alarms_are_those_of_the_summary_and_of_the_result_bag(feed: Feed, published: Feed, replayed: Path) -> None:
    summary = json.loads((replayed / "summary.json").read_text())
    (told,) = [each for each in summary["alarms"] if each["kind"] != "gap"]
    assert (told["channel"], told["cause"]) == ("joint_3", "joint_3.sensor")
    for each in (feed, published):
        (alarm,) = [alarm for alarm in each.store.alarms.all if alarm.causes]
        assert (alarm.name, alarm.reason, alarm.end) == (told["channel"], told["told"], told["to_s"])
        assert alarm.begin == pytest.approx(told["from_s"], abs=2e-3) == pytest.approx(15.0, abs=0.1)
        assert alarm.level == Severity.ERROR and alarm.causes[0][0] == told["cause"]
        shown = state(each.store, 25.0, 25.0)
        assert (shown["level"], shown["reason"]) == ("ERROR", alarm.reason) and shown["action"] == "look"
    gaps = [(alarm.begin, alarm.end) for alarm in feed.store.alarms.all if alarm.name == "cylinder_strokes"]
    assert gaps == [pytest.approx((each["from_s"], each["to_s"])) for each in summary["alarms"] if each["kind"] == "gap"]
    assert gaps == [pytest.approx(GAP, abs=0.02)]


def test_it_is_shown_while_it_is_read(faulty: Path) -> None:
    feed = bag_feed(faulty, load_scene(), Settings(), window=TimeWindow(duration=4.0))
    play = Playback(feed)
    assert feed.end == pytest.approx(4.0, abs=0.1) and play.advance(5.0) == 0.0 and not play.is_held
    while not feed.store.newest:
        feed.poll()
    assert feed.is_reading and 0.0 < feed.store.newest < 4.0
    play.seek(3.9)
    assert play.position == feed.store.newest
    play.advance(1.0)
    assert not play.is_held
    read_all(feed)
    play.seek(3.9)
    assert play.advance(1.0) == feed.end and play.is_held


def test_a_session_that_is_damaged_is_shown_up_to_there(replayed: Path, tmp_path: Path) -> None:
    damaged = shutil.copytree(replayed / "bag", tmp_path / "damaged")
    file = next(damaged.glob("*.mcap"))
    content = bytearray(file.read_bytes())
    for place in range(len(content) // 2, len(content) // 2 + 20_000, 50):  # wherever chunks and their indexes lie
        content[place] ^= 1
    file.write_bytes(content)
    feed = read_all(bag_feed(damaged, load_scene(), Settings()))
    assert "read up to" in feed.trouble and 5.0 < feed.store.newest == feed.end < 35.0
