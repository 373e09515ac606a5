"""The benchmark of health: sessions of the virtual rig, drawn at random by their numbers, through the twin.

    python test/bench/health/run.py --out out/health/rows.jsonl --count 100 [--first 0]
    python test/bench/health/run.py --out out/health/rows.jsonl --table
    python test/bench/health/run.py --out out/health/causes.jsonl --causes --count 100

Two of three rigs are 2 % wrong. Half of the sessions are healthy, the others have one fault from 15 s on. A row of the file has
what is true of a session and every alarm; rows that are there already are not made again. With --causes the twin names causes,
the scene has a payload of 30 kg, and the faults are those of `CAUSES`.

Six elements a section, exact at their nodes, with steps of 5 ms at a tolerance of 1e-4 agree with 16 elements and 0.5 ms (20 s
of random moves) within 8e-6 rad rms in every joint, 0.09 mm and 0.007 m/s^2 at the tip.
"""

from __future__ import annotations

import json
import os
import sys
from argparse import ArgumentParser
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # files repeat bit for bit

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from bench.record import keep
from default_boom import with_parameters

from boom_twin import Twin, load_scene
from boom_twin.bag.session_writer import samples_in_rows
from boom_twin.health.alarms import Alarms
from boom_twin.twin.blocks import block_of
from boom_twin.types import NANO, Stream
from boom_twin.validation.rig import Scheme, Sensors, at_rest, move, observe, random_programme
from boom_twin.validation.rig.faults import changes, parse, spoil, wrong_by
from boom_twin.validation.rig.loads import PumpLoad, WindLoad, tip_load
from boom_twin.validation.rig.motion import Programme

ELEMENTS, STEP, SCHEME = 6, 5e-3, Scheme(tolerance=1e-4)
DURATION, ONSET, FASTER = 60.0, 15.0, 2.0  # s; how much faster hasty moves are
KINDS = ("quiet", "fast", "pump", "wind", "both")
FAULTS = (
    "joint_{i}.sensor:stuck", "joint_{i}.sensor:noisy:5", "joint_{i}.sensor:spikes:0.03", "joint_{i}.sensor:dropout:1",
    "joint_{i}.sensor:bias:0.02", "joint_{i}.sensor:bias:0.02@15+5", "cylinder_{i}.sensor:stuck",
    "cylinder_{i}.sensor:dropout:1", "cylinder_{i}.sensor:spikes:0.02", "cylinder_{i}.sensor:bias:0.003@15+5",
    "joint_angles.delay:late:0.2", "cylinder_force_{i}.sensor:bias:10000@15+5", "tip.payload:more:20",
    "cylinder_{i}.k:softer:0.3",
)  # fmt: skip

SENSOR_FAILS = (":stuck", ":noisy:5", ":spikes:0.03", ":spikes:0.02", ":dropout:1", "sensor:bias:0.02")
"""Ends of faults that the readings of a sensor show by themselves."""
CAUSES = (
    "cylinder_{i}.k:softer:{share}", "cylinder_{i}.k:softer:{share}@15+4", "cylinder_{i}.k:softer:{share}@0",
    "section_{i}.EI:softer:{share}@15+4", "section_{i}.EI:softer:{share}@0", "tip.payload:more:20", "tip.payload:less:20",
    "line_fill:more:3@15+2", "joint_{i}.sensor:bias:0.0035", "joint_{i}.sensor:bias:0.0052@15+30",
    "cylinder_{i}.sensor:bias:0.0007", "cylinder_{i}.sensor:bias:0.003@15+30", "cylinder_force_{i}.sensor:bias:10000@15+5",
    "{stream}.delay:late:0.02@0", "cylinder_{i}.k:softer:{share} joint_{j}.sensor:bias:0.0035@30",
    "tip.payload:more:20 section_{j}.EI:softer:{share}@30+4", "cylinder_{i}.k:softer:{share}@10..35",
    "section_{i}.EI:softer:{share}@10+4..35", "tip.payload:more:20@10..35", "joint_{i}.sensor:bias:0.0035@10..35",
)  # fmt: skip
"""Faults whose cause is named, from `ONSET` on where they say no other time; the share that is lost is drawn."""
NEED_FORCES = ("cylinder_force", "tip.payload")
LATE = ("joint_angles", "tip_imu", "cylinder_forces", "cylinder_strokes")  # streams of which one is late


def row_of(number: int, causes: bool = False) -> dict[str, Any]:
    """Make the session of a number, replay it, and return what is true of it with every alarm."""
    rng, scene = np.random.default_rng([number, 17]), load_scene()
    if causes:
        scene = with_parameters(scene, {"tip.payload": 30.0})
    kind, i = str(rng.choice(KINDS)), int(rng.integers(1, 5))
    words = str(rng.choice(CAUSES if causes else FAULTS)) if number % 2 else ""
    more = np.random.default_rng([number, 36])
    drawn = {"share": round(float(more.uniform(0.2, 0.4)), 2), "j": int(more.integers(1, 5)), "stream": str(more.choice(LATE))}
    named = " ".join(each + ("" if "@" in each else f"@{ONSET:g}") for each in words.format(i=i, **drawn).split())
    sensors, posture = Sensors(float(rng.choice([50.0, 100.0, 200.0]))), str(rng.choice(sorted(scene.postures)))
    has_all, rig = words.startswith(NEED_FORCES) and not causes, int(rng.integers(3))
    streams = ("imu", "forces")[: 2 if has_all else int(rng.integers(3))]
    if causes:
        asked = {"imu": "EI" in words or "tip_imu" in named, "forces": "force" in named}
        streams = tuple(name for name, share in (("imu", 0.7), ("forces", 0.6)) if more.random() < share or asked[name])
    loads = []
    if kind in ("pump", "both"):
        loads.append(PumpLoad(float(rng.uniform(0.2, 0.6)), float(np.exp(rng.uniform(np.log(30.0), np.log(250.0)))), onset=2.0))
    if kind in ("wind", "both"):
        loads.append(WindLoad(float(rng.uniform(10.0, 40.0))))
    late = named.partition(".delay:late:")[0] if causes else ""
    faults = [] if late in LATE else [parse(each) for each in named.split()]
    boom, changing = changes(wrong_by(scene, 0.02, rig) if rig else scene, faults)
    programme = random_programme(scene, posture, DURATION * (FASTER if kind == "fast" else 1.0), number)
    if kind == "fast":
        hasty = (replace(each, start=each.start / FASTER, duration=each.duration / FASTER) for each in programme.moves)
        programme = Programme(programme.first, tuple(hasty))
    load = tip_load(boom, loads, DURATION, number) if loads else None
    resting = at_rest(boom, np.array(programme.first), ELEMENTS, nodally_exact=True)
    rows, _ = move(resting, programme, DURATION, STEP, STEP, SCHEME, load, changing)
    seen = spoil(observe(boom, programme, rows, sensors, number, load), faults, number)
    imu, forces = (getattr(seen, name) if name in streams else None for name in ("imu", "forces"))
    twin, alarms = Twin(scene, health=True, causes=causes), Alarms()
    first = int(seen.stamps[0])
    rows = {Stream.STROKES: seen.strokes, Stream.ANGLES: seen.joints, Stream.IMU: imu, Stream.FORCES: forces}
    samples = samples_in_rows(
        seen.stamps, {stream: each for stream, each in rows.items() if each is not None}, seen.angle_stamps
    )
    if late in LATE:
        by = round(float(named.rpartition(":")[2].partition("@")[0]) / NANO)
        moved = (replace(each, stamp=each.stamp + by) if each.stream.value == late else each for each in samples)
        samples = sorted(moved, key=lambda each: each.stamp)
    for health in twin.take(block_of(samples, len(scene.joints))).health.values():
        alarms.take(health)
    found = []
    for each in alarms.all:
        since, until = (stamp and (stamp - first) * NANO for stamp in (each.since, each.until))
        found.append([each.channel, each.kind, since, until, each.told, each.cause])
    drawn = {"number": number, "kind": kind, "rig": rig, "rate": sensors.rate, "streams": streams}
    return drawn | {"fault": named, "words": words, "alarms": found}


def onsets(row: dict[str, Any]) -> list[float]:
    """Return when the alarms of a row began, s."""
    return [since for _, _, since, *_ in row["alarms"]]


def counts(rows: list[dict[str, Any]]) -> dict[str, int]:
    """Return how many sessions are healthy and have an alarm, and in how many a sensor fails and is reported from then on."""
    healthy = [row for row in rows if not row["words"]]
    failing = [row for row in rows if row["words"].endswith(SENSOR_FAILS)]
    return {
        "healthy": len(healthy),
        "healthy with an alarm": sum(bool(row["alarms"]) for row in healthy),
        "failing": len(failing),
        "failing reported": sum(max(onsets(row), default=0.0) >= ONSET - 0.2 for row in failing),
    }


def named_in(row: dict[str, Any]) -> tuple[set[str], bool]:
    """Return the causes that the alarms of a row name wrongly, and whether all true ones are named.

    A stroke transducer that is off is named as the sensors of its joint.
    """
    named = {cause for *_, cause in row["alarms"] if cause}
    true = [{each.partition(":")[0]} for each in row["fault"].split()]
    true = [each | {name.replace("cylinder_", "joint_") for name in each if name.endswith("sensor")} for each in true]
    return named.difference(*true), all(named & each for each in true)


def causes_named(rows: list[dict[str, Any]]) -> dict[str, int]:
    """Return how many healthy and faulty sessions there are, in how many a wrong cause is named, and all right ones."""
    healthy, faulty = ([named_in(row) for row in rows if bool(row["words"]) is each] for each in (False, True))
    found = {"healthy": len(healthy), "healthy named": sum(bool(wrong) for wrong, _ in healthy), "faulty": len(faulty)}
    return found | {"wrong": sum(bool(wrong) for wrong, _ in faulty), "right": sum(right for _, right in faulty)}


def table(rows: list[dict[str, Any]]) -> None:
    """Print healthy sessions by kind, and faults: how many are told, after which median time, and other alarms before them."""
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[row["words"] or f"healthy, {row['kind']}"].append(row)
    for name, own in sorted(groups.items()):
        is_fault = not name.startswith("healthy")
        times = [onsets(row) for row in own]
        before = sum(min(each, default=ONSET) < ONSET - 0.2 for each in times) if is_fault else sum(map(bool, times))
        delays = [min(after) - ONSET for each in times if (after := [t for t in each if t >= ONSET - 0.2])]
        told = f", told in {len(delays)}, after {np.median(delays):.1f} s (median)" if is_fault and delays else ""
        told = told or (", told in 0" if is_fault else "")
        found = [named_in(row) for row in own]
        right = sum(is_right for _, is_right in found)
        told += f", a wrong cause named in {sum(bool(wrong) for wrong, _ in found)}"
        told += f", the true ones in {right}" if is_fault else ""
        print(f"{name}: {len(own)} sessions{told}, {'too early' if is_fault else 'with an alarm'} in {before}")


def main() -> None:
    """Make rows, or print the table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--causes", action="store_true")
    parser.add_argument("--table", action="store_true")
    args = parser.parse_args()
    rows = [json.loads(line) for line in args.out.read_text().splitlines()] if args.out.is_file() else []
    if args.table:
        table(rows)
        return
    args.out.parent.mkdir(parents=True, exist_ok=True)
    done = {row["number"] for row in rows}
    with args.out.open("a") as file:
        for number in range(args.first, args.first + args.count):
            if number not in done:
                rows.append(row_of(number, args.causes))
                print(json.dumps(rows[-1]), file=file, flush=True)
    keep("causes" if args.causes else "health", causes_named(rows) if args.causes else counts(rows))


if __name__ == "__main__":
    main()
