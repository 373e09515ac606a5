"""Hostile phases: what a twin is given beside, or instead of, the true strokes for a while; isolated from one another.

Run ``python test/twin/hostile.py [COUNT] [FIRST SEED]`` for the distribution of the tip's error 2 s after such phases.
"""

from __future__ import annotations

import copy
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator

import numpy as np
from drive_twin import drive_twin

from boom_twin import Sample, Stream, Twin, load_scene
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.validation.rig.motion import Move, Programme

MS = 1_000_000
START = 1_700_000_000_000_000_000
STEP, COUNT = 5 * MS, 1600
AFTER = 400  # samples, 2 s
Phase = Callable[[np.random.Generator, list[Sample]], list[Sample]]


def strokes(stamp: int, values: np.ndarray) -> Sample:
    return Sample(Stream.STROKES, int(stamp), np.asarray(values, dtype=float))


def beside(make: Callable[[np.random.Generator, Sample, list[Sample]], list[Sample]], share: float = 1.0) -> Phase:
    """A phase in which other samples follow some of the true ones."""

    def phase(rng: np.random.Generator, true: list[Sample]) -> list[Sample]:
        return [each for s in true for each in (s, *(make(rng, s, true) if rng.random() < share else ()))]

    return phase


def far(rng: np.random.Generator) -> int:
    """1 ms to years, ahead or back."""
    return int(rng.choice([-1, 1]) * 10.0 ** rng.uniform(0.0, 11.0) * MS)


def second_source(rng: np.random.Generator, true: list[Sample]) -> list[Sample]:
    shift, other = far(rng), true[0].values + rng.normal(0.0, 0.05, 4) * rng.integers(0, 2)
    return [each for s in true for each in (s, *(strokes(s.stamp + shift + k * MS, other) for k in range(rng.integers(0, 3))))]


def swapped(rng: np.random.Generator, true: list[Sample]) -> list[Sample]:
    order = np.argsort(np.arange(len(true)) + rng.uniform(0.0, 4.0, len(true)))
    return [true[i] for i in order]


def burst(rng: np.random.Generator, s: Sample, true: list[Sample]) -> list[Sample]:
    return [strokes(s.stamp + rng.integers(-5, 5) * MS, s.values) for _ in range(30)]


PHASES: dict[str, Phase] = {
    "stray stamps": beside(lambda rng, s, true: [strokes(s.stamp + far(rng), s.values)], 0.2),
    "stray stamps and values": beside(lambda rng, s, _: [strokes(s.stamp + far(rng), s.values + rng.normal(0, 0.1, 4))], 0.2),
    "duplicates": beside(lambda rng, s, true: [s] * 3),
    "duplicates, other values": beside(lambda rng, s, true: [strokes(s.stamp, s.values + rng.normal(0.0, 0.1, 4))]),
    "flood": beside(lambda rng, s, true: [strokes(s.stamp + k, s.values) for k in range(1, 40)], 0.3),
    "bursts": beside(burst, 0.1),
    "old samples again": lambda rng, true: [*true, *true[int(rng.integers(0, len(true))) :]],
    "NaN": beside(lambda rng, s, true: [strokes(s.stamp + MS, np.where(rng.random(4) < 0.6, np.nan, s.values))]),
    "beyond reach": beside(lambda rng, s, true: [strokes(s.stamp + MS, s.values + rng.choice([-1e6, 5.0, 1e300]))], 0.3),
    "clock back and forth": lambda rng, true: [
        strokes(s.stamp + 3600_000 * MS * (len(true) // 4 < k < 3 * len(true) // 4), s.values) for k, s in enumerate(true)
    ],
    "swapped order": swapped,
    "second source": second_source,
    "pause": lambda rng, true: true[: len(true) // 8] + true[-len(true) // 8 :],
}


def session(seed: int) -> list[Sample]:
    """8 s of an own drive, with the noise of the sensors."""
    rng, scene = np.random.default_rng(seed), load_scene()
    start = strokes_of_posture(scene, "arch")
    moves = []
    for i in rng.choice(4, 2, replace=False):
        way, time = rng.uniform(-0.04, 0.04), rng.uniform(0.2, 3.0)
        moves.append(Move(int(i), time, rng.uniform(1.5, 4.0), float(start[i] + way)))
    times = np.arange(COUNT) * STEP * 1e-9
    true = Programme(tuple(start.tolist()), tuple(moves))(times)[0]
    noisy = np.round((true + rng.normal(0.0, 2e-5, true.shape)) / 5e-6) * 5e-6
    stamps = START + np.arange(COUNT) * STEP + rng.integers(-200_000, 200_000, COUNT)
    return [strokes(stamp, row) for stamp, row in zip(stamps.tolist(), noisy, strict=True)]


def phases(count: int, first: int) -> Iterator[tuple[str, float]]:
    """Kind of phase and error of the tip (m) 2 s after it, of `count` of them; 25 in each session."""
    for seed in range(first, first + -(-count // 25)):
        samples, rng = session(seed), np.random.default_rng([seed, 1])
        begins = sorted(rng.integers(200, COUNT - AFTER - 220, min(25, count - 25 * (seed - first))).tolist())
        clean, twin, tips = drive_twin(load_scene()), drive_twin(load_scene()), list[np.ndarray]()
        for sample in samples:
            prediction = clean.update(sample).prediction
            assert prediction is not None
            tips.append(prediction.tip_position)
        for k in range(COUNT):
            while begins and begins[0] == k:
                begins.pop(0)
                name = str(rng.choice(list(PHASES)))
                length = int(rng.integers(20, 200))
                yield name, _error(copy.deepcopy(twin), PHASES[name](rng, samples[k : k + length]), samples, tips, k + length)
            twin.update(samples[k])


def _error(twin: Twin, phase: list[Sample], samples: list[Sample], tips: list[np.ndarray], end: int) -> float:
    for sample in [*phase, *samples[end : end + AFTER]]:
        twin.update(sample)
    prediction = twin.update(samples[end + AFTER]).prediction
    return float("inf") if prediction is None else float(np.hypot(*(prediction.tip_position - tips[end + AFTER])))


def main(count: int = 1000, first: int = 0) -> None:
    found: dict[str, list[float]] = defaultdict(list)
    for name, error in phases(count, first):
        found[name].append(1e3 * error)
    every = np.concatenate([np.array(errors) for errors in found.values()])
    for name, errors in sorted(found.items()):
        print(f"{name:28} {len(errors):4}  median {np.median(errors):7.3f}  worst {max(errors):8.3f} mm")
    print(f"{count} phases: {np.mean(every < 5.0):.2%} within 5 mm 2 s later; 99 % within {np.quantile(every, 0.99):.2f} mm")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
