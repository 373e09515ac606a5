"""The benchmark of health: sessions of the virtual rig, drawn at random by their numbers, through the twin.

    python test/bench/health/run.py --causes --count 100 [--first 0] [--held]
    python test/bench/health/run.py --causes --hours 2

It prints a table of faults and false alarms. Two of five sessions are healthy, half of the rigs 2 % wrong, a sixth of the booms
folded in Z. With --causes the twin names causes. Every third number is held back: only --held draws it, to judge what was made
by looking at the others. With --hours all sessions are healthy, under pump and wind, on rigs 2 % wrong with all sensors. Each
row of the file has what is true of a session and every alarm; rows that are there already are not made again.

Six elements a section, exact at their nodes, with steps of 2.5 ms at a tolerance of 1e-4 agree with 10 elements and 1 ms, in
60 s of joystick moves with 7 m/s^2 rms at the tip, within 5e-5 rad rms in every joint, 0.3 mm and 0.03 m/s^2 at the tip.
"""

from __future__ import annotations

import json
import math
import os
import re
import sys
from argparse import ArgumentParser
from collections import defaultdict
from dataclasses import replace
from itertools import count, islice
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # files repeat bit for bit

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from bench.record import FOLDER, ROOT, keep
from default_boom import with_parameters

from boom_twin import Scene, Twin, load_scene
from boom_twin.bag.session_writer import samples_in_rows
from boom_twin.health.alarms import Alarms
from boom_twin.scene.pump_pulses import ease
from boom_twin.twin.blocks import SampleBlock, block_of
from boom_twin.types import NANO, SECOND, Array, Stream
from boom_twin.validation.rig import Scheme, Sensors, at_rest, move, observe, random_programme
from boom_twin.validation.rig.faults import RigFault, changes, parse, spoil, wrong_by
from boom_twin.validation.rig.motion import Programme, PumpLoad, WindLoad, parse_load, tip_load

ELEMENTS, STEP, RECORDED, SCHEME = 6, 2.5e-3, 5e-3, Scheme(tolerance=1e-4)
DURATION, LONG, FASTER = 60.0, 600.0, 2.0  # s; how much faster hasty moves are
Z_FOLD = ROOT / "boom_twin" / "examples" / "five_section_z_fold.yaml"
PACES: dict[str, Any] = {"usual": (), "joystick": ((0.7, 4.0), (0.5, 2.0)), "fast": ()}  # s of holds and of moves
MOVES = ("usual", "usual", "joystick", "joystick", "fast")
LOADS = ("", "pump", "wind", "pump wind")
SOFTER = ("cylinder_{i}.k:softer:{share}", "section_{i}.EI:softer:{share}")
SENSORS = ("joint_{i}.sensor:bias:0.0035", "cylinder_{i}.sensor:bias:0.0007", "cylinder_force_{i}.sensor:bias:{force}")
PARTS = (*SOFTER, "tip.payload:more:{payload}", *SENSORS)  # of two faults, and of one that ends
FAULTS = (
    *(each + when for each in SOFTER for when in ("@{t}+4", "@0")), SOFTER[0] + "@{t}", "tip.payload:more:{payload}@{t}",
    "tip.payload:more:{payload}@0", "tip.payload:less:{payload}@{t}+10", "line_fill:more:{fill}@{t}+2",
    "joint_{i}.sensor:bias:0.0035@{t}", "joint_{i}.sensor:bias:0.0052@{t}+30", "cylinder_{i}.sensor:bias:0.0007@{t}",
    "cylinder_{i}.sensor:bias:0.003@{t}+30", "cylinder_force_{i}.sensor:bias:{force}@{t}+5", "tip_imu.sensor:bias:0.4@{t}",
    "{stream}.delay:late:0.02@0", "joint_angles.delay:late:0.2@{t}", "joint_{i}.sensor:stuck@{t}",
    "joint_{i}.sensor:noisy:5@{t}", "joint_{i}.sensor:spikes:0.03@{t}", "joint_{i}.sensor:dropout:1@{t}",
    "joint_{i}.sensor:bias:0.02@{t}", "cylinder_{i}.sensor:stuck@{t}", "cylinder_{i}.sensor:dropout:1@{t}",
    "cylinder_{i}.sensor:spikes:0.02@{t}", *["{a}@{t}+4 {b}@{later}+4"] * 2, *["{a}@8+3..33"] * 2,
)  # fmt: skip
"""Faults; sizes of loads and forces grow with the mass of the boom."""


def scene_of(row: dict[str, Any]) -> tuple[Scene, float]:
    """Return the scene of a row with a payload like 5 % of the boom's mass, and how much heavier it is than the usual boom."""
    usual, scene = load_scene(), load_scene(Z_FOLD if row["z_fold"] else None)
    ours, others = (sum(section.mass for section in each.sections) for each in (scene, usual))
    return with_parameters(scene, {"tip.payload": 30.0 * ours / others}), ours / others


def drawn(number: int, is_long: bool = False) -> dict[str, Any]:
    """Draw what is true of the session of a number: a row without alarms."""
    rng = np.random.default_rng([number, 36 + is_long])
    row: dict[str, Any] = {"number": number, "z_fold": bool(rng.random() < 1 / 6), "duration": LONG if is_long else DURATION}
    scene, heavier = scene_of(row)
    i, j = (rng.permutation(len(scene.joints))[:2] + 1).tolist()
    t, (a, b) = round(float(rng.uniform(12.0, 20.0)), 1), rng.permutation(PARTS)[:2].tolist()
    fill = 3.0 * heavier * load_scene().reach / scene.reach
    sizes = {"payload": 20.0 * heavier, "fill": fill, "force": 1e4 * heavier, "share": rng.uniform(0.2, 0.4)}
    sizes = {name: f"{float(f'{size:.3g}'):g}" for name, size in sizes.items()}
    sizes |= {"i": i, "t": t, "later": round(t + 12.0, 1), "stream": rng.choice([each.value for each in tuple(Stream)[:4]])}
    five, place = divmod(number // 3, 5)  # of every five two are healthy
    words = "" if place % 2 or is_long else FAULTS[(3 * five + place // 2) % len(FAULTS)]
    words = words.format(**sizes, a=a.format(**sizes), b=b.format(**sizes | {"i": j}))
    chances = (("tip_imu", 0.3, "EI|imu"), ("cylinder_forces", 0.4, "force"))
    without = [name for name, chance, needed in chances if rng.random() < chance and not re.search(needed, words)]
    pump = PumpLoad(rng.uniform(0.2, 0.6), math.exp(rng.uniform(math.log(30.0), math.log(250.0))), onset=2.0)
    wind, kind = WindLoad(rng.uniform(10.0, 40.0)), str(rng.choice(LOADS[3:] if is_long else LOADS))
    return row | {
        "faults": words.split(),
        "moves": str(rng.choice(MOVES[: 4 if is_long else 5])),
        "loads": [str(each) for name, each in (("pump", pump), ("wind", wind)) if name in kind],
        "mean_wind": float(rng.uniform(0.0, 3.0)) * wind.deviation * ("wind" in kind),
        "is_wrong": bool(rng.random() < 0.5) or is_long,
        "rate": float(rng.choice([50.0, 100.0, 200.0])),
        "posture": str(rng.choice(sorted(scene.postures))),
        "without": [] if is_long else without,
    }


def fault_of(text: str) -> RigFault:
    """Parse a fault; one that the rig lacks, of the IMU or the lag of any stream, becomes one of an angle of the same kind."""
    return parse(re.sub(r"^\w+\.delay", "joint_angles.delay", text.replace("tip_imu.", "joint_1.")))


def programme_of(row: dict[str, Any], scene: Scene) -> Programme:
    """Return the moves of a row's session."""
    faster = FASTER if row["moves"] == "fast" else 1.0
    of = random_programme(scene, row["posture"], row["duration"] * faster, row["number"], *PACES[row["moves"]])
    return Programme(
        of.first, tuple(replace(each, start=each.start / faster, duration=each.duration / faster) for each in of.moves)
    )


def session_of(row: dict[str, Any]) -> SampleBlock:
    """Make the samples of a row's session."""
    scene, number, duration = scene_of(row)[0], row["number"], row["duration"]
    ours = [each for each in row["faults"] if each.startswith("tip_imu.") or ".delay" in each]
    faults = [parse(each) for each in row["faults"] if each not in ours]
    boom, changing = changes(wrong_by(scene, 0.02, number) if row["is_wrong"] else scene, faults)
    varying = tip_load(boom, [parse_load(each) for each in row["loads"]], duration, number)
    mean = row["mean_wind"] * WindLoad(1.0).direction(boom.base.inclination)

    def load(times: Array) -> Array:
        return varying(times) + ease(times / 2.0)[:, None] * mean

    programme = programme_of(row, scene)
    resting = at_rest(boom, np.array(programme.first), ELEMENTS, nodally_exact=True)
    rows, _ = move(resting, programme, duration, STEP, RECORDED, SCHEME, load if row["loads"] else None, changing)
    seen = spoil(observe(boom, programme, rows, Sensors(row["rate"]), number), faults, number)
    values = dict(zip(Stream, (seen.strokes, seen.joints, seen.imu, seen.forces), strict=False))
    stamps = dict.fromkeys(values, seen.stamps)
    for text in ours:
        fault = fault_of(text)
        size = fault.size * fault.share(seen.truth["t"])
        if fault.kind == "late":
            stamps[Stream(text.partition(".")[0])] = seen.stamps + np.rint(size * SECOND).astype(np.int64)
        else:
            values[Stream.IMU][:, number % 2] += size
    kept = (each for each in values if each.value not in row["without"])
    samples = [sample for each in kept for sample in samples_in_rows(stamps[each], {each: values[each]})]
    return block_of(sorted(samples, key=lambda each: each.stamp), len(scene.joints))


def row_of(number: int, causes: bool = False, is_long: bool = False) -> dict[str, Any]:
    """Make the session of a number, replay it, and return what is true of it with every alarm.

    An alarm is a list of channel, kind, cause, the times of its onset, of its end and of the report (s), and evidence.
    """
    row = drawn(number, is_long)
    moves = programme_of(row, scene_of(row)[0]).moves
    edges = sorted({each for move in moves for each in (move.start, move.end)})
    return row | {"edges": edges, "causes": causes, "alarms": alarms_of(row, session_of(row), causes)}


def alarms_of(row: dict[str, Any], block: SampleBlock, causes: bool) -> list[list[Any]]:
    """Return the alarms of a row's session."""
    twin, alarms, reported = Twin(scene_of(row)[0], health=True, causes=causes), Alarms(), dict[Any, float]()
    first = int(block.stamps[0])
    for health in twin.take(block).health.values():
        alarms.take(health)
        for each in health.alarms:
            reported.setdefault((each.channel, each.since, each.cause), (health.stamp - first) * NANO)
    found = []
    for each in alarms.all:
        since, until = (stamp and (stamp - first) * NANO for stamp in (each.since, each.until))
        told = reported[each.channel, each.since, each.cause]
        found.append([each.channel, each.kind, each.cause, since, until, told, each.evidence])
    return found


def judged(row: dict[str, Any]) -> tuple[list[dict[str, Any]], list[list[Any]]]:
    """Return what is right of each fault of a row, or of a healthy session, and the false alarms.

    An alarm tells of a fault if it names it; without --causes, if it names nothing, too. It is false if it names another thing,
    or comes before the faults. A fault of the boom or a lag is told in time within 20 s of the next begin or end of a move, one
    of a sensor within 10 s.
    """
    found, false = [], list(row["alarms"])
    for text in row["faults"]:
        fault, cause = fault_of(text), text.partition(":")[0]
        names = {cause, cause.replace("cylinder_", "joint_")} if cause.endswith("sensor") else {cause}
        begun = [each for each in row["alarms"] if each[2] in (*names, None) and each[5] >= fault.onset]
        false, own = [each for each in false if each not in begun], [each for each in begun if each[2] or not row["causes"]]
        full, shows_in_moves = fault.onset + fault.ramp, fault.is_physical or fault.kind == "late"
        due = min([each for each in row["edges"] if each >= full], default=full) + 20.0 if shows_in_moves else full + 10.0
        found.append({
            "of": f"{re.sub(r'_[0-9]+', '', cause)}:{fault.kind}",
            "right": any(each[5] <= due for each in own),
            "missed": not own,
            "onset": any(abs(each[3] - fault.onset) <= 3.0 for each in own),
            "ends": fault.end < math.inf,
            "end": any(abs(each[4] - fault.end) <= 5.0 for each in own if each[4] is not None),
        })  # fmt: skip
    return found or [{"of": "healthy", "right": not false, "missed": False, "onset": False, "ends": False, "end": False}], false


def table(rows: list[dict[str, Any]]) -> dict[str, dict[str, int]]:
    """Print what is right by kind of fault, and the false alarms with the numbers of their sessions; return the figures."""
    figures: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    false: dict[str, list[int]] = defaultdict(list)
    for row in rows:
        found, others = judged(row)
        for each in found:
            own = figures[each.pop("of")]
            for key, value in (each | {"count": 1}).items():
                own[key] += value
        for channel, kind, cause, *_ in others:
            false[f"{channel} {kind} {cause or ''}"].append(row["number"])
    print("| fault | count | told in time, healthy: no alarm | never told | onset within 3 s | end within 5 s |")
    print("|---|---|---|---|---|---|")
    for name, each in sorted(figures.items()):
        end = f"{each['end']} of {each['ends']}" if each["ends"] else ""
        print(f"| {name} | {each['count']} | {each['right']} | {each['missed']} | {each['onset']} | {end} |")
    print(f"\nFalse alarms in {sum(row['duration'] for row in rows) / 3600.0:.2f} h, with numbers of sessions:")
    for name, numbers in sorted(false.items()):
        print(f"{name}: {len(numbers)}, {sorted(set(numbers))}")
    return figures


def main() -> None:
    """Make rows, and print the table."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--hours", type=float)
    parser.add_argument("--causes", action="store_true")
    parser.add_argument("--held", action="store_true")
    args = parser.parse_args()
    name = ("causes" if args.causes else "health") + "_held" * args.held + "_long" * (args.hours is not None)
    out = args.out or FOLDER / f"{name}.jsonl"
    out.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in out.read_text().splitlines()] if out.is_file() else []
    done = {row["number"] for row in rows}
    wanted = args.count if args.hours is None else math.ceil(args.hours * 3600.0 / LONG)
    with out.open("a") as file:
        for number in islice((each for each in count(args.first) if (each % 3 == 2) is args.held), wanted):
            if number not in done:
                rows.append(row_of(number, args.causes, args.hours is not None))
                print(json.dumps(rows[-1]), file=file, flush=True)
    keep(name, table(rows))


if __name__ == "__main__":
    main()
