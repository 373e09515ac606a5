"""Softer sections against a learnt baseline: sessions of two holds of 20 s after moves, and what is told of them.

    python test/bench/health/sections.py --make --count 144 --out out/health     # the sessions, and those to learn from
    python test/bench/health/sections.py --count 144 --out out/health            # judges them and prints the table
    python test/bench/health/sections.py --count 144 --out out/health --held-out
    python test/bench/health/sections.py --own-rigs --kinds 8 9 12 13 14 15 --count 208 --out out/health [--make]

Each session is drawn from its number: a quarter is healthy, the others have a section 20, 30 or 40 % softer from the start. The
boom is one of the two whose model is 2 % wrong; of the healthy ones half are shaken by a pump or wind, or moved fast. A third
is held out (`number % 3 == 2`) and is not to be looked at while health is being worked on.

`--own-rigs`: every session on a rig of its own that is 2 % wrong, judged by the baseline that ships. `--kinds`: only some of
the sixteen kinds of session (number modulo 16): 0 to 11 with a section (1 + kind modulo 4) 20, 30 or 40 % softer, from 12 on
healthy.
"""

from __future__ import annotations

import itertools
import json
import os
from argparse import ArgumentParser, Namespace
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import run
import stored
import table
from scenarios import RIGS, Scenario, learning

from boom_twin import load_scene, statics
from boom_twin.scene.kinematics import stroke_range, strokes_of_posture
from boom_twin.validation.rig.faults import RigFault
from boom_twin.validation.rig.faulty_boom import with_faults
from boom_twin.validation.rig.loads import PumpLoad, WindLoad
from boom_twin.validation.rig.motion import Move, Programme

SIZES = (0.2, 0.3, 0.4)
FIRST, HOLD = 4.0, 20.0  # s
KINDS, TIPS = 16, (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 100.0)  # of sessions; mm
OWN = 100  # and the number of a session: its rig, where each has one of its own
LOADS = ((), (), (PumpLoad(0.37, 110.0),), (WindLoad(25.0),))  # of healthy sessions; the second of these four is moved fast


def drawn(number: int, own_rig: bool = False) -> Scenario:
    """The session of a number, on a rig of its own or on one of those that are learnt."""
    rng = np.random.default_rng([number, 27])
    place, kind = number // KINDS, number % KINDS
    fault = () if kind >= 12 else (RigFault(f"section_{kind % 4 + 1}.EI", "softer", SIZES[kind // 4], 0.0, 0.0),)
    loads = LOADS[kind - 12] if kind >= 12 else ()
    posture = str(rng.choice(sorted(load_scene().postures)))
    rig = OWN + number if own_rig else 1 + place % (RIGS - 1)
    duration = FIRST + 2 * (HOLD + _move_time(number))
    return Scenario(number, "sections", rig, posture, duration, fault, loads, 1.0, 200.0, ("angles", "imu"))


def _move_time(number: int) -> float:
    return 1.2 if number % KINDS == 13 else 3.0


def programme(each: Scenario) -> Programme:
    """A move of two cylinders, a hold, another, a hold."""
    rng, scene, span = np.random.default_rng([each.number, 28]), load_scene(), _move_time(each.number)
    first = strokes_of_posture(scene, each.posture)
    moves, at = [], first.copy()
    for start in (FIRST, FIRST + span + HOLD):
        for i in rng.choice(len(first), 2, replace=False).tolist():
            low, high = stroke_range(scene, i, 91)
            way = float(rng.choice([-1.0, 1.0])) * rng.uniform(0.06, 0.12) * (high - low)
            margin = 0.08 * (high - low)
            way = way if low + margin < at[i] + way < high - margin else -way
            at[i] += way
            moves.append(Move(i, start, span, float(at[i])))
    return Programme(tuple(first.tolist()), tuple(moves))


def make(each: Scenario, folder: Path) -> str:
    """Make the file of one session unless it is there."""
    from sessions import simulated  # needs Exudyn

    path = stored.path_of(folder, each)
    if not path.is_file():
        stored.save(path, simulated(each, programme(each) if each.number >= 0 else None))
    return path.name


def judge(each: Scenario, out: Path) -> dict[str, Any]:
    """What was told of a session."""
    if each.rig >= OWN:
        return run.outcome(out / "own_rig_sessions", out, each, shipped=True) | {"tip_mm": tip_off(each)}
    return run.outcome(out / "section_sessions", out, each)


def tip_off(each: Scenario) -> float:
    """Distance (mm) of the tip from where the model has it, at rest at the end of a session; by the model's own statics."""
    strokes = np.array(programme(each).first)
    for move in programme(each).moves:
        strokes[move.cylinder] = move.target
    there, model = (statics(scene, strokes).tip for scene in (with_faults(each.boom, each.faults), load_scene()))
    return float(1e3 * np.hypot(*(np.array(there) - np.array(model))))


def near(row: dict[str, Any], by: int) -> bool:
    """Whether a section no further than `by` from the right one is the most probable cause of an alarm, or its name."""
    own = int(row["causes"][0][8])
    return any(
        cause.startswith("section_") and abs(int(cause[8]) - own) <= by
        for told in row["told"]
        for cause in ([told["cause"]] if told["cause"] else [each[0] for each in told["ranked"][:1]])
    )


def tables(rows: list[dict[str, Any]]) -> list[str]:
    """By size and by section: told, most probable cause the right section or its neighbour, another cause named."""
    lines = [
        "| softer by | sessions | alarm | right section or neighbour | the section itself | wrong name |",
        "|---|---|---|---|---|---|",
    ]
    faulty = [row for row in rows if row["faults"]]
    keys = [(f"{size:.0%}", [r for r in faulty if f":{size:g}" in r["faults"][0]]) for size in SIZES]
    keys += [
        (f"section {i}, 30 % and more", [r for r in faulty if r["causes"][0][8] == str(i) and ":0.2" not in r["faults"][0]])
        for i in range(1, 5)
    ]
    for name, own in keys:
        told = [row for row in own if row["told"]]
        wrong = sum(any(not cause.startswith("section_") for cause in table.wrong_names(row)) for row in own)
        counts = [len(told), sum(near(row, 1) for row in told), sum(near(row, 0) for row in told), wrong]
        lines.append(f"| {name} | {len(own)} | " + " | ".join(table.share(count, len(own)) for count in counts) + " |")
    return [*lines, "", *table.healthy([row for row in rows if not row["faults"]])]


def main(args: Namespace) -> None:
    """Make the sessions, or judge them and print the tables."""
    name = "own_rig" if args.own_rigs else "section"
    folder = args.out / f"{name}_sessions"
    every = [drawn(number, args.own_rigs) for number in range(args.count) if number % KINDS in args.kinds]
    wanted = [each for each in every if (each.number % 3 == 2) == args.held_out]
    with Pool(args.jobs, maxtasksperchild=20) as pool:
        if args.make:
            learnt = [] if args.own_rigs else learning()
            for path in pool.imap(partial(make, folder=folder), [*learnt, *every]):
                print(path, flush=True)
            return
        for rig in () if args.own_rigs else range(1, RIGS):
            run.learn(rig, folder, args.out)
        kept, rows = args.out / f"{name}s{'_held_out' if args.held_out else ''}.jsonl", []
        with kept.open("w") as file:
            for row in pool.imap(partial(judge, out=args.out), wanted):
                rows.append(row)
                file.write(json.dumps(row) + "\n")
                file.flush()
    print("\n".join([*tables(rows), *(far_tips(rows) if args.own_rigs else [])]))
    for row in rows if args.each else []:
        print("\n".join(lines_of(row)))


def far_tips(rows: list[dict[str, Any]]) -> list[str]:
    """By how far the tip is off at rest at the end: sessions, those with an alarm, with a wrong name."""
    lines = ["", "| tip off by | sessions | with a fault | alarm | wrong name |", "|---|---|---|---|---|"]
    for low, high in itertools.pairwise(TIPS):
        own = [row for row in rows if low <= row["tip_mm"] < high]
        told, wrong = sum(bool(row["told"]) for row in own), sum(bool(table.wrong_names(row)) for row in own)
        shares = " | ".join(table.share(count, len(own)) for count in (told, wrong))
        lines.append(f"| {low:g} to {high:g} mm | {len(own)} | {sum(bool(row['faults']) for row in own)} | {shares} |")
    return lines


def lines_of(row: dict[str, Any]) -> list[str]:
    """What was told of one session."""
    off = f"tip off by {row['tip_mm']:.1f} mm" if "tip_mm" in row else ""
    lines = [f"{row['number']} {row['rig']} {row['posture']} {row['faults']} {row['loads']} {off}"]
    for told in row["told"]:
        ranks = " ".join(f"{cause}:{p:.2f}" for cause, p, _ in told["ranked"][:4])
        over = "" if told["until"] is None else f" until {told['until']:.1f}"
        lines.append(f"    {told['at']:5.1f} {told['channel']} {told['kind']} {told['cause']}{over} [{ranks}] {told['told']}")
    return lines


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/health"))
    parser.add_argument("--count", type=int, default=144)
    parser.add_argument("--kinds", type=int, nargs="*", default=list(range(KINDS)), help="numbers modulo 16")
    parser.add_argument("--own-rigs", action="store_true", help="each session on a rig of its own; the baseline that ships")
    parser.add_argument("--make", action="store_true")
    parser.add_argument("--held-out", action="store_true")
    parser.add_argument("--each", action="store_true", help="what was told of every session")
    parser.add_argument("--jobs", type=int, default=1)
    main(parser.parse_args())
