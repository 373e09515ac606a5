"""The benchmark of health: sessions of the virtual rig, drawn at random, through the twin.

    python test/bench/health/sessions.py --out out/health/sessions --count 200   # makes them
    python test/bench/health/run.py --sessions out/health/sessions --out out/health
    python test/bench/health/table.py out/health/outcomes.jsonl

Learns a baseline for every rig that is not the scene's own, replays all other sessions, and keeps what was told of each as a
row of ``outcomes.jsonl``; what is there already is not done again. Sessions that are held out need ``--held-out``.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import stored
from scenarios import Scenario, learning, nominal, scenario

from boom_twin import Twin
from boom_twin.calibration.baseline import learn_baseline
from boom_twin.config.settings import Settings
from boom_twin.health.baseline import Baseline, load_baseline
from boom_twin.twin.blocks import ReportBlock, block_of
from boom_twin.types import NANO, Alarm, Health, Sample, StrokeReading

AT_ONCE = 400  # samples


def main(args: Namespace) -> None:
    """Learn, replay, keep."""
    args.out.mkdir(parents=True, exist_ok=True)
    kept = args.out / "outcomes.jsonl"
    done = {json.loads(line)["number"] for line in kept.read_text().splitlines()} if kept.is_file() else set()
    numbers = sorted(int(path.stem[-4:]) for path in args.sessions.glob("session_*.npz"))
    wanted = [each for each in map(scenario, numbers) if each.number not in done and each.is_held_out == args.held_out]
    if args.only:
        wanted = [each for each in wanted if each.number in args.only]
    for rig, scene in sorted({(each.rig, each.scene) for each in wanted if each.rig}):
        learn(rig, args.sessions, args.out, scene)
    with Pool(args.jobs, maxtasksperchild=20) as pool, kept.open("a") as file:
        for row in pool.imap_unordered(partial(outcome, args.sessions, args.out), wanted):
            file.write(json.dumps(row) + "\n")
            file.flush()


def baseline_file(out: Path, rig: int, scene: str = "") -> Path:
    """Where the baseline of a rig is kept."""
    return out / f"baseline_{scene}{'_' if scene else ''}{rig}.json"


def learn(rig: int, sessions: Path, out: Path, scene: str = "") -> None:
    """Learn the baseline of a rig, unless it is there."""
    path = baseline_file(out, rig, scene)
    if not path.is_file():
        own = [each for each in learning(scene) if each.rig == rig]
        names = [stored.path_of(sessions, each).name for each in own]
        learnt = learn_baseline(nominal(scene), Settings(), [stored.load_samples(sessions, each) for each in own], names)
        path.write_text(learnt.model_dump_json())


def outcome(sessions: Path, out: Path, each: Scenario, shipped: bool = False) -> dict[str, Any]:
    """What is true of a session and everything that was told of it: each alarm at each of its changes, and as it was last.

    By the baseline of its rig, or by the one that ships.
    """
    baseline = load_baseline(baseline_file(out, each.rig, each.scene)) if each.rig and not shipped else Baseline()
    twin = Twin(each.model, baseline=baseline, reads=StrokeReading.DRIVE)
    told: list[dict[str, Any]] = []
    last: dict[tuple[str, int, str], tuple[Any, ...]] = {}
    newest: dict[tuple[str, int, str], dict[str, Any]] = {}
    samples = stored.load_samples(sessions, each)
    for first in range(0, len(samples), AT_ONCE):
        for health in _health(twin, samples[first : first + AT_ONCE]):
            for alarm in health.alarms:
                key = alarm.channel, alarm.since, alarm.kind if alarm.cause is None else alarm.cause
                newest[key] = _told(alarm, health.stamp)
                state = alarm.until, tuple(rank.cause for rank in alarm.ranked[:2])
                if last.get(key) != state:
                    last[key] = state
                    told.append(newest[key])
    return each.row | {"told": told, "newest": [*newest.values()]}


def _health(twin: Twin, samples: list[Sample]) -> list[Health]:
    """What the twin tells of its health while it takes these samples."""
    found: list[Health] = []
    for report in twin.update_block(block_of(samples, len(twin.scene.joints))):
        each = report.health.values() if isinstance(report, ReportBlock) else [report.health]
        found += [health for health in each if health is not None]
    return found


def _told(alarm: Alarm, stamp: int) -> dict[str, Any]:
    return {
        "at": (stamp - stored.EPOCH) * NANO,
        "channel": alarm.channel,
        "kind": alarm.kind,
        "since": (alarm.since - stored.EPOCH) * NANO,
        "until": None if alarm.until is None else (alarm.until - stored.EPOCH) * NANO,
        "cause": alarm.cause,
        "told": alarm.told,
        "ranked": [[rank.cause, rank.probability, list(rank.parts)] for rank in alarm.ranked],
    }


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--held-out", action="store_true", help="only the sessions that are held out")
    parser.add_argument("--only", type=int, nargs="*", help="numbers")
    parser.add_argument("--jobs", type=int, default=None)
    main(parser.parse_args())
