"""The live node beside a bare echo node with the same topics in and out: loss, latency, processor time.

Run ``python test/bench/live.py`` on an idle machine: real processes and DDS, loopback only; medians of three runs. A
source sends strokes and angles, stamped with the time of sending; a listener takes everything that is published. The node
comes first, then the echo, which is rclpy as its tutorials use it: the node's topics, so ten stamped messages for every stroke
sample, one for angles, two for an IMU, nothing computed; once on rclpy's default executor, once on the events executor.
"""

from __future__ import annotations

import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from array import array
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import (
    AccelStamped,
    AccelWithCovarianceStamped,
    PointStamped,
    PoseWithCovarianceStamped,
    TwistWithCovarianceStamped,
    Vector3,
    Vector3Stamped,
    WrenchStamped,
)
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from record import keep
from sensor_msgs.msg import Imu, JointState

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from demo.isolation import isolated

from boom_twin import load_scene, statics
from boom_twin.analysis.equilibrium import rest_at
from boom_twin.kernels.tables import FRAME_ANGLE
from boom_twin.messages.cdr_decoder import stamp_in

OUT = {
    "tip/position": PointStamped,
    "tip/displacement": Vector3Stamped,
    "tip/acceleration": AccelStamped,
    "joint_states": JointState,
    "estimate/tip/pose": PoseWithCovarianceStamped,
    "estimate/tip/twist": TwistWithCovarianceStamped,
    "estimate/tip/acceleration": AccelWithCovarianceStamped,
    "estimate/tip/load": WrenchStamped,
    "estimate/modes": JointState,
    "residuals": JointState,
}
SENSOR = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
NAMES = {"node": "boom_twin", "echo": "echo", "echo-events": "echo"}
TICK = os.sysconf("SC_CLK_TCK")


class Echo(Node):
    """Answers every message at once."""

    def __init__(self) -> None:
        super().__init__("echo")
        self._out = {name: (self.create_publisher(kind, f"~/{name}", 100), kind()) for name, kind in OUT.items()}
        for message in (self._out[name][1] for name, kind in OUT.items() if kind is JointState):
            message.name = [f"joint_{i}" for i in range(1, 5)]
            message.position = message.velocity = message.effort = array("d", [0.0] * 4)
        self.create_subscription(JointState, "cylinder_strokes", lambda msg: self._answer(msg, list(OUT)), SENSOR)
        self.create_subscription(JointState, "joint_angles", lambda msg: self._answer(msg, ["residuals"]), SENSOR)
        self.create_subscription(Imu, "tip_imu", lambda msg: self._answer(msg, ["residuals"] * 2), SENSOR)

    def _answer(self, msg: Any, names: list[str]) -> None:
        for name in names:
            publisher, answer = self._out[name]
            answer.header.stamp = msg.header.stamp
            publisher.publish(answer)


def echo() -> None:
    """On rclpy's default executor, until it is killed."""
    node = Echo()
    print("active;", flush=True)
    rclpy.spin(node)


def echo_on_events() -> None:
    """On the executor that costs least."""
    node, executor = Echo(), EventsExecutor()
    executor.add_node(node)
    print("active;", flush=True)
    while True:
        executor.spin_once(timeout_sec=1.0)


def source(rate_text: str, duration_text: str, *more: str) -> None:
    """Send, once it has been found; prints a line when it begins, and the stamps of the strokes.

    More words: ``imu`` sends that too, ``stuck`` repeats one reading of the angles after 5 s, ``later=S`` stamps by a clock
    that is ahead by so many seconds, ``even`` stamps with the time when a message was due, as a rig with its own clock does.
    """
    later = sum(round(float(word.removeprefix("later=")) * 1e9) for word in more if word.startswith("later="))
    rate, duration = float(rate_text), float(duration_text)
    node, scene = rclpy.create_node("source"), load_scene()
    publishers = [node.create_publisher(JointState, name, SENSOR) for name in ("cylinder_strokes", "joint_angles")]
    publishers += [node.create_publisher(Imu, "tip_imu", SENSOR)] * ("imu" in more)
    end = time.monotonic() + 30.0
    while any(publisher.get_subscription_count() < 1 for publisher in publishers):
        if time.monotonic() > end:
            raise SystemExit("nobody listens")
        time.sleep(0.1)
    time.sleep(1.0)
    random, rest = np.random.default_rng(1), statics(scene, "arch")
    templates = []
    for kind, values, sigma in (("cylinder", rest.lengths, 2e-5), ("joint", rest.joints, 1.7e-4)):
        msg = JointState(name=[f"{kind}_{i}" for i in range(1, 5)])
        rows = values + random.normal(0.0, sigma, (200, 4))
        for row in rows:
            msg.position = array("d", row)
            templates.append(bytearray(serialize_message(msg)))
    angle = rest_at(scene, rest.strokes, rest.joints)[1].frames[-1, FRAME_ANGLE]
    at_rest, sigmas = (9.81 * np.sin(angle), 9.81 * np.cos(angle), 0.0), (0.05, 0.05, 1e-3)
    for x, z, turning in random.normal(at_rest, sigmas, (200, 3)):
        imu = Imu(linear_acceleration=Vector3(x=x, z=z), angular_velocity=Vector3(y=turning))
        templates.append(bytearray(serialize_message(imu)))
    print("sending", flush=True)
    stamps, began, start = [], time.monotonic(), time.time_ns()
    for k in range(int(rate * duration)):
        left = began + k / rate - time.monotonic()
        if left > 0.0:
            time.sleep(left)
        for number, publisher in enumerate(publishers):
            is_stuck = "stuck" in more and number == 1 and k > 5 * rate
            place = 200 * number + (0 if is_stuck else k % 200)
            stamp = (start + round(k / rate * 1e9) if "even" in more else time.time_ns()) + later
            data = templates[place]
            data[4:12] = (stamp // 10**9).to_bytes(4, "little") + (stamp % 10**9).to_bytes(4, "little")
            publisher.publish(bytes(data))
            if publisher is publishers[0]:
                stamps.append(stamp)
    print(json.dumps({"sent": stamps, "seconds": time.monotonic() - began}), flush=True)
    time.sleep(1.0)


def listen(who: str, *forget: str) -> None:
    """Until SIGTERM; prints stamps and delays by topic, or how many messages if it is to forget them."""
    node, heard, counts = rclpy.create_node("listener"), {}, dict.fromkeys(OUT, 0)
    qos = QoSProfile(depth=2000, reliability=ReliabilityPolicy.RELIABLE)

    def hear(name: str, kind: type) -> None:
        rows: Any = deque(maxlen=1 if forget else None)
        heard[name] = rows

        def take(data: bytes) -> None:
            counts[name] += 1
            rows.append((data[:12], time.time_ns()))

        node.create_subscription(kind, f"/{who}/{name}", take, qos, raw=True)

    for name, kind in OUT.items():
        hear(name, kind)
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda *_: ended.append(1))
    executor = EventsExecutor()
    executor.add_node(node)
    while not ended:
        executor.spin_once(timeout_sec=0.1)
    if forget:
        print(json.dumps(counts))
        return
    found = {name: [(stamp_in(data), now) for data, now in rows] for name, rows in heard.items()}
    print(json.dumps({name: [[stamp, now - stamp] for stamp, now in rows] for name, rows in found.items()}))


def folders(process: subprocess.Popen) -> list[Path]:
    """Folders in /proc of a process and its children."""
    own = Path(f"/proc/{process.pid}")
    children = " ".join(each.read_text() for each in own.glob("task/*/children"))
    return [own, *(Path("/proc") / number for number in children.split())]


def cpu(process: subprocess.Popen) -> float:
    """Processor seconds so far, with children."""
    rows = [(each / "stat").read_text().rsplit(")", 1)[1].split() for each in folders(process)]
    return sum(int(fields[11]) + int(fields[12]) for fields in rows) / TICK


def memory(process: subprocess.Popen) -> float:
    """Resident, MB, with children."""
    pages = sum(int((each / "statm").read_text().split()[1]) for each in folders(process))
    return pages * os.sysconf("SC_PAGESIZE") / 1e6


def run(who: str, rate: float, duration: float, words: list[str], arguments: list[str]) -> dict[str, float]:
    """One answering process with source and listener."""
    own = [sys.executable, __file__]
    command = [sys.executable, "-m", "boom_twin.ros.node.main", *arguments] if who == "node" else [*own, who]
    with tempfile.TemporaryDirectory() as folder:
        log, out = Path(folder) / "log", Path(folder) / "heard"
        answering = subprocess.Popen(command, stdout=log.open("w"), stderr=subprocess.STDOUT)
        listener = subprocess.Popen([*own, "listen", NAMES[who]], stdout=out.open("w"))
        try:
            while "active;" not in log.read_text():
                if answering.poll() is not None:
                    raise SystemExit(log.read_text())
                time.sleep(0.2)
            sending = subprocess.Popen([*own, "source", str(rate), str(duration), *words], stdout=subprocess.PIPE, text=True)
            assert sending.stdout is not None
            sending.stdout.readline()
            before = cpu(answering)
            told = json.loads(sending.stdout.readline())
            used = cpu(answering) - before
            resident = memory(answering)
            time.sleep(1.0)
            listener.send_signal(signal.SIGTERM)
            listener.wait(60)
            heard = json.loads(out.read_text())
        finally:
            for process in (answering, listener):
                process.kill()
    return judge(told, heard, 2 + 2 * ("imu" in words)) | {"cpu": 100.0 * used / told["seconds"], "MB": resident}


def judge(told: dict[str, Any], heard: dict[str, list[list[int]]], compared: int) -> dict[str, float]:
    """Loss and latency of one process, with so many streams that have residuals; the node has none of the first strokes."""
    answers = heard["tip/position"]
    delays = np.array([delay for _, delay in answers]) * 1e-6
    sent, stamps = told["sent"], [stamp for stamp, _ in answers]
    return {
        "rate": len(sent) / told["seconds"],
        "lost": len(set(sent) - set(stamps)),
        "twice": len(stamps) - len(set(stamps)),
        "residuals lost": compared * len(sent) - len(heard["residuals"]),
        "p50": float(np.quantile(delays, 0.5)),
        "p99": float(np.quantile(delays, 0.99)),
    }


def compared(rate: float, duration: float, words: list[str], arguments: list[str]) -> dict[str, float]:
    """The node, then the echoes, in one go."""
    of = {who: run(who, rate, duration, words, arguments) for who in NAMES}
    found = {f"{who} {key}": value for who, numbers in of.items() for key, value in numbers.items()}
    for who in ("echo", "echo-events"):
        found[f"cpu over {who}"] = of["node"]["cpu"] / of[who]["cpu"]
        for key in ("p50", "p99"):
            found[f"{key} added to {who}"] = of["node"][key] - of[who][key]
    return found


def main() -> None:
    """Print the medians."""
    if sys.argv[1:2] and sys.argv[1] in ROLES:
        rclpy.init()
        ROLES[sys.argv[1]](*sys.argv[2:])
        return
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=1000.0, help="of strokes and of angles, Hz (1000)")
    parser.add_argument("--duration", type=float, default=60.0, help="s (60)")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--even", action="store_true", help="stamp with the time when a message was due")
    parser.add_argument("--imu", action="store_true", help="send and compare that too, at the same rate")
    args, rest = parser.parse_known_args()
    words = ["even"] * args.even + ["imu"] * args.imu
    with isolated():
        runs = [compared(args.rate, args.duration, words, rest) for _ in range(args.runs)]
    medians = {name: statistics.median(each[name] for each in runs) for name in runs[0]}
    keep(f"live_{args.rate:g}", medians)
    for name, middle in medians.items():
        values = [each[name] for each in runs]
        print(f"{name:26s} {middle:10.3f}   ({', '.join(f'{value:.3f}' for value in values)})")
    print(f"load of the machine, 1 min {os.getloadavg()[0]:10.2f}")


ROLES = {"echo": echo, "echo-events": echo_on_events, "listen": listen, "source": source}

if __name__ == "__main__":
    main()
