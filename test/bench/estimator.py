"""The estimator's trade between lag and noise, and what its steps cost: numbers and picture for docs/estimator.md.

Run ``python test/bench/estimator.py``; writes docs/estimator.png and prints Markdown tables. Uses the bundled session, which is
synthetic: with the noise of its sensors, and with the true strokes that it keeps beside them.
"""

from __future__ import annotations

import time
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from boom_twin import Settings, Stream, Twin, load_scene
from boom_twin.bag.reader import read, scan
from boom_twin.messages.sample_decoder import SampleDecoder, stamp_of
from boom_twin.offline.ground_truth import load_truth
from boom_twin.offline.recording import Recording
from boom_twin.twin.blocks import SampleBlock

ROOT = Path(__file__).parents[2]
SESSION = ROOT / "bags" / "arch_session"
DENSITIES = (1e-6, 1e-5, 1e-4, 4e-4, 2e-3, 1e-2, 1e-1)
LAGS = (0.001, 0.01, 0.02, 0.03, 0.045, 0.06, 0.1)
STEPS = ((0.0025, 0.013), (0.005, 0.013), (0.005, 0.026), (0.005, 0.05), (0.0101, 0.026))


def strokes_of_session() -> tuple[list[int], np.ndarray, np.ndarray]:
    """Stamps, measured strokes and true strokes."""
    scene, truth = load_scene(), np.genfromtxt(SESSION / "truth.csv.gz", delimiter=",", names=True)
    decoder, stamps, measured = SampleDecoder(len(scene.joints)), [], []
    for _, _, message in read(scan(SESSION), {"cylinder_strokes": "sensor_msgs/msg/JointState"}):
        sample = decoder.put(Stream.STROKES, stamp_of(message), message)
        stamps.append(sample.stamp)
        measured.append(sample.values)
    true = np.column_stack([truth[f"stroke_{i + 1}_m"] for i in range(len(scene.joints))])
    return stamps, np.array(measured), true


def errors(stamps, strokes, **tuning) -> tuple[float, float, float]:
    """Tip error (mm rms), acceleration error (m/s^2 rms), microseconds per sample."""
    twin, truth = Twin(load_scene(), Settings(**tuning)), load_truth(SESSION)
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


def draw(densities: list[tuple], lags: list[tuple]) -> None:
    """Error against jerk density and against smoothing lag."""
    figure, axes = plt.subplots(1, 2, figsize=(12, 5), sharey=True)
    for axis, values, rows, label, default in (
        (axes[0], DENSITIES, densities, "jerk density, m$^2$/s$^5$ (lag 45 ms)", 4e-4),
        (axes[1], LAGS, lags, "smoothing lag, s (jerk density 4e-4 m$^2$/s$^5$)", 0.045),
    ):
        both, lag = np.array(rows).T
        axis.loglog(values, both, "o-", color="#0072b2", label="sensors with noise")
        axis.loglog(values, lag, "s--", color="#d55e00", label="true strokes: lag alone")
        axis.axvline(default, color="0.5", lw=1)
        axis.text(default, 0.0105, " default", color="0.4")
        axis.set_ylim(0.01, 0.6)
        axis.axhline(0.45, color="0.7", lw=1, ls=":")
        axis.set_xlabel(label)
        axis.grid(True, which="both", alpha=0.2)
    axes[0].set_ylabel("tip acceleration error, m/s$^2$ rms")
    axes[0].legend()
    figure.suptitle("Estimator: noise against lag (bundled session, synthetic)")
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "estimator.png", dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    Twin(load_scene()).warm_up()
    by_density = sweep("jerk density", [{"jerk_density": value} for value in DENSITIES])
    by_lag = sweep("lag", [{"lag": value} for value in LAGS])
    sweep("steps", [{"step": step, "look_step": look} for step, look in STEPS])
    draw(by_density, by_lag)
