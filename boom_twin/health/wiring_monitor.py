"""Monitor of the wiring of sensors: the commissioning check on the first seconds after a start, reported once.

A channel that does not read as declared is left out at once. A thread looks for its name, unit, sign and zero. The result is
taken `DELAY` later, with the same sample in a live node and a replay.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..scene.schema import Scene
from ..types import SENSORS, Alarm, Array, Channel, Mount, Place, Ranked, Stream, StrokeReading, channels_of, streams_of
from ..wiring.check import Checked, channel_name, check, likely
from ..wiring.hypotheses import as_read
from ..wiring.readings import RestModel, Series, Window, is_checked
from .alarms import UNKNOWN
from .sensor_check import Block, Flags, Readings

KIND = "wiring"  # kind of all its alarms
SCENE = "scene"  # channel and cause of the alarm that the scene is of another boom
CHECKS = 6, 20, 50, 100, 200, 400  # blocks after a start, at the end of which all of them are checked
NONE = np.zeros((), bool)  # of the channels of a stream that is not checked
DELAY = 20  # blocks from a check until its answer is taken


class WiringMonitor:
    """Monitor of the wiring of all sensors.

    Parameters
    ----------
    scene : Scene
        Boom with its load.
    reads : StrokeReading
        Quantity that stroke transducers read.
    mounts : sequence of Mount or None
        Mounts of the angle sensors.
    places : mapping of str to Place
        See `boom_twin.Twin`.
    declared : mapping of str to Channel
        See `boom_twin.Twin`. An alarm names the unit, sign and zero that the mapping should have.
    """

    def __init__(
        self,
        scene: Scene,
        reads: StrokeReading,
        mounts: Sequence[Mount | None],
        places: Mapping[str, Place],
        declared: Mapping[str, Channel],
    ) -> None:
        self._scene, self._reads, self._places = scene, reads, places
        channels = channels_of(len(scene.joints), streams_of(places))
        self._channels = {stream: names for stream, names in channels.items() if names and is_checked(stream)}
        self._names = [name for names in self._channels.values() for name in names]
        ends = np.cumsum([len(names) for names in self._channels.values()]).tolist()
        self._own = {s: slice(end - len(self._channels[s]), end) for s, end in zip(self._channels, ends, strict=True)}
        self._declared = {
            stream: [
                declared.get(name, Channel(name, kind.unit))._replace(turned=places.get(kind.stem, Place()).turned)
                for name in self._channels[stream]
            ]
            for stream, kind in SENSORS.items()
            if stream in self._channels
        }
        angles = self._declared[Stream.ANGLES]
        self._declared[Stream.ANGLES] = [each._replace(absolute=at) for each, at in zip(angles, mounts, strict=True)]
        self._last: dict[str, Alarm] = {}
        self._sure: set[str] = set()
        self._worker: ThreadPoolExecutor | None = None
        self.begin()

    def begin(self) -> None:
        """Restart with the boom at rest; alarms last until the next check."""
        self._blocks: list[tuple[int, Mapping[Stream, Array]]] = []
        self._age, self._searched, self._is_other_boom = 0, False, False
        self._model: RestModel | None = None
        self._search: tuple[int, Future[Checked | None]] | None = None
        self._wrong, self._doubted, self._right, self._found = np.zeros((4, len(self._names)), bool)

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """Alarms that last."""
        return tuple(self._last.values())

    @property
    def has_wrong_strokes(self) -> bool:
        """Return True if strokes are not read as declared, or the scene is of another boom: every prediction is wrong."""
        return self._is_other_boom or bool(self._wrong[self._own[Stream.STROKES]].any())

    def wrong(self, stream: Stream) -> NDArray[np.bool_]:
        """Return the channels of a stream not read as declared, shape (channels,) or (); with another boom all but strokes."""
        return self._of(stream, self._wrong) | (self._is_other_boom and stream is not Stream.STROKES)

    @property
    def found_wrong_angles(self) -> NDArray[np.bool_]:
        """Return which angle sensors are read otherwise for sure, and then agree with the strokes without another zero."""
        return self._of(Stream.ANGLES, self._wrong & self._found)

    def doubted(self, stream: Stream) -> NDArray[np.bool_]:
        """Return the channels of a stream not read as declared, while it is looked for how, shape (channels,) or ()."""
        return self._of(stream, self._doubted)

    def _of(self, stream: Stream, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        return chosen[self._own[stream]] if stream in self._own else NONE

    def _chosen(self, chosen: NDArray[np.bool_]) -> set[str]:
        return {self._names[place] for place in np.flatnonzero(chosen)}

    def explains(self, alarm: Alarm) -> bool:
        """Return True if an alarm of a single sensor is a consequence of its wiring."""
        is_of_reading = alarm.kind in {"range", "jump", "noise", "spikes", "intermittent"}
        return is_of_reading and alarm.channel in self._chosen(self._wrong | self._doubted)

    def take(self, block: Block, readings: Readings, failing: Mapping[Stream, Flags]) -> list[Alarm]:
        """Take a block; return the alarms that began or ended.

        Channels that are `failing` by themselves are left out once their wiring is known to be right.
        """
        if self._age < CHECKS[-1]:
            means = {Stream.STROKES: readings[Stream.STROKES].means[3].copy()}
            for stream, own in self._own.items():
                if stream is not Stream.STROKES and readings[stream].has_readings:
                    means[stream] = np.where(failing[stream] & self._right[own], np.nan, readings[stream].means[3])
            self._blocks.append((block.start, means))
            self._silent = {s: failing[s] & np.isnan(means.get(s, np.nan)) for s in self._channels}
        self._age += 1
        if self._age in CHECKS:
            self._check()
        if self._search is not None and self._age >= self._search[0]:
            found, self._search = self._search[1].result(), None
            return [] if found is None else self._reported(found, block.end)
        return [] if self._search is not None or self._age not in CHECKS else self._ended(block.end)

    def _check(self) -> None:
        """Look for channels that are not read as declared; if there are any, begin the search for how they are read.

        After the first search, only its successors say that further channels are wrong.
        """
        window, boom = self._window(), (self._scene, self._reads, self._places)
        self._model = self._model or RestModel(*boom)
        found = check(self._model, self._declared, window, is_quick=True)
        if found is None:
            return
        is_sound = not any(verdict.is_wrong for verdict in found.verdicts)
        self._is_other_boom &= not is_sound
        for verdict in found.verdicts:
            place = self._names.index(verdict.channel)
            self._wrong[place] &= not is_sound  # wrong strokes show in other sensors only
            self._doubted[place] = verdict.is_wrong and not self._searched
            self._right[place] |= not verdict.is_wrong
        if self._search is None and not is_sound:
            self._worker = self._worker or ThreadPoolExecutor(1, "wiring")
            self._search = self._age + DELAY, self._worker.submit(check, RestModel(*boom), self._declared, window)

    def _window(self) -> Window:
        """Return the means of all blocks since the start, in the units of the messages; NaN for sensors that have stopped."""
        found: dict[Stream, dict[str, Series]] = {}
        for stream, names in self._channels.items():
            rows = [(start, means[stream]) for start, means in self._blocks if stream in means]
            stamps = np.array([start for start, _ in rows], np.int64)
            columns = np.array([values for _, values in rows]).reshape(len(rows), len(names)).T
            columns[self._silent[stream]] = np.nan
            units, declared = SENSORS[stream].units, self._declared[stream]
            pairs = zip(declared, columns, strict=True)
            found[stream] = {each.name: Series(stamps, as_read(each, units, column)) for each, column in pairs}
        return found

    def _reported(self, found: Checked, end: int) -> list[Alarm]:
        """Begin and end alarms by the result of a search."""
        news, self._searched, self._is_other_boom = list[Alarm](), True, found.is_other_boom
        if found.is_other_boom and SCENE not in self._last:
            self._last[SCENE] = Alarm(SCENE, KIND, self._blocks[0][0], None, SCENE, ", ".join(found.wrong_angles))
            news.append(self._last[SCENE])
        self._doubted[:] = False
        for verdict in found.verdicts:
            is_wrong = (
                verdict.is_wrong and verdict.is_explained and (verdict.has_no_gravity or verdict.best != verdict.declared)
            )
            place, read = self._names.index(verdict.channel), verdict.best
            self._wrong[place] = is_wrong
            self._found[place] = verdict.is_sure and read is not None and read.zero == verdict.declared.zero
            name = channel_name(verdict)
            is_told = is_wrong and not found.is_other_boom
            if is_told and (name not in self._last or (verdict.is_sure and name not in self._sure)):
                cause = f"{name}.sensor"
                since = self._last[name].since if name in self._last else self._blocks[0][0]
                chance = 1.0 / (1.0 + math.exp(-verdict.margin))  # posterior beside the next way to read it
                ranked = tuple(Ranked(*each, ()) for each in ((cause, chance), (UNKNOWN, 1.0 - chance)))
                self._last[name] = Alarm(name, KIND, since, None, cause, likely(verdict), ranked)
                self._sure |= {name} if verdict.is_sure else set()
                news.append(self._last[name])
        return [*news, *self._ended(end)]

    def _ended(self, end: int) -> list[Alarm]:
        """End the alarms of channels that are read as declared by now."""
        wrong = self._chosen(self._wrong)
        wrong |= {SENSORS[s].stem for s, own in self._own.items() if SENSORS[s].is_accelerometer and self._wrong[own].any()}
        wrong = {SCENE} if self._is_other_boom else wrong
        self._sure &= wrong
        return [replace(self._last.pop(name), until=end) for name in list(self._last) if name not in wrong]
