"""How often a healthy rig is told to be ill: hours of sessions of the virtual rig, and what their levels extrapolate to.

    python test/bench/health/false_alarms.py --out out/health/healthy --count 60 [--jobs 2]
    python test/bench/health/false_alarms.py --out out/health/healthy --table

Sessions of ten minutes, each drawn from its number: quiet, fast (moves in half the time), pump, wind, or both; loads, noise,
rates, sensors and rigs as `scenarios.py` draws them. Kept of each: what was told, and of every minute the highest that any
evidence came to which would have been an alarm from its threshold on. Few hours hold few alarms or none, so a rate is
extrapolated: where levels are above `TAIL`, what they are above it by is taken as exponentially distributed, which a Gaussian
regression's evidence is for large values; the interval is of sessions drawn again with replacement. Resumable.
"""

from __future__ import annotations

import json
import math
import os
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np
import sessions
import stored
from run import learn, outcome
from scenarios import RATES, RIGS, Z_FOLD, Scenario, draw_loads, learning, nominal
from scipy.stats import chi2

from boom_twin.health import residual_monitor
from boom_twin.health.residual_monitor import ResidualMonitor
from boom_twin.health.suspicion import SURE
from boom_twin.types import NANO
from boom_twin.validation.rig.motion import Programme, random_programme

DURATION, MINUTE = 600.0, 60.0  # s
FIRST = 100_000  # number of the first session, beyond those of the other draws
KINDS = {"quiet": 0.25, "fast": 0.15, "pump": 0.2, "wind": 0.15, "both": 0.25}
FASTER = 2.0  # times, moves of fast sessions
FOLDING = 0.1  # share of sessions of the boom that folds in a Z
TAIL = 3.0  # ln of the odds above which levels count
DRAWS = 2000


def healthy(number: int) -> tuple[str, Scenario]:
    """Kind and session of a number."""
    rng = np.random.default_rng([number, 23])
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    scene = Z_FOLD if rng.random() < FOLDING else ""
    streams = ("angles", *(["imu"] if rng.random() < 0.8 else []), *(["forces"] if rng.random() < 0.2 else []))
    noise = float(rng.choice([0.5, 1.0, 2.0], p=[0.15, 0.7, 0.15]))
    rate = float(rng.choice(list(RATES), p=list(RATES.values())))
    posture = str(rng.choice(sorted(nominal(scene).postures)))
    rig = 0 if scene else int(rng.integers(RIGS))
    load = draw_loads(rng, kind if kind in ("pump", "wind", "both") else "none")
    return kind, Scenario(number, "healthy", rig, posture, DURATION, (), load, noise, rate, streams, scene)


def moves(kind: str, each: Scenario) -> Programme:
    """Of a session."""
    if kind != "fast":
        return random_programme(each.model, each.posture, each.duration, each.seed)
    slow = random_programme(each.model, each.posture, FASTER * each.duration, each.seed)
    return Programme(
        slow.first, tuple(replace(move, start=move.start / FASTER, duration=move.duration / FASTER) for move in slow.moves)
    )


@contextmanager
def watched(levels: list[tuple[int, str, float]]) -> Iterator[None]:
    """Note stamp, kind and level of everything that would be an alarm above its threshold, as that is weighed."""
    judge, judge_hold = ResidualMonitor._judge, ResidualMonitor._judge_hold

    def judged(self: Any, start: int, suspicion: Any, verdict: Any) -> Any:
        waiting = residual_monitor.LEAST_SPAN if verdict.strength > residual_monitor.OBVIOUS else residual_monitor.SWINGS
        is_weighed = suspicion.span >= waiting and self._weight(
            verdict.best
        ) >= residual_monitor.LOAD_MEANS * self._load_lately(start)
        if is_weighed and self.levels.max() >= 1.0:
            levels.append((start, "blocks", verdict.strength))
        return judge(self, start, suspicion, verdict)

    def judged_hold(self: Any, hold: Any) -> Any:
        take = self._hold_test.take

        def taken(*arguments: Any) -> Any:
            found = take(*arguments)
            if self._weight(found.verdict.best) >= residual_monitor.LOAD_MEANS * self._load_lately(hold.end):
                levels.append((hold.end, "holds", found.verdict.strength))
            return found

        self._hold_test.take = taken
        try:
            return judge_hold(self, hold)
        finally:
            del self._hold_test.take

    ResidualMonitor._judge, ResidualMonitor._judge_hold = judged, judged_hold  # type: ignore[method-assign]
    try:
        yield
    finally:
        ResidualMonitor._judge, ResidualMonitor._judge_hold = judge, judge_hold  # type: ignore[method-assign]


def result(out: Path, number: int) -> dict[str, Any]:
    """Simulate and judge one session; gives its row."""
    kind, each = healthy(number)
    path = stored.path_of(out, each)
    stored.save(path, sessions.simulated(each, moves(kind, each)))
    levels: list[tuple[int, str, float]] = []
    with watched(levels):
        row = outcome(out, out, each)
    path.unlink()
    highest: dict[str, list[float | None]] = {what: [None] * math.ceil(DURATION / MINUTE) for what in ("blocks", "holds")}
    for stamp, what, level in levels:
        minute = min(max(int((stamp - stored.EPOCH) * NANO / MINUTE), 0), len(highest[what]) - 1)
        before = highest[what][minute]
        highest[what][minute] = level if before is None else max(before, level)
    return row | {"kind": kind, "levels": highest}


def extrapolated(rows: list[dict[str, Any]], what: str, limit: float) -> float:
    """Alarms a day by the levels of `what`, whose threshold is `limit` (ln of odds)."""
    above = [level - TAIL for row in rows for level in row["levels"][what] if level is not None and level > TAIL]
    days = sum(row["duration"] for row in rows) / 86400.0
    if not above:
        return 0.0
    return len(above) / days * math.exp(-(limit - TAIL) / (sum(above) / len(above)))


def table(rows: list[dict[str, Any]]) -> str:
    """As Markdown."""
    lines = [
        "| healthy | sessions | hours | alarms | with a name | a day | a day by levels: blocks; holds |",
        "|---|---|---|---|---|---|---|",
    ]
    rng = np.random.default_rng(0)
    groups = {"all": rows} | {kind: [row for row in rows if row["kind"] == kind] for kind in KINDS}
    groups["default boom"] = [row for row in rows if not row["scene"]]
    for name, own in groups.items():
        if not own:
            continue
        hours = sum(row["duration"] for row in own) / 3600.0
        alarms = {(row["number"], told["channel"], told["since"]) for row in own for told in row["told"]}
        named = {(row["number"], told["cause"]) for row in own for told in row["told"] if told["cause"] is not None}
        low = 0.5 * chi2.ppf(0.025, 2 * len(alarms)) if alarms else 0.0
        rate = f"{24 * low / hours:.1f}-{12 * chi2.ppf(0.975, 2 * len(alarms) + 2) / hours:.1f}"
        by_levels = []
        for what, limit in (("blocks", SURE), ("holds", residual_monitor.HELD)):
            again = [extrapolated([own[i] for i in rng.integers(len(own), size=len(own))], what, limit) for _ in range(DRAWS)]
            by_levels.append(f"{extrapolated(own, what, limit):.2g} (95 % below {np.quantile(again, 0.95):.2g})")
        lines.append(f"| {name} | {len(own)} | {hours:.2f} | {len(alarms)} | {len(named)} | {rate} | {'; '.join(by_levels)} |")
    return "\n".join(lines)


def main(args: Namespace) -> None:
    """Make and judge what is not there yet, or print the table."""
    args.out.mkdir(parents=True, exist_ok=True)
    kept = args.out / "healthy.jsonl"
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept.is_file() else []
    if args.table:
        print(table(rows))
        return
    done = {row["number"] for row in rows}
    for each in learning():
        sessions.make(each, args.out)
    for rig in range(1, RIGS):
        learn(rig, args.out, args.out)
    wanted = [number for number in range(FIRST, FIRST + args.count) if number not in done]
    with Pool(args.jobs, os.nice, (sessions.NICE,), maxtasksperchild=4) as pool, kept.open("a") as file:
        for row in pool.imap_unordered(partial(result, args.out), wanted):
            file.write(json.dumps(row) + "\n")
            file.flush()


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/health/healthy"))
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--table", action="store_true", help="print what was kept")
    main(parser.parse_args())
