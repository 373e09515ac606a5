"""Baseline of a healthy rig: bias and spread of parameters, sensors and model error. A twin with a baseline judges health."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from ..config.settings import checked
from ..config.yaml_text import read_plain
from ..errors import UsageError

DEFAULT_FILE = Path(str(files("boom_twin") / "msg_config" / "baseline.yaml"))
REMEDY = "Give a file with the keys of the package's own, msg_config/baseline.yaml."

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Row = list[Finite]


class Baseline(BaseModel):
    """Content of a baseline file, SI units."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    description: str = Field(default="nothing learnt", description="where it comes from")
    sessions: tuple[str, ...] = Field(default=(), description="that it was learnt from")
    names: tuple[str, ...] = Field(default=(), description="parameters that were learnt, cause:kind")
    mean: Row = Field(default=[], description="of these")
    covariance: list[Row] = Field(default=[], description="of these")
    angle_error: Positive = Field(default=5e-5, description="deviation of the model's error of an angle in one posture, rad")
    force_error: Positive = Field(default=0.02, description="likewise of the IMU's readings, m/s^2")
    angle_noise: Positive = Field(default=1.0, description="noise of the angles over what sensors are stated to have")
    force_noise: Positive = Field(default=1.9, description="likewise of the IMU; the look ahead adds to it")
    detuning: Positive = Field(default=0.01, description="share by which natural frequencies may be wrong")
    frequency_error: Positive = Field(
        default=0.01, description="likewise of those that are measured in holds, with the parameters' part taken out"
    )


def load_baseline(path: Path | None = None) -> Baseline:
    """Return the baseline of a YAML file, by default the package's own. UsageError names every invalid value."""
    path = DEFAULT_FILE if path is None else path
    return baseline_from(read_plain(path, UsageError, REMEDY), str(path))


def baseline_from(content: object, source: str) -> Baseline:
    """Return a baseline from the plain values of its file. UsageError names `source` and every invalid value."""
    if not isinstance(content, dict):
        raise UsageError(f"{source}: not a baseline. {REMEDY}")
    return checked(Baseline, {str(key): value for key, value in content.items()}, source)
