"""The estimator at rest and in haste, and what its steps cost: numbers and picture for docs/estimator.md.

Run ``python test/bench/estimator.py``; writes docs/estimator.png and prints Markdown tables. Uses the bundled session, which is
synthetic: with the noise of its sensors, and with the true strokes that it keeps beside them.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[1]))
from drive_twin import ARCH_DRIVES, drive_twin
from estimation.motions import measured
from estimation.test_motions import error, followed

from boom_twin import Settings, Stream, load_scene
from boom_twin.bag.reader import read, scan
from boom_twin.messages.sample_decoder import SampleDecoder, stamp_of
from boom_twin.offline.ground_truth import load_truth
from boom_twin.offline.recording import Recording
from boom_twin.twin.blocks import SampleBlock

ROOT = Path(__file__).parents[2]
AGILITIES = (0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0)
RATES = (50.0, 100.0, 200.0, 1000.0)
SHOWN = ("rests", "sweep", "stops")
BIN = 0.1  # s, over which errors are drawn
BEFORE = ROOT / "docs" / "estimator_before.csv"
"""Errors (m/s^2 rms over `BIN`) of the filter of 0.1.0, with one jerk density, 4e-4 m^2/s^5, and a lag of 45 ms."""
STEPS = ((0.0025, 0.013), (0.005, 0.013), (0.005, 0.026), (0.005, 0.05), (0.0101, 0.026))


def strokes_of_session() -> tuple[list[int], np.ndarray, np.ndarray]:
    """Stamps, measured strokes and true strokes."""
    scene, truth = load_scene(), np.genfromtxt(ARCH_DRIVES / "truth.csv.gz", delimiter=",", names=True)
    decoder, stamps, measured = SampleDecoder(len(scene.joints)), [], []
    for _, _, message in read(scan(ARCH_DRIVES), {"cylinder_strokes": "sensor_msgs/msg/JointState"}):
        sample = decoder.put(Stream.STROKES, stamp_of(message), message)
        stamps.append(sample.stamp)
        measured.append(sample.values)
    true = np.column_stack([truth[f"stroke_{i + 1}_m"] for i in range(len(scene.joints))])
    return stamps, np.array(measured), true


def errors(stamps, strokes, **tuning) -> tuple[float, float, float]:
    """Tip error (mm rms), acceleration error (m/s^2 rms), microseconds per sample."""
    twin, truth = drive_twin(load_scene(), Settings(**tuning)), load_truth(ARCH_DRIVES)
    start = time.perf_counter()
    recording = Recording(strokes.shape[1])
    for part in twin.update_block(SampleBlock(np.zeros(len(stamps), np.int64), np.array(stamps), strokes)):
        recording.add(part)
    spent = 1e6 * (time.perf_counter() - start) / len(stamps)
    found = truth.errors(recording.predictions, slice(None))
    return 1e3 * found["tip_error_rms_m"], found["tip_acceleration_error_rms_m_s2"], spent


def sweep(name: str, choices: list[dict]) -> list[tuple]:
    """Errors for each choice of settings, with noise and with true strokes; printed as a table."""
    stamps, noisy, true = strokes_of_session()
    rows = []
    print(f"\n| {name} | tip, mm rms | acceleration, m/s^2 rms | same, true strokes | us per sample |\n|---|---|---|---|---|")
    for choice in choices:
        tip, acceleration, spent = errors(stamps, noisy, **choice)
        _, lag, _ = errors(stamps, true, **choice)
        rows.append((acceleration, lag))
        label = ", ".join(f"{key} {value:g}" for key, value in choice.items())
        print(f"| {label} | {tip:.2f} | {acceleration:.3f} | {lag:.3f} | {spent:.0f} |", flush=True)
    return rows


def binned(values: np.ndarray) -> np.ndarray:
    """Root mean square of vectors (k, 2), 200 a second, over each `BIN`."""
    size = round(200.0 * BIN)
    count = len(values) // size
    return np.sqrt((values[: count * size] ** 2).sum(axis=1).reshape(count, size).mean(axis=1))


def draw() -> None:
    """Errors of the tip's acceleration at rest, in a sweep and after stops, of this filter and of the one before."""
    before = np.genfromtxt(BEFORE, delimiter=",", names=True)
    figure, axes = plt.subplots(len(SHOWN), 1, figsize=(12, 9), sharex=True)
    for axis, name in zip(axes, SHOWN, strict=True):
        session = measured(name)
        left = binned(followed(session)[1].tip_acceleration - session.acceleration)
        times = BIN * (np.arange(len(left)) + 0.5)
        axis.semilogy(times, binned(session.acceleration), color="0.75", lw=3, label="the acceleration itself")
        axis.semilogy(times, before[name], color="#d55e00", label="error, filter of 0.1.0")
        axis.semilogy(times, left, color="#0072b2", label="error")
        axis.set_ylim(0.02, 60.0)
        axis.set_ylabel(f"{name}: m/s$^2$ rms")
        axis.grid(True, which="both", alpha=0.2)
    axes[0].legend(loc="upper right", ncols=3)
    axes[-1].set_xlabel("s")
    figure.suptitle("Tip acceleration predicted from strokes with noise, 200 Hz (synthetic)")
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "estimator.png", dpi=110, metadata={"Software": None})


def compare_rates() -> None:
    """Errors of the motions at every sample rate, printed as a table."""
    print("\n| motion | " + " | ".join(f"{rate:g} Hz" for rate in RATES) + " |\n|---|" + "---|" * len(RATES))
    for name in SHOWN:
        print(f"| {name} | " + " | ".join(f"{error(name, rate):.3f}" for rate in RATES) + " |", flush=True)


if __name__ == "__main__":
    drive_twin(load_scene()).warm_up()
    sweep("agility", [{"stroke_agility": value} for value in AGILITIES])
    sweep("steps", [{"step": step, "look_step": look} for step, look in STEPS])
    compare_rates()
    draw()
