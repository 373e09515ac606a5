"""Encode a `Report` of the twin as ROS messages: tip, residuals, joint states, changes, health."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from math import nan
from typing import Any

import numpy as np

from ..config.settings import Settings
from ..errors import BagError, UsageError
from ..health.alarms import alarm_of, values_of
from ..predictions import Estimate, Prediction
from ..scene.kinematics import PassiveJoints
from ..scene.schema import Scene
from ..twin.blocks import STREAMS, EstimateBlock, PredictionBlock, ReportBlock, ResidualBlock
from ..types import SECOND, Alarm, Array, Change, Health, Integers, Report, channels_of, stream_of
from .cdr_encoder import STAMP, Bytes, EncodedBlock, EncodedBlockBuilder, NumberFields, Template
from .numeric_outputs import ESTIMATED, JOINTS, PREDICTED, Chain, Placer, number_rows, selection
from .sample_decoder import stamp_of
from .topic_table import FRAME, TIP_JOINTS, Output, type_of
from .type_store import fill_header, fill_xz, jazzy, new_message

POINT = struct.Struct("<3d")
LINE_STRIP, TEXT, ADD = 4, 9, 0
TRACE = 5_000_000_000  # duration of the tip's trace, ns
TEXT_HEIGHT = 0.35  # height of the text, m

Colour = tuple[float, float, float, float]
BOOM: Colour = (0.90, 0.45, 0.10, 1.0)
LARGE: Colour = (0.55, 0.30, 0.75, 0.8)
GHOST: Colour = (0.60, 0.60, 0.60, 0.5)
TIP: Colour = (0.10, 0.60, 0.35, 1.0)
NO_FORCE, TENSION, COMPRESSION = (np.array(rgb) for rgb in ((0.75, 0.75, 0.75), (0.80, 0.05, 0.05), (0.05, 0.20, 0.85)))


class ShapeMarkers:
    """Encoder of a MarkerArray whose namespaces and ids are equal in every message.

    ============================  =========================  ========================================================
    namespace, id                 type                       content
    ============================  =========================  ========================================================
    ``boom``, 0                   LINE_STRIP                 deflected centre line, base to tip, true to scale
    ``boom_exaggerated``, 0       LINE_STRIP                 the same, displacements times a factor
    ``boom_exaggerated``, 1       TEXT_VIEW_FACING           that factor
    ``boom_undeflected``, 0       LINE_STRIP                 rigid sections, incompressible cylinders, the same strokes
    ``cylinders``, 1 .. n         LINE_STRIP                 pin to pin, coloured by force
    ``tip_trace``, 0              LINE_STRIP                 tip of the last 5 s, one point for every message
    ============================  =========================  ========================================================

    `force_scale` is the force that has the full colour, N.
    """

    def __init__(self, exaggeration: float, force_scale: float, frame: str = FRAME) -> None:
        self._factor, self._scale, self._frame = exaggeration, force_scale, frame
        self._template: Template | None = None
        self._past: deque[tuple[int, bytes]] = deque()

    def fill(self, predictions: Sequence[Prediction]) -> Iterator[bytes]:
        """Yield the encoded messages of predictions that have a shape; at least one."""
        names = "stamp", "shape", "undeflected", "pins", "tip_position", "cylinder_forces"
        stamps, line, straight, pins, tips, forces = (np.array([getattr(p, name) for p in predictions]) for name in names)
        large = straight + self._factor * (line - straight)
        label = large[:, -1] + (0.0, 2.0 * TEXT_HEIGHT)
        if self._template is None:
            self._template = self._new_template(line.shape[1], pins.shape[1])
        rows = (part.reshape(len(stamps), -1) for part in (line, large, label, straight, pins, tips))
        colours = force_colours(forces / self._scale).reshape(len(stamps), -1)
        (data,) = self._template.fill(stamps, np.concatenate(list(rows), axis=1), colours)
        for prediction, message in zip(predictions, data, strict=True):
            self._extend_trace(prediction.stamp, prediction.tip_position)
            yield self._with_trace(message.tobytes())

    def _new_template(self, points: int, cylinders: int) -> Template:
        """Return the template of a message whose lines have `points` points and whose trace has one point."""
        msg, fields = new_message(type_of(Output.SHAPE)), NumberFields()
        msg.markers = [
            self._line("boom", 0, 0.12, BOOM, fields, points),
            self._line("boom_exaggerated", 0, 0.06, LARGE, fields, points),
            self._label("boom_exaggerated", 1, f"displacements x {self._factor:g}", fields),
            self._line("boom_undeflected", 0, 0.06, GHOST, fields, points),
            *(self._line("cylinders", i + 1, 0.09, None, fields, 2) for i in range(cylinders)),
            self._line("tip_trace", 0, 0.03, TIP, fields, 1),
        ]
        return Template([(type_of(Output.SHAPE), msg)], fields)

    def _with_trace(self, data: bytes) -> bytes:
        """Return the message with all points of the trace. A point has 24 bytes, so the alignment after them is unchanged."""
        assert self._template is not None
        point = self._template.byte_of(-2)
        count = point - 4 if data[point - 4] else point - 8  # before the padding, if there is any
        head, padding, tail = data[:count], data[count + 4 : point], data[point + POINT.size :]
        return b"".join([head, len(self._past).to_bytes(4, "little"), padding, *(place for _, place in self._past), tail])

    def _extend_trace(self, stamp: int, tip: Array) -> None:
        """Add the newest point to the trace. Remove points older than `TRACE`, and points after `stamp` (time set back)."""
        while self._past and self._past[-1][0] >= stamp:
            self._past.pop()
        while self._past and self._past[0][0] < stamp - TRACE:
            self._past.popleft()
        self._past.append((stamp, POINT.pack(tip[0], 0.0, tip[1])))

    def _line(self, namespace: str, number: int, width: float, colour: Colour | None, fields: NumberFields, points: int) -> Any:
        """Return a line of `points` points. Without a colour, the colour is four number fields."""
        marker = self._marker(namespace, number, LINE_STRIP, colour or tuple(fields.single() for _ in range(4)))
        marker.scale.x = width
        marker.points = [new_message("geometry_msgs/msg/Point") for _ in range(points)]
        for point in marker.points:
            fill_xz(point, fields.row(2))
        return marker

    def _label(self, namespace: str, number: int, text: str, fields: NumberFields) -> Any:
        marker = self._marker(namespace, number, TEXT, LARGE)
        marker.scale.z, marker.text = TEXT_HEIGHT, text
        fill_xz(marker.pose.position, fields.row(2))
        return marker

    def _marker(self, namespace: str, number: int, kind: int, colour: tuple[float, ...]) -> Any:
        marker = new_message("visualization_msgs/msg/Marker")
        fill_header(marker.header, STAMP * SECOND, self._frame)
        marker.ns, marker.id, marker.type, marker.action = namespace, number, kind, ADD
        marker.pose.orientation.w, marker.lifetime.sec = 1.0, 1
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = colour
        return marker


def force_colours(shares: Array) -> Array:
    """Return colours (.., 4) of cylinders: grey at a share of 0, red at 1 (tension), blue at -1 (compression), pale for NaN."""
    shares = shares[..., None]
    colours = NO_FORCE + np.minimum(abs(shares), 1.0) * (np.where(shares > 0.0, TENSION, COMPRESSION) - NO_FORCE)
    return np.where(np.isnan(shares), GHOST, np.concatenate([colours, np.ones_like(shares)], axis=-1))


OK, WARN, ERROR = range(3)
"""Levels of diagnostic_msgs/DiagnosticStatus: the alarm has ended; its cause is unknown; its cause is named."""


def encode_health(health: Health, frame: str = FRAME) -> bytes:
    """Return `health` as a diagnostic_msgs/DiagnosticArray in CDR, with its stamp; see ``topics.yaml`` for its values."""
    msg = new_message(type_of(Output.HEALTH))
    fill_header(msg.header, health.stamp, frame)
    msg.status = [_status(alarm) for alarm in health.alarms]
    return bytes(jazzy().serialize_cdr(msg, type_of(Output.HEALTH)))


def decode_health(msg: Any) -> tuple[Alarm, ...]:
    """Return the alarms of a DiagnosticArray, see `boom_twin.health.alarms.alarm_of`. A status without an alarm is left out."""
    found = []
    for status in msg.status:
        try:
            found.append(alarm_of(status.name, {"evidence": status.message} | {pair.key: pair.value for pair in status.values}))
        except (KeyError, ValueError, ArithmeticError):
            continue
    return tuple(found)


def _status(alarm: Alarm) -> Any:
    status = new_message("diagnostic_msgs/msg/DiagnosticStatus")
    status.level = OK if alarm.until is not None else WARN if alarm.cause is None else ERROR
    status.name, status.message = alarm.channel, alarm.told
    for key, value in values_of(alarm).items():
        pair = new_message("diagnostic_msgs/msg/KeyValue")
        pair.key, pair.value = key, value
        status.values.append(pair)
    return status


FROM_REST, NEW = "from_rest", 2.0


def encode_changes(change: Change, frame: str = FRAME) -> bytes:
    """Return the message of a change in CDR."""
    values = {FROM_REST: NEW if change.is_new else float(change.from_rest), **change.settings, **change.zeros}
    msg = new_message(type_of(Output.CHANGES))
    fill_header(msg.header, change.stamp, frame)
    msg.name, msg.position = list(values), np.array(list(values.values()), dtype=float)
    return bytes(jazzy().serialize_cdr(msg, type_of(Output.CHANGES)))


def decode_changes(msg: Any) -> Change:
    """Return the change in a decoded message. Raise BagError if the message has names or values that a change cannot have."""
    values = dict(zip(msg.name, map(float, msg.position), strict=False))
    from_rest = values.pop(FROM_REST, 0.0)
    settings = {name: values.pop(name) for name in Settings.live_names() if name in values}
    try:
        Settings().tuned(settings)
    except UsageError as error:
        raise BagError(f"a message of changes cannot be used: {error}") from None
    zeros = {name: value for name, value in values.items() if value != 0.0 and stream_of(name) is not None}
    return Change(stamp_of(msg), bool(from_rest), settings, zeros, from_rest == NEW)


Messages = list[tuple[Output, bytes]]


class ReportEncoder:
    """Encoder of reports as messages in CDR, to publish or to record. Equal reports in equal order give equal bytes.

    `frame` is that of all headers, of the base.
    """

    def __init__(self, scene: Scene, settings: Settings, frame: str = FRAME) -> None:
        count, self._frame = len(scene.joints), frame
        self._passive = PassiveJoints(scene)
        self._chain = Chain(np.array(scene.base.pivot), np.array([section.length for section in scene.sections]))
        rows = [*PREDICTED, (Output.JOINT_STATES, _joint_states(count)), *ESTIMATED]
        self._predicted, self._outputs = len(PREDICTED) + 1, [output for output, _ in rows]
        self._numeric = self._template(rows)
        self._chosen, self._signs = selection(self._numeric.names, count)
        self._shaped_joints = self._template([(Output.JOINT_STATES, _joint_states(count, self._passive.names))])
        self._joints, _ = selection(self._shaped_joints.names, count)
        self._uncertainty = self._template([(Output.TIP_UNCERTAINTY, lambda msg, at: fill_xz(msg.vector, at.row(2)))])
        self._channels = channels_of(count)
        self._residuals: dict[tuple[str, ...], Template] = {}
        self._markers = ShapeMarkers(settings.exaggeration, settings.force_scale, frame)
        for output in Output:  # encoders and the kernel are compiled here, not when the first message waits
            jazzy().get_msgdef(type_of(output))
        number_rows(self._chain, None, None, 1)

    def fill(self, report: Report, is_wanted: Callable[[Output], bool] = lambda output: True) -> Messages:
        """Return the wanted messages of one report; by default all.

        With a prediction: the outputs `PREDICTED`, ``joint_states``, `ESTIMATED`, and ``shape`` if it has one. ``residuals``
        for each set of residuals. ``changes`` with a change. ``health`` and ``tip_uncertainty`` (m) with new health.
        """
        p, e, messages = report.prediction, report.estimate, Messages()
        if p is not None and any(map(is_wanted, self._outputs)):
            stamps = np.array([p.stamp])
            numbers, found = self._numbers(p, e, stamps)
            for key, data in found if e is not None else found[: self._predicted]:
                if not is_wanted(key):
                    continue
                if key is Output.JOINT_STATES and p.shape is not None:
                    data = self._shaped_joint_states(stamps, numbers)
                messages.append((key, data.tobytes()))
        if report.residuals and is_wanted(Output.RESIDUALS):
            for each in report.residuals:
                data = self._fill_residuals(each.names, np.array([each.stamp]), each.values[np.newaxis], each.sigmas)
                messages.append((Output.RESIDUALS, data.tobytes()))
        if report.change is not None and is_wanted(Output.CHANGES):
            messages.append((Output.CHANGES, encode_changes(report.change, self._frame)))
        if report.health is not None:
            messages += [each for each in self._fill_health(report.health) if is_wanted(each[0])]
        if p is not None and p.shape is not None and is_wanted(Output.SHAPE):
            messages += [(Output.SHAPE, data) for data in self._markers.fill([p])]
        return messages

    def fill_block(self, block: ReportBlock) -> EncodedBlock:
        """Return the messages of many reports, equal to those of `fill` for one report after the other."""
        p, residuals, found = block.predictions, block.residuals, EncodedBlockBuilder()
        first = len(self._outputs)  # turn of residuals among the messages of one sample
        last = first + len(residuals.at)  # of a change; health and shape follow
        if len(p.at):
            shaped = np.zeros(len(p.at), bool)
            shaped[list(p.outlines)] = True
            numbers, messages = self._numbers(p, block.estimates, p.stamps)
            for turn, (output, data) in enumerate(messages):
                rows = ~shaped if output is Output.JOINT_STATES else slice(None)
                found.add(output, p.at[rows], turn, data[rows])
            data = self._shaped_joint_states(p.stamps[shaped], numbers[shaped])
            found.add(Output.JOINT_STATES, p.at[shaped], self._predicted - 1, data)
        for rows, data in self._residual_rows(residuals):
            found.add(Output.RESIDUALS, residuals.at[rows], first + rows, data)
        for row, note in block.notes.items():
            if note.change is not None:
                found.add_one(Output.CHANGES, row, last, encode_changes(note.change, self._frame))
        for row, health in block.health.items():
            for turn, (output, message) in enumerate(self._fill_health(health), start=last + 1):
                found.add_one(output, row, turn, message)
        if shapes := sorted(p.outlines):
            for row, message in zip(shapes, self._markers.fill([p.one(row) for row in shapes]), strict=True):
                found.add_one(Output.SHAPE, int(p.at[row]), last + 3, message)
        return found.block(block.stamps)

    def _numbers(
        self, p: Prediction | PredictionBlock, e: Estimate | EstimateBlock | None, stamps: Integers
    ) -> tuple[Array, list[tuple[Output, Bytes]]]:
        """Return the numbers of predictions and estimates, a row for each stamp, and their messages in the same rows."""
        numbers = number_rows(self._chain, p, e, len(stamps))
        data = self._numeric.fill(stamps, numbers[:, self._chosen] * self._signs)
        return numbers, list(zip(self._outputs, data, strict=True))

    def _shaped_joint_states(self, stamps: Integers, numbers: Array) -> Bytes:
        """Return joint states with passive joints, which come with a shape, from numbers, shape (k, all)."""
        joints = numbers[:, JOINTS : JOINTS + len(self._chain.lengths)]
        places = np.concatenate([numbers[:, self._joints], self._passive.positions(joints)], axis=1)
        return self._shaped_joints.fill(stamps, places)[0]

    def _residual_rows(self, residuals: ResidualBlock) -> Iterator[tuple[Integers, Bytes]]:
        """Yield rows of the block and their messages of residuals, one stream after the other."""
        for code in set(residuals.streams.tolist()):
            rows, names = np.flatnonzero(residuals.streams == code), self._channels[STREAMS[code]]
            values, sigmas = (array[rows, : len(names)] for array in (residuals.values, residuals.sigmas))
            yield rows, self._fill_residuals(names, residuals.stamps[rows], values, sigmas)

    def _fill_residuals(self, names: tuple[str, ...], stamps: Integers, values: Array, sigmas: Array) -> Bytes:
        """Return messages of residuals: ``position`` residual, ``velocity`` normalised, ``effort`` standard deviation."""

        def put(msg: Any, fields: NumberFields) -> None:
            msg.name = list(names)
            msg.position, msg.velocity, msg.effort = (np.array(fields.row(len(names))) for _ in range(3))

        if names not in self._residuals:
            self._residuals[names] = self._template([(Output.RESIDUALS, put)])
        numbers = np.concatenate([values, values / sigmas, np.reshape(sigmas, values.shape)], axis=1)
        return self._residuals[names].fill(stamps, numbers)[0]

    def _fill_health(self, health: Health) -> Messages:
        (uncertainty,) = self._uncertainty.fill(np.array([health.stamp]), health.tip_sigmas)
        return [(Output.HEALTH, encode_health(health, self._frame)), (Output.TIP_UNCERTAINTY, uncertainty.tobytes())]

    def _template(self, outputs: Sequence[tuple[Output, Placer]]) -> Template:
        messages, fields = list[tuple[str, Any]](), NumberFields()
        for output, put in outputs:
            msg = new_message(type_of(output))
            fill_header(msg.header, STAMP * SECOND, self._frame)
            put(msg, fields)
            messages.append((type_of(output), msg))
        return Template(messages, fields)


def _joint_states(count: int, passive: Sequence[str] = ()) -> Placer:
    """Return the placer of joints, cylinders, joints of the tip and passive joints. Only cylinders have an effort."""

    def numbered(*kinds: str) -> list[str]:
        return [f"{kind}_{number}" for kind in kinds for number in range(1, count + 1)]

    def put(msg: Any, fields: NumberFields) -> None:
        msg.name = [*numbered("joint", "cylinder"), *TIP_JOINTS, *passive]
        own, efforts = fields.named(*numbered("joint", "stroke")), fields.named(*numbered("force"))
        others = fields.named(*TIP_JOINTS) + fields.row(len(passive))
        msg.position, msg.effort = np.array(own + others), np.array([nan] * count + efforts + [nan] * len(others))

    return put
