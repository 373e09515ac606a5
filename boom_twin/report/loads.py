"""Bending moment and stress of every flexible section where it is loaded most."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import UsageError
from ..moments import Station, stations
from ..records import Array
from ..scene.parts import Scene
from ..view import History
from ..view.moments import slow_part

BOX = 2.4
"""Height over radius of gyration of a thin-walled box, for sections whose height is not given."""


@dataclass(frozen=True, slots=True)
class Load:
    """The most loaded station of a section.

    Attributes
    ----------
    station : Station
    column : int
        Of `History.moments`.
    moment, time, static : float
        The largest moment in magnitude (N m), when (s), and the static part of it then (N m).
    height : float
        Of the section, m.
    stress : float
        Of its outermost fibre by bending, Pa.
    """

    station: Station
    column: int
    moment: float
    time: float
    static: float
    height: float
    stress: float


def loads(history: History, scene: Scene, heights: Array | None) -> list[Load]:
    """One for every flexible section; `heights` (n,) of the sections in m, or None to take them for thin-walled boxes."""
    places = stations(scene)
    found = []
    for section in sorted({station.section for station in places}):
        columns = [i for i, station in enumerate(places) if station.section == section]
        size = np.abs(history.moments[:, columns])
        row, best = np.unravel_index(int(size.argmax()), size.shape)
        column = columns[int(best)]
        moment, part = float(history.moments[row, column]), scene.sections[section]
        assert part.A is not None and part.I is not None
        height = BOX * math.sqrt(part.I / part.A) if heights is None else float(heights[section])
        static = float(slow_part(history, column)[row])
        stress = abs(moment) * height / 2.0 / part.I
        found.append(Load(places[column], column, moment, float(history.stamps_s[row]), static, height, stress))
    return found


def section_heights(text: str | None, scene: Scene) -> Array | None:
    """Heights (m) of all sections from ``h1,h2,..``; UsageError unless there is one above 0 for each."""
    if text is None:
        return None
    count = len(scene.sections)
    try:
        heights = np.array([float(part) for part in text.split(",")])
    except ValueError:
        heights = np.zeros(0)
    if len(heights) != count or not (np.isfinite(heights) & (heights > 0.0)).all():
        raise UsageError(f"--section-height {text}: give {count} heights above 0, in m, with commas between them.")
    return heights
