"""Spectrum and natural frequencies of what was just shown, worked out beside the server."""

from __future__ import annotations

import asyncio
from dataclasses import asdict
from typing import Any

from .feed import Feed
from .frames import SPECTRUM, pack
from .modes import Modes
from .spectrum import WINDOW, Spectrum, spectrum

TABLE = "acceleration"
MATCH = 0.2
"""Relative distance up to which a peak is taken for a mode of the model."""


class Analyst:
    """Looks at one feed; one look at a time, because the model's workspace is one.

    Parameters
    ----------
    feed : Feed
    """

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._modes: Modes | None = None
        self._turn = asyncio.Lock()
        self._known: tuple[tuple[int, int], tuple[dict[str, Any], bytes]] | None = None

    async def look(self, time: float) -> tuple[dict[str, Any], bytes] | None:
        """Text message ``lines`` and binary block of the spectrum at `time` (s); None without enough of a signal."""
        async with self._turn:
            store = self._feed.store
            table = store.tables.get(TABLE)
            if table is None:
                return None
            end = table.until(time)
            key = (store.generation, end)
            if self._known is None or self._known[0] != key:
                times, values = table.rows(table.until(time - WINDOW), end)
                found = await asyncio.to_thread(self._work_out, times, values.astype(float), self._feed.strokes(time))
                if found is None:
                    return None
                lines, result = found
                number = list(store.tables).index(TABLE)
                block = pack(SPECTRUM, number, result.frequencies, result.densities.astype("f4"))
                self._known = key, ({"kind": "lines", "time": time, **lines}, block)
            return self._known[1]

    def _work_out(self, times: Any, values: Any, strokes: list[float]) -> tuple[dict[str, Any], Spectrum] | None:
        found = spectrum(times, values)
        if found is None:
            return None
        natural = self._natural(strokes)
        peaks = [{**asdict(peak), "mode": _mode(peak.frequency, natural)} for peak in found.peaks]
        return {"natural": natural, "peaks": peaks}, found

    def _natural(self, strokes: list[float]) -> list[float]:
        scene = self._feed.scene()
        if scene is None or len(strokes) != len(scene.joints):
            return []
        self._modes = self._modes or Modes(scene)
        return self._modes.at(strokes)


def _mode(frequency: float, natural: list[float]) -> int | None:
    """Number, from 1, of the nearest natural frequency, if it is near."""
    number = min(range(len(natural)), key=lambda i: abs(natural[i] - frequency), default=None)
    return None if number is None or abs(natural[number] - frequency) > MATCH * natural[number] else number + 1
