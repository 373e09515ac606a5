"""The benchmark of health: sessions of the virtual rig with and without faults through the twin, all cores.

    python test/bench/health/sessions.py --out out/health/sessions      # makes the sessions, an hour or two
    python test/bench/health/run.py --sessions out/health/sessions --out out/health

Learns a baseline for every rig from its learning sessions, replays all others, and keeps what was told of each in
``outcomes.json``; what is there already is not done again. `table.py` makes the tables.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import stored
from tqdm import tqdm

from boom_twin import Twin, load_scene
from boom_twin.calibration.baseline import learn_baseline
from boom_twin.config.settings import Settings
from boom_twin.health.baseline import Baseline, load_baseline
from boom_twin.types import Alarm

NANO = 1e-9
CALM, LOAD = 1.0, 0.25  # s over which a force is averaged; share of it that counts as a change of load


def main(args: Namespace) -> None:
    """Learn, replay, keep."""
    out = args.out
    out.mkdir(parents=True, exist_ok=True)
    entries = [entry for entry in stored.entries(args.sessions) if (args.sessions / entry["file"]).is_file()]
    _learn(args, entries)
    kept = out / "outcomes.json"
    outcomes = json.loads(kept.read_text()) if kept.is_file() else {}
    wanted = [e for e in entries if e["group"] != "learn" and e["file"] not in outcomes and args.only in e["file"]]
    wanted = [e for e in wanted if e["group"] != "physical" or int(e["file"][-6:-4]) < args.most]
    wanted = [e for e in wanted if e["group"] != "sensor" or int(e["file"][-6:-4]) < args.most]
    with Pool(args.cores, maxtasksperchild=20) as pool:
        for entry, outcome in tqdm(pool.imap_unordered(partial(_outcome, args.sessions, out), wanted), total=len(wanted)):
            outcomes[entry["file"]] = entry | outcome
            stored.save_json(kept, outcomes)


def _learn(args: Namespace, entries: list[dict[str, Any]]) -> None:
    """One baseline for each rig; that of the right model is the package's own."""
    for instance in sorted({entry["instance"] for entry in entries} - {0}):
        path = args.out / f"baseline_{instance}.json"
        if not path.is_file():
            files = [entry["file"] for entry in entries if entry["group"] == "learn" and entry["instance"] == instance]
            sessions = [stored.samples(stored.load(args.sessions / file)) for file in files]
            learnt = learn_baseline(load_scene(), Settings(), sessions, [Path(file).name for file in files])
            path.write_text(learnt.model_dump_json())


def _outcome(sessions: Path, out: Path, entry: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Everything that was told of one session: each alarm at each of its changes."""
    path = out / f"baseline_{entry['instance']}.json"
    twin = Twin(load_scene(), baseline=load_baseline(path) if entry["instance"] else Baseline())
    arrays = stored.load(sessions / entry["file"])
    told: list[dict[str, Any]] = []
    last: dict[tuple[str, int], tuple[Any, ...]] = {}
    for sample in stored.samples(arrays):
        health = twin.update(sample).health
        for alarm in () if health is None else health.alarms:
            state = (alarm.cause, alarm.kind, alarm.until, tuple(each.cause for each in alarm.ranked[:2]))
            if last.get((alarm.channel, alarm.since)) != state:
                last[alarm.channel, alarm.since] = state
                told.append(_told(alarm, sample.stamp))
    seconds = float(arrays["stamps"][-1] - stored.EPOCH) * NANO
    return entry, {"told": told, "telling_move_end": _telling_move(entry, arrays), "seconds": seconds}


def _telling_move(entry: dict[str, Any], arrays: Any) -> float | None:
    """End (s) of the first move after the fault began that changes the load: of the soft cylinder, by a quarter at least."""
    moves, times = arrays["moves"], (arrays["stamps"] - stored.EPOCH) * NANO
    begin = entry["onset"] or 0.0
    forces = arrays["true_forces"]
    for end in sorted(end for end in (moves[:, 1] + moves[:, 2]).tolist() if end > begin):
        cause = entry["cause"] or ""
        if not (cause.startswith("cylinder_") and cause.endswith(".k")):
            return float(end)
        force = forces[:, int(cause[9]) - 1]
        before = force[(times >= begin) & (times <= begin + CALM)].mean()
        after = force[(times >= end) & (times <= end + CALM)].mean()
        if abs(after - before) > LOAD * abs(before):
            return float(end)
    return None


def _told(alarm: Alarm, stamp: int) -> dict[str, Any]:
    return {
        "at": (stamp - stored.EPOCH) * NANO,
        "channel": alarm.channel,
        "kind": alarm.kind,
        "since": (alarm.since - stored.EPOCH) * NANO,
        "until": None if alarm.until is None else (alarm.until - stored.EPOCH) * NANO,
        "cause": alarm.cause,
        "told": alarm.told,
        "ranked": [[each.cause, each.probability, list(each.parts)] for each in alarm.ranked],
    }


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", default="", help="sessions whose file has this in its name")
    parser.add_argument("--most", type=int, default=20, help="sessions of each fault and size")
    parser.add_argument("--cores", type=int, default=None)
    main(parser.parse_args())
