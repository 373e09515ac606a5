"""Tables of the health benchmark, from what `run.py` kept.

    python test/bench/health/table.py out/health/outcomes.json

A fault is detected by an alarm that began no earlier than half a second before it; alarms before that, and in healthy sessions,
are false. `first`: the cause that is named half a second after the first move that changes the load (sessions
without one do not count); `end`: the
one named last, if one still is; `ranked`: the cause stands first, or among the first two, at the end. Intervals are
Wilson's, 95 %.
"""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

EARLY, AFTER = 0.5, 0.5  # s
Outcome = dict[str, Any]


def main(path: Path) -> None:
    """Print both tables as Markdown."""
    outcomes = list(json.loads(path.read_text()).values())
    print("\n".join([*healthy(outcomes), "", *faulty(outcomes)]))


def healthy(outcomes: list[Outcome]) -> list[str]:
    """False alarms per group."""
    lines = ["| sessions | hours | false alarms | per day, 95 % |", "|---|---|---|---|"]
    for group, name in (("test", "healthy, wrong by 2 %, learnt baseline"), ("right", "healthy, right model, own baseline")):
        own = [outcome for outcome in outcomes if outcome["group"] == group]
        hours = sum(outcome["seconds"] for outcome in own) / 3600.0
        count = sum(len(alarms(outcome)) for outcome in own)
        if own:
            low, high = (0.5 * chi2.ppf(0.025, 2 * count) if count else 0.0), 0.5 * chi2.ppf(0.975, 2 * count + 2)
            lines.append(f"| {len(own)} {name} | {hours:.2f} | {count} | {24 * low / hours:.1f} to {24 * high / hours:.1f} |")
    return lines


def faulty(outcomes: list[Outcome]) -> list[str]:
    """A line for each fault and size."""
    groups: dict[tuple[str, str, float, str], list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        if outcome["cause"] is not None:
            groups[kind_of(outcome)].append(outcome)
    lines = [
        "| fault | size | sessions | detected | within s, median / worst | false before | first: right / wrong / open | "
        "end: right / wrong / open | ranked 1 / 2 | estimate, median error / worst |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for (cause, kind, size, start), own in sorted(groups.items()):
        judged = [judge(outcome) for outcome in own]
        found = [each for each in judged if each["after"] is not None]
        times = sorted(each["after"] for each in found)
        told = f"{np.median(times):.2f} / {times[-1]:.2f}" if times else "-"
        errors = sorted(abs(each["error"]) for each in found if each["error"] is not None)
        error = f"{100 * np.median(errors):.1f} / {100 * errors[-1]:.1f} %" if errors else "-"
        lines.append(
            f"| {cause} {kind}{start} | {size:.4g} | {len(own)} | {interval(len(found), len(own))} | {told} | "
            f"{sum(each['false'] for each in judged)} | {split(judged, 'first')} | {split(judged, 'end')} | "
            f"{sum(each['rank'] == 1 for each in judged)} / {sum(each['rank'] in (1, 2) for each in judged)} | {error} |"
        )
    return lines


def kind_of(outcome: Outcome) -> tuple[str, str, float, str]:
    """Cause without its number, kind, size, and whether it is there from the start of a sensor's session."""
    cause = outcome["cause"]
    alone = cause if outcome["group"] == "physical" else "".join(c for c in cause if not c.isdigit()).replace("_.", ".")
    start = ", from the start" if outcome["group"] == "sensor" and outcome["onset"] == 0.0 else ""
    return alone, outcome["kind"], outcome["size"], start


def alarms(outcome: Outcome) -> dict[tuple[str, float], list[Outcome]]:
    """What was told of each alarm, in order."""
    found: dict[tuple[str, float], list[Outcome]] = defaultdict(list)
    for each in outcome["told"]:
        found[each["channel"], each["since"]].append(each)
    return found


def judge(outcome: Outcome) -> dict[str, Any]:
    """How one faulty session went."""
    onset, cause = outcome["onset"], wanted(outcome["cause"])
    every = alarms(outcome)
    own = [told for (_, since), told in every.items() if since >= onset - EARLY]
    told = sorted((each for alarm in own for each in alarm), key=lambda each: each["at"])
    move = outcome["telling_move_end"]
    early = [each for each in told if move is not None and each["at"] <= max(move, onset) + AFTER]
    last = told[-1] if told else None
    named = [each["cause"] for each in told if each["cause"] is not None]
    return {
        "after": told[0]["at"] - onset if told else None,
        "false": len(every) - len(own),
        "first": "none" if move is None else verdict(early[-1]["cause"] if early else None, cause),
        "end": verdict(named[-1] if named and last is not None and last["cause"] is not None else None, cause),
        "rank": rank(last, cause),
        "error": error_of(outcome, told, cause),
    }


def wanted(cause: str) -> tuple[str, ...]:
    """Names that count as right: a whole stream that falls silent shows in each of its sensors."""
    if cause.endswith(".dropout"):
        kind = "joint" if cause.startswith("joint") else "cylinder"
        return tuple(f"{kind}_{i}.sensor" for i in range(1, 5))
    return (cause,)


def verdict(cause: str | None, right: tuple[str, ...]) -> str:
    """Right, wrong, or open."""
    return "open" if cause is None else "right" if cause in right else "wrong"


def rank(last: Outcome | None, right: tuple[str, ...]) -> int | None:
    """Place of the cause at the end, from 1."""
    if last is None:
        return None
    causes = [each[0] for each in last["ranked"]] or [last["cause"]]
    return next((i + 1 for i, cause in enumerate(causes) if cause in right), None)


def error_of(outcome: Outcome, told: list[Outcome], right: tuple[str, ...]) -> float | None:
    """Estimate less size over size, by the last alarm that has one; stiffnesses by what is left of them."""
    for each in reversed(told):
        for cause, _, parts in each["ranked"]:
            if cause in right and parts:
                value, size = parts[0][1], outcome["size"]
                if outcome["kind"] == "softer":
                    return float((1.0 / (1.0 + value)) / (1.0 - size) - 1.0)
                return float(abs(value) / size - 1.0) if outcome["kind"] in ("more", "bias", "late", "grown") and size else None
    return None


def split(judged: list[dict[str, Any]], key: str) -> str:
    """Counts of right, wrong, open."""
    return " / ".join(str(sum(each[key] == word for each in judged)) for word in ("right", "wrong", "open"))


def interval(count: int, total: int) -> str:
    """Share with Wilson's interval, in percent."""
    z, p = 1.96, count / total
    middle, half = p + z * z / (2 * total), z * math.sqrt(p * (1 - p) / total + z * z / (4 * total * total))
    low, high = (middle - half) / (1 + z * z / total), (middle + half) / (1 + z * z / total)
    return f"{100 * p:.0f} % ({100 * low:.0f}-{100 * high:.0f})"


if __name__ == "__main__":
    main(Path(sys.argv[1]))
