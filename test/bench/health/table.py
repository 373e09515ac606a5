"""Tables of the health benchmark, from what `run.py` kept.

    python test/bench/health/table.py out/health/outcomes.jsonl [--each]

A name is right if it is the cause of a fault that has begun when it is told; any other name is wrong, and every alarm of a
healthy session is a false one. `alarm`: one was told of after the fault's onset, named or not. Intervals are Wilson's, 95 %;
rates of false alarms those of a Poisson process.
"""

from __future__ import annotations

import json
import math
from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path
from typing import Any

from scipy.stats import chi2

from boom_twin.validation.rig.faults import RigFault, parse

EARLY = 0.5  # s by which an alarm may seem to begin before its fault
Row = dict[str, Any]


def faults_of(row: Row) -> list[RigFault]:
    """That the session has."""
    return [parse(text) for text in row["faults"]]


def names(row: Row) -> list[tuple[float, str, float]]:
    """Every name that was told: when, the cause, and its probability then."""
    found = []
    for told in row["told"]:
        if told["cause"] is not None:
            share = next((p for cause, p, _ in told["ranked"] if cause == told["cause"]), 1.0)
            found.append((told["at"], told["cause"], share))
    return found


def is_right(row: Row, at: float, cause: str) -> bool:
    """Whether a fault of that cause has begun."""
    return any(fault.cause == cause and fault.onset - EARLY <= at for fault in faults_of(row))


def wrong_names(row: Row) -> list[str]:
    """Causes that were named and are not."""
    return sorted({cause for at, cause, _ in names(row) if not is_right(row, at, cause)})


def named(row: Row, number: int = 0) -> bool:
    """Whether the fault of this number was named."""
    return any(cause == row["causes"][number] and is_right(row, at, cause) for at, cause, _ in names(row))


def told_after(row: Row, number: int = 0) -> float | None:
    """Time (s) from half of the fault to the first alarm since its onset; None without one."""
    fault = faults_of(row)[number]
    times = [told["at"] for told in row["told"] if told["at"] >= fault.onset and told["since"] >= fault.onset - 10.0]
    return min(times) - fault.onset - 0.5 * fault.ramp if times else None


def ended(row: Row, within: float) -> bool:
    """Whether no alarm lasts `within` s of the fault's end."""
    over = faults_of(row)[0].end + min(faults_of(row)[0].ramp, 5.0) + within
    last: dict[tuple[str, float], Row] = {}
    for told in row["told"]:
        if told["at"] <= over:
            last[told["channel"], told["since"]] = told
    return bool(last) and all(told["until"] is not None for told in last.values())


def share(hits: int, of: int) -> str:
    """A share with Wilson's interval."""
    if of == 0:
        return "-"
    z, p = 1.96, hits / of
    centre, width = p + z * z / (2 * of), z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    low, high = (centre - width) / (1 + z * z / of), (centre + width) / (1 + z * z / of)
    return f"{hits} of {of} ({100 * max(low, 0):.0f}-{100 * min(high, 1):.0f} %)"


def healthy(rows: list[Row]) -> list[str]:
    """Alarms of sessions without a fault."""
    lines = ["| healthy | sessions | hours | alarms | with a name | alarms a day, 95 % |", "|---|---|---|---|---|---|"]
    for name, own in (("quiet", [r for r in rows if not r["loads"]]), ("pump or wind", [r for r in rows if r["loads"]])):
        hours = sum(row["duration"] for row in own) / 3600.0
        alarms = sum(len({(told["channel"], told["since"]) for told in row["told"]}) for row in own)
        wrong = sum(len(wrong_names(row)) for row in own)
        if own:
            low, high = (0.5 * chi2.ppf(0.025, 2 * alarms) if alarms else 0.0), 0.5 * chi2.ppf(0.975, 2 * alarms + 2)
            rate = f"{24 * low / hours:.0f}-{24 * high / hours:.0f}"
            lines.append(f"| {name} | {len(own)} | {hours:.2f} | {alarms} | {wrong} | {rate} |")
    return lines


def kind_of(row: Row) -> str:
    """Of its first fault, without number."""
    fault = faults_of(row)[0]
    cause = "".join("i" if char.isdigit() else char for char in fault.cause)
    return f"{cause} {fault.kind}"


def faulty(rows: list[Row], key: Callable[[Row], str]) -> list[str]:
    """A line for every group of sessions with a fault."""
    lines = ["| fault | sessions | alarm | named | a wrong name at any time |", "|---|---|---|---|---|"]
    for group in sorted({key(row) for row in rows}):
        own = [row for row in rows if key(row) == group]
        alarm = sum(told_after(row) is not None for row in own)
        right, wrong = sum(named(row) for row in own), sum(bool(wrong_names(row)) for row in own)
        shares = " | ".join(share(hits, len(own)) for hits in (alarm, right, wrong))
        lines.append(f"| {group} | {len(own)} | {shares} |")
    return lines


def summary(rows: list[Row]) -> list[str]:
    """Calibration, second faults, recovery."""
    sure = {(row["number"], cause): is_right(row, at, cause) for row in rows for at, cause, p in names(row) if p >= 0.9}
    two, recovery = ([row for row in rows if row["group"] == group] for group in ("two", "recovery"))
    return [
        f"- of causes named with 0.9 and more, right: {share(sum(sure.values()), len(sure))}",
        f"- two faults, both named: {share(sum(named(row, 0) and named(row, 1) for row in two), len(two))}",
        *(
            f"- recovery, no alarm {within:g} s after it: {share(sum(ended(row, within) for row in recovery), len(recovery))}"
            for within in (5.0, 8.0)
        ),
    ]


def main() -> None:
    """Print the tables as Markdown."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("outcomes", type=Path)
    parser.add_argument("--each", action="store_true", help="every session, too")
    args = parser.parse_args()
    rows = sorted(map(json.loads, args.outcomes.read_text().splitlines()), key=lambda row: row["number"])
    well, ill = [row for row in rows if not row["faults"]], [row for row in rows if row["faults"]]
    one = [row for row in ill if row["group"] != "two"]
    tables = [healthy(well), faulty(one, lambda row: "pump or wind" if row["loads"] else "quiet")]
    print("\n\n".join("\n".join(table) for table in [*tables, faulty(one, kind_of), summary(ill)]))
    for row in rows if args.each else []:
        seen = f"rig {row['rig']} {row['rate']:g} Hz x{row['noise']:g} {row['streams']}"
        print(f"\n{row['number']} {row['faults']} {row['loads']} {seen}")
        for told in row["told"]:
            cause = told["cause"] or "-"
            until = "" if told["until"] is None else f"..{told['until']:.1f}"
            ranks = " ".join(f"{name}:{p:.2f}" for name, p, _ in told["ranked"][:3])
            print(f"  {told['at']:5.1f} {told['channel']} @{told['since']:.1f}{until} {told['kind']} {cause} [{ranks}]")


if __name__ == "__main__":
    main()
