"""Evaluation of a replay while it runs: its history for pictures, its figures, what was measured while the boom stood still."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..bag.session_model import baseline_of
from ..config.settings import Settings
from ..offline.history import HistoryBuilder
from ..offline.recording import Stretch
from ..offline.replay import Replay
from ..plots import History
from ..scene.schema import Scene
from ..types import Array
from .quantities import Load, QuantityBuilder, write
from .vibration import HoldFinder, HoldInterval


@dataclass(frozen=True)
class Evaluation:
    """What a replay showed.

    Attributes
    ----------
    history : History
    still : list of HoldInterval
    loads : list of Load
        Of the flexible sections.
    file : Path
        Where the figures are.
    """

    history: History
    still: list[HoldInterval]
    loads: list[Load]
    file: Path


class Evaluator:
    """Evaluates the stretches of a replay; its `add` is what `boom_twin.offline.replay.replay_into` is to give them to.

    Parameters
    ----------
    scene : Scene
    settings : Settings
        Of the replay.
    baseline : Path, optional
        As for the replay.
    """

    def __init__(self, scene: Scene, settings: Settings, baseline: Path | None) -> None:
        self._scene, self._settings, self._baseline = scene, settings, baseline
        self._history = HistoryBuilder(scene)
        self._quantities, self._holds = QuantityBuilder(scene), HoldFinder(scene)

    def add(self, stretch: Stretch) -> None:
        """Take the next stretch in."""
        own = self._history.add(stretch)
        self._quantities.add(own)
        self._holds.add(own)

    def finish(self, result: Replay, folder: Path, heights: Array | None = None) -> Evaluation:
        """What came out of the replay, whose figures are written into `folder`; to be called once.

        Parameters
        ----------
        result : Replay
        folder : Path
        heights : ndarray, shape (n,), optional
            Of the sections, m, for the stresses; by default those of thin-walled boxes.
        """
        still, usual = self._holds.finish(), baseline_of(result.session.path, self._baseline).baseline
        found = self._quantities.quantities(result.recording.totals.tip_sigma, still, self._settings, usual)
        file = write(folder, self._scene, found)
        return Evaluation(self._history.history(result.recording), still, self._quantities.loads(heights), file)
