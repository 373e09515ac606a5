"""Run a calibration: read sessions, hold out a part, fit, judge."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..bag.session_model import Mapped, mapping_of, strokes_of
from ..bag.time_window import WHOLE, TimeWindow
from ..config.settings import Settings
from ..errors import BagError, SolverError, UsageError
from ..scene.edit import with_parameters
from ..scene.schema import Scene
from ..types import NANO, SENSORS, Mount, Stream, StrokeReading
from .forward_model import READINGS, CalibrationProblem
from .least_squares import Fit, InseparableUnknowns, fitted, groups_of
from .noise_model import ResidualBlocks, block_length, blocks_of, channel_names
from .sessions import MeasuredSession, SessionCourse, course_of, read_sessions, refuse_short
from .unknown_load import LENGTH, SAMPLES, fitted_under_load, is_plausible
from .unknowns import Unknown, unknowns_of, usual_names
from .validation import HeldOutResult, judged

KEPT = 2.0 / 3.0  # of a single session is fitted, the rest held out
MOVED = 0.01  # m, least travel of some stroke
LOADED = 1.2  # misfit from which on an unknown load is looked for, and up to which it explains the residuals
MISFIT = 1.5  # from which on the fit is remarked on
GROWN = 1.1  # of residuals on what was held out, likewise
AT_BOUND = 1e-6  # deviations of the prior, within which an estimate is at its bound
BETWEEN = 1.96  # deviations, of a normal distribution's 95 %

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Choice:
    """Unknowns to estimate: `names`, or if there are none the usual ones and those requested by the other fields.

    See `boom_twin.calibration.unknowns.usual_names`.
    """

    names: tuple[str, ...] = ()
    load: str | None = None
    damping: str | None = None
    stiffness: bool = False
    zeros: str = "all"


@dataclass(frozen=True)
class Estimate:
    """Estimate of one parameter, SI: present value, estimate, 95 % interval, and whether the sessions determine it."""

    unknown: Unknown
    value: float
    low: float
    high: float
    told: bool


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration.

    Attributes
    ----------
    scene : Scene
        With the estimates that the sessions tell; all else as it was.
    zeros : dict of str to float
        What sensors read too much (SI) beyond the mapping, by channel; likewise.
    estimates : tuple of Estimate
    groups : tuple of InseparableUnknowns
        What the sessions do not tell.
    misfit : float
        Root mean square of the white residuals of the fit; 1 where the model explains all but noise.
    passes : int
    sessions : tuple of MeasuredSession
    held_out : str
        What was not used for the fit.
    before, after : HeldOutResult
        The twin's residuals there.
    mapped : Mapped
        How the sensors of the sessions were read.
    remarks : tuple of str
        What a reader should know.
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


def calibrate(
    bags: Sequence[str | Path],
    scene: Scene,
    choice: Choice | None = None,
    settings: Settings | None = None,
    mapping: str | Path | None = None,
    progress: Progress = lambda share, what: None,
    window: TimeWindow = WHOLE,
) -> Calibration:
    """Estimate parameters of `scene` from healthy sessions of its boom.

    Parameters
    ----------
    bags : sequence of path
        Recorded sessions, each begun at rest. The last one is held out; of a single one, its last third.
    choice : Choice, optional
    settings : Settings, optional
        Noise of the sensors; the package's own by default.
    mapping : path, optional
        Of topics and sensors; by default as the sessions were recorded, see `boom_twin.messages.mapping`.
    progress : callable, optional
        Told the share done and what comes next.
    window : TimeWindow, optional
        The part of each session that is used.

    Returns
    -------
    Calibration
        Estimates with their intervals, what the sessions do not tell, and the residuals on what was held out.

    Raises
    ------
    UsageError
        A parameter that the scene lacks; sessions with different mappings; nothing that the sessions could tell.
    BagError
        A session that cannot be used.
    SolverError
        The model fails on a session.
    """
    settings, choice = settings or Settings(), choice or Choice()
    progress(0.0, "reading")
    paths, joints = [Path(bag) for bag in bags], len(scene.joints)
    mapped = common_mapping(paths, Path(mapping) if mapping else None, joints)
    refuse_lengths(paths, mapped)
    sessions = read_sessions(paths, mapped.topics.of_joints(joint.range_deg for joint in scene.joints), joints, window)
    streams = (Stream.STROKES, *_compared(sessions))
    names = choice.names or usual_names(scene, streams, choice.load, choice.damping, choice.stiffness, choice.zeros)
    unknowns = unknowns_of(scene, names)
    parts, kept_from = _parts(scene, sessions, mapped, settings)
    progress(0.1, "fit, holds")
    problem, fit = _fitted(scene, unknowns, parts, settings, progress)
    progress(0.75, "what can be told apart")
    groups = groups_of(problem, fit)
    estimates = _estimates(problem, fit, groups)
    told = {estimate.unknown.name: estimate.value for estimate in estimates if estimate.told}
    if not told:
        raise UsageError("the sessions tell none of the parameters:\n" + "\n".join(f"  {group}" for group in groups))
    zeros = {name.removesuffix(".zero"): value for name, value in told.items() if name.endswith(".zero")}
    better = with_parameters(scene, {name: value for name, value in told.items() if not name.endswith(".zero")})
    progress(0.8, "held out, before")
    mounts = mapped.topics.mounts(joints)
    before = judged(scene, settings, mounts, sessions[-1], {}, kept_from)
    progress(0.9, "held out, after")
    after = judged(better, settings, mounts, sessions[-1], zeros, kept_from)
    progress(1.0, "done")
    held_out = sessions[-1].name if len(sessions) > 1 else f"the last third of {sessions[-1].name}"
    return Calibration(
        better, zeros, estimates, tuple(groups), fit.misfit, fit.passes, tuple(sessions), held_out, before, after, mapped,
        tuple(_remarks(problem, fit, estimates, sessions, mounts) + ([] if fit.load else _worse(before, after))),
    )  # fmt: skip


def _fitted(
    scene: Scene, unknowns: Sequence[Unknown], parts: FittedParts, settings: Settings, progress: Progress
) -> tuple[CalibrationProblem, Fit]:
    """Return the problem and its fit; under an unknown load at the tip, if more than noise is left and the load explains it."""
    passes = iter(range(1, 1000))

    def tell() -> None:
        _tell_pass(progress, next(passes))

    problem = CalibrationProblem(scene, unknowns, parts.in_blocks(parts.length), parts.channels, settings)
    quiet = fitted(problem, tell)
    if quiet.misfit <= LOADED:
        return problem, quiet
    blocks = [(course.held(settings.stroke_variance), each) for course, each in parts.in_blocks(parts.loaded_length, 0.5)]
    finer = CalibrationProblem(scene, unknowns, blocks, parts.channels, settings)
    try:
        loaded = fitted_under_load(finer, quiet, tell)
    except SolverError:  # then the misfit stays, and is remarked on
        return problem, quiet
    return problem, loaded if loaded.misfit <= LOADED and is_plausible(loaded.load, scene) else quiet


def _tell_pass(progress: Progress, number: int) -> None:
    progress(0.15 + 0.6 * (1.0 - 0.85**number), f"fit, pass {number}")


def refuse_lengths(paths: Sequence[Path], mapped: Mapped) -> None:
    """Raise a UsageError for a session whose stroke transducers read lengths, which the fit would take for drives."""
    for path in paths:
        strokes = strokes_of(path, mapped)
        if strokes.reading is StrokeReading.LENGTH:
            raise UsageError(
                f"{path}: its stroke transducers read lengths ({strokes.source}), and the fit knows drives only: it would "
                "count the oil's compression twice. If they do read drives, say reads: drive under inputs.cylinder_strokes of "
                "a mapping (--mapping)."
            )


def common_mapping(paths: Sequence[Path], mapping: Path | None, joints: int) -> Mapped:
    """Return the mapping of all sessions, or the one at `mapping`; UsageError if the sessions' mappings differ."""
    found = [mapping_of(path, mapping, joints) for path in paths]
    for path, each in zip(paths, found, strict=True):
        if each.topics != found[0].topics:
            raise UsageError(
                f"{path}: recorded with another mapping than {paths[0]}, so that zeros differ. Calibrate them apart, or give "
                "the one that is right by --mapping."
            )
    return found[0]


@dataclass(frozen=True)
class FittedParts:
    """Parts of the sessions that are fitted.

    `length` and `loaded_length` (s) are those of blocks without and with a load, `streams` are compared, `mounts` tell how
    their sensors are mounted.
    """

    sessions: tuple[tuple[MeasuredSession, SessionCourse], ...]
    length: float
    loaded_length: float
    streams: tuple[Stream, ...]
    mounts: tuple[Mount | None, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the streams' channels."""
        return channel_names(self.sessions[0][1].strokes.shape[1], self.streams)

    def in_blocks(self, length: float, lead: float = 0.0) -> list[tuple[SessionCourse, ResidualBlocks]]:
        """Return each course with its averages over blocks of `length` (s).

        The first block begins before the course, by the share `lead` of the time between samples.
        """
        return [
            (course, blocks_of(session, course, length, self.streams, self.mounts, lead * course.interval))
            for session, course in self.sessions
        ]


def _parts(scene: Scene, sessions: Sequence[MeasuredSession], mapped: Mapped, settings: Settings) -> tuple[FittedParts, int]:
    """Return the parts to fit, and the stamp from which the last session is held out."""
    joints, streams = len(scene.joints), _compared(sessions)
    courses = [course_of(session, settings) for session in sessions]
    _refuse_other_boom(scene, sessions, courses)
    kept_from = courses[-1].start
    if len(sessions) == 1:
        used = KEPT * courses[0].duration
        refuse_short(sessions[0].name, used, "left for the fit, the last third being held out")
        kept_from += round(used / NANO)
        courses = [courses[0].until(used)]
    fitting = list(zip(sessions, courses, strict=True))[: max(1, len(sessions) - 1)]
    travel = max(float(np.ptp(course.strokes, axis=0).max()) for _, course in fitting)
    between = np.ptp([course.strokes.mean(axis=0) for _, course in fitting], axis=0).max()
    if max(travel, float(between)) < MOVED:
        raise BagError(
            f"{', '.join(session.name for session, _ in fitting)}: no stroke moves by more than {1e3 * MOVED:g} mm, so loads "
            "do not change and stiffness looks like a zero. Record moves of every cylinder, with holds between them."
        )
    lengths = block_length(sessions, streams), block_length(sessions, streams, LENGTH, SAMPLES)
    return FittedParts(tuple(fitting), *lengths, streams, tuple(mapped.topics.mounts(joints))), kept_from


def _compared(sessions: Sequence[MeasuredSession]) -> tuple[Stream, ...]:
    """Return the streams to compare; a stream that one session lacks is left out of all."""
    return tuple(stream for stream in READINGS if all(stream in session.series for session in sessions))


def _refuse_other_boom(scene: Scene, sessions: Sequence[MeasuredSession], courses: Sequence[SessionCourse]) -> None:
    """Raise BagError where strokes are beyond the travel of the scene's cylinders."""
    for session, course in zip(sessions, courses, strict=True):
        for i, joint in enumerate(scene.joints):
            low, high = float(course.strokes[:, i].min()), float(course.strokes[:, i].max())
            most = joint.cylinder.max_stroke
            if low < -MOVED or high > most + MOVED:
                raise BagError(
                    f"{session.name}: cylinder_{i + 1} reads {low:.3f} to {high:.3f} m, the scene's travels 0 to {most:g} m. "
                    "Give a session of this boom, or a mapping with its unit and zero."
                )


def _estimates(problem: CalibrationProblem, fit: Fit, groups: Sequence[InseparableUnknowns]) -> tuple[Estimate, ...]:
    untold = {name for group in groups for name in group.names}
    reach = BETWEEN * np.sqrt(np.diag(fit.covariance()))
    best = fit.without([i for i, unknown in enumerate(problem.unknowns) if unknown.name in untold], problem.least)
    best = np.where([unknown.name in untold for unknown in problem.unknowns], fit.deviations, best)
    found = []
    for unknown, at, half in zip(problem.unknowns, best.tolist(), reach.tolist(), strict=True):
        values = (unknown.value(at), unknown.value(max(at - half, unknown.least)), unknown.value(at + half))
        found.append(Estimate(unknown, *values, unknown.name not in untold))
    return tuple(found)


def _worse(before: HeldOutResult, after: HeldOutResult) -> list[str]:
    worse = [name for name, old, new in zip(before.names, before.spread, after.spread, strict=True) if new > GROWN * old]
    if not worse:
        return []
    return [
        f"On what was held out the residuals of {', '.join(worse)} have grown: do not use this result. Record a session that "
        "tells what was left as before, or estimate fewer parameters."
    ]


def _remarks(
    problem: CalibrationProblem, fit: Fit, estimates: Sequence[Estimate], sessions: Sequence[MeasuredSession],
    mounts: Sequence[object],
) -> list[str]:  # fmt: skip
    found = []
    for each in estimates:
        bound = each.unknown.value(each.unknown.least)
        if each.told and each.value <= bound + AT_BOUND * each.unknown.kind.prior:
            found.append(
                f"{each.unknown.name} is at its lower bound of {bound:g} {each.unknown.kind.unit}: the sessions fit best with "
                "less, which no boom has. Check the zeros of the sensors and the other loads of the scene."
            )
    if fit.misfit > MISFIT:
        found.append(
            f"The residuals of the fit are {fit.misfit:.1f} times what noise explains: the sessions hold something that the "
            "parameters cannot make (a fault, another boom, a load that changed). Intervals are widened by it."
        )
    if fit.load is not None:
        found.append(
            f"A load at the tip that the scene does not know was taken into account: {fit.load.text}. The residuals on "
            "what was held out hold it, too."
        )
    if any(session.changed for session in sessions):
        found.append("A load or a zero was changed while a session was recorded; the fit takes no account of it.")
    if any(mounts):
        found.append("Inclinometers are not used by the fit, only encoders.")
    compared = _compared(sessions)
    for stream in READINGS:
        if stream not in compared and any(stream in session.series for session in sessions):
            found.append(f"Not every session has a {SENSORS[stream].title}, so none is used.")
    lacking = [name for name in channel_names(len(problem.scene.joints), compared) if name not in problem.channels]
    if lacking:
        found.append(f"Not measured throughout, and left out: {', '.join(lacking)}.")
    return found
