"""Whether the node answers while it is flooded: ``python test/bench/flood.py [--seconds 5]``.

Real processes over DDS, loopback only. One node; a source of strokes and angles at 5 and at 20 kHz, and two sources at 200 Hz
whose clocks are 1000 s apart. Meanwhile the state and a parameter are asked for, ten times a second, and what is published is
counted.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped
from lifecycle_msgs.srv import GetState
from rcl_interfaces.srv import GetParameters

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from demo.isolation import isolated

SOURCE = [sys.executable, str(Path(__file__).with_name("live.py")), "source"]
CASES = {
    "200 Hz": [["200"]],
    "two sources at 200 Hz": [["200"], ["200", "later=1000"]],
    "5 kHz": [["5000"]],
    "20 kHz": [["20000"]],
}
LONGEST = 60.0
"""Seconds that an answer is waited for."""


class Listener:
    """Asks, and counts what is published."""

    def __init__(self) -> None:
        self.node = rclpy.create_node("flood")
        self.predictions = self.diagnostics = 0
        self.worst = ""
        self.node.create_subscription(PointStamped, "/boom_twin/tip/position", self._predicted, 1000, raw=True)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._judged, 100)
        parameter = GetParameters.Request(names=["gap"])
        asked = [("get_state", GetState, GetState.Request()), ("get_parameters", GetParameters, parameter)]
        self._asked = [(self.node.create_client(kind, f"/boom_twin/{name}"), request) for name, kind, request in asked]
        for client, _ in self._asked:
            client.wait_for_service(30.0)

    def _predicted(self, _: bytes) -> None:
        self.predictions += 1

    def _judged(self, msg: DiagnosticArray) -> None:
        self.diagnostics += 1
        errors = [f"{status.name}: {status.message}" for status in msg.status if status.level == b"\x02"]
        self.worst = errors[0] if errors else self.worst

    def ask(self) -> list[float]:
        """Seconds until each service has answered; `LONGEST` if it has not."""
        found = []
        for client, request in self._asked:
            began = time.monotonic()
            future = client.call_async(request)
            rclpy.spin_until_future_complete(self.node, future, timeout_sec=LONGEST)
            found.append(time.monotonic() - began)
        return found

    def listen(self, seconds: float) -> None:
        """Hear what comes."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.01)


def run(sources: list[list[str]], seconds: float) -> str:
    """One case, in words."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log"
        node = subprocess.Popen(
            [sys.executable, "-m", "boom_twin.ros.node.main"], stdout=log.open("w"), stderr=subprocess.STDOUT
        )
        sending: list[Any] = []
        try:
            while "active;" not in log.read_text():
                if node.poll() is not None:
                    raise SystemExit(log.read_text())
                time.sleep(0.2)
            listener = Listener()
            for rate, *more in sources:
                command = [*SOURCE, rate, str(seconds + 2.0), *more]
                sending.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
                sending[-1].stdout.readline()
            listener.listen(1.0)
            listener.predictions = listener.diagnostics = 0
            began, delays = time.monotonic(), []
            while time.monotonic() < began + seconds:
                delays += listener.ask()
                listener.listen(0.1)
            took = time.monotonic() - began
            listener.node.destroy_node()
        finally:
            for process in (*sending, node):
                process.kill()
                process.wait()
    p50, p99, longest = 1e3 * np.quantile(delays, [0.5, 0.99, 1.0])
    rates = f"{listener.predictions / took:7.0f} predictions/s, {listener.diagnostics / took:4.1f} diagnostics/s"
    return f"answers p50 {p50:7.1f} ms, p99 {p99:7.1f}, longest {longest:7.1f} of {len(delays)}; {rates}; {listener.worst}"


def main() -> None:
    """Print a line for each case."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=CASES, nargs="+", default=list(CASES))
    parser.add_argument("--seconds", type=float, default=5.0, help="of each case (5)")
    args = parser.parse_args()
    with isolated():
        rclpy.init()
        for name in args.only:
            print(f"{name:22s} {run(CASES[name], args.seconds)}", flush=True)
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
