"""Commissioning check of a recorded session: reads its messages by name, and proposes a corrected mapping."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..bag.reader import Session, read_blocks, scan
from ..bag.session_file import WHOLE, TimeWindow
from ..bag.session_model import SessionScene, mapping_of, mapping_text, scene_of, settings_of, strokes_of
from ..config.yaml_text import plain
from ..errors import BagError, UsageError
from ..messages.mapping import NO_LAG, mapping_from
from ..messages.topic_table import Sensor, Topics, usual
from ..scene.edit import loaded
from ..scene.load import SceneSource
from ..scene.schema import Scene
from ..twin.blocks import CODES, SampleBlock
from ..twin.twin import Twin
from ..types import SENSORS, Array, Channel, Integers, Place, Stream, StrokeReading
from ..wiring.check import ABSENT, STROKES_ALONE, Checked, Verdict, check, finding, likely, reading
from ..wiring.hypotheses import SLACK, si
from ..wiring.readings import Lag, RestModel, Series, Window, is_checked, lag_of
from .inputs import of_another_boom
from .session_samples import SessionSamples, decoder_of

LOOK = 60.0  # s of a session that `wiring_of` reads
AXES = "x", "y", "z"

UNTIMED = {Stream.STROKES, *NO_LAG}


@dataclass(frozen=True)
class Commissioning:
    """Result of the check of a session."""

    checked: Checked
    document: dict[str, Any]  # keys of the mapping that mends what the check is sure of
    # lag of each stream against the strokes; empty if it was not asked for, or the strokes are not known
    lags: Mapping[Stream, Lag]
    absent: list[str]  # channels that are in no message, proposed as ``none``
    lost: list[str]  # sentences on strokes with missing or impossible readings

    @property
    def wrong(self) -> list[Verdict]:
        """Channels that are not read as the mapping says."""
        return [verdict for verdict in self.checked.verdicts if verdict.is_wrong]

    @property
    def has_proposal(self) -> bool:
        """Return True if a mapping is proposed."""
        return any(map(is_late, self.lags.values())) or bool(self.absent) or any(verdict.is_sure for verdict in self.wrong)


def wiring_of(
    bag: Path, scene: SceneSource | SessionScene, mapping: str | Path | None, window: TimeWindow, namespace: str = ""
) -> str:
    """Return one line on how the sensors of a session are wired, by its first `LOOK` seconds."""
    duration = LOOK if window.duration is None else min(LOOK, window.duration)
    try:
        found = commission(bag, scene, mapping, TimeWindow(window.start, duration), with_lags=False, namespace=namespace)
    except (BagError, UsageError) as error:
        return f"not checked: {str(error).splitlines()[0].rstrip('.')}"
    absent = [f"{channel} is {ABSENT}" for channel in found.absent]
    remedy = f". `boom_twin mapping --check {bag}` proposes a mapping" if absent or found.wrong else ""
    if not found.wrong:
        still = "" if found.checked.moved else ", as far as a boom at rest shows"
        rest = STROKES_ALONE if found.checked.has_strokes_alone else f"as expected{still}"
        return "; else ".join([*found.lost, *absent, rest]) + remedy
    wrong = [
        f"{each.channel}: declared as `{reading(each.declared)}`, found `{likely(each)}`"
        if each.is_sure
        else f"{each.channel} {finding(each, found.checked)}"
        for each in found.wrong
    ]
    return "; ".join(wrong + absent) + remedy


def is_late(lag: Lag) -> bool:
    """Return True if a lag is sure and large enough to be proposed."""
    sigmas = 4.0  # standard deviations required to accept a lag
    late = 0.01  # s, smallest lag that is proposed as `delay`
    return abs(lag.lag) > max(late, sigmas * lag.sigma)


def commission(
    bag: str | Path,
    scene: SceneSource | SessionScene = None,
    mapping: str | Path | None = None,
    window: TimeWindow = WHOLE,
    with_lags: bool = True,
    namespace: str = "",
) -> Commissioning:
    """Check how the sensors of a session are wired.

    Scene and mapping are by default those of the session, else those of the package. `window` is the part of the session that
    is read. `with_lags`: the twin runs over the session, for the lags of the streams. `namespace` is that of the node.

    Raise BagError if the session cannot be read, is of another boom, or its messages do not name all cylinders; UsageError if
    scene or mapping have faults.
    """
    most_lag = 0.08  # s, largest lag that the filter is left to estimate
    session = scan(Path(bag))
    own, given = scene_of(session.path, scene), None if mapping is None else Path(mapping)
    joints = len(own.scene.joints)
    mapped = mapping_of(session.path, given, joints, namespace)
    document = dict(plain(mapping_text(session.path, given)) or {})
    reads = strokes_of(session.path, mapped).reading
    if reads is StrokeReading.ANGLE:
        raise BagError(f"{session.path}: has `drive: angles`. The check needs the strokes of all cylinders; it cannot be made.")
    settings = settings_of(session.path).settings
    series = readings_of(session, mapped.topics, joints, window)
    places = mapped.topics.places
    model = RestModel(loaded(own.scene, *settings.load), reads, places)
    found = check(model, declared(mapped.topics, joints), series)
    if found is None:
        if not series[Stream.STROKES]:
            topic = mapped.topics.inputs[Stream.STROKES].name
            raise BagError(f"{session.path}: no readings of {topic}. The check needs the strokes of all cylinders.")
        names = [sensor.name for sensor in mapped.topics.sensors_of(Stream.STROKES, joints).values()]
        heard = series[Stream.STROKES]
        silent = [name for name in names if name not in heard or not np.isfinite(heard[name].values).any()]
        without = f": {', '.join(silent)} never had a value" if silent else ""
        lacking = f"{session.path}: no time in which all {joints} cylinders of the scene ({own.source}) have strokes{without}"
        raise BagError(f"{lacking}. Give the boom's scene by --scene, or the session's mapping.")
    if found.is_other_boom:
        raise of_another_boom(session, own, ", ".join(found.wrong_angles))
    _mend(document, found)
    absent = [each.channel for each in found.verdicts if found.lacks(each) and each.channel not in mapped.topics.absent]
    for channel in absent:
        document.setdefault("sensors", {})[channel] = "none"
    lags: dict[Stream, Lag] = {}
    if with_lags and all(v.is_sure or not v.is_wrong for v in found.verdicts if v.stream is Stream.STROKES):
        topics = mapping_from(document, mapped.source, joints).in_namespace(namespace).of_scene(own.scene.joints)
        boom, sensing = (own.scene, topics.noise_of(settings)), topics.sensing(joints) | {"reads": reads}
        twin = Twin(*boom, **sensing)
        lags = _lags(twin, session, topics, window, found)
        near = [stream for stream, lag in lags.items() if abs(lag.lag) < most_lag and lag.sigma < math.inf]
        for _ in range(2):  # the second pass estimates lags of late streams only; the others give the time
            twin = Twin(*boom, **sensing | {"lagging": dict.fromkeys([*topics.lagging, *near])})
            for block in _samples(session, topics, window, joints):
                twin.take(block)
            lags |= {stream: Lag(clock.lag, clock.lag_sigma) for stream, clock in twin.clocks.items() if stream in lags}
            near = [stream for stream in near if is_late(lags[stream])]
        for stream, lag in lags.items():
            if is_late(lag) and stream not in topics.lagging:
                delay = round(topics.inputs[stream].delay + lag.lag, 3)
                entry = document.setdefault("inputs", {}).setdefault(stream.value, {})
                entry["delay"] = "auto" if abs(delay) < most_lag else delay
    return Commissioning(found, document, lags, absent, [*_lost(found, series[Stream.STROKES], own.scene)])


def _lost(found: Checked, series: Mapping[str, Series], scene: Scene) -> Iterator[str]:
    """Yield a part of a sentence for each cylinder with strokes that are missing, or beyond the travel by `SLACK` of it."""
    verdicts = [verdict for verdict in found.verdicts if verdict.stream is Stream.STROKES]
    for verdict, joint in zip(verdicts, scene.joints, strict=True):
        if (way := verdict.best or verdict.declared).name not in series:
            continue
        share = si(way, SENSORS[Stream.STROKES].units, series[way.name].values) / joint.cylinder.max_stroke
        missing, outside = np.isnan(share).sum(), (np.abs(share - 0.5) > 0.5 + SLACK).sum()
        if missing or outside:
            yield f"{verdict.channel}: {missing} readings missing, {outside} beyond the travel"


def _mend(document: dict[str, Any], found: Checked) -> None:
    """Write everything that a check is sure of into the content of a mapping."""
    for verdict in found.verdicts:
        if verdict.is_sure and verdict.best is not None:
            is_turned = verdict.best.turned != verdict.declared.turned
            if not is_turned or verdict.best._replace(turned=verdict.declared.turned) != verdict.declared:
                mended = "none" if verdict.has_no_gravity else _unusual_keys(verdict.channel, verdict.best)
                document.setdefault("sensors", {})[verdict.channel] = mended
            if is_turned:
                entry = document.setdefault("inputs", {}).setdefault(verdict.stream.value, {})
                turned = round(math.remainder(verdict.best.turned, math.tau), 4)
                entry["place"] = {**(entry.get("place") or {}), "turned": turned}


def _unusual_keys(channel: str, way: Channel) -> dict[str, Any]:
    least = Sensor(**usual(channel)).model_dump()
    values = way._replace(zero=float(f"{way.zero:.6g}"))._asdict()
    return {key: values[key] for key, value in least.items() if key in values and values[key] != value}


def declared(topics: Topics, joints: int) -> dict[Stream, list[Channel]]:
    """Return how a mapping reads every channel."""

    def channel(sensor: Sensor, place: Place) -> Channel:
        return Channel(sensor.name, sensor.unit, sensor.sign, sensor.zero, sensor.scale, sensor.absolute, place.turned)

    return {
        stream: [channel(each, topics.places.get(kind.stem, Place())) for each in topics.sensors_of(stream, joints).values()]
        for stream, kind in SENSORS.items()
    }


def readings_of(session: Session, topics: Topics, joints: int, window: TimeWindow = WHOLE) -> Window:
    """Return the readings of a session by the names of its messages.

    Names that the mapping does not have are taken if it names a sensor that is in no message.
    """
    heard = {name: streams for name, streams in topics.streams_by_topic.items() if session.count(name)}
    types = {name: topics.inputs[streams[0]].type for name, streams in heard.items()}
    columns: dict[tuple[Stream, str], tuple[list[Integers], list[Array]]] = defaultdict(lambda: ([], []))
    blocks = read_blocks(session, types, window)
    streams = [heard[source.name] for source in blocks.sources]
    checked = [[(stream, topics.delay(stream)) for stream in group if is_checked(stream)] for group in streams]
    decoders = [decoder_of(group) for group in streams]
    for source, times, message in (each for block in blocks for each in blocks.read_together(decoders, block)):
        for stream, delay in checked[source]:
            for key, numbers in _values(message, stream):
                stamps, values = columns[stream, key]
                stamps.append(times - delay)
                values.append(numbers)
    found: dict[Stream, dict[str, Series]] = {stream: {} for stream in Stream}
    known = {
        stream: [each.name for channel, each in topics.sensors_of(stream, joints).items() if channel not in topics.absent]
        for stream in Stream
    }
    for (stream, key), (stamps, values) in columns.items():
        is_lacking = any((stream, name) not in columns for name in known[stream])
        others = {name for other in Stream if other is not stream for name in known[other]}
        if key in known[stream] or (SENSORS[stream].is_accelerometer and known[stream]) or (is_lacking and key not in others):
            times, numbers = np.concatenate(stamps), np.concatenate(values)
            order = np.argsort(times, kind="stable")
            found[stream][key] = Series(times[order], numbers[order])
    return found


def _values(message: Any, stream: Stream) -> Iterator[tuple[str, Array]]:
    if SENSORS[stream].is_accelerometer:
        names, values = AXES, [getattr(message.linear_acceleration, axis) for axis in AXES]
    else:
        names, values = message.name, getattr(message, SENSORS[stream].field)
    return zip(names, (np.atleast_1d(np.asarray(each, float)) for each in values), strict=False)


def _lags(twin: Twin, session: Session, topics: Topics, window: TimeWindow, found: Checked) -> dict[Stream, Lag]:
    """Return the lags of angles, IMUs and points against what the strokes make a twin expect.

    Forces have none: their zeros change with the posture, which hides a lag.
    """
    raw, left = defaultdict[Stream, list[Any]](list), defaultdict[Stream, list[Any]](list)  # stamps and further fields
    for block in _samples(session, topics, window, len(twin.mounts)):
        residuals = twin.take(block).residuals
        _append_by_stream(raw, block.streams, block.stamps, block.values)
        _append_by_stream(left, residuals.streams, residuals.stamps, residuals.values, residuals.sigmas)
    known = {v.stream for v in found.verdicts} - {v.stream for v in found.verdicts if v.is_wrong and not v.is_sure}
    return {each: _lag(raw[each], left[each]) for each in Stream if each in known - UNTIMED and left[each]}


def _samples(session: Session, topics: Topics, window: TimeWindow, joints: int) -> Iterator[SampleBlock]:
    """Yield the samples of a session, without changes that a node made."""
    return (item for item in SessionSamples(session, topics, joints, window) if isinstance(item, SampleBlock))


def _append_by_stream(columns: dict[Stream, list[Any]], streams: Integers, *fields: Any) -> None:
    """Append the rows of every stream: stamps and further fields."""
    for stream, code in CODES.items():
        own = streams == code
        if own.any():
            columns[stream].append(tuple(field[own] for field in fields))


def _lag(raw: Sequence[Any], left: Sequence[Any]) -> Lag:
    """Return the lag of a stream by its readings and their residuals."""
    (stamps, values), (own, residuals, sigmas) = (map(np.concatenate, zip(*rows, strict=True)) for rows in (raw, left))
    common, here, there = np.intersect1d(stamps, own, return_indices=True)
    read, off = values[here], residuals[there]
    is_read = np.isfinite(read).any(axis=0) & np.isfinite(off).any(axis=0)
    width = min(read.shape[1], off.shape[1])
    whole = np.isfinite(off[:, :width][:, is_read[:width]]).all(axis=1)
    if whole.sum() < 2 or not is_read.any():
        return Lag(0.0, math.inf)
    columns = np.flatnonzero(is_read[:width])
    read, off, sigmas = (each[whole][:, columns] for each in (read, off, sigmas[there]))
    return lag_of(common[whole], read, read - off, sigmas**2)
