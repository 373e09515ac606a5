"""Numbers of a replay for ``summary.json``, and its alarms in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..deviation.load_spectrum import TipLoad
from ..health.alarms import evidence_with_cause
from ..system.received_files import sha256_of
from ..types import NANO, Alarm, Clock, Stream
from .recording import Recording


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
        Alarm(drive, "clock", start, start, None, f"stamps go on at {(end - first) * NANO:.3f} s")
        for start, end in recording.clock_sets
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
