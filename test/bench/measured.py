"""Write docs/measured.md and the figures of README that stand there: ``python test/bench/measured.py [--cold]``.

The rows are in docs/measured.json. Those with a key are measured in this run if they are quick, or read from out/bench, where
long benches leave their figures. All others keep their last value, with its date and commit.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from analysis.reference_errors import AT_REST, POSTURES, at_rest, moving
from bench.lengths import rms
from bench.record import FOLDER, ROOT, commit, git
from bench.speed import SESSION, replays, step_times
from drive_twin import PUMP_DRIVES

from boom_twin.offline.ground_truth import load_truth
from boom_twin.offline.replay import Replay
from boom_twin.system.files import write_atomic
from boom_twin.validation.study.report import machine

DOCS = ROOT / "docs"
HEAD = """# What was measured

After this page you know how far the model agrees with independent ones, how fast it is, and which command says so.

The default scene with default modes, unless a row says otherwise. The independent model is Exudyn with geometrically exact
beams, 16 and 32 elements a section. All sessions are synthetic and all parameters surrogates. Agreement says that the
equations are solved rightly, not that a real boom behaves so.

{run} `make measured` writes this page. Other rows name the day and the commit
of their last record in the docs; the rows of live pages are of version 0.1.
Named tests hold the bounds. Run times depend on the machine: repeat them on yours.
"""
FOOT = """
## Where the numerics hold

![Error of the tip and of its acceleration against run time: this model's methods and Exudyn](study/error.png)

`make study` makes these reports; `boom_twin study` makes the first three for your scene.

- [Error against run time](study/error.md)
- [Stability](study/stability.md)
- [Parts](study/parts.md)
- [The papers](study/papers.md)
- [Clearance](study/clearance.md)
"""
COLUMNS = "| what | value | bound | measured by | when |\n|---|---|---|---|---|\n"
Values = dict[str, str]
"""Values in words, by the key of their row."""


def percent(value: float) -> str:
    return f"{100.0 * value:.2g} %"


def model() -> Values:
    """Compare the model with the reference numbers."""
    resting = [at_rest(posture) for posture in POSTURES]
    rest = {name: max(each[name] for each in resting) for name in AT_REST}
    move = moving()
    return {
        "rest_tip": percent(rest["tip"]),
        "rest_forces": percent(rest["forces"]),
        "rest_joints": f"{rest['joints']:.0e} rad",
        "frequencies_1_4": percent(rest["frequencies 1-4"]),
        "frequencies_5_6": percent(rest["frequencies 5-6"]),
        "move_tip": f"{1e3 * move['tip']:.2g} mm",
        "move_acceleration": percent(move["acceleration"]),
    }


def sessions() -> Values:
    """Replay the bundled sessions, and the one of drives."""
    done: dict[str, Replay] = {}
    found: Values = {}
    for name in ("arch", "pump"):
        session = SESSION.with_name(f"{name}_session")
        speed, done[name] = replays(session)
        truth, summary = load_truth(session), done[name].summary
        assert truth is not None
        (tip, acceleration), (tip_all, acceleration_all) = (
            (summary[f"tip_{of}error_rms_m"], summary[f"tip_{of}acceleration_error_rms_m_s2"]) for of in ("", "estimate_")
        )
        found |= {
            f"{name}_strokes": f"{1e3 * tip:.2g} mm; {acceleration:.2g} m/s² (of {rms(truth.acceleration):.2f})",
            f"{name}_all": f"{1e3 * tip_all:.2g} mm; {acceleration_all:.2g} m/s²",
            f"replay_{name}": f"{speed:.0f} times real time",
        }
    pump = done["pump"].summary
    spread, mean = (
        np.array([each.summary[f"joint_residual_normalised_{name}"] for each in done.values()]) for name in ("std", "mean")
    )
    drives = replays(PUMP_DRIVES, 1)[1].summary
    return found | {
        "pump_force": f"{pump['tip_load_pulses_N']:.0f} N; {pump['tip_load_frequency_Hz']:.4f} Hz",
        "residuals": f"{spread.min():.2f} to {spread.max():.2f}; within {np.abs(mean).max():.2f}",
        "drives": f"{1e3 * drives['tip_error_rms_m']:.1f} mm; {1e3 * drives['tip_estimate_error_rms_m']:.2g} mm",
    }


def speed(is_cold: bool) -> Values:
    """Measure steps, updates, starts, and if asked to the compilation into an empty cache."""
    ours, theirs = step_times()
    found = {"step": f"{1e6 * ours:.2g} us", "exudyn_step": f"{1e6 * theirs:.2g} us, {theirs / ours:.0f} times as long"}
    from gate import ratio, spent, timed_tasks  # only now: it loads Exudyn's build with range checks

    tasks = timed_tasks()
    update, start = (next(tasks[name] for name in tasks if name.startswith(each)) for each in ("update", "start"))
    found["update"] = f"{1e6 * ratio(update)[2] / 16_000:.2g} us"
    found["start"] = f"{ratio(start)[2]:.2g} s"
    if is_cold:
        program = "from boom_twin import Twin, load_scene; Twin(load_scene()).warm_up()"
        with tempfile.TemporaryDirectory() as folder:
            environment = os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": folder}
            cpu, _ = spent(lambda: subprocess.run([sys.executable, "-c", program], check=True, env=environment))
        found["cold"] = f"{cpu:.0f} s"
    return found


def live(rate: str) -> Callable[[Any], Values]:
    """Return the reader of what test/bench/live.py leaves."""

    def read(found: dict[str, float]) -> Values:
        node, echo = ([found[f"{who} {key}"] for key in ("cpu", "p50", "p99")] for who in ("node", "echo-events"))
        return {
            f"live_{rate}_share": f"{node[0]:.0f} %, the echo {echo[0]:.0f} %",
            f"live_{rate}_latency": f"{node[1]:.2g} and {node[2]:.2g} ms, the echo {echo[1]:.2g} and {echo[2]:.2g} ms",
        }

    return read


def lengths(found: dict[str, list[float]]) -> Values:
    text = "{:.2g} mm, {:.2g} m/s²; {:.2g} mm, {:.2g} m/s²; {:.2g}"
    return {f"lengths: {name}": text.format(*row[:5]) for name, row in found.items()}


def health(found: dict[str, dict[str, int]]) -> Values:
    """Read what test/bench/health/run.py leaves: healthy sessions, and sensors that fail by themselves."""
    healthy, failing = found["healthy"], [each for name, each in found.items() if re.search("stuck|noisy|spikes|dropout", name)]
    missed, count = (sum(each[key] for each in failing) for key in ("missed", "count"))
    return {"health": f"{healthy['count'] - healthy['right']} of {healthy['count']}; {count - missed} of {count}"}


def soak(found: dict[str, float]) -> Values:
    sent = f"{found['sent']:,.0f}".replace(",", " ")
    return {"soak": f"{found['lost'] or 'none'} of {sent}; {found['rise_MB']:.1f} MB"} if found["seconds"] > 3500 else {}


def live_page(found: dict[str, Any]) -> Values:
    delays = [int(each) for words in found["said"] for each in re.findall(r"(\d+) ms", words)]
    told = f"{found['frames_per_s']:.0f}; {min(delays)} to {max(delays)} ms" if delays else ""
    return {"page": told} if told and found["seconds"] >= 600 else {}


BENCHES: dict[str, Callable[[Any], Values]] = {
    "live_200": live("200"), "live_1000": live("1000"), "soak_200": soak, "monitor": live_page, "lengths": lengths,
    "health": health,
}  # fmt: skip


def take(rows: list[dict[str, str]], values: Values, date: object, commit: str) -> None:
    for row in rows:
        if row["key"] in values:
            row |= {"value": values[row["key"]], "date": str(date), "commit": commit}


def take_benches(rows: list[dict[str, str]]) -> None:
    """Put in what benches have left in out/bench, and the ratios at equal error of docs/study/error.md."""
    for name, read in BENCHES.items():
        if (path := FOLDER / f"{name}.json").is_file():
            record = json.loads(path.read_text())
            take(rows, read(record["figures"]), record["machine"]["date"], record["commit"])
    study = (DOCS / "study" / "error.md").read_text()
    table = study.partition("## At equal error")[2].partition("\n## ")[0]
    ratios = re.findall(r"^\| ([\d.]+) \|.*\| ([\d.]+) \|$", table, re.M)
    values = {f"equal_{mm}": f"{ratio} times as long" for mm, ratio in ratios}
    date = re.findall(r"^date (\S+ \S+ UTC)", study, re.M)[0]
    take(rows, values, date, git("log", "-1", "--format=%h", "--abbrev=8", "--", "docs/study/error.md"))


def page(content: dict[str, Any]) -> str:
    """Return the page in Markdown."""
    run = content["run"]
    told = f"Measured on {run['date']} at commit {run['commit']} on {run['cpu']} with {run['cores']} cores."
    if run["load"] > 0.5:
        told += f" **Other work took {run['load']:.1f} cores before this run: its run times are too long.**"
    parts = [HEAD.format(run=told)]
    for section in content["sections"]:
        parts.append(f"\n## {section['name']}\n\n{section['text']}\n\n{COLUMNS}")
        for row in section["rows"]:
            when = "this run" if row["date"] == run["date"] else f"{row['date'][:10]}, {row['commit']}"
            parts.append(f"| {row['what']} | {row['value']} | {row['bound']} | {row['command']} | {when} |\n")
    return "".join([*parts, FOOT])


def main() -> None:
    """Measure, write the page, its rows, and the rows of README that the page has too."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--cold", action="store_true", help="compile all kernels anew too, for about a minute")
    is_cold = parser.parse_args().cold
    content = json.loads((DOCS / "measured.json").read_text())
    on = {key: machine()[key] for key in ("date", "cpu", "cores")}
    content["run"] = {**on, "commit": commit(), "load": os.getloadavg()[0]}
    rows = [row for section in content["sections"] for row in section["rows"]]
    take_benches(rows)
    take(rows, speed(is_cold) | model() | sessions(), content["run"]["date"], content["run"]["commit"])
    write_atomic(DOCS / "measured.json", json.dumps(content, indent=1, ensure_ascii=False) + "\n")
    write_atomic(DOCS / "measured.md", page(content))
    readme, values = ROOT / "README.md", {row["what"]: row["value"] for row in rows}
    text = re.sub(
        r"^\| (.*?) \| .* \|$",
        lambda found: f"| {found[1]} | {values[found[1]]} |" if found[1] in values else found[0],
        readme.read_text(),
        flags=re.M,
    )
    write_atomic(readme, text)


if __name__ == "__main__":
    main()
