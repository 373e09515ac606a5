"""Modes of the present posture for the estimate of the tip: how deviations move, what drives them, how sensors read them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.bending_moments import flexibility_by_station, moments_by_unknowns, stations
from ..analysis.modal import StrokeNoise
from ..compiler.plan import Plan
from ..config.settings import Settings
from ..kernels.elements.linkage import levers
from ..kernels.jit import hold
from ..kernels.tables import State
from ..scene.oil_spring import middle_stiffness
from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..types import SENSORS, Array, Mount, Stream
from .cause_mixture import LEVELS
from .deviation_filter import ANGLES_STAMP, COUNT, FED, FIRST_LOAD, IMU_STAMP, MODES, SHARES, STAMP, STARTED, DeviationFilter
from .posture_modes import PostureMode, PostureModes
from .sensor_model import Mounting

LOADS = np.array([0.3, 31.0, 9.2, 3.0])
"""See `DeviationFilter.loads`, in loads that turn the joints by one standard deviation of their sensors: 6.5 N of the
default boom in posture arch, 21 N of the 36 m Z fold."""
STIFFEST = 1e-3  # of the boom's weight: most that such a load is taken for
HIGHEST = 25.0  # Hz; what is faster follows a load without vibration of its own
POSTURE_STEP = 0.03  # m of stroke after which the modes are made anew


class DeviationModes:
    """Keeps the modes in a `DeviationFilter` those of the present posture.

    Parameters
    ----------
    scene : Scene
        With its load.
    plan : Plan
        The same compiled.
    settings : Settings
    mounts : sequence of Mount or None
        Of the angle sensors.

    Attributes
    ----------
    filter : DeviationFilter
    postures : PostureModes
    """

    def __init__(self, scene: Scene, plan: Plan, settings: Settings, mounts: Sequence[Mount | None]) -> None:
        self._plan, self.postures = plan, PostureModes(scene, plan)
        self._bending = moments_by_unknowns(plan) * flexibility_by_station(scene)[:, None]
        mounting = Mounting(plan, scene.base.inclination, mounts)
        self.filter = _new_filter(scene, plan, settings, mounting)
        self._angle_variance = settings.angle_variance
        self._weight = weight_of(scene)
        self._motions: list[Array] = []
        self._at = np.full(plan.joints, math.inf)

    @cached_property
    def held(self) -> Any:
        """`filter` as compiled code takes it with every call, see `boom_twin.kernels.jit.hold`."""
        return hold(self.filter)

    def begin(self) -> None:
        """Begin a new run: nothing is known of the deviation."""
        self.filter.status[STARTED:] = 0
        self._at[:] = math.inf
        self._forget()
        self.expect_noise(1.0, 1.0)

    def _forget(self) -> None:
        """Begin anew from the prediction with the next strokes."""
        f = self.filter
        f.status[STARTED] = f.status[FED] = 0
        f.level[:] = f.loads[FIRST_LOAD]
        f.before[:], f.spread[:] = 0.0, 0.0

    def mask(self, masked: NDArray[np.bool_]) -> None:
        """Leave out the masked channels (c,); forget what a channel has shown that was used until now."""
        if (masked & ~self.filter.masked).any():
            self._forget()
        self.filter.masked[:] = masked

    def expect_noise(self, strokes: float, angles: float) -> None:
        """Expect so many times the noise that is stated, of strokes and of angle sensors."""
        self.filter.noisier[0] = strokes * strokes
        self.filter.noise[: len(self.filter.slopes)] = angles * angles * self._angle_variance

    @property
    def tip_variances(self) -> Array:
        """Mean square by which the predicted tip is off in x and y, as sensors show it, m^2, shape (2,); 0 without any."""
        spread = self.filter.spread
        return np.maximum(spread[0], spread[1]) if self.filter.status[FED] else np.zeros(2)

    def rebase(self, shift: int) -> None:
        """All stamps are later by `shift` (ns) from now on."""
        self.filter.status[STAMP] += shift
        self.filter.status[ANGLES_STAMP] += shift
        self.filter.status[IMU_STAMP] += shift

    def refresh(self, strokes: Array, angles: Array, live: State, noise: StrokeNoise) -> None:
        """Take other modes, about an equilibrium near `strokes` (m), shape (n,), if these have moved far enough.

        Parameters
        ----------
        angles : ndarray, shape (n,)
            Joint angles of the rigid boom, rad.
        live : State
            The boom; left as it is.
        noise : StrokeNoise
            As it is now.
        """
        if float(np.abs(strokes - self._at).max()) > POSTURE_STEP:
            self._make(strokes, angles, live)
        f, known = self.filter, min(len(noise.modes), int(self.filter.status[COUNT]))
        f.density[:] = 0.0
        f.density[:known] = 2.0 * f.noisier[0] * noise.collected[:known] * f.decay[:known] * f.omega[:known] ** 2

    def _make(self, strokes: Array, angles: Array, live: State) -> None:
        f, plan = self.filter, self._plan
        posture = self.postures.at(strokes, angles, live)
        modes, self._at = posture.lowest(MODES, 2.0 * math.pi * HIGHEST), posture.strokes
        kept = []
        for j, found in enumerate(modes):
            is_turned = j < len(self._motions) and float((plan.masses * found.mode.motion) @ self._motions[j]) < 0.0
            kept.append(self._put(j, found, -1.0 if is_turned else 1.0))
        f.softness[:], _ = plan.compliances_and_lags(plan.closed_lengths + strokes)
        levers(plan.tables.linkages, angles, f.slopes)
        self._keep_states(int(f.status[COUNT]), len(modes))
        self._motions, f.status[COUNT] = kept, len(modes)
        self._set_loads()

    def _keep_states(self, before: int, now: int) -> None:
        """Nothing is known of modes that come, as many as there are `now`; of forces' offsets as much as before."""
        f, first, n = self.filter, SHARES + 2 * self._plan.joints, self._plan.joints
        kept = first + 2 * min(before, now)
        old, new = (np.r_[:kept, first + 2 * count : first + 2 * count + n] for count in (before, now))
        x, p = f.x[old], f.p[np.ix_(old, old)]
        f.x[:], f.p[:] = 0.0, 0.0
        f.x[new], f.p[np.ix_(new, new)] = x, p

    def _set_loads(self) -> None:
        """What loads are usual: by how far they turn the joints, in standard deviations of the angle sensors."""
        f, tip, count = self.filter, self._plan.tables.tip, len(self._motions)
        if not count:
            return
        bends = np.array([motion[tip : tip + 2] for motion in self._motions]) / f.omega[:count, None] ** 2
        turns = f.turns[:count].T @ bends / math.sqrt(self._angle_variance)
        f.loads[:] = LOADS / max(float(np.linalg.norm(turns, 2)), 1.0 / (STIFFEST * self._weight))

    def _put(self, j: int, found: PostureMode, sign: float) -> Array:
        """A mode as number j of the filter, turned round if `sign` is -1; gives its motion."""
        f, mode = self.filter, found.mode
        f.omega[j] = 2.0 * math.pi * mode.frequency
        f.decay[j] = 2.0 * found.damping * f.omega[j]
        f.forces[j] = sign * mode.increments[self._plan.tables.cylinders.z]
        f.bending[j] = sign * (self._bending @ mode.increments)
        f.turns[j], f.relative[:, j] = sign * found.turns, sign * found.relative
        return np.asarray(sign * mode.motion)


def _new_filter(scene: Scene, plan: Plan, settings: Settings, mounting: Mounting) -> DeviationFilter:
    n, frames, places = plan.joints, len(plan.tables.operations) + 1, stations(scene)
    noise = [
        settings.variance(kind) for stream, kind in SENSORS.items() if stream is not Stream.STROKES for _ in kind.channels(n)
    ]
    size = SHARES + 3 * n + 2 * MODES
    return DeviationFilter(
        status=np.zeros(7, np.int64), omega=np.ones(MODES), decay=np.zeros(MODES), density=np.zeros(MODES),
        relative=np.zeros((frames, MODES, 3)), forces=np.zeros((MODES, n)), bending=np.zeros((MODES, len(places))),
        sections=np.array([each.section for each in places], np.int64),
        sections_off=np.array([settings.section_deviation * scene.is_flexible(i) for i in range(n)]),
        softness=np.array([1.0 / middle_stiffness(joint.cylinder) for joint in scene.joints]),
        slopes=np.ones(n), roots=mounting.roots, sensed=mounting.frames, absolute=mounting.absolute,
        noise=np.array(noise), masked=np.zeros(len(noise), bool),
        noisier=np.ones(1), reading=np.full(1, settings.stroke_variance), pulls=np.zeros(n),
        tip=np.zeros((MODES, 3)), turns=np.zeros((MODES, n)), lever=np.zeros((n, 3)),
        coupling=np.zeros((MODES, 4 + 2 * n)), drawn=np.zeros(n), ahead=np.zeros(n), variances=np.zeros(n), pushes=np.zeros(2),
        x=np.zeros(size), p=np.zeros((size, size)), row=np.zeros(size), gain=np.zeros(size), rows=np.zeros((8, size)),
        within=np.zeros((8, 8)), cross=np.zeros((8, n)), healed=np.zeros((LEVELS, 8, n)), inverse=np.zeros((LEVELS, n, n)),
        drag=np.zeros((LEVELS, n)), shifts=np.zeros((8, LEVELS * (n + 1))), chances=np.zeros(LEVELS * (n + 1) + 1),
        spread=np.zeros((2, 2)), level=np.zeros(2), loads=LOADS * STIFFEST * weight_of(scene),
        likely=np.zeros(5), before=np.zeros((2, 2)), now=np.zeros(6),
    )  # fmt: skip
