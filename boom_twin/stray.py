"""Tells a stray stamp from a clock that was set: by the sample that comes next."""

from __future__ import annotations

from .records import Sample, Stream
from .settings import Settings

NANO = 1_000_000_000


class Strays:
    """Holds samples whose stamp leaps far from the newest one of their stream.

    One wrong stamp, of the far future or of 1970, is followed by samples that go on where the stream was: it was stray, and
    has done nothing. Where time was set, the next sample follows the one that leapt, within `Settings.restart_gap`; then it
    is believed. The rule looks at the stamps of one stream alone, in their order of arrival, so a replay decides alike.
    """

    def __init__(self, settings: Settings) -> None:
        self._leap, self._gap = round(settings.leap * NANO), round(settings.restart_gap * NANO)
        self._held: dict[Stream, int] = {}

    def hold(self, sample: Sample, newest: int | None) -> bool:
        """Whether this sample is left out until the next one confirms it; `newest` (ns) of its stream, if there is one."""
        held = self._held.pop(sample.stream, None)
        if newest is None or abs(sample.stamp - newest) <= self._leap:
            return False
        if held is not None and 0 < sample.stamp - held <= self._gap:
            return False
        self._held[sample.stream] = sample.stamp
        return True
