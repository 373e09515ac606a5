"""Evaluation of a replay while it runs: its history for pictures, its figures, what was measured while the boom stood still."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..bag.session_model import SessionScene
from ..config.settings import Settings
from ..offline.history import HistoryBuilder
from ..offline.inputs import USUAL, ReplayOptions
from ..offline.recording import Stretch
from ..offline.replay import Replay, replay_into
from ..plots import History
from ..scene.schema import Scene
from .fatigue import Fatigue, FatigueCounter
from .quantities import Load, Quantity, QuantityBuilder, write
from .vibration import RestFinder, RestPeriod


@dataclass(frozen=True)
class Evaluation:
    """Contents of the report of a replay."""

    result: Replay
    scene: Scene
    history: History
    rests: list[RestPeriod]
    loads: list[Load]  # of all stations, that of the largest stress first
    fatigue: list[Fatigue]  # of all stations, if it was asked for
    category: float | None  # detail category (MPa) that it was asked for
    quantities: list[Quantity]

    @property
    def has_heights(self) -> bool:
        """Return True if the stresses are by heights that the scene gives."""
        return all(part.height for part in self.scene.sections if part.beam is not None)


def evaluated_replay(
    building: Path,
    bag: str | Path,
    scene: SessionScene,
    settings: Settings,
    options: ReplayOptions = USUAL,
    category: float | None = None,
    also: Callable[[Stretch], None] | None = None,
) -> Evaluation:
    """Replay a session into the folder `building` as `replay_into` does, with its figures; return its evaluation.

    Fatigue is computed for a detail `category` (MPa), without one not at all. `also` is given each stretch too.
    """
    history, quantities, finder = HistoryBuilder(scene.scene), QuantityBuilder(scene.scene), RestFinder(scene.scene)
    rests = list[RestPeriod]()
    fatigue = None if category is None else FatigueCounter(scene.scene, category)

    def take(stretch: Stretch) -> None:
        own, estimates = history.add(stretch), stretch.estimates
        quantities.add(own, estimates.load, estimates.load_variance)
        rests.extend(finder.find(own, estimates.load))
        if fatigue is not None:
            fatigue.add(own)
        if also is not None:
            also(stretch)

    result = replay_into(building, bag, scene, settings, options, take)
    found = quantities.quantities(result.recording.totals.tip_sigma, rests)
    write(building, scene.scene, found)
    return Evaluation(
        result,
        scene.scene,
        history.history(result.recording),
        rests,
        quantities.loads.most_loaded(),
        [] if fatigue is None else fatigue.results(),
        category,
        found,
    )
