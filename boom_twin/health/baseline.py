"""Baseline of a healthy rig: bias and spread of parameters, sensors and model error, learnt from its sessions or assumed."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ..config.settings import checked
from ..config.yaml_text import read_plain
from ..errors import UsageError
from ..types import Array, Stream, channels_of
from .inference.fault_catalogue import Parameter, variances

DEFAULT_FILE = Path(str(files("boom_twin") / "msg_config" / "baseline.yaml"))
REMEDY = "Give a file written by `boom_twin calibrate --baseline`."

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Row = list[Finite]


JUDGED = {Stream.ANGLES: "angle", Stream.IMU: "force"}
"""The streams whose residuals are judged, and how the keys of a baseline begin that are of them."""


def judged_channels(joints: int) -> tuple[str, ...]:
    """Names of the channels whose residuals are judged: ``joint_1``, .., ``tip_imu_x``, ``tip_imu_z``."""
    known = channels_of(joints)
    return tuple(name for stream in JUDGED for name in known[stream])


class Baseline(BaseModel):
    """A baseline as its file has it; SI units. Its channels are those of `judged_channels`, c of them.

    Without learning, parameters may be off by what `boom_twin.health.inference.fault_catalogue` calls healthy.
    """

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

    def errors(self, joints: int) -> Array:
        """Deviation of the model's error of every channel, shape (c,)."""
        return self._by_channel("error", joints)

    def noise(self, joints: int) -> Array:
        """Factors on the noise of every channel, shape (c,)."""
        return self._by_channel("noise", joints)

    def _by_channel(self, what: str, joints: int) -> Array:
        known = channels_of(joints)
        return np.array([getattr(self, f"{key}_{what}") for stream, key in JUDGED.items() for _ in known[stream]])

    def healthy(self, known: tuple[Parameter, ...]) -> tuple[Array, Array]:
        """Mean (parameters,) and covariance (parameters, parameters) of all parameters while all is well.

        Raises
        ------
        UsageError
            It was learnt on another boom, or mean and covariance are none of its names.
        """
        place = {each.name: i for i, each in enumerate(known)}
        if strange := [name for name in self.names if name not in place]:
            raise UsageError(f"baseline: this boom has no {', '.join(strange)}. Learn a baseline with its own scene.")
        size = len(self.names)
        if len(self.mean) != size or len(self.covariance) != size or any(len(row) != size for row in self.covariance):
            raise UsageError("baseline: mean and covariance are not of the size of names. Learn it anew.")
        mean, covariance = np.zeros(len(known)), np.diag(variances(known, "healthy"))
        at = [place[name] for name in self.names]
        mean[at] = self.mean
        if at:
            covariance[np.ix_(at, at)] = self._checked_covariance()
        return mean, covariance

    def _checked_covariance(self) -> Array:
        """The covariance, if it is one."""
        covariance = np.array(self.covariance)
        scale = np.sqrt(np.abs(np.diag(covariance))) + 1e-300
        scaled = covariance / np.outer(scale, scale)
        if np.abs(scaled - scaled.T).max() > 1e-6 or np.linalg.eigvalsh(scaled).min() < -1e-6:
            raise UsageError("baseline: covariance must be symmetric and without negative variances. Learn it anew.")
        return covariance


def load_baseline(path: Path | None = None) -> Baseline:
    """A baseline from its file (YAML), the package's own if no path is given; UsageError names every value that cannot be."""
    path = DEFAULT_FILE if path is None else path
    return baseline_from(read_plain(path, UsageError, REMEDY), str(path))


def baseline_from(content: object, source: str) -> Baseline:
    """A baseline from the plain values of its file; UsageError, with the name of the source, as `load_baseline`."""
    if not isinstance(content, dict):
        raise UsageError(f"{source}: not a baseline. {REMEDY}")
    return checked(Baseline, {str(key): value for key, value in content.items()}, source)
