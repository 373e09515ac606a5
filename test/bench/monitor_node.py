"""What the live page costs the node: times of its steps, and delays of its outputs, over DDS at 200 Hz.

``python test/bench/monitor_node.py [--rounds 4] [--seconds 30]``. One node is fed all the time. In every round come four spans,
in an order that changes: no monitor; a monitor with a page that reads; a monitor under attack, by a viewer that stalls all the
time, garbage, and a thousand connections every five seconds; a monitor that is stopped (SIGSTOP) and so takes no message of
the node. The attacker gives way to all others: what it does is not the monitor's work.
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from aiohttp import ClientSession
from live import cpu

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from demo.isolation import isolated

LIVE = [sys.executable, str(Path(__file__).with_name("live.py"))]
SETTLING = 3.0
KINDS = ("none", "read", "attacked", "stopped")
BURST = 5.0
GARBAGE = ("{", "[" * 4000, '{"do": "format"}', b"\0" * 100)


def timed_node(out: str) -> None:
    """The node, whose steps are written down as end (ns) and duration (s)."""
    from boom_twin.ros.node.main import main
    from boom_twin.twin import twin
    from boom_twin.types import Stream

    rows: list[tuple[int, float]] = []
    update = twin.Twin.update

    def timed(self: twin.Twin, sample: object) -> object:
        began = time.perf_counter()
        report = update(self, sample)
        if sample.stream is Stream.STROKES:
            rows.append((time.time_ns(), time.perf_counter() - began))
        return report

    twin.Twin.update = timed
    main([])
    Path(out).write_text(json.dumps(rows), encoding="utf-8")


@contextmanager
def monitor() -> Iterator[tuple[subprocess.Popen, str]]:
    """A running monitor, and its address."""
    command = [sys.executable, "-m", "boom_twin.cli.main", "monitor", "--port", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        for line in process.stderr:
            if found := re.search(r"open (http\S+)", line):
                yield process, found[1]
                return
        raise SystemExit("the monitor did not start")
    finally:
        process.kill()
        process.wait()


async def read(url: str) -> None:
    """A viewer that reads."""
    async with ClientSession() as session, connect(session, url) as socket:
        async for _ in socket:
            pass


async def stall(url: str) -> None:
    """A viewer that never reads."""
    async with ClientSession() as session, connect(session, url) as socket:
        socket._response.connection.transport.pause_reading()
        await asyncio.sleep(1e6)


async def attack(url: str) -> None:
    """Garbage and a thousand connections, again and again."""
    while True:
        async with ClientSession() as session:
            for garbage in GARBAGE:
                async with connect(session, url) as socket:
                    await (socket.send_bytes(garbage) if isinstance(garbage, bytes) else socket.send_str(garbage))
            opened = await asyncio.gather(*(connect(session, url) for _ in range(1000)), return_exceptions=True)
            for each in opened:
                if not isinstance(each, BaseException):
                    await each.close()
        await asyncio.sleep(BURST)


def connect(session: ClientSession, url: str) -> object:
    return session.ws_connect(f"{url}socket", headers={"Origin": url.rstrip("/")}, max_msg_size=0)


async def all_of(names: list[str], url: str) -> None:
    """Run roles of a viewer until killed."""
    os.nice(10)
    await asyncio.gather(*(ROLES[name](url) for name in names))


def span(kind: str, seconds: float) -> tuple[int, int]:
    """Live through `seconds` of one kind; gives begin and end, ns."""
    if kind == "none":
        return pass_by(seconds)
    viewers = {"read": ["read"], "attacked": ["read", "stall", "attack"], "stopped": []}[kind]
    with monitor() as (process, url):
        others = [subprocess.Popen([sys.executable, __file__, "--as", url, *viewers])] if viewers else []
        time.sleep(SETTLING)
        if kind == "stopped":
            process.send_signal(signal.SIGSTOP)
        before = cpu(process)
        found = pass_by(seconds)
        print(f"{kind}: the monitor took {100 * (cpu(process) - before) / seconds:.0f} % of a core", flush=True)
        if process.poll() is not None or any(other.poll() is not None for other in others):
            raise SystemExit(f"{kind}: the monitor or its viewer ended")
        for other in others:
            other.kill()
            other.wait()
    return found


def pass_by(seconds: float) -> tuple[int, int]:
    """Begin and end, ns."""
    time.sleep(1.0)
    began = time.time_ns()
    time.sleep(seconds)
    return began, time.time_ns()


def watch(rounds: int, seconds: float) -> tuple[list[dict[str, tuple[int, int]]], np.ndarray, np.ndarray]:
    """Spans by kind of every round; end (ns) and duration (s) of steps; stamp and delay (ns) of tip positions."""
    with tempfile.TemporaryDirectory() as folder:
        steps, heard, log = (Path(folder) / name for name in ("steps", "heard", "log"))
        command = [sys.executable, __file__, "--node", str(steps)]
        node = subprocess.Popen(command, stdout=log.open("w"), stderr=subprocess.STDOUT)
        listener = subprocess.Popen([*LIVE, "listen", "boom_twin"], stdout=heard.open("w"))
        source = None
        try:
            while "active;" not in log.read_text():
                if node.poll() is not None:
                    raise SystemExit(log.read_text())
                time.sleep(0.2)
            source = subprocess.Popen([*LIVE, "source", "200", "1e5"], stdout=subprocess.PIPE, text=True)
            source.stdout.readline()
            time.sleep(SETTLING)
            spans = []
            for number in range(rounds):
                order = KINDS[number % len(KINDS) :] + KINDS[: number % len(KINDS)]
                spans.append({kind: span(kind, seconds) for kind in order})
            for process in (listener, node):
                process.send_signal(signal.SIGTERM)
                process.wait(60)
            delays = json.loads(heard.read_text())["tip/position"]
            return spans, np.array(json.loads(steps.read_text())), np.array(delays)
        finally:
            for process in (source, listener, node):
                with suppress(AttributeError):
                    process.kill()


def main() -> None:
    """Print medians over the rounds, and their ratio to those without a monitor."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=30.0, help="of every span (30)")
    args = parser.parse_args()
    with isolated():
        spans, steps, delays = watch(args.rounds, args.seconds)
    print(f"load: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; {args.rounds} rounds of {args.seconds:g} s")
    for name, (times, values), scale in (("step", steps.T, 1e3), ("delay", delays.T, 1e-6)):
        for q in (0.5, 0.99):
            found = {kind: [quantile(times, scale * values, each[kind], q) for each in spans] for kind in KINDS}
            for kind in KINDS:
                ratio = statistics.median(a / b for a, b in zip(found[kind], found["none"], strict=True))
                rounds = ", ".join(f"{value:.3f}" for value in found[kind])
                told = f"{name:6s}p{100 * q:<4g}{kind:10s}{statistics.median(found[kind]):8.3f} ms  {100 * (ratio - 1):+6.1f} %"
                print(f"{told}   ({rounds})")


def quantile(times: np.ndarray, values: np.ndarray, span: tuple[int, int], q: float) -> float:
    """Of the values within a span."""
    return float(np.quantile(values[(times >= span[0]) & (times < span[1])], q))


ROLES = {"read": read, "stall": stall, "attack": attack}

if __name__ == "__main__":
    if sys.argv[1:2] == ["--node"]:
        timed_node(sys.argv[2])
    elif sys.argv[1:2] == ["--as"]:
        asyncio.run(all_of(sys.argv[3:], sys.argv[2]))
    else:
        main()
