"""Model of the twin under one load, and its preparation in a thread while the present model takes the samples.

A model takes some hundredths of a second, and depends on scene and settings alone. A sample would wait for it; prepared beside,
it is taken in between two samples. The `Change` of the stroke sample that it takes effect with is recorded, as any other, and a
replay makes the same model at the same sample.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from threading import Thread
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.doubts import VALID_DEFLECTION
from ..config.settings import Settings
from ..deviation.predictor import BoomPredictor
from ..errors import BoomTwinError
from ..health.monitor import HealthMonitor
from ..scene.edit import loaded
from ..scene.schema import Scene
from ..types import GIVE, NANO, SECOND, SENSORS, Mount, Place, Stream, StrokeReading
from .blocks import CODES
from .regular import NOISE_REACH
from .state import Limits

if TYPE_CHECKING:
    from .twin import Twin

SWITCH = 5e-4
"""Most time (s) that a sample waits for the interpreter while a model is prepared in the other thread."""


SWAY = 0.5  # rad, by which an inclinometer that drives the model may be off its estimate at once while its section shakes


def limits_of(scene: Scene, boom: BoomPredictor, settings: Settings, absent: Collection[str], reads: StrokeReading) -> Limits:
    """Return the limits of the compiled update for `boom`, that of `scene` with its load, and for its sensors."""
    channels = list(boom.channels.values())
    counts = np.array([len(names) for names in channels])
    far = NOISE_REACH * settings.variance(SENSORS[reads.stream]) ** 0.5
    low, high = np.zeros(boom.plan.joints), np.array([joint.cylinder.max_stroke for joint in scene.joints])
    absolute = boom.posture.absolute
    if reads is StrokeReading.ANGLE:
        far += SWAY * boom.posture.sways.any()
        low, high = np.radians([joint.range_deg for joint in scene.joints]).T
        low, high = np.where(absolute, -np.inf, low - GIVE), np.where(absolute, np.inf, high + GIVE)
        counts[CODES[Stream.STROKES]] = 0
    return Limits(
        gap=round(settings.gap * SECOND),
        leap=settings.leap / NANO,
        drive=CODES[reads.stream],
        far=far,
        rate=settings.rate(reads),
        shortest=low - far,
        longest=high + far,
        turns=absolute & (reads is StrokeReading.ANGLE),
        valid=VALID_DEFLECTION * scene.reach,
        gravity=np.array(boom.plan.tables.gravity),
        absolute=absolute,
        absent=np.array([name in absent for names in channels[1:] for name in names]),
        first=np.concatenate([[0], np.cumsum(counts[1:]) - counts[1:]]),
        channels=counts,
    )


@dataclass(frozen=True)
class LoadedModel:
    """Parts of the twin's model that depend on the load, and `scene` with that load."""

    scene: Scene
    limits: Limits
    boom: BoomPredictor
    judge: HealthMonitor | None


def loaded_model(
    scene: Scene,
    settings: Settings,
    mounts: Sequence[Mount | None],
    health: bool,
    reads: StrokeReading,
    absent: Collection[str],
    places: Mapping[str, Place],
    lagging: Collection[Stream],
) -> LoadedModel:
    """Return the model of `scene` under the load of `settings`; for the parameters see `boom_twin.Twin`."""
    scene = loaded(scene, *settings.load)
    boom = BoomPredictor(scene, settings, mounts, reads, places, lagging)
    judge = HealthMonitor(scene, settings, tuple(mounts), absent, boom.channels, reads, places) if health else None
    _ = boom.held  # made here, where no sample waits for it
    return LoadedModel(scene, limits_of(scene, boom, settings, absent, reads), boom, judge)


class ModelPreparation:
    """Preparation of the models that new live settings need, in a thread; requests the settings once the model is ready."""

    def __init__(self, twin: Twin) -> None:
        self._twin = twin
        self._asked: dict[str, float] = {}
        self._thread: Thread | None = None
        self._made: tuple[Settings, LoadedModel | None] | None = None

    def tune(self, live: Mapping[str, float]) -> None:
        """Request other live settings; UsageError, and nothing requested, if a value is out of bounds."""
        self._twin.requests.settings.tuned({**self._asked, **live})
        self._asked.update(live)
        if self._thread is None:
            self._go_on()

    def take_in(self) -> None:
        """Request what is ready; call it between two samples, in the thread that updates the twin."""
        if self._thread is not None and not self._thread.is_alive():
            self._thread = None
            self._go_on()

    def finish(self) -> None:
        """Wait until all requested models are ready, and request them; for use where no sample waits."""
        while self._thread is not None:
            self._thread.join()
            self.take_in()

    def close(self) -> None:
        """Stop requesting; return when the other thread has ended."""
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _go_on(self) -> None:
        requests, made = self._twin.requests, self._made
        settings = requests.settings.tuned(self._asked)
        if settings.load == requests.settings.load or (made is not None and made[0] == settings):
            requests.tune(self._asked, made[1] if made is not None and made[0] == settings else None)
            self._asked, self._made = {}, None
            return
        self._thread = Thread(target=self._make, args=(settings,), name="model")
        self._thread.start()

    def _make(self, settings: Settings) -> None:
        self._made = settings, None  # should it fail, the twin makes it, and fails, at a sample
        usual = sys.getswitchinterval()
        sys.setswitchinterval(SWITCH)
        try:
            with suppress(BoomTwinError):
                self._made = settings, self._twin.model(settings)
        finally:
            sys.setswitchinterval(usual)
