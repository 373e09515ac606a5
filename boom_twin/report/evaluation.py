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


class Evaluator:
    """Evaluation of a replay block by block. Its `add` is the function to give to `boom_twin.offline.replay.replay_into`.

    Fatigue is computed for a detail `category` (MPa), without one not at all.
    """

    def __init__(self, scene: Scene, category: float | None = None) -> None:
        self._scene, self._category = scene, category
        self._history, self._quantities, self._rests = HistoryBuilder(scene), QuantityBuilder(scene), RestFinder(scene)
        self._fatigue = None if category is None else FatigueCounter(scene, category)

    def add(self, stretch: Stretch) -> None:
        """Add the next block of the replay."""
        own = self._history.add(stretch)
        self._quantities.add(own, stretch.estimates.load, stretch.estimates.load_variance)
        if self._fatigue is not None:
            self._fatigue.add(own)
        self._rests.add(own, stretch.estimates.load)

    def finish(self, result: Replay, folder: Path) -> Evaluation:
        """Return the evaluation of the replay and write its figures into `folder`; to be called once."""
        rests = self._rests.finish()
        found = self._quantities.quantities(result.recording.totals.tip_sigma, rests)
        history, loads = self._history.history(result.recording), self._quantities.loads.most_loaded()
        fatigue = [] if self._fatigue is None else self._fatigue.results()
        write(folder, self._scene, found)
        return Evaluation(result, self._scene, history, rests, loads, fatigue, self._category, found)


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

    `category` is that of `Evaluator`; `also` is given each stretch too.
    """
    evaluator = Evaluator(scene.scene, category)

    def take(stretch: Stretch) -> None:
        evaluator.add(stretch)
        if also is not None:
            also(stretch)

    return evaluator.finish(replay_into(building, bag, scene, settings, options, take), building)
