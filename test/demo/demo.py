"""The demonstration: a recorded session played over DDS into the live node, its outputs recorded and scored.

Three processes: ``twin_node``, ``boom_twin record``, and this one, which plays. Run by ``make demo``. The bundled
session is synthetic (virtual rig, surrogate parameters).
"""

from __future__ import annotations

import sys
import time
from argparse import ArgumentParser, Namespace
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from recordings import TRUTH, Session, read, scan, scene_of
from ros_messages import Output, Topic, load_topics, stamp_of

from boom_twin import BagError, BoomTwinError, Stream
from boom_twin.bag.session_model import settings_of
from boom_twin.offline.history import draw
from boom_twin.offline.progress import ProgressLine
from boom_twin.offline.recording import Stretch
from boom_twin.report.evaluation import evaluated_replay
from boom_twin.ros.startup import require_rclpy
from boom_twin.system.files import holds_file, open_received, write_atomic
from boom_twin.system.result_folder import REPLAY, result_folder
from boom_twin.types import NANO, sensor_kind

from .isolation import add_domain
from .processes import DemoProcesses, demo_processes


@dataclass(frozen=True)
class DemoResult:
    """Predicted tips (x, z of ``base_link``, m) by stamp, as they arrived, and how many residuals.

    `latency_ms`: median and 99 % quantile from the arrival of a stroke to that of its prediction, both at the recorder.
    `residual_rms`: measured minus predicted by channel, in the unit of the sensor.
    """

    positions: dict[int, tuple[float, float]]
    residual_sets: int
    latency_ms: np.ndarray
    residual_rms: dict[str, float]

    def as_text(self, session: str, sent: int, equal: int, summary: dict[str, Any]) -> list[str]:
        """Return the lines of a short table.

        `sent` strokes were played. A replay, of this `summary`, reproduced `equal` of the predictions.
        """
        arrived, (median, slowest) = len(self.positions), self.latency_ms
        rows = [
            ("session", session),
            ("stroke samples sent", f"{sent}"),
            ("predictions received", f"{arrived}"),
            ("lost", f"{sent - arrived}"),
            ("residual sets", f"{self.residual_sets}"),
            ("equal to a replay", f"{equal} of {arrived}, to the last bit"),
            ("latency, median / 99 %", f"{median:.1f} / {slowest:.1f} ms"),
        ]
        for source, key in (("prediction", "tip"), ("estimate", "tip_estimate")):
            if f"{key}_error_rms_m" in summary:
                position, acceleration = summary[f"{key}_error_rms_m"], summary[f"{key}_acceleration_error_rms_m_s2"]
                amount = f"{position * 1e3:.2f} mm, {acceleration:.3f} m/s^2 rms against the rig's truth"
                rows.append((f"tip error, {source}", amount))
        for name, value in self.residual_rms.items():
            factor, unit = sensor_kind(name).shown_unit
            rows.append((f"residual {name}", f"{value * factor:.3f} {unit} rms"))
        return [f"{name:25s}  {value}" for name, value in rows]


def score(recorded: Path) -> DemoResult:
    """Return the results of one recorded run; BagError if it cannot be read, or holds no prediction."""
    topics, session = load_topics(), scan(recorded)
    arrived = _messages(session, topics.outputs[Output.TIP_POSITION])
    strokes = {stamp_of(msg): time for time, msg in _messages(session, topics.inputs[Stream.STROKES])}
    if not arrived or not strokes:
        raise BagError(f"{recorded}: the node published no prediction.")
    delays = [time - strokes[stamp_of(msg)] for time, msg in arrived if stamp_of(msg) in strokes]
    residuals = _messages(session, topics.outputs[Output.RESIDUALS])
    return DemoResult(
        positions={stamp_of(msg): (msg.point.x, msg.point.z) for _, msg in arrived},
        residual_sets=len(residuals),
        latency_ms=np.quantile(delays, [0.5, 0.99]) * 1e-6 if delays else np.full(2, np.nan),
        residual_rms=_residual_rms([msg for _, msg in residuals]),
    )


def _messages(session: Session, topic: Topic) -> list[tuple[int, Any]]:
    known = session.find(topic.absolute)
    if known is None or known.count == 0:
        return []
    return [(time, msg) for _, time, msg in read(session, {topic.absolute: topic.type})]


def _residual_rms(residuals: list[Any]) -> dict[str, float]:
    """Return the root mean square of the residuals by channel, over the values that are there."""
    values: dict[str, list[NDArray[np.float64]]] = {}
    for msg in residuals:
        for name, value in zip(msg.name, msg.position, strict=True):
            values.setdefault(name, []).append(value)
    return {name: float(np.sqrt(np.nanmean(np.square(column)))) for name, column in sorted(values.items())}


SETTLE = 1.0
"""Seconds for the last messages to arrive."""


def main() -> int:
    """Run the demonstration; return the exit code, 1 if no output arrived."""
    args = _arguments()
    try:
        require_rclpy()
        session = scan(args.bag)
        about = session.notes.get("origin", "origin not noted")
        taken = scene_of(args.bag)
        with demo_processes(args.out, f"live run of: {about}", taken.text, args.domain) as running:
            sent, recorded = _play(session, args.duration, running), running.recorded
        if holds_file(args.bag / TRUTH):
            with open_received(args.bag / TRUTH) as truth:
                write_atomic(recorded / TRUTH, truth.read())
        live = score(recorded)
        with result_folder(args.out / "replay", REPLAY, [recorded]) as building:
            stretches: list[Stretch] = []
            scene, settings = scene_of(recorded), settings_of(recorded).settings
            found = evaluated_replay(building, recorded, scene, settings, also=stretches.append)
            pictures = [path.name for path in draw(found.result, found.history, found.scene, building)]
        name, equal = f"{session.path.name} ({about})", _equal(live, stretches)
        print("\n".join(live.as_text(name, sent[Stream.STROKES.value], equal, found.result.summary)))
        for path in [recorded, *(args.out / "replay" / name for name in pictures)]:
            print(path)
        print(f"see it in a browser: {sys.executable} -P -m boom_twin.cli.main monitor --bag {recorded}")
        return 0
    except BoomTwinError as error:
        print(f"demo: {error}", file=sys.stderr)
    except KeyboardInterrupt:
        print("demo: stopped", file=sys.stderr)
    return 1


def _arguments() -> Namespace:
    parser = ArgumentParser(prog="python -m demo.demo", description="Play a session into the live twin.")
    parser.add_argument("--bag", type=Path, default=Path("bags/arch_session"), help="session (bags/arch_session)")
    parser.add_argument("--duration", type=float, default=30.0, help="seconds of it (30)")
    parser.add_argument("--out", type=Path, default=Path("out/demo"), help="folder for the results (out/demo)")
    add_domain(parser)
    args = parser.parse_args()
    if not 0.0 < args.duration < inf:
        parser.error(f"--duration {args.duration}: must be > 0 and finite")
    return args


def _play(session: Session, duration: float, running: DemoProcesses) -> dict[str, int]:
    """Play, once all have found each other; return the number of messages sent by topic."""
    from boom_twin.ros.bag.player import Player
    from boom_twin.ros.runtime import ros

    with ros([]):
        player = Player(session)
        running.wait_for_discovery(player)
        total, before = round(player.length(0.0, duration)), 0
        bar = ProgressLine(total, "s", "playing")
        for elapsed in running.play(player, duration):
            bar.update((elapsed - before) * NANO)
            before = elapsed
        bar.update(total - before * NANO)  # the last message comes shortly before the end
        bar.close()
        time.sleep(SETTLE)
        running.check()
        player.close()
    return player.sent


def _equal(live: DemoResult, again: list[Stretch]) -> int:
    """Return how many live predictions a replay of the recorded inputs reproduces, to the last bit."""
    replayed = {
        stamp: tuple(position)
        for each in again
        for stamp, position in zip(each.predictions.stamps.tolist(), each.predictions.tip_position.tolist(), strict=True)
    }
    return sum(replayed.get(stamp) == position for stamp, position in live.positions.items())


if __name__ == "__main__":
    sys.exit(main())
