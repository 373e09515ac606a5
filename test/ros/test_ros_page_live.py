"""The whole chain: sensors at 200 Hz, node, monitor, and the page in Chromium; what it shows is what the topics say."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from rcl_interfaces.msg import Log
from ros_messages import decode_health, load_topics, stamp_of

from boom_twin.monitor.data.status import LEVELS

LIVE = Path(__file__).parents[1] / "bench" / "live.py"
EVENTS = load_topics().events


class Witness:
    """Hears the node's topics beside the page, whenever that is waited for."""

    def __init__(self, page: Any) -> None:
        self.node, self._page = rclpy.create_node("witness"), page
        self.tips: dict[int, Any] = {}
        self.diagnostics: list[Any] = []
        self.health: list[Any] = []
        self.node.create_subscription(Vector3Stamped, "/boom_twin/tip/displacement", self._hear_tip, 5000)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self.diagnostics.append, 100)
        self.events: list[str] = []
        self.node.create_subscription(DiagnosticArray, "/boom_twin/health", self.health.append, 100)
        self.node.create_subscription(Log, EVENTS.absolute, lambda message: self.events.append(message.msg), 100)

    def _hear_tip(self, msg: Any) -> None:
        self.tips[stamp_of(msg)] = msg.vector

    def until(self, condition: Callable[[], Any]) -> None:
        end = time.monotonic() + 120.0
        while not condition():
            assert time.monotonic() < end
            for _ in range(100):
                rclpy.spin_once(self.node, timeout_sec=0.0)
            self._page.wait_for_timeout(50)

    def rows(self) -> list[tuple[float, Any]]:
        """The page's displacement at stamps that were heard here too: what it has, what the topic said."""
        epoch = int(self._page.evaluate("String(twin.connection.epoch)"))
        table = self._page.evaluate(
            "(r => [...Array(r.count).keys()].map(k => [r.time(k), r.at(1, k)]))(TABLE)".replace("TABLE", TABLE)
        )
        return [(value, self.tips[stamp].z) for t, value in table for stamp in self._near(epoch + round(t * 1e9))]

    def _near(self, stamp: int) -> list[int]:
        return [each for each in range(stamp - 1, stamp + 2) if each in self.tips]


TABLE = "twin.connection.table('displacement')"


def test_the_page_shows_what_the_topics_say_and_marks_it(
    browser: Any, spawn: Callable[..., Any], spawn_node: Callable[..., Any]
) -> None:
    spawn_node().wait_for("active;")
    monitor = spawn("boom_twin.cli.main", "monitor", "--port", "0", "--allow", "mark")
    url = monitor.wait_for("open http").split("open ")[1].split()[0]
    command = [sys.executable, str(LIVE), "source", "200", "1e4", "imu", "stuck"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as source:
        try:
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.set_default_timeout(120_000)
            page.goto(url)
            witness = Witness(page)
            shows_what_was_said(page, witness)
            publishes_a_mark(page, witness)
        finally:
            source.kill()
    witness.node.destroy_node()


def shows_what_was_said(page: Any, witness: Witness) -> None:
    witness.until(lambda: page.evaluate("twin.view.newest > 3"))
    witness.until(lambda: len(witness.rows()) > 100)
    for shown, said in witness.rows():
        assert shown == pytest.approx(said, rel=1e-6)
    page.keyboard.press("4")

    def are_the_lamps() -> bool:
        """They are those of one of the newest messages; an alarm stands in the place of the lamp for all alarms."""
        texts = page.locator("#lamps tr").all_inner_texts()[1:]
        rows = [row for row in (text.split("\t") for text in texts) if len(row) > 3]  # as long as nothing is told there is none
        lamps = {row[1].strip(): (row[2], row[3].strip()) for row in rows}
        newest = [{each.name.partition(": ")[2]: each for each in msg.status} for msg in witness.diagnostics[-4:]]
        judged = {alarm.channel for msg in witness.health[-4:] for alarm in decode_health(msg)}
        return bool(lamps and judged) and all(
            name in judged
            or any(
                name in each and level.endswith(LEVELS[each[name].level[0]].name) and words == each[name].message
                for each in newest
            )
            for name, (level, words) in lamps.items()
        )

    witness.until(are_the_lamps)
    page.keyboard.press("1")


def publishes_a_mark(page: Any, witness: Witness) -> None:
    page.keyboard.press("m")
    page.locator("#note-text").fill("hose moved")
    page.keyboard.press("Enter")
    page.locator("#answer", has_text="marked: hose moved").wait_for()
    witness.until(lambda: "mark: hose moved" in witness.events)
