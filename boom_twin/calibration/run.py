"""Calibration: read sessions, hold out a part, fit, compare residuals before and after."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..bag.session_file import WHOLE, TimeWindow
from ..bag.session_model import Mapped, mapping_of, strokes_of
from ..config.settings import Settings
from ..errors import BagError, UsageError
from ..scene.edit import with_parameters
from ..scene.schema import Scene
from ..twin.blocks import CODES, ResidualBlock, block_of
from ..twin.twin import Twin
from ..types import SENSORS, Array, Stream, StrokeReading, channels_of, streams_of
from .fit import CalibrationProblem, Fit, InseparableUnknowns, fitted, groups_of
from .sessions import STREAMS, MeasuredSession, Rigging, read_sessions, rest_periods
from .unknowns import Choice, Unknown, assumed_of, unknowns_of, usual_names

BEYOND = 0.01  # m, by which a stroke may be beyond the travel of its cylinder
BETWEEN = 1.96  # deviations, of a normal distribution's 95 %

UNSETTLED = (
    "The estimates still moved in the last pass, so they are not those that fit best: do not use this result. Record more rest "
    "periods in other postures, or estimate fewer parameters."
)

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Estimate:
    """Estimate of one parameter, SI: present value, estimate, 95 % interval, and whether the sessions determine it."""

    unknown: Unknown
    value: float
    low: float
    high: float
    told: bool

    @property
    def has_changed(self) -> bool:
        """Return True if the sessions determine it, and the present value is outside the interval."""
        return self.told and not self.low <= self.unknown.present <= self.high


@dataclass(frozen=True)
class HeldOutResult:
    """Residuals of c channels on the held-out part."""

    names: tuple[str, ...]
    spread: Array  # (c,), root mean square of the normalised residuals; 1 if they are as expected, NaN for none


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    Attributes
    ----------
    scene : Scene
        Scene with the determined estimates; all other values are unchanged.
    zeros : dict of str to float
        Determined zeros (SI) of sensors by channel, in addition to those of the mapping.
    estimates : tuple of Estimate
    groups : tuple of InseparableUnknowns
        Undetermined unknowns.
    misfit : float
        Largest root mean square of a channel's normalised innovations; 1 if noise alone is left.
    passes : int
    sessions : tuple of MeasuredSession
    held_out : str
        Part that was not used for the fit.
    before, after : HeldOutResult
        Residuals of the twin on the held-out part.
    mapped : Mapped
        Mapping of the sensors of the sessions.
    remarks : tuple of str
        Remarks for the reader.
    unusable : str
        The remark that the result must not be used; empty if it may be.
    """

    scene: Scene
    zeros: dict[str, float]
    estimates: tuple[Estimate, ...]
    groups: tuple[InseparableUnknowns, ...]
    misfit: float
    passes: int
    sessions: tuple[MeasuredSession, ...]
    held_out: str
    before: HeldOutResult
    after: HeldOutResult
    mapped: Mapped
    remarks: tuple[str, ...]
    unusable: str


def calibrate(
    bags: Sequence[str | Path],
    scene: Scene,
    choice: Choice | None = None,
    settings: Settings | None = None,
    mapping: str | Path | None = None,
    progress: Progress = lambda share, what: None,
    window: TimeWindow = WHOLE,
    namespace: str = "",
) -> Calibration:
    """Estimate parameters of `scene` from healthy sessions of its boom, each begun at rest.

    The last session is held out; of a single one, its last third. `settings` give the noise of the sensors. `mapping` is by
    default that of the sessions. `progress` is told the share done and what comes next. `window` is the part of each session
    that is used. `namespace` is the ROS namespace of the recorded topics.

    Raises
    ------
    UsageError
        A parameter that the scene lacks; sessions with different mappings; nothing that the sessions could tell.
    BagError, SolverError
        A session that cannot be used; the model fails on it.
    """
    settings, choice = settings or Settings(), choice or Choice()
    progress(0.0, "reading")
    paths, given = [Path(bag) for bag in bags], Path(mapping) if mapping else None
    mapped, rigging, sessions = rigged_sessions(paths, scene, settings, given, namespace, window)
    _refuse_other_boom(scene, sessions)
    present = [stream for stream in Stream if any(stream in session.series for session in sessions)]
    names = choice.names or usual_names(scene, present, choice)
    unknowns = unknowns_of(scene, names)
    kept_from, fitting = _parts(sessions)
    progress(0.05, "rests")
    periods = [period for each, until in fitting for period in rest_periods(each, scene, rigging, until)]
    problem = CalibrationProblem(scene, unknowns, periods, rigging)
    fit = fitted(problem, assumed_of(scene, names), lambda k: progress(0.15 + 0.6 * (1.0 - 0.85**k), f"fit, pass {k}"))
    groups = groups_of(problem, fit)
    estimates = _estimates(problem, fit, groups)
    told = {estimate.unknown.name: estimate.value for estimate in estimates if estimate.told}
    if not told:
        raise UsageError("the sessions tell none of the parameters:\n" + "\n".join(f"  {group}" for group in groups))
    zeros = {name.removesuffix(".zero"): value for name, value in told.items() if name.endswith(".zero")}
    better = with_parameters(scene, {name: value for name, value in told.items() if not name.endswith(".zero")})
    progress(0.8, "held out, before")
    before = judged(scene, rigging, sessions[-1], {}, kept_from)
    progress(0.9, "held out, after")
    after = judged(better, rigging, sessions[-1], zeros, kept_from)
    progress(1.0, "done")
    held_out = sessions[-1].name if len(sessions) > 1 else f"the last third of {sessions[-1].name}"
    unusable = _worse(before, after) if fit.is_settled else UNSETTLED
    remarks = (*_remarks(fit, problem.names, estimates, sessions), *([unusable] if unusable else []))
    misfit, judgements = float(fit.misfits.max()), (held_out, before, after, mapped, remarks, unusable)
    return Calibration(better, zeros, estimates, tuple(groups), misfit, fit.passes, tuple(sessions), *judgements)


def rigged_sessions(
    paths: Sequence[Path], scene: Scene, settings: Settings, mapping: Path | None, namespace: str, window: TimeWindow
) -> tuple[Mapped, Rigging, list[MeasuredSession]]:
    """Return the mapping of sessions of one boom, what its sensors are, and the sessions. For arguments see `calibrate`."""
    joints = len(scene.joints)
    mapped = _common_mapping(paths, mapping, joints, namespace)
    topics = mapped.topics.of_scene(scene.joints)
    rigging = Rigging(topics.noise_of(settings), tuple(topics.mounts(joints)), _common_reading(paths, mapped), topics.places)
    return mapped, rigging, read_sessions(paths, topics, joints, window)


def _common_reading(paths: Sequence[Path], mapped: Mapped) -> StrokeReading:
    """Return what the stroke transducers of all sessions read; UsageError if it differs."""
    found = [strokes_of(path, mapped).reading for path in paths]
    if StrokeReading.ANGLE in found:
        raise UsageError(
            f"{mapped.source}: drive: angles. calibrate needs strokes. Give sessions that have them, and their mapping."
        )
    for path, reading in zip(paths, found, strict=True):
        if reading is not found[0]:
            raise UsageError(
                f"{path}: its stroke transducers read {reading.value}s, those of {paths[0]} {found[0].value}s. "
                "Calibrate the two apart."
            )
    return found[0]


def _common_mapping(paths: Sequence[Path], mapping: Path | None, joints: int, namespace: str) -> Mapped:
    """Return the mapping of all sessions, or the one at `mapping`; UsageError if the sessions' mappings differ."""
    found = [mapping_of(path, mapping, joints, namespace) for path in paths]
    for path, each in zip(paths, found, strict=True):
        if each.topics != found[0].topics:
            raise UsageError(
                f"{path}: recorded with another mapping than {paths[0]}, so that zeros differ. Calibrate them apart, or give "
                "the one that is right by --mapping."
            )
    return found[0]


def _parts(sessions: Sequence[MeasuredSession]) -> tuple[int, list[tuple[MeasuredSession, int | None]]]:
    """Return the stamp from which the last session is held out, and the sessions to fit, each up to a stamp (None: whole)."""
    strokes = sessions[-1].series[Stream.STROKES].stamps
    if len(sessions) > 1:
        return int(strokes[0]), [(session, None) for session in sessions[:-1]]
    until = int(strokes[0] + 2.0 / 3.0 * (strokes[-1] - strokes[0]))
    return until, [(sessions[0], until)]


def _refuse_other_boom(scene: Scene, sessions: Sequence[MeasuredSession]) -> None:
    for session in sessions:
        strokes = session.series[Stream.STROKES].values
        for i, joint in enumerate(scene.joints):
            low, high = np.nanquantile(strokes[:, i], [0.01, 0.99]).tolist()
            most = joint.cylinder.max_stroke
            if low < -BEYOND or high > most + BEYOND:
                raise BagError(
                    f"{session.name}: cylinder_{i + 1} reads {low:.3f} to {high:.3f} m, the scene's travels 0 to {most:g} m. "
                    "Give a session of this boom, or a mapping with its unit and zero."
                )


def _estimates(problem: CalibrationProblem, fit: Fit, groups: Sequence[InseparableUnknowns]) -> tuple[Estimate, ...]:
    untold = {name for group in groups for name in group.names}
    least = np.array([unknown.kind.least / unknown.kind.prior for unknown in problem.unknowns])
    reach = BETWEEN * np.sqrt(np.diag(fit.covariance()) + least**2)
    best = fit.without([i for i, unknown in enumerate(problem.unknowns) if unknown.name in untold], problem.least)
    best = np.where([unknown.name in untold for unknown in problem.unknowns], fit.deviations, best)
    found = []
    for unknown, at, half in zip(problem.unknowns, best.tolist(), reach.tolist(), strict=True):
        values = (unknown.value(at), unknown.value(max(at - half, unknown.least)), unknown.value(at + half))
        found.append(Estimate(unknown, *values, unknown.name not in untold))
    return tuple(found)


def judged(
    scene: Scene,
    rigging: Rigging,
    session: MeasuredSession,
    zeros: Mapping[str, float],
    start: int,
) -> HeldOutResult:
    """Run a session, less the sensors' `zeros`, through the twin of `scene`; keep the residuals from stamp `start` on.

    BagError if the twin predicts nothing there.
    """
    batch, samples, joints = 10_000, session.samples(zeros), len(scene.joints)  # samples that are taken at once
    twin = Twin(scene, rigging.settings, rigging.mounts, reads=rigging.reads, places=rigging.places)
    blocks = (block_of(samples[first : first + batch], joints) for first in range(0, len(samples), batch))
    found = ResidualBlock(*map(np.concatenate, zip(*(twin.take(block).residuals for block in blocks), strict=True)))
    names, columns = list[str](), list[Array]()
    for stream, channels in channels_of(joints, streams_of(rigging.places)).items():
        own = (found.streams == CODES[stream]) & (found.stamps >= start)
        if own.any():
            names += channels
            columns += [*(found.values[own] / found.sigmas[own]).T[: len(channels)]]
    if not names:
        raise BagError(f"{session.name}: the twin predicts nothing in the part held out. Are the strokes within the travel?")
    return HeldOutResult(tuple(names), np.array([_rms(column) for column in columns]))


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _worse(before: HeldOutResult, after: HeldOutResult) -> str:
    """Return which residuals have grown on what was held out, and the remedy; empty if none has."""
    worse = [
        name for name, old, new in zip(before.names, before.spread, after.spread, strict=True) if new > 1.1 * max(old, 1.0)
    ]
    if not worse:
        return ""
    return (
        f"On what was held out the residuals of {', '.join(worse)} have grown: do not use this result. Record a session that "
        "tells what was left as before, or estimate fewer parameters."
    )


def _remarks(fit: Fit, names: Sequence[str], estimates: Sequence[Estimate], sessions: Sequence[MeasuredSession]) -> list[str]:
    found = []
    for each, pull in zip(estimates, fit.pull / np.sqrt(np.diag(fit.precision)), strict=True):
        bound = each.unknown.value(each.unknown.least)
        if each.told and pull < -BETWEEN:
            found.append(
                f"{each.unknown.name} is at its lower bound of {bound:g} {each.unknown.kind.unit}: the sessions fit best with "
                "less, which no boom has. Check the zeros of the sensors and the other loads of the scene."
            )
    for name, misfit in zip(names, fit.misfits, strict=True):
        if misfit > 1.5:
            found.append(
                f"The readings of {name} are {misfit:.1f} times as far from the fit as its noise explains. The sessions hold "
                "something that the parameters cannot make, as a fault of the sensor or another boom. It has the less weight."
            )
    if any(session.changed for session in sessions):
        found.append("A load or a zero was changed while a session was recorded; the fit takes no account of it.")
    for stream in STREAMS:
        if len({stream in session.series for session in sessions}) > 1:
            found.append(f"Not every session has a {SENSORS[stream].title}.")
    return found
