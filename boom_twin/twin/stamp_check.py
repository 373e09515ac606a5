"""Check the stamps of a stream: tell regular samples from stray ones, pauses, a clock that was set, and a second source."""

from __future__ import annotations

from ..config.settings import Settings
from ..types import SECOND, Sample
from .regular import USUAL_STEP, is_next, longest_step, smoothed
from .state import NONE, TwinState

EARLY_STEP = 8.0  # usual intervals; where strokes are as expected after a step up to that, it need not be confirmed
MOST_HELD = 1024  # samples that wait
SECOND_LINE = 1_000_000_000  # ns that a second line of stamps has to go on alone before it is followed


class StampCheck:
    """Line of stamps that is followed, and another line that may replace it.

    A sample whose stamp steps ahead or back is held and has no effect. If the next samples continue the old line, it was stray.
    If they follow the held sample, time has stepped: it and they are released together. After a stray stamp within the last
    second there may be two sources. Then the other line must continue alone for longer.

    Parameters
    ----------
    settings : Settings
    state : TwinState
        Where `newest`, `usual` and the number of `held` samples are kept.
    stream : int
        See `boom_twin.twin.blocks.CODES`.

    Attributes
    ----------
    is_second : bool
        Whether that line had been met before, and the one that is followed went on since: there are two sources.
    """

    def __init__(self, settings: Settings, state: TwinState, stream: int) -> None:
        self._state, self._stream = state, stream
        self.newest, self.usual, self.held = None, 0.0, []
        self.is_second = False
        self._since = 0
        self._other: int | None = None
        self._strayed: int | None = None
        self.tune(settings)

    @property
    def newest(self) -> int | None:
        """Stamp (ns) of the newest sample that was taken; None before the first."""
        stamp = int(self._state.newest[self._stream])
        return None if stamp == NONE else stamp

    @newest.setter
    def newest(self, stamp: int | None) -> None:
        self._state.newest[self._stream] = NONE if stamp is None else stamp

    @property
    def usual(self) -> float:
        """Usual time (ns) from one sample to the next; 0 while unknown."""
        return float(self._state.usual[self._stream])

    @usual.setter
    def usual(self, span: float) -> None:
        self._state.usual[self._stream] = span

    @property
    def held(self) -> list[tuple[Sample, str]]:
        """Newest samples of the other line, each with the event reported for it."""
        return self._held

    @held.setter
    def held(self, samples: list[tuple[Sample, str]]) -> None:
        self._held = samples
        self._note_held()

    def _note_held(self) -> None:
        self._state.held[self._stream] = len(self._held)

    def tune(self, settings: Settings) -> None:
        """Set the limits to those of `settings`."""
        self._gap = round(settings.gap * SECOND)

    @property
    def longest(self) -> float:
        """Longest step of a stamp (ns) that needs no confirmation by the next sample."""
        return float(longest_step(self.usual, self._gap))

    def is_next(self, stamp: int) -> bool:
        """Return True if a sample comes at its usual time."""
        return self.newest is None or bool(is_next(self.newest, self.usual, self._gap, stamp))

    def is_soon(self, stamp: int) -> bool:
        """Return True if a sample comes early, or after few lost ones."""
        return self.newest is not None and 0 < stamp - self.newest <= min(self.longest, EARLY_STEP * self.usual or self._gap)

    def take(self, stamp: int) -> None:
        """Take this stamp as the newest of the line; held samples were stray."""
        if self.newest is not None:
            self.usual = smoothed(self.usual, stamp - self.newest)
        self.newest = stamp
        if self.held:
            self._other, self.held, self._strayed = self.held[-1][0].stamp, [], stamp

    def hold(self, sample: Sample, event: str, is_apart: bool = False) -> str:
        """Hold a sample, after the held ones that it follows or else in their place; return its event.

        A sample that `is_apart` does not follow the held ones: no cylinder could have moved from their values to its own.
        """
        last = self.held[-1][0].stamp if self.held else self._other
        follows = last is not None and 0 < sample.stamp - last <= self.longest and not is_apart
        if not (self.held and follows):
            self.held, self._since, self.is_second = [], sample.stamp, follows
        if self.is_second and event == "leap":
            event = "second source"
        self._held.append((sample, event))
        if len(self._held) > MOST_HELD:
            del self._held[0]
        self._note_held()
        return event

    def is_confirmed(self, least: float = 0.0) -> bool:
        """Return True if the held samples continue for `least` ns, and until the line that is followed is late."""
        if self._strayed is not None and self.newest is not None and self.newest - self._strayed < SECOND_LINE:
            least = max(least, self._gap)
        span = self.held[-1][0].stamp - self._since
        return span > 0 and span >= max(self.usual / USUAL_STEP, least)

    def release(self) -> list[tuple[Sample, str]]:
        """Return the held samples; their line is followed from now on."""
        held, self.held, self._other = self.held, [], self.newest
        self.usual = self.usual or float(held[-1][0].stamp - held[0][0].stamp) / (len(held) - 1)
        return held
