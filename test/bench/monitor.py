"""What the live page costs and how soon it shows: frames, memory, delay.

``python test/bench/monitor.py [--seconds 120]`` needs Debian's chromium. The feed is made here, 200 rows a second stamped by
this machine's clock, so the delay is from a row's stamp to its drawing, without node and DDS.
"""

from __future__ import annotations

import asyncio
import os
import sys
import threading
import time
from argparse import ArgumentParser
from math import sin
from pathlib import Path
from statistics import median
from typing import Any

from aiohttp import web
from playwright.sync_api import sync_playwright
from record import keep

from boom_twin.messages.topic_table import load_topics
from boom_twin.monitor.data.feed import Feed
from boom_twin.monitor.data.store import Store
from boom_twin.monitor.server import AccessControl, Server
from boom_twin.monitor.viewer import ViewerActions

RATE = 200
CHROMIUM = Path("/usr/bin/chromium")
LARGEST = 2.0
"""MiB by which the heap may grow from the first quarter to the last."""
COUNT = "window.counted ??= (requestAnimationFrame(function step() { window.counted++; requestAnimationFrame(step); }), 0)"


class Waves(Feed):
    """Displacement, acceleration and specific force: six traces, the band of one more."""

    def __init__(self) -> None:
        super().__init__("waves", Store(150_000), load_topics())
        self._next = time.time_ns()

    def now(self) -> float:
        return time.monotonic()

    def poll(self) -> None:
        while self._next <= time.time_ns():
            phase = (self._next % 10**12) * 1e-9 * 6.3
            wave = [sin(phase), sin(2.3 * phase), sin(phase), sin(2.3 * phase), 0.1, 0.1]
            for name, columns in (("displacement", 2), ("acceleration", 2), ("force", 6)):
                self.store.append(name, [f"{i}_m_s2" for i in range(columns)], self._next, wave[:columns])
            self._next += 10**9 // RATE


def serve(feed: Feed, ready: threading.Event, port: list[int]) -> None:
    """In a thread, for ever."""

    async def run() -> None:
        runner = web.AppRunner(
            Server(feed, ViewerActions(feed, frozenset()), AccessControl("127.0.0.1")).application(), access_log=None
        )
        await runner.setup()
        await web.TCPSite(runner, "127.0.0.1", 0).start()
        port.append(runner.addresses[0][1])
        ready.set()
        await asyncio.Event().wait()

    asyncio.run(run())


def watch(pages: list[Any], seconds: int) -> list[list[int]]:
    """Frames of every page in every second."""
    for page in pages:
        page.evaluate(COUNT)
    found: list[list[int]] = [[] for _ in pages]
    last, began = [0] * len(pages), time.monotonic()
    for second in range(seconds):
        time.sleep(max(0.0, began + second + 1 - time.monotonic()))
        for i, page in enumerate(pages):
            count = page.evaluate("window.counted")
            found[i].append(count - last[i])
            last[i] = count
    return [each[1:] for each in found]


def heap(page: Any) -> float:
    """What the page's scripts hold once the rest is collected, MiB."""
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    used = float(session.send("Runtime.getHeapUsage")["usedSize"]) / 2**20
    session.detach()
    return used


def one_page(page: Any, seconds: int) -> bool:
    """Frames, delay and memory of one page in four parts of that time; whether memory stays, and half the frames come."""
    found, heaps, words = [], [], []
    for _ in range(4):
        (frames,) = watch([page], max(seconds // 4, 5))
        found += frames
        heaps.append(heap(page))
        words.append(page.locator("#connection").inner_text())
        print(
            f"one page: {median(frames):.0f} frames/s median, {min(frames)} worst second; {words[-1]}; heap {heaps[-1]:.2f} MiB"
        )
    keep("monitor", {"seconds": seconds, "frames_per_s": median(found), "said": words, "heap_rise_MiB": heaps[-1] - heaps[0]})
    return median(found) >= 30 and heaps[-1] - heaps[0] <= LARGEST


def main() -> int:
    """Print all; 1 if the memory of a page grows, or it has less than 30 frames/s at the median."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=120, help="how long (120)")
    seconds = parser.parse_args().seconds
    if not CHROMIUM.is_file():
        print("skipped: the live page, because chromium is not there (Debian: apt-get install chromium)")
        return 0
    ready, port = threading.Event(), list[int]()
    threading.Thread(target=serve, args=(Waves(), ready, port), daemon=True).start()
    ready.wait()
    url = f"http://127.0.0.1:{port[0]}/"
    print(f"load of the machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        first = browser.new_page(viewport={"width": 1280, "height": 720})
        first.goto(url)
        time.sleep(5)
        is_well = one_page(first, seconds)
        browser.close()
    print(f"load of the machine after: {os.getloadavg()[0]:.1f}")
    return 0 if is_well else 1


if __name__ == "__main__":
    sys.exit(main())
