"""Monte Carlo simulation: one motion of booms whose parameters are drawn at random about those of a scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import BoomTwinError, SolverError, UsageError
from ..scene.edit import parameter, parameter_names, with_parameters
from ..scene.load import SceneSource, as_scene
from ..scene.schema import Scene
from ..system.cores import usable_cores
from ..types import Array
from .simulate import Simulation, simulate

LOADS = ("tip.payload", "line_fill")
"""Parameters that may be nothing: their deviations have units, those of all others are shares."""
LOWER, UPPER = 0.025, 0.975
"""Quantiles that are told."""
LARGEST_RESULT = 4e9  # bytes that all motions may take


@dataclass(frozen=True, repr=False)
class SampledMotions:
    """Motions of sampled booms. c samples that could be computed, of m rows each."""

    times: Array  # (m,), s
    parameters: dict[str, Array]  # (c,) each, drawn values, SI, by the parameter's name
    motions: dict[str, Array]  # (c, m) each, tip position, acceleration and cylinder forces, by the columns of `Simulation`
    failures: tuple[str, ...]  # parameters of samples that could not be computed, and why
    doubtful: int  # number of samples whose motion `simulate` doubts

    def columns(self) -> dict[str, Array]:
        """Return mean, standard deviation and quantiles `LOWER` and `UPPER` of every quantity over the samples, (m,) each."""
        found = {"t_s": self.times}
        for name, values in self.motions.items():
            low, high = np.quantile(values, (LOWER, UPPER), axis=0)
            found |= {f"{name}_mean": values.mean(axis=0), f"{name}_std": values.std(axis=0, ddof=1)}
            found |= {f"{name}_p2.5": low, f"{name}_p97.5": high}
        return found

    @cached_property
    def samples(self) -> dict[str, Array]:
        """Parameters and extremes of every sample, (c,) each."""
        motion = self.motions
        forces = {name: values for name, values in motion.items() if name.startswith("cylinder_force_")}
        return self.parameters | {
            "tip_y_min_m": motion["tip_y_m"].min(axis=1),
            "tip_y_max_m": motion["tip_y_m"].max(axis=1),
            "tip_acceleration_max_m_s2": np.hypot(motion["tip_ax_m_s2"], motion["tip_ay_m_s2"]).max(axis=1),
            **{f"{name.removesuffix('_N')}_max_N": np.abs(values).max(axis=1) for name, values in forces.items()},
        }


def drawn(scene: Scene, deviations: Mapping[str, float], count: int, seed: int) -> dict[str, Array]:
    """Return random values (count,) of parameters about those of `scene`, independent of each other.

    `deviations` by name: of loads in kg and kg/m, normal, cut off at nothing; of all others shares, log-normal, so that
    stiffness and mass stay positive. UsageError for none, one that the scene lacks, or a deviation that is not positive.
    """
    names = parameter_names(scene)
    if not deviations:
        raise UsageError(f"vary: nothing. Name a parameter with its deviation, of {', '.join(names)}.")
    noise = np.random.default_rng(seed)
    found = {}
    for name, deviation in deviations.items():
        if name not in names:
            raise UsageError(f"vary {name}: the scene has no such parameter. It has {', '.join(names)}.")
        if not 0.0 < deviation < math.inf:
            raise UsageError(f"vary {name} = {deviation:g}: a standard deviation is positive and finite.")
        if name not in LOADS and deviation > 1.0:
            raise UsageError(f"vary {name} = {deviation:g}: a share of the value, 1 at most. For 10 %, give 0.1.")
        steps, present = deviation * noise.standard_normal(count), parameter(scene, name)
        found[name] = np.maximum(present + steps, 0.0) if name in LOADS else present * np.exp(steps)
    return found


def simulate_samples(
    scene: SceneSource,
    times: Array,
    strokes: Array,
    deviations: Mapping[str, float],
    count: int,
    seed: int = 0,
    dt: float = 1e-3,
    angles: Array | None = None,
    tell: Callable[[int], object] = lambda done: None,
    force: Array | None = None,
) -> SampledMotions:
    """Follow the strokes with `count` booms (2 at least) that differ in parameters drawn at random, on all cores.

    The boom's arguments are as for `boom_twin.simulate`, from rest; for `deviations` and errors see `drawn`. The same `seed`
    gives the same samples, whatever the number of cores. `tell` is called with 1 whenever a sample is done. SolverError if
    fewer than two could be computed.
    """
    scene = as_scene(scene)
    if count < 2:
        raise UsageError(f"samples = {count}: a spread needs 2 at least. Give 100.")
    if (size := 8.0 * count * len(times) * (4 + len(scene.joints))) > LARGEST_RESULT:
        raise UsageError(
            f"samples = {count} of {len(times)} rows: {size:.2g} bytes, {LARGEST_RESULT:.2g} at most. Give fewer rows."
        )
    values = drawn(scene, deviations, count, seed)
    simulate(scene, times[:1], strokes[:1], dt, angles, estimate_errors=False)  # what is wrong for all is told once

    def follow(i: int) -> tuple[dict[str, Array], bool] | str:
        mine = {name: float(column[i]) for name, column in values.items()}
        try:
            found = simulate(with_parameters(scene, mine), times, strokes, dt, angles, estimate_errors=False, force=force)
        except BoomTwinError as error:
            return f"{', '.join(f'{name} = {value:.6g}' for name, value in mine.items())}: {error}"
        return _kept(found), bool(found.doubts)

    with ThreadPoolExecutor(usable_cores()) as pool:
        results = []
        for each in pool.map(follow, range(count)):
            results.append(each)
            tell(1)
    failures = tuple(each for each in results if isinstance(each, str))
    right = [i for i, each in enumerate(results) if not isinstance(each, str)]
    if len(right) < 2:
        raise SolverError(f"{len(failures)} of {count} samples have no solution; the first: {failures[0]}")
    done = [each for each in results if not isinstance(each, str)]
    return SampledMotions(
        np.asarray(times, dtype=float),
        {name: column[right] for name, column in values.items()},
        {name: np.array([motion[name] for motion, _ in done]) for name in done[0][0]},
        failures,
        sum(is_doubtful for _, is_doubtful in done),
    )


def _kept(found: Simulation) -> dict[str, Array]:
    columns = found.columns()
    names = [name for name in columns if name.startswith(("tip_", "cylinder_force_"))]
    return {name: columns[name].copy() for name in names}
