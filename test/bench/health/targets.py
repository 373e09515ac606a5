"""Table of the sessions of the targets (numbers from 8000 on, see `scenarios.py`), from what `run.py` kept.

    python test/bench/health/sessions.py --only $(seq 8004 8063) $(seq 9000 9059)
    python test/bench/health/run.py --sessions out/health/sessions --out out/health
    python test/bench/health/targets.py out/health/outcomes.jsonl [--each]

Half of the fault is there H, all of it F seconds after the start. An alarm is in time within 10 s after H; a name by the start
of the third move after H, or after F. The size is that of the alarm as it was last told: the loss of stiffness as a share, kg.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser
from pathlib import Path

import numpy as np
from scenarios import TARGETS_FROM, scenario
from table import Row, faults_of, named, names, share, told_after, wrong_names

from boom_twin.validation.rig import random_programme

IN_TIME, MOVES = 10.0, 2  # s; within so many moves
CLOSE = {"cylinder_4.k": 0.25}  # share that a size may be off by
USUAL = 0.1  # likewise, of others


def deadline(row: Row, since: float) -> float:
    """Start (s) of the third move after `since`, or the end of the session."""
    each = scenario(row["number"])
    starts = sorted({move.start for move in random_programme(each.model, each.posture, each.duration, each.seed).moves})
    return [*(start for start in starts if start > since), *[each.duration] * (MOVES + 1)][MOVES]


def named_at(row: Row) -> float:
    """When (s) the fault was named first; infinite where it was not."""
    return min((at for at, cause, _ in names(row) if cause == row["causes"][0]), default=np.inf)


def is_named_in_time(row: Row, part: float) -> bool:
    """Whether within two moves after this part of the fault was there."""
    fault = faults_of(row)[0]
    return named_at(row) <= deadline(row, fault.onset + part * fault.ramp)


def size_error(row: Row) -> float | None:
    """Share by which the size that was told last is off; None without a name."""
    fault = faults_of(row)[0]
    own = [told for told in row["newest"] if told["cause"] == fault.cause]
    if not own:
        return None
    value = next(parts[0][1] for cause, _, parts in own[-1]["ranked"] if cause == fault.cause)
    size = value / (1.0 + value) if fault.kind == "softer" else abs(value)
    return float(size / fault.size - 1.0)


def is_close(row: Row) -> bool:
    """Whether the size is told as well as is wanted."""
    error = size_error(row)
    return error is not None and abs(error) <= CLOSE.get(row["causes"][0], USUAL)


def line(name: str, rows: list[Row]) -> str:
    """A line of the table."""
    delays, count = [told_after(row) for row in rows], len(rows)
    told, right = sorted(delay for delay in delays if delay is not None), [row for row in rows if named(row)]
    in_time = share(sum(delay <= IN_TIME for delay in told), count)
    median = f"{np.median(told):.1f}; {np.quantile(told, 0.9):.1f}" if told else "-"
    shares = [sum(is_named_in_time(row, part) for row in rows) for part in (0.5, 1.0)] + [len(right)]
    errors = [abs(error) for error in map(size_error, right) if error is not None]
    off = f"{100 * np.median(errors):.1f}; {100 * np.quantile(errors, 0.9):.1f}" if errors else "-"
    cells = [
        in_time,
        median,
        *(share(hits, count) for hits in shares),
        share(sum(bool(wrong_names(row)) for row in rows), count),
    ]
    return " | ".join([f"| {name}", *cells, share(sum(map(is_close, right)), len(right)), f"{off} |"])


def table(rows: list[Row]) -> list[str]:
    """By load and by cause."""
    quiet, shaken = [row for row in rows if not row["loads"]], [row for row in rows if row["loads"]]
    head = [
        "| | alarm within 10 s of half | delay, s: median; 90 % | named within two moves of half | of all of it | at any time "
        "| a wrong name | size close enough | off by, %: median; 90 % |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    groups = {"quiet": quiet, "under a load": shaken, "pump and wind": [row for row in shaken if len(row["loads"]) == 2]}
    for name, own in (("quiet", quiet), ("load", shaken)):
        groups |= {f"{name}: {cause}": [row for row in own if key(row) == cause] for cause in sorted({*map(key, rows)})}
    return head + [line(name, own) for name, own in groups.items() if own]


def key(row: Row) -> str:
    """Its fault, without times."""
    fault = faults_of(row)[0]
    return f"{fault.cause} {fault.kind} {fault.size:g}"


def main() -> None:
    """Print the tables as Markdown."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("outcomes", type=Path)
    parser.add_argument("--each", action="store_true", help="every session, too")
    args = parser.parse_args()
    found = map(json.loads, args.outcomes.read_text().splitlines())
    rows = sorted((row for row in found if row["number"] >= TARGETS_FROM), key=lambda row: row["number"])
    for held_out in (False, True):
        own = [row for row in rows if scenario(row["number"]).is_held_out == held_out]
        if own:
            print("\n".join(["held out" if held_out else "looked at", "", *table(own), ""]))
    for row in rows if args.each else []:
        error, delay, at = size_error(row), told_after(row), named_at(row)
        told = "no alarm" if delay is None else f"alarm {delay:+.1f} s"
        off = "" if error is None else f", size {100 * error:+.1f} %"
        seen = f"rig {row['rig']} {row['posture']} {'+'.join(row['streams'])} {row['loads']}"
        wrong = f" WRONG {wrong_names(row)}" if wrong_names(row) else ""
        print(f"{row['number']} {row['faults'][0]} {seen}: {told}, named {at:.1f}{off}{wrong}")


if __name__ == "__main__":
    main()
