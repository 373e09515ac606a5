"""Recording of a replay: predictions of one stretch of the session at a time, totals, and ``summary.json``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.load_spectrum import TipLoad, TipLoadFinder
from ..analysis.sample_series import ColumnStatistics
from ..config.settings import Settings
from ..health.alarms import Alarms, evidence_with_cause
from ..health.sensor_monitor import noise_as_text
from ..predictions import Clock
from ..system.files import sha256_of
from ..twin.blocks import CODES, STREAMS, EstimateBlock, PredictionBlock, ReportBlock, SampleBlock, joined
from ..types import NANO, SENSORS, USUAL_STREAMS, Alarm, Array, Health, Stream, StrokeReading, channels_of
from .ground_truth import TipErrors

STRETCH = 2**14  # predictions in a stretch, at least: 82 s at 200 Hz, some 30 MB


class ResidualRows(NamedTuple):
    """Residuals of one stream."""

    names: tuple[str, ...]  # of its channels
    stamps: NDArray[np.int64]  # ns; shape (k,)
    # values, sigmas: measured minus predicted in the unit of the sensor, NaN where not measured; standard deviation expected of
    # it; shape (k, channels)
    values: Array
    sigmas: Array

    @property
    def normalised(self) -> Array:
        """Residuals over their expected standard deviations, shape (k, channels)."""
        return self.values / self.sigmas


@dataclass(frozen=True)
class Stretch:
    """Part of a session, with all predictions and residuals in it."""

    joints: int  # of the boom
    block: ReportBlock
    health: list[Health]
    first: int  # stamp of the first prediction of the session, ns
    samples: list[SampleBlock]  # read meanwhile
    reads: StrokeReading  # of the strokes of the predictions
    streams: Collection[Stream]  # of the session's sensors
    length: float  # of the whole session, s, by its log times; 0 if it is not known

    @property
    def predictions(self) -> PredictionBlock:
        """All predictions of the stretch."""
        return self.block.predictions

    @property
    def estimates(self) -> EstimateBlock:
        """Estimates beside the predictions."""
        return self.block.estimates

    def residuals_of(self, stream: Stream) -> ResidualRows:
        """Return the residuals of one stream."""
        rows, names = self.block.residuals, channels_of(self.joints)[stream]
        own = rows.streams == CODES[stream]
        return ResidualRows(names, rows.stamps[own], rows.values[own, : len(names)], rows.sigmas[own, : len(names)])


class SessionTotals:
    """Totals over all predictions and residuals of a session, without the values themselves."""

    def __init__(self, joints: int) -> None:
        self.samples, self.acceleration = 0, 0.0  # predictions; largest acceleration of the tip, m/s^2
        # of the joints, rad, and over the expected deviations
        self.residuals, self.normalised = ColumnStatistics(joints), ColumnStatistics(joints)
        self.tip_sigmas: Array = np.full(2, np.nan)  # largest standard deviation of the predicted tip's x and y, m
        self.tip_sigma: float | None = None  # the largest of both together, m
        self.load = TipLoadFinder()  # of the load at the tip that the model does not know

    def add(self, stretch: Stretch) -> None:
        angles, predictions = stretch.residuals_of(Stream.ANGLES), stretch.predictions
        self.residuals.add(angles.values)
        self.normalised.add(angles.normalised)
        for sigmas in (health.tip_sigmas for health in stretch.health):
            self.tip_sigmas = np.fmax(self.tip_sigmas, sigmas)
            if np.isfinite(sigmas).all():
                self.tip_sigma = max(self.tip_sigma or 0.0, float(np.hypot(*sigmas)))
        if not len(predictions.stamps):
            return
        self.samples += len(predictions.stamps)
        self.load.add(predictions.stamps, stretch.estimates.load, stretch.estimates.load_variance)
        self.acceleration = float(np.fmax(self.acceleration, np.hypot(*predictions.tip_acceleration.T).max()))


class ReadOut:
    """Resolution of a stream: the smallest change from one reading to the next of any of its sensors."""

    def __init__(self) -> None:
        self._steps: dict[int, float] = {}  # by the code of their stream

    def add(self, samples: SampleBlock) -> None:
        """Add a block of samples."""
        for code in np.unique(samples.streams).tolist():
            changes = np.abs(np.diff(samples.values[samples.streams == code], axis=0))
            self._steps[code] = min(self._steps.get(code, np.inf), changes[changes > 1e-9].min(initial=np.inf))

    def coarse(self, settings: Settings) -> dict[str, list[str]]:
        """Return a sentence for each stream with a step q where q^2 / 12 exceeds the stated variance s^2 + r^2 / 12."""
        found = []
        for code, q in self._steps.items():
            kind = SENSORS[STREAMS[code]]
            if kind.resolution and np.isfinite(q) and q**2 > 12.0 * settings.variance(kind):
                told = f"{kind.title}: readings come in steps of {q:g} {kind.unit}: set {kind.resolution} to that"
                found.append(f"{told}, or sensors look stuck or noisy")
        return {"read_out": found} if found else {}


class Recording:
    """Recording of a replay's results, in the order of the session.

    `take` receives every `Stretch` of the session, and the recording keeps none. Without `take`, the recording keeps the
    session as one stretch. `errors` receives all predictions for which the truth is known.
    """

    def __init__(
        self,
        joints: int,
        take: Callable[[Stretch], None] | None = None,
        errors: TipErrors | None = None,
        reads: StrokeReading = StrokeReading.LENGTH,
        streams: Collection[Stream] = USUAL_STREAMS,
        length: float = 0.0,
    ) -> None:
        self._joints, self._take, self._errors, self.reads, self._streams = joints, take, errors, reads, streams
        self._length = length
        self._parts: list[ReportBlock] = []
        self._health: list[Health] = []
        self._samples: list[SampleBlock] = []
        self._alarms, self.read_out = Alarms(), ReadOut()
        self._newest: int | None = None
        self.first = 0  # stamp of the first prediction, ns
        self._count = self._before = 0  # predictions so far, and those in earlier stretches
        self._whole: Stretch | None = None
        self.gaps: list[tuple[int, int]] = []  # stamps (ns) between which strokes paused
        self.clock_sets: list[tuple[int, int]] = []  # stamps (ns) before and after a clock was set back
        self.refused = 0  # samples that were not used
        self.is_judged = False  # whether the rig's health was
        self.noise: Mapping[str, float] = {}  # see `Health.noise`; the newest
        self.totals = SessionTotals(joints)  # of all stretches that are complete

    def add(self, rows: ReportBlock, samples: SampleBlock) -> None:
        self._samples.append(samples)
        self.read_out.add(samples)
        self._parts.append(rows)
        stamp_only = {"leap", "late", "second source"}  # values of such samples are not used
        for row, note in rows.notes.items():
            self.refused += not note.accepted or not stamp_only.isdisjoint(note.events)
            self._note_time(rows.predictions, row, frozenset(note.events))
        stamps = rows.predictions.stamps
        if len(stamps):
            self.first = int(stamps[0]) if self._newest is None else self.first
            self._newest = int(stamps[-1])
            self._count += len(stamps)
        for health in rows.health.values():
            self.is_judged, self.noise = True, health.noise
            self._health.append(health)
            self._alarms.take(health)
        if self._take is not None and self._count - self._before >= STRETCH:
            self._complete()

    def _note_time(self, predictions: PredictionBlock, row: int, events: frozenset[str]) -> None:
        """Store where stamps stepped: the stamp before, and that of the sample in `row`, if it was followed."""
        at = int(np.searchsorted(predictions.at, row))
        if at == len(predictions.at) or predictions.at[at] != row:
            return
        before = int(predictions.stamps[at - 1]) if at else self._newest
        for found, kinds in ((self.gaps, {"gap", "restart"}), (self.clock_sets, {"jump back"})):
            if before is not None and events & kinds:
                found.append((before, int(predictions.stamps[at])))

    def close(self) -> None:
        """Complete the last stretch; to be called once, after the last `add`."""
        self._complete()

    @property
    def is_empty(self) -> bool:
        return self._newest is None

    def _complete(self) -> None:
        """Make a stretch of what came since the last one, add it to the totals, and give it away or keep it."""
        stretch = self._stretch()
        self._parts, self._health, self._samples = [], [], []
        if stretch is None:
            return
        self.totals.add(stretch)
        if self._errors is not None:
            self._errors.add(stretch.predictions, stretch.estimates)
        self._before = self._count
        if self._take is None:
            self._whole = stretch
        elif len(stretch.predictions.stamps):
            self._take(stretch)

    def _stretch(self) -> Stretch | None:
        parts = [part for part in self._parts if len(part.predictions.stamps) or len(part.residuals.stamps)]
        own = self._health, self.first, self._samples, self.reads, self._streams, self._length
        return Stretch(self._joints, joined(parts), *own) if parts else None

    @property
    def whole(self) -> Stretch:
        """Session so far as one stretch; only for a recording that keeps it."""
        found = self._whole or self._stretch()
        if self._take is not None or found is None:
            raise ValueError("the stretches of this recording were given away")
        return found

    @property
    def duration(self) -> float:
        """Time from the first prediction to the last, s, in the model's own time.

        Steps of a clock that was set are not part of it.
        """
        span = (self._newest or 0) - self.first
        return (span - sum(after - before for before, after in self.clock_sets)) * NANO

    def alarms(self) -> list[Alarm]:
        """Return all alarms, each once with its latest values, in the order of their beginning."""
        return sorted(self._alarms.all, key=lambda alarm: alarm.since)


def summary_of(recording: Recording, counts: Counter[str], wall: float, file: Path | None) -> dict[str, Any]:
    """Return the numbers of a replay for ``summary.json``."""
    totals, duration = recording.totals, recording.duration
    return {
        "samples": totals.samples,
        "duration_s": duration,
        "wall_s": wall,
        "realtime_factor": duration / wall,
        "dropped": recording.refused,
        "outside_validity": counts["deflected"],
        "events": dict(sorted(counts.items())),
        "joint_residual_rms_rad": totals.residuals.rms,
        "joint_residual_normalised_mean": totals.normalised.mean,
        "joint_residual_normalised_std": totals.normalised.deviation,
        "tip_acceleration_max_m_s2": totals.acceleration,
        **_load(totals.load.load),
        **recording.noise,
        "output_sha256": None if file is None else sha256_of(file),
        "alarms": _alarms(recording, recording.first),
    }


def clocks_of(clocks: Mapping[Stream, Clock]) -> dict[str, Any]:
    """Return the lags and drifts that were estimated, as at the end; empty without any."""
    if not clocks:
        return {}
    found = list(clocks.values())
    return {
        "lag_streams": [stream.value for stream in clocks],
        "lags_s": [clock.lag for clock in found],
        "lag_sigmas_s": [clock.lag_sigma for clock in found],
        "clock_drifts_ppm": [1e6 * clock.drift for clock in found],
        "clock_drift_sigmas_ppm": [1e6 * clock.drift_sigma for clock in found],
    }


def _alarms(recording: Recording, first: int) -> list[dict[str, Any]]:
    """Return gaps, clock steps and health alarms in the order of their beginning; seconds since the stamp `first`."""
    drive = recording.reads.stream.value
    gaps = [Alarm(drive, "gap", start, end, None, f"for {(end - start) * NANO:.2f} s") for start, end in recording.gaps]
    gaps += [
        Alarm(drive, "clock", start, start, None, f"stamps go on at {(end - first) * NANO:.3f} s{f', {n} times' * (n > 1)}")
        for (start, end), n in Counter(recording.clock_sets).items()
    ]
    return [
        {
            "channel": alarm.channel,
            "kind": alarm.kind,
            "from_s": max(0.0, (alarm.since - first) * NANO),
            "to_s": None if alarm.until is None else (alarm.until - first) * NANO,
            "cause": alarm.cause,
            "told": alarm.told,
            "evidence": evidence_with_cause(alarm.evidence, ((rank.cause, rank.probability) for rank in alarm.ranked)),
            "ranked": [{"cause": rank.cause, "probability": rank.probability} for rank in alarm.ranked],
        }
        for alarm in sorted([*gaps, *recording.alarms()], key=lambda alarm: alarm.since)
    ]


def alarm_as_text(alarm: dict[str, Any]) -> str:
    """Return an alarm of ``summary.json`` in words."""
    end = "the end" if alarm["to_s"] is None else f"{alarm['to_s']:.2f} s"
    evidence = f" ({alarm['evidence']})" if alarm["evidence"] else ""
    return f"{alarm['channel']}, {max(0.0, alarm['from_s']):.2f} s to {end}: {alarm['told']}{evidence}"


def noise_told(summary: dict[str, Any]) -> list[str]:
    """Return advice on settings of noise and resolution; none while a sensor is wired otherwise, as in another unit."""
    if any(alarm["kind"] == "wiring" for alarm in summary["alarms"]):
        return []
    return [*summary.get("read_out", []), *noise_as_text(summary)]


def _load(load: TipLoad | None) -> dict[str, Any]:
    """Return the numbers of the unknown load at the tip; empty where only strokes were measured."""
    if load is None:
        return {}
    pulses = load.pulses
    return {
        "tip_load": load.text,
        "tip_load_rms_N": load.rms,
        "tip_load_sigma_N": load.sigma,
        "tip_load_pulses_N": None if pulses is None else pulses.height,
        "tip_load_pulses_sigma_N": None if pulses is None else pulses.height_sigma,
        "tip_load_frequency_Hz": None if pulses is None else pulses.frequency,
        "tip_load_frequency_sigma_Hz": None if pulses is None else pulses.frequency_sigma,
    }
