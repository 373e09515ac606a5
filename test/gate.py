"""The gate of a change that must not alter numbers: hashes of what users compute, and speed as ratios.

    make gate                                  table and numbers into out/gate/gate.md and gate.json
    make gate BEFORE=out/gate/before.json      beside those of an earlier run; exit code 1 if a hash differs

Sessions are made once and kept in out/gate/sessions. Floats enter a hash with 12 digits, bags and messages with all bytes. A
speed is the least of several runs over that of a fixed computation (SHA-256 of 32 MB) in turn with it: smaller is faster.
CPU time counts children too; it hardly depends on what else the machine does, wall time does.
"""

from __future__ import annotations

import csv
import hashlib
import json
import math
import os
import re
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before NumPy: files of the virtual rig repeat bit for bit

import numpy as np
from bench.health.run import row_of
from bench.speed import move
from gate_sessions import BAGS, FOLDER, ROOT, messages, quiet, sessions

from boom_twin import Sample, Stream, Twin, load_scene, replay, simulate

DATA = ROOT / "test" / "data"
COMMANDS = {  # small outputs of users' commands: what they print as JSON or text, and the tables that they write
    "statics, arch": "statics --posture arch --json",
    "statics, low": "statics --posture low --json",
    "statics by lengths": "statics --lengths 0.63,0.17,0.23,0.19 --json",
    "response to a force": "response --posture arch --json --out {out}",
    "response to a drive": "response --posture high --drive 2 --json --out {out}",
    "steady state under the pump": "response --posture arch --pump 0.4:130 --json --out {out}",
    "resonance map": "response --map all --pump 0.4:130 --rates 0.2:1.2:21 --json --out {out}",
    "simulate": "simulate --drive {drive} --out {out}/motion.csv --json",
    "simulate lengths": "simulate --lengths {drive} --out {out}/motion.csv --json --no-error-estimate",
    "play: statics": "statics --scene {play} --posture arch --json",
    "play: simulate": "simulate --scene {play} --drive {drive} --out {out}/motion.csv --json",
    "Z fold: statics": "statics --scene {z_fold} --strokes={z_strokes} --json",
    "check": "check --json",
    "check --need": "check --need tip=2mm --json",
    "envelope": "envelope --json --out {out}",
    "study error": "study error --quick --out {out}",
    "study stability": "study stability --quick --out {out}",
    "study parts": "study parts --quick --out {out}",
    "rig": "rig --random high --duration 3 --seed 7 --load pump:0.43:130@1 --out {out}",
    "calibrate": "calibrate {data}/drives/arch_session --out {out}/calibrated.yaml",
    "info": "info {bags}/pump_session --json",
}
TIMING = re.compile(
    r"machine|^costs$|^feeding$|^on_front|step_time|time_saved|seconds|wall|twin_s$|exudyn_s$|ratio|realtime|_us$"
    r"|path|folder|out$|bag$|session$"
)
HEALTH = (46, 82, 88, 115)  # numbers of sessions of test/bench/health: angle off, angles late, angle stuck, healthy


def plain(value: Any) -> Any:
    """Return a value with floats as text of 12 digits, and without run times and paths."""
    if isinstance(value, dict):
        return {key: plain(each) for key, each in sorted(value.items()) if not TIMING.search(str(key))}
    if isinstance(value, np.ndarray):
        return [*map(int, value.shape), *map(plain, value.ravel().tolist())]
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, str):
        return value.replace(str(ROOT), "")
    return f"{value + 0.0:.11e}" if isinstance(value, float) else value


def hash_of(value: Any) -> str:
    return hashlib.sha256(json.dumps(plain(value)).encode()).hexdigest()


def number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def content(path: Path) -> Any:
    """Return what counts of a result file, None for one that does not: pictures, pages, notes with dates."""
    if path.suffix == ".json" and path.name != "manifest.json":
        return json.loads(path.read_text())
    if path.suffix == ".csv":
        return [list(map(number, row)) for row in csv.reader(path.open()) if row]
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.suffix in (".mcap", ".gz") else None


# -- what is measured -------------------------------------------------------------------------------------------------


def scenes_and_drive(place: Path) -> dict[str, str]:
    """Write what commands read into a folder: a scene with play in its pins, one with five sections, a motion."""
    files = {"play": quiet(["scene", "--clearance"]), "z_fold": quiet(["scene", "--example", "five_section_z_fold"])}
    for name, text in files.items():
        (place / name).write_text(text)
    times = np.linspace(0.0, 2.0, 41)
    header = ",".join(["t_s", *(f"stroke_{k}_m" for k in range(1, 5))])
    rows = np.column_stack([times, move(load_scene(), times)])
    np.savetxt(place / "drive", rows, delimiter=",", header=header, comments="")
    half = [joint.cylinder.max_stroke / 2 for joint in load_scene(place / "z_fold").joints]
    return {each: str(place / each) for each in (*files, "drive")} | {"z_strokes": ",".join(map(str, half))}


def hash_of_command(command: str, given: dict[str, str]) -> str:
    """Return the hash of what a command prints and of the files that it writes; its error, if it fails."""
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "out"
        if "{out}/" in command:
            out.mkdir()
        try:
            said = quiet(command.format(out=out, bags=BAGS, data=DATA, **given).split())
        except RuntimeError as error:
            return f"failed: {error}"
        printed = json.loads(said) if "--json" in command else re.sub(r"(?m)^[\d.]+ s$", "", said.replace(place, ""))
        files = {str(path.relative_to(out)): content(path) for path in sorted(out.rglob("*")) if path.is_file()}
        return hash_of([printed, [(name, each) for name, each in files.items() if each is not None]])


def hashes_of_session(session: Path) -> dict[str, str]:
    """Return the hash of a session's messages, its result bag, its table of samples, and its summary."""
    with tempfile.TemporaryDirectory() as place:
        done = replay(session, None, Path(place) / "out")
    summary = {key: value for key, value in done.summary.items() if key != "output_sha256"}
    alarms = [f"{each['cause'] or each['kind']} {each['from_s']:.1f} s" for each in summary["alarms"]]
    raw = session.read_bytes() if session.is_file() else b"".join(data for *_, data in messages(session)[1])
    return {
        "input": hashlib.sha256(raw).hexdigest(),
        "output_sha256": done.summary["output_sha256"],
        "table": hash_of(done.columns()),
        "summary": hash_of(summary),
        "alarms": "; ".join(alarms) or "none",
    }


def verdict(drawn: int) -> str:
    row = row_of(drawn)
    alarms = ", ".join(f"{channel} {kind} {since:.2f} s" for channel, kind, _, since, *_ in row["alarms"])
    return f"{' '.join(row['faults']) or 'healthy'}, {' '.join(row['loads']) or 'quiet'}: {alarms or 'no alarm'}"


def spent(task: Callable[[], object]) -> tuple[float, float]:
    """Return the CPU time of a task and its children, and its wall time, s."""
    before = os.times()
    task()
    after = os.times()
    return sum(after[:4]) - sum(before[:4]), after.elapsed - before.elapsed


def ratio(task: Callable[[], object], runs: int = 5) -> list[float]:
    """Return the least CPU time and wall time of a task over those of the fixed computation, and its wall time in s."""
    fixed = bytes(32_000_000)

    def unit() -> None:
        hashlib.sha256(fixed).digest()

    task()
    pairs = [(*(each / 10 for each in spent(lambda: [unit() for _ in range(10)])), *spent(task)) for _ in range(runs)]
    unit_cpu, unit_wall, cpu, wall = (min(each) for each in zip(*pairs, strict=True))
    return [cpu / unit_cpu, wall / unit_wall, wall]


def timed_tasks() -> dict[str, Callable[[], object]]:
    """Return the tasks whose speed is measured: steps, updates, replays and the start of a command."""
    scene, times = load_scene(), np.arange(0.0, 4.0, 1e-3)
    strokes = move(scene, times)
    joints = simulate(scene, times, strokes, 1e-3, estimate_errors=False).joints
    tens = range(10)  # the clock of CPU time ticks in 10 ms
    nano = [round(at * 1e9) for at in times[::5].tolist()]
    pairs = zip(nano, strokes[::5], joints[::5], strict=True)
    samples = [
        Sample(kind, at, row) for at, *rows in pairs for kind, row in zip((Stream.STROKES, Stream.ANGLES), rows, strict=True)
    ]

    def update() -> None:
        twin = Twin(scene)
        for sample in samples:
            twin.update(sample)

    def replayed(with_bag: bool) -> None:
        with tempfile.TemporaryDirectory() as place:
            replay(BAGS / "arch_session", scene, Path(place) / "out", with_bag=with_bag)

    command = [sys.executable, "-m", "boom_twin.cli.main", "statics", "--posture", "arch"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return {
        "step: simulate 40 000 steps": lambda: [simulate(scene, times, strokes, 1e-3, estimate_errors=False) for _ in tens],
        "update: 16 000 samples of a twin": lambda: [update() for _ in tens],
        "replay of arch": lambda: replayed(True),
        "replay of arch, no bag": lambda: replayed(False),
        "start: boom_twin statics": lambda: subprocess.run(command, check=True, capture_output=True, env=environment),
    }


# -- report -----------------------------------------------------------------------------------------------------------


def measured() -> dict[str, Any]:
    """Return everything that is measured: hashes, speeds, words."""
    found: dict[str, Any] = {"hashes": {}, "words": {}, "speeds": {}}
    begun = time.perf_counter()

    def tell(what: str) -> None:
        print(f"{time.perf_counter() - begun:5.0f} s  {what}", file=sys.stderr, flush=True)

    tell("sessions ..")
    for name, path in sessions().items():
        tell(f"replay: {name}")
        for kind, value in hashes_of_session(path).items():
            found["words" if kind == "alarms" else "hashes"][f"{name}: {kind}"] = value
    with tempfile.TemporaryDirectory() as place:
        given = scenes_and_drive(Path(place))
        for name, command in COMMANDS.items():
            tell(name)
            found["hashes"][name] = hash_of_command(command, given)
    for drawn in HEALTH:
        tell(f"health {drawn}")
        found["words"][f"health {drawn}"] = verdict(drawn)
        found["hashes"][f"health {drawn}"] = hash_of(found["words"][f"health {drawn}"])
    tell("speed")
    found["speeds"] = {name: [round(each, 6) for each in ratio(task)] for name, task in timed_tasks().items()}
    tell("done")
    return found


def report(now: dict[str, Any], before: dict[str, Any] | None) -> tuple[str, bool]:
    """Return the tables in Markdown, and True if no hash differs from the earlier run's."""
    former = before or {"hashes": {}, "words": {}, "speeds": {}}
    different = [name for name, value in former["hashes"].items() if now["hashes"].get(name) != value]
    lines = ["| numbers | before | now | |", "|---|---|---|---|"]
    for name, value in now["hashes"].items():
        old = former["hashes"].get(name)
        mark = "" if before is None else "new" if old is None else "same" if old == value else "**DIFFERS**"
        lines.append(f"| {name} | {(old or '-')[:12]} | {value[:12]} | {mark} |")
    lines += [
        f"| {name} | {former['hashes'][name][:12]} | - | **MISSING** |" for name in different if name not in now["hashes"]
    ]
    lines += ["", "| verdict | before | now |", "|---|---|---|"]
    lines += [f"| {name} | {former['words'].get(name, '-')} | {words} |" for name, words in now["words"].items()]
    lines += [
        "",
        "| speed | CPU: before | now | now / before | wall: before | now | now / before | now, s |",
        "|---|" + "---|" * 7,
    ]
    for name, (*own, seconds) in now["speeds"].items():
        old = former["speeds"].get(name, [math.nan] * 3)
        pairs = (f"{was:.2f} | {is_now:.2f} | {is_now / was:.2f}" for was, is_now in zip(old[:2], own, strict=True))
        lines.append(f"| {name} | {' | '.join(pairs)} | {seconds:.3f} |")
    return "\n".join(lines), not different


def main() -> int:
    """Measure, write both files, print the tables."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path, help="gate.json of an earlier run")
    before = parser.parse_args().before
    earlier = json.loads(before.read_text()) if before else None
    now = measured()
    text, is_same = report(now, earlier)
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "gate.json").write_text(json.dumps(now, indent=1) + "\n")
    (FOLDER / "gate.md").write_text(text + "\n")
    print(text)
    return 0 if is_same else 1


if __name__ == "__main__":
    sys.exit(main())
