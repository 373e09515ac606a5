"""Status of the bending stresses: the newest at every station, with what sensors know beyond the prediction."""

from __future__ import annotations

import math

from ..analysis.bending_moments import stations
from ..analysis.bending_stress import BendingStressModel
from ..scene.schema import Scene
from ..types import Estimate, Prediction, StrokeReading
from .levels import ComponentJudge, Evaluation, Status

MEGA = 1e6


def stress_watch(scene: Scene, reads: StrokeReading = StrokeReading.LENGTH) -> StressWatch | None:
    """Return the report of a boom's stresses; `reads`: how strokes of predictions are read. None if no section bends."""
    return StressWatch(BendingStressModel(scene, reads=reads)) if stations(scene) else None


class StressWatch:
    """Report of bending moments and stresses at the newest stamp. They are never a fault, because no limit is known.

    Parameters
    ----------
    model : BendingStressModel
    """

    def __init__(self, model: BendingStressModel) -> None:
        self._model, self._judge = model, ComponentJudge("bending")

    def status(self, prediction: Prediction, estimate: Estimate | None, at: Evaluation) -> Status:
        """Return moment, stress and its deviation at every station, from a prediction and the estimate beside it."""
        found, judge, places = self._model.at(prediction, estimate), self._judge, self._model.stations
        judge.begin(at)
        columns = found.moments, found.stresses, found.stress_sigmas
        for station, moment, stress, sigma in zip(places, *columns, strict=True):
            name = f"{station.key}_m"
            judge.note(f"{name}_Nm", float(moment))
            judge.note(f"{name}_MPa", float(stress) / MEGA)
            judge.note(f"{name}_sigma_MPa", float(sigma) / MEGA)
        most = int(abs(found.stresses).argmax())
        sigma = float(found.stress_sigmas[most])
        deviation = f" ± {sigma / MEGA:.2g}" if math.isfinite(sigma) else ""
        largest = f"{found.stresses[most] / MEGA:.3g}{deviation} MPa"
        return judge.finish(f"{largest} in {places[most].name}, the most of all stations")
