"""Thresholds of ``/diagnostics``, for the node and the recorder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from .parameter_file import checked, read_parameters

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Share = Annotated[float, Field(gt=0, le=1)]
Probability = Annotated[float, Field(gt=0, lt=1)]


class Thresholds(BaseModel):
    """What ``/diagnostics`` judges by; SI units. They can change at any time, and have no part in what is predicted."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    raise_after: NotNegative = Field(default=2.0, description="time for which a limit is passed before it is told, s")
    clear_after: NotNegative = Field(default=5.0, description="time for which all is well again before it is told, s")
    release: Share = Field(default=0.8, description="share of a limit below which its level is left")
    stale_after: Positive = Field(default=2.0, description="a sensor without readings for so long is stale, s")
    gap_warn: Positive = Field(default=0.1, description="a longer step between two stamps of a sensor is told, s")
    unusable_warn: Share = Field(default=0.01, description="share of readings missing or out of range: warning")
    unusable_error: Share = Field(default=0.5, description="share of readings missing or out of range: error")
    frozen_after: Positive = Field(default=1.0, description="a reading unchanged for so long, at least, is frozen, s")
    frozen_false_alarm: Probability = Field(
        default=1e-9, description="probability that a live sensor is taken for frozen, for each reading"
    )
    clock_offset: Positive = Field(default=0.05, description="clocks of two streams that differ by more are told, s")
    stamp_offset: Positive = Field(default=1.0, description="stamps and node's clock that differ by more are told once, s")
    residual_window: Positive = Field(default=10.0, description="time over which a residual is judged, s")
    residual_warn: Positive = Field(default=2.0, description="root mean square of a normalised residual: warning")
    residual_error: Positive = Field(default=4.0, description="root mean square of a normalised residual: error")
    load_warn: Positive = Field(default=0.5, description="time of a step over the time between strokes: warning")
    load_error: Positive = Field(default=0.9, description="time of a step over the time between strokes: error")
    unread_warn: Share = Field(default=0.01, description="share of messages lost, or given way to newer ones: warning")
    unread_error: Share = Field(default=0.5, description="share of messages lost, or given way to newer ones: error")
    wait_warn: Positive = Field(default=0.1, description="messages wait for their turn for longer: warning, s")
    wait_error: Positive = Field(default=1.0, description="messages wait for their turn for longer: error, s")
    lag_warn: Positive = Field(default=2.0, description="recorded messages not on the disk for so long: warning, s")
    lag_error: Positive = Field(default=5.0, description="recorded messages not on the disk for so long: error, s")
    disk_warn: Positive = Field(default=1800.0, description="the disk is full in less, at the present pace: warning, s")
    disk_error: Positive = Field(default=120.0, description="the disk is full in less, at the present pace: error, s")


def thresholds_from(values: dict[str, Any], source: str) -> Thresholds:
    """Thresholds from names and values; UsageError names every value that is out of bounds."""
    return checked(Thresholds, values, source)


def load_thresholds(path: Path) -> Thresholds:
    """Thresholds from a ROS parameter file; other parameters in it are passed over."""
    values = read_parameters(path)
    return thresholds_from({name: value for name, value in values.items() if name in Thresholds.model_fields}, str(path))
