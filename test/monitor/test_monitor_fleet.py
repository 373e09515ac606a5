"""What programs get of a monitor: figures at /metrics, and alarms by a webhook."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from aiohttp import ClientSession, web
from aiohttp.test_utils import TestServer
from monitor.test_monitor_lamps import ERROR
from monitor.test_monitor_server import Made, serve

from boom_twin.monitor.access_control import AccessControl
from boom_twin.monitor.data.feed import Feed
from boom_twin.monitor.fleet import Webhook
from boom_twin.monitor.server import Server
from boom_twin.monitor.viewer import ViewerActions
from boom_twin.texts import alarm_text
from boom_twin.types import Alarm

SECOND = 10**9
PATIENCE = 240.0


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
    monkeypatch.setattr("boom_twin.monitor.fleet.SILENCE", -1.0)
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


class Receiver:
    """HTTP server that takes what a webhook posts; it answers with `statuses` first, then with 204."""

    def __init__(self, *statuses: int) -> None:
        self.taken: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._statuses = list(statuses)

    async def take(self, request: web.Request) -> web.Response:
        found = await request.json()
        status = self._statuses.pop(0) if self._statuses else 204
        if status == 204:
            self.taken.put_nowait(found)
        return web.Response(status=status, headers={"Location": "/elsewhere"})


def posting(feed: Feed, receiver: Receiver, story: Callable[[TestServer], Awaitable[None]]) -> None:
    """Run a story while a server of the feed posts to the receiver."""

    async def run() -> None:
        application = web.Application()
        application.router.add_post("/secret", receiver.take)
        async with TestServer(application) as target:
            webhook = Webhook(str(target.make_url("/secret")))
            server = Server(feed, ViewerActions(feed, frozenset()), AccessControl("127.0.0.1"), webhook=webhook)
            async with TestServer(server.application()) as served:
                await asyncio.wait_for(story(served), PATIENCE)

    asyncio.run(run())


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boom_twin.monitor.fleet.PAUSES", (0.0,) * 3)
    monkeypatch.setattr("boom_twin.monitor.server.ALARM_PERIOD", 0.0)


@pytest.mark.usefixtures("at_once")
def test_an_alarm_is_posted_when_it_begins_changes_its_cause_and_ends() -> None:
    live, receiver = Live(), Receiver(503, 429)

    async def story(_: TestServer) -> None:
        live.judge()
        begun = await receiver.taken.get()
        text = alarm_text("joint_2", "deviation", None)
        assert begun == {
            "host": socket.gethostname(), "event": "begin", "boom": "front", "source": "made", "channel": "joint_2",
            "kind": "deviation", "cause": None, "text": text, "evidence": "5 times the expected noise", "stop": False,
            "from": "2001-09-09T01:46:42.000000Z", "to": None,
        }  # fmt: skip
        live.judge()
        live.judge(cause="cylinder_2.k")
        changed = await receiver.taken.get()
        assert (changed["event"], changed["cause"]) == ("cause", "cylinder_2.k")
        live.judge(until=10**18 + 9_500_000_000)
        ended = await receiver.taken.get()
        assert (ended["event"], ended["to"]) == ("end", "2001-09-09T01:46:49.500000Z") and receiver.taken.empty()

    posting(live, receiver, story)


@pytest.mark.usefixtures("at_once")
@pytest.mark.parametrize(("statuses", "told"), [((503,) * 4, "503; 4 attempts"), ((404, 404, 404, 302), "302; 4 attempts")])
def test_it_gives_up_with_a_line_in_the_log(statuses: tuple[int, ...], told: str, caplog: pytest.LogCaptureFixture) -> None:
    live, receiver = Live(), Receiver(*statuses)

    async def story(_: TestServer) -> None:
        live.judge()
        while not caplog.messages:
            await asyncio.sleep(0)
        live.judge(cause="cylinder_2.k")
        assert (await receiver.taken.get())["event"] == "cause", "the next one is posted all the same"

    posting(live, receiver, story)
    (line,) = caplog.messages
    assert "gave up the message begin of alarm joint_2 (deviation)" in line and told in line and "secret" not in line


@pytest.mark.usefixtures("at_once")
def test_a_receiver_that_never_answers_does_not_delay_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boom_twin.monitor.fleet.CLOSING_TIME", 0.0)
    live = Live()

    class Silent(Receiver):
        def __init__(self) -> None:
            super().__init__()
            self.asked = asyncio.Event()

        async def take(self, request: web.Request) -> web.Response:
            self.asked.set()
            await asyncio.Event().wait()
            raise AssertionError

    receiver = Silent()

    async def story(served: TestServer) -> None:
        live.judge()
        await receiver.asked.wait()
        async with ClientSession() as session:
            assert (await session.get(served.make_url("/"))).status == 200

    posting(live, receiver, story)
