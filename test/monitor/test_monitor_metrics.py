"""What programs get of a monitor: figures at /metrics."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from aiohttp import ClientSession
from monitor.test_monitor_lamps import ERROR
from monitor.test_monitor_server import Made, serve

from boom_twin.monitor.access_control import AccessControl
from boom_twin.monitor.data.feed import Feed
from boom_twin.types import Alarm

SECOND = 10**9


def scraped(feed: Feed) -> dict[str, dict[tuple[tuple[str, str], ...], float]]:
    """Values of all metrics by name and labels, as the client library of Prometheus reads them."""
    parser = pytest.importorskip("prometheus_client.parser", reason="pip install .[monitor]")
    found: dict[str, dict[tuple[tuple[str, str], ...], float]] = {}

    async def talk(session: ClientSession, url: str) -> None:
        response = await session.get(f"{url}metrics")
        assert response.status == 200 and response.headers["Content-Type"].startswith("text/plain; version=")
        for family in parser.text_string_to_metric_families(await response.text()):
            for sample in family.samples:
                found.setdefault(sample.name, {})[tuple(sorted(sample.labels.items()))] = sample.value

    serve(feed, talk)
    return found


def label(boom: str = "", **more: str) -> tuple[tuple[str, str], ...]:
    return tuple(sorted({"boom": boom, **more}.items()))


def test_the_figures_of_a_session_are_those_of_its_replay(feed: Feed, replayed: Path) -> None:
    found, tables = scraped(feed), feed.store.tables
    summary = json.loads((replayed / "summary.json").read_text())
    assert found["boom_twin_stroke_samples_total"] == {label(): summary["samples"]}
    assert "boom_twin_newest_sample_age_seconds" not in found, "the age of a recording says nothing"
    last = tables["displacement"].rows(summary["samples"] - 1, summary["samples"])[1][0]
    shown = found["boom_twin_tip_displacement_meters"]
    assert [shown[label(source="predicted", axis=axis)] for axis in "xz"] == pytest.approx(last.tolist())
    assert label(source="estimated", axis="x") in shown and label(axis="z") in found["boom_twin_tip_load_newtons"]
    residuals = found["boom_twin_residual_normalised_rms_ratio"]
    lamps = {lamp.channel: lamp for lamp in feed.store.statuses(feed.now()).groups(feed.now())["residuals"]}
    for channel in ("joint_1", "tip_imu_z", "cylinder_1"):  # as the twin's diagnosis has them, a second before
        assert lamps[channel].quantity == "rms_normalised"
        assert residuals[label(channel=channel)] == pytest.approx(lamps[channel].value, rel=0.1), channel
    assert residuals[label(channel="joint_3")] > 2.0
    levels = found["boom_twin_component_level"]
    assert levels[label(component="residual joint_3")] == ERROR and levels[label(component="cylinder_strokes")] == 0
    lasting = [alarm for alarm in summary["alarms"] if alarm["to_s"] is None]
    keys = {label(channel=each["channel"], kind=each["kind"], cause=each["cause"] or "") for each in lasting}
    assert keys and {key for key, count in found["boom_twin_alarms_active"].items() if count} == keys


class Live(Made):
    """Live feed of a boom `front` with an alarm."""

    def __init__(self) -> None:
        super().__init__()
        self.boom = "front"
        self.alarm = Alarm("joint_2", "deviation", 10**18 + 2 * SECOND, None, None, "5 times the expected noise")

    def judge(self, **changes: Any) -> None:
        self.alarm = replace(self.alarm, **changes)
        self.store.alarms.judge(self.store.newest, [self.alarm], self.store.time)


def test_a_silent_feed_gives_no_old_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    live = Live()
    live.store.append("displacement", ["x_m", "z_m"], 10**18 + 10 * SECOND, (0.1, -0.2))
    live.judge()
    live.tell(ERROR)
    found = scraped(live)
    assert found["boom_twin_tip_displacement_meters"][label("front", source="predicted", axis="z")] == pytest.approx(-0.2)
    assert found["boom_twin_component_level"][label("front", component="sensor joint_1")] == ERROR
    monkeypatch.setattr("boom_twin.monitor.metrics.SILENCE", -1.0)
    found = scraped(live)
    assert (
        "boom_twin_tip_displacement_meters" not in found and found["boom_twin_newest_sample_age_seconds"][label("front")] >= 0.0
    )
    assert found["boom_twin_alarms_active"] == {label("front", channel="joint_2", kind="deviation", cause=""): 1.0}


def test_access_to_metrics_is_that_to_the_page() -> None:
    pytest.importorskip("prometheus_client")
    access = AccessControl("127.0.0.1", "a-token-of-a-fleet-1234567890")

    async def talk(session: ClientSession, url: str) -> None:
        for headers, expected in (
            ({}, 403),
            ({"Authorization": "Bearer wrong"}, 403),
            ({"Authorization": f"Basic {access.token}"}, 403),
            ({"Authorization": f"Bearer {access.token}"}, 200),
        ):
            assert (await session.get(f"{url}metrics", headers=headers)).status == expected, headers

    serve(Live(), talk, access=access)

    async def as_another_host(session: ClientSession, url: str) -> None:
        assert (await session.get(f"{url}metrics", headers={"Host": "evil.example"})).status == 403

    serve(Live(), as_another_host)
