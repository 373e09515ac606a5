"""The estimate of the tip against the virtual rig: errors, stated deviations and the load's pulses, for docs/estimate.md.

    python test/bench/estimate.py --out out/estimate [--seeds 1 2] [--only rest moving] [--sensors angles] [--wrong 0.02]

Sessions are made once and kept in the folder. Prints of every session and set of sensors: rms error of the tip (mm) and of its
acceleration (m/s^2), predicted and estimated; rms of error over stated deviation of the two estimates; the load in words. With
`--wrong`, stiffnesses and masses of every session's boom are off from its scene by that share at random, others for each seed.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from boom_twin import Twin
from boom_twin.config.settings import Settings
from boom_twin.deviation.load_spectrum import tip_load as pulses_of
from boom_twin.deviation.estimate_row import ACCELERATION, ACCELERATION_COVARIANCE, FORCE, TIP, TIP_COVARIANCE
from boom_twin.scene import load_scene
from boom_twin.scene.edit import parameter, with_parameters
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.scene.load import examine_text, example_text
from boom_twin.scene.schema import Scene
from boom_twin.twin.blocks import CODES, ReportBlock, SampleBlock
from boom_twin.types import NANO, Array, Stream, StrokeReading
from boom_twin.validation.rig import Programme, Scheme, Sensors, at_rest, move, observe, random_programme
from boom_twin.validation.rig.faults import RigFault
from boom_twin.validation.rig.faulty_boom import changes as changes_by
from boom_twin.validation.rig.faulty_boom import wrong_by
from boom_twin.validation.rig.loads import parse, tip_load
from boom_twin.validation.rig.motion import ease, ease_rate

ELEMENTS, SCHEME = 6, Scheme(tolerance=1e-4)
POSTURE = "arch"
FIELDS = {Stream.ANGLES: "joints", Stream.IMU: "imu", Stream.FORCES: "forces"}


@dataclass(frozen=True)
class Case:
    """A motion under loads of a boom that is off from its scene by factors."""

    motion: str = "moving"
    loads: tuple[str, ...] = ()
    off: tuple[tuple[str, float], ...] = ()
    example: str = ""
    seconds: float = 40.0
    rate: float = 200.0
    settings: tuple[tuple[str, float], ...] = ()
    faults: tuple[RigFault, ...] = ()


SHAKEN = ("pump:0.43:130", "wind:15")
STILL = ("pump:0.05:196.2:10@10",)
CASES = {
    "rest": Case("rest", SHAKEN),
    "moving": Case("moving", SHAKEN),
    "moving 260 N": Case("moving", ("pump:0.3:260", "wind:30")),
    "quiet rests": Case("rests"),
    "quiet rest": Case("rest"),
    "stops": Case("stops"),
    "sweep": Case("sweep"),
    "cylinder 2 soft": Case(off=(("cylinder_2.k", 0.7),)),
    "cylinder 2 soft, shaken": Case(loads=SHAKEN, off=(("cylinder_2.k", 0.7),)),
    "cylinder 2 softens": Case(faults=(RigFault("cylinder_2.k", "softer", 0.3, 12.0, 2.0),)),
    "cylinder 3 softens, shaken": Case(loads=SHAKEN, faults=(RigFault("cylinder_3.k", "softer", 0.4, 12.0, 10.0),)),
    "load begins": Case("rest", ("pump:0.4:150@15",)),
    "section 2 soft": Case(off=(("section_2.EI", 0.6),)),
    "section 2 soft, told": Case(off=(("section_2.EI", 0.6),), settings=(("section_deviation", 0.4),)),
    "20 kg more, rest": Case("rest", off=(("tip.payload", 20.0),)),
    "20 kg more, moving": Case(off=(("tip.payload", 20.0),)),
    "wind only": Case(loads=("wind:40",)),
    "fold quiet": Case("rest", example="five_section_z_fold", seconds=20.0),
    "fold moving": Case(example="five_section_z_fold", seconds=30.0),
    "fold 300 N": Case("rest", ("pump:0.3:300",), example="five_section_z_fold", seconds=30.0),
    **{f"pump {f:g} Hz {h:g} N {m}": Case(m, (f"pump:{f}:{h}",)) for f, h, m in [
        (0.2, 130, "rest"), (0.43, 130, "rest"), (0.6, 130, "rest"), (0.3, 30, "rest"), (0.3, 300, "rest"),
        (0.2, 130, "moving"), (0.5, 60, "moving"), (0.3, 300, "moving"),
    ]},
    **{f"{r:g} Hz": Case("moving", SHAKEN, rate=r) for r in (50.0, 100.0, 1000.0)},
}  # fmt: skip


class Session(NamedTuple):
    """Arrays of one session."""

    stamps: np.ndarray
    strokes: Array
    joints: Array
    imu: Array
    forces: Array
    tip: Array
    tip_acc: Array
    load: Array


def scene_of(case: Case) -> Scene:
    """What the twin is told."""
    return examine_text(example_text(case.example), case.example)[0] if case.example else load_scene()


def programme_of(case: Case, scene: Scene, seed: int) -> Callable[[Array], tuple[Array, Array]]:
    """Strokes and rates over time."""
    first = strokes_of_posture(scene, POSTURE)
    if case.motion == "moving":
        return random_programme(scene, POSTURE, case.seconds, seed)
    if case.motion == "rest":
        return Programme(tuple(first.tolist()), ())
    if case.motion == "rests":
        moved = random_programme(scene, POSTURE, case.seconds, seed)
        return Programme(moved.first, moved.moves[:2])
    shift = 0.1 * np.random.default_rng(seed).random()

    def stops(times: Array) -> tuple[Array, Array]:
        fine = np.arange(0.0, case.seconds + 1.0, 1e-4)
        speeds = np.zeros((len(fine), len(first)))
        for k in range(int((case.seconds - 4.0) / 2.5)):
            start = 1.0 + shift + 2.5 * k
            sign = 0.04 if (k // len(first)) % 2 == 0 else -0.04
            speeds[:, k % len(first)] += sign * (ease((fine - start) / 0.5) - ease((fine - start - 1.0) / 0.02))
        ways = np.cumsum(speeds, axis=0) * 1e-4
        read = [np.column_stack([np.interp(times, fine, column) for column in values.T]) for values in (ways, speeds)]
        return first + read[0], read[1]

    def sweep(times: Array) -> tuple[Array, Array]:
        end = case.seconds - 1.0
        along = np.clip(times - 1.0, 0.0, end - 1.0)
        phase = 2.0 * np.pi * ((1.0 + shift) * along + 2.5 * along**2 / (end - 1.0))
        rate = 2.0 * np.pi * ((1.0 + shift) + 5.0 * along / (end - 1.0)) * (times > 1.0) * (times < end)
        up, down = (times - 1.0) / 0.5, (times - end + 0.5) / 0.5
        shape, shape_rate = ease(up) - ease(down), (ease_rate(up) - ease_rate(down)) / 0.5
        ways, speeds = np.zeros((2, len(times), len(first)))
        ways[:, 0] = 3e-4 * np.sin(phase) * shape
        speeds[:, 0] = 3e-4 * (np.cos(phase) * rate * shape + np.sin(phase) * shape_rate)
        return first + ways, speeds

    return {"stops": stops, "sweep": sweep}[case.motion]


def made(name: str, case: Case, seed: int, folder: Path, wrong: float = 0.0) -> Session:
    """The session, from its file if it is there."""
    share = f"-wrong_{wrong:g}" if wrong else ""
    path = folder / f"{name.replace(' ', '_').replace(',', '')}-{seed}{share}.npz"
    if path.is_file():
        with np.load(path) as stored:
            return Session(*(stored[field] for field in Session._fields))
    scene = scene_of(case)
    true = wrong_by(scene, wrong, seed) if wrong else scene
    changes = {key: parameter(true, key) * by if by < 10.0 else parameter(true, key) + by for key, by in case.off}
    boom, changing = changes_by(with_parameters(true, changes) if changes else true, case.faults)
    programme = programme_of(case, scene, seed)
    load = tip_load(boom, [parse(text) for text in case.loads], case.seconds, seed) if case.loads else None
    step = 1e-3 if case.rate > 200.0 or case.motion in ("stops", "sweep") else 5e-3
    resting = at_rest(boom, programme(np.zeros(1))[0][0], ELEMENTS, nodally_exact=True)
    rows, _ = move(resting, programme, case.seconds, step, step, SCHEME, load, changing)
    found = observe(boom, programme, rows, Sensors(case.rate), seed, load)
    truth = found.truth
    loads = truth.get("load", np.zeros((len(found.stamps), 2)))
    session = Session(found.stamps, found.strokes, found.joints, found.imu, found.forces, truth["tip"], truth["tip_acc"], loads)
    folder.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, **session._asdict())
    return session


def block_of(session: Session, streams: list[Stream]) -> SampleBlock:
    """Samples of strokes and other streams, in the order of stamps."""
    read = [(Stream.STROKES, session.strokes), *((each, getattr(session, FIELDS[each])) for each in streams)]
    width = max(session.strokes.shape[1], 2)
    values = np.full((len(session.stamps), len(read), width), np.nan)
    for k, (_, column) in enumerate(read):
        values[:, k, : column.shape[1]] = column
    codes = np.tile([CODES[stream] for stream, _ in read], len(session.stamps))
    return SampleBlock(codes.astype(np.int64), np.repeat(session.stamps, len(read)), values.reshape(-1, width))


def measured(session: Session, case: Case, sensors: str, skip: float = 0.0) -> dict[str, float | str]:
    """Errors of prediction and estimate from `skip` (s) on; see the module's text."""
    twin = Twin(scene_of(case), Settings(**dict(case.settings)), reads=StrokeReading.DRIVE)
    parts = [
        part for part in twin.update_block(block_of(session, [Stream[each.upper()] for each in sensors.split(",")]))
        if isinstance(part, ReportBlock)
    ]  # fmt: skip
    stamps = np.concatenate([part.predictions.stamps for part in parts])
    rows = np.concatenate([part.estimates.rows for part in parts])
    predicted = [
        np.concatenate([getattr(part.predictions, f"tip_{each}") for part in parts]) for each in ("position", "acceleration")
    ]
    at = np.searchsorted(session.stamps, stamps)
    kept = (stamps - session.stamps[0]) * NANO >= skip
    found: dict[str, float | str] = {}
    for word, first, spread, true, before in (
        ("tip", TIP, TIP_COVARIANCE, session.tip, predicted[0]),
        ("acc", ACCELERATION, ACCELERATION_COVARIANCE, session.tip_acc, predicted[1]),
    ):
        off = (rows[:, first : first + 2] - true[at])[kept]
        variances = rows[:, [spread, spread + 3]][kept]
        scale = 1e3 if word == "tip" else 1.0
        found[f"{word} before"] = scale * rms(before[kept] - true[at][kept])
        found[word] = scale * rms(off)
        found[f"{word} stated"] = scale * float(np.sqrt(variances.sum(axis=1).mean()))
        found[f"{word} ne"] = float(np.sqrt((off**2 / variances).mean()))
    load = pulses_of(stamps * NANO, rows[:, FORCE : FORCE + 2])
    found["load off"] = rms((rows[:, FORCE : FORCE + 2] - session.load[at])[kept])
    found["load"] = load.text if load is not None else ""
    return found


def rms(values: Array) -> float:
    """Of vectors (k, 2)."""
    return float(np.sqrt((values**2).sum(axis=1).mean()))


def main() -> None:
    """Arguments, then the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/estimate"))
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--only", nargs="+", help="words with which names of cases begin")
    parser.add_argument("--sensors", nargs="+", default=["angles,imu", "angles"])
    parser.add_argument("--wrong", type=float, default=0.0, help="share by which the booms are off from their scenes")
    parser.add_argument("--skip", type=float, default=0.0, help="s at the start that count for nothing")
    args = parser.parse_args()
    print(
        "case | seed | sensors | tip before, mm | tip | stated | ne | acc before, m/s2 | acc | stated | ne | load off, N | load"
    )
    for name, case in CASES.items():
        if args.only and not any(name.startswith(word) for word in args.only):
            continue
        for seed in args.seeds:
            session = made(name, case, seed, args.out, args.wrong)
            for sensors in args.sensors:
                found = measured(session, case, sensors, args.skip)
                shown = [f"{each:.3g}" if isinstance(each, float) else each for each in found.values()]
                print(" | ".join([name, str(seed), sensors, *shown]), flush=True)


if __name__ == "__main__":
    sys.exit(main())
