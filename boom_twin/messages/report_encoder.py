"""Encode a `Report` of the twin as ROS messages: tip, residuals, joint states, changes, health.

The model's plane (x forward, y up) is the x-z plane of ``base_link``, so a positive turn is one about its -y (REP-103).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import nan
from typing import Any, NamedTuple

import numpy as np

from ..config.settings import Settings
from ..errors import BagError, UsageError
from ..health.alarms import alarm_of, values_of
from ..scene.kinematics import PassiveJoints, TipJoints
from ..scene.schema import Scene
from ..twin.blocks import STREAMS, EstimateBlock, Integers, PredictionBlock, ReportBlock, ResidualBlock
from ..types import Alarm, Array, Change, Estimate, Health, Prediction, Report, Residuals, channels_of
from .cdr_encoder import NumberFields, Template, stamped
from .encoded_block import Bytes, EncodedBlock, EncodedBlockBuilder
from .marker_encoder import ShapeMarkers
from .message_fields import FRAME, fill_header, fill_xz
from .sample_decoder import stamp_of
from .topic_table import TYPES, Output
from .type_store import jazzy, new_message

OK, WARN, ERROR = range(3)
"""Of diagnostic_msgs/DiagnosticStatus: the alarm has ended; its cause cannot be told; its cause is named."""


def encode_health(health: Health, frame: str = FRAME) -> bytes:
    """A diagnostic_msgs/DiagnosticArray in CDR, with the stamp of `health`; see ``topics.yaml`` for its values."""
    msg = new_message(TYPES[Output.HEALTH])
    fill_header(msg.header, health.stamp, frame)
    msg.status = [_status(alarm) for alarm in health.alarms]
    return bytes(jazzy().serialize_cdr(msg, TYPES[Output.HEALTH]))


def decode_health(msg: Any) -> tuple[Alarm, ...]:
    """The alarms of such a message, see `boom_twin.health.alarms.alarm_of`; a status that is none is left out."""
    found = []
    for status in msg.status:
        try:
            found.append(alarm_of(status.name, status.message, {pair.key: pair.value for pair in status.values}))
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
    """The message of a change, in CDR."""
    values = {FROM_REST: NEW if change.is_new else float(change.from_rest), **change.settings, **change.zeros}
    msg = new_message(TYPES[Output.CHANGES])
    fill_header(msg.header, change.stamp, frame)
    msg.name, msg.position = list(values), np.array(list(values.values()), dtype=float)
    return bytes(jazzy().serialize_cdr(msg, TYPES[Output.CHANGES]))


def decode_changes(msg: Any) -> Change:
    """The change of a message.

    Raises
    ------
    BagError
        It has names or values that a change cannot have.
    """
    values = dict(zip(msg.name, map(float, msg.position), strict=False))
    from_rest = values.pop(FROM_REST, 0.0)
    settings = {name: values.pop(name) for name in Settings.live_names() if name in values}
    try:
        Settings().tuned(settings)
    except UsageError as error:
        raise BagError(f"a message of changes cannot be used: {error}") from None
    zeros = {name: value for name, value in values.items() if value != 0.0}
    return Change(stamp_of(msg), bool(from_rest), settings, zeros, from_rest == NEW)


class PredictedOutput(NamedTuple):
    """An output that every prediction gives one message of: what is put into an empty message, and with which numbers.

    ``put`` gets the message and the fields, which it places where numbers stand; ``numbers`` gives these in the same order.
    Of a block of predictions each of them is a column of it: transpose what has a row for every prediction.
    """

    output: Output
    put: Callable[[Any, NumberFields], None]
    numbers: Callable[[Prediction | PredictionBlock], Array | Sequence[Any]]


def _put_vector(msg: Any, fields: NumberFields) -> None:
    fill_xz(msg.vector, fields.row(2))


def _put_point(msg: Any, fields: NumberFields) -> None:
    fill_xz(msg.point, fields.row(2))


def _put_acceleration(msg: Any, fields: NumberFields) -> None:
    fill_xz(msg.accel.linear, fields.row(2))
    msg.accel.angular.y = fields.double()


PREDICTED = (
    PredictedOutput(Output.TIP_DISPLACEMENT, _put_vector, lambda p: p.tip_displacement.T),
    PredictedOutput(Output.TIP_POSITION, _put_point, lambda p: p.tip_position.T),
    PredictedOutput(Output.TIP_ACCELERATION, _put_acceleration, lambda p: [*p.tip_acceleration.T, -p.tip_angular_acceleration]),
)
"""In the order in which a bag has them: m; m; m/s^2 and rad/s^2. ``joint_states`` follows."""


def _put_pose(msg: Any, fields: NumberFields) -> None:
    fill_xz(msg.pose.pose.position, fields.row(2))
    msg.pose.pose.orientation.y, msg.pose.pose.orientation.w = fields.row(2)
    _put_covariance(msg.pose, fields)


def _put_acceleration_estimate(msg: Any, fields: NumberFields) -> None:
    fill_xz(msg.accel.accel.linear, fields.row(2))
    msg.accel.accel.angular.y = fields.double()
    _put_covariance(msg.accel, fields)


def _put_covariance(holder: Any, fields: NumberFields) -> None:
    """Of x, z and the turn about y; the triangle that the numbers have comes first, then what mirrors it."""
    table, (rows, columns) = np.zeros((6, 6)), np.triu_indices(3)
    places = np.array([0, 2, 4])
    table[places[rows], places[columns]] = fields.row(6)
    off = rows != columns
    table[places[columns[off]], places[rows[off]]] = fields.row(3)
    holder.covariance = table.ravel()


_MIRRORED = np.array([0, 1, 2, 3, 4, 5, 1, 2, 4])
_SIGNS = np.array([1.0, 1.0, -1.0, 1.0, -1.0, 1.0])[_MIRRORED]


def _covariance_numbers(triangle: Array) -> Array:
    """Numbers of `_put_covariance` from an upper triangle (6,) or (6, k) of x, y and the angle: the turn counts about -y."""
    return np.asarray((triangle[_MIRRORED].T * _SIGNS).T)


def _pose_numbers(e: Estimate | EstimateBlock) -> Array:
    x, y, angle = e.tip.T
    place = np.array([x, y, -np.sin(0.5 * angle), np.cos(0.5 * angle)])
    return np.concatenate([place, _covariance_numbers(e.tip_covariance.T)])


def _acceleration_numbers(e: Estimate | EstimateBlock) -> Array:
    x, y, angular = e.acceleration.T
    return np.concatenate([np.array([x, y, -angular]), _covariance_numbers(e.acceleration_covariance.T)])


class EstimatedOutput(NamedTuple):
    """As `PredictedOutput`, of the estimate beside every prediction."""

    output: Output
    put: Callable[[Any, NumberFields], None]
    numbers: Callable[[Estimate | EstimateBlock], Array]


ESTIMATED = (
    EstimatedOutput(Output.ESTIMATE_POSE, _put_pose, _pose_numbers),
    EstimatedOutput(Output.ESTIMATE_ACCELERATION, _put_acceleration_estimate, _acceleration_numbers),
    EstimatedOutput(Output.ESTIMATE_LOAD, lambda msg, fields: fill_xz(msg.wrench.force, fields.row(2)), lambda e: e.load.T),
)
"""In the order in which a bag has them, behind ``joint_states``."""


Messages = list[tuple[Output, bytes]]


class ReportEncoder:
    """Writes messages as CDR, to be published or kept in a bag; the same reports in the same order give the same bytes.

    Parameters
    ----------
    scene : Scene
        What the reports are about.
    settings : Settings
        How ``shape`` is drawn.
    frame : str
        In all headers: that of the base.
    """

    def __init__(self, scene: Scene, settings: Settings, frame: str = FRAME) -> None:
        count, self._frame = len(scene.joints), frame
        self._tip = TipJoints(scene)
        self._passive = PassiveJoints(scene)
        names = [f"{kind}_{number}" for kind in ("joint", "cylinder") for number in range(1, count + 1)]
        self._predicted = [(row.output, self._template(row.output, row.put), row.numbers) for row in PREDICTED]
        self._estimated = [(row.output, self._template(row.output, row.put), row.numbers) for row in ESTIMATED]
        self._uncertainty = self._template(Output.TIP_UNCERTAINTY, _put_vector)
        self._joints = self._joint_states([*names, *TipJoints.NAMES], count)
        self._all_joints = self._joint_states([*names, *TipJoints.NAMES, *self._passive.names], count)
        self._channels = channels_of(count)
        self._residuals: dict[tuple[str, ...], Template] = {}
        self._markers = ShapeMarkers(settings.exaggeration, settings.force_scale, frame)
        for output in Output:  # their encoders are compiled here, not when the first message waits
            jazzy().get_msgdef(TYPES[output])

    def fill(self, report: Report, is_wanted: Callable[[Output], bool] = lambda output: True) -> Messages:
        """The messages of one report.

        Parameters
        ----------
        report : Report
        is_wanted : callable
            Of which outputs; all by default.

        Returns
        -------
        list of (Output, bytes)
            Those of `PREDICTED`, ``joint_states``, those of `ESTIMATED`, and ``shape`` where it has one, if there is a
            prediction; ``residuals`` for each set of them; ``health`` and ``tip_uncertainty`` (m) where there is news of it.
        """
        messages: Messages = []
        if (p := report.prediction) is not None:
            messages += [
                (key, template.fill(p.stamp, numbers(p))) for key, template, numbers in self._predicted if is_wanted(key)
            ]
            if is_wanted(Output.JOINT_STATES):
                messages.append((Output.JOINT_STATES, self._fill_joint_states(p)))
        if (e := report.estimate) is not None:
            messages += [
                (key, template.fill(e.stamp, numbers(e))) for key, template, numbers in self._estimated if is_wanted(key)
            ]
        if report.residuals and is_wanted(Output.RESIDUALS):
            messages += [(Output.RESIDUALS, self._fill_residuals(residuals)) for residuals in report.residuals]
        if report.change is not None and is_wanted(Output.CHANGES):
            messages.append((Output.CHANGES, encode_changes(report.change, self._frame)))
        if report.health is not None:
            messages += [each for each in self._fill_health(report.health) if is_wanted(each[0])]
        if p is not None and p.shape is not None and is_wanted(Output.SHAPE):
            messages.append((Output.SHAPE, self._markers.fill(p)))
        return messages

    def fill_block(self, block: ReportBlock) -> EncodedBlock:
        """The messages of many reports: those that `fill` gives of one after the other."""
        p, residuals, found = block.predictions, block.residuals, EncodedBlockBuilder()
        turn = len(self._predicted)  # of joint_states among the messages of one sample; estimates and residuals follow
        first = turn + 1 + len(self._estimated)
        last = first + len(residuals.at)  # of health; shape follows
        if len(p.at):
            for number, (output, template, numbers) in enumerate(self._predicted):
                found.add(output, p.at, number, template.fill_rows(p.stamps, numbers(p)))
            for rows, data in self._joint_states_rows(p):
                found.add(Output.JOINT_STATES, p.at[rows], turn, data)
            for number, (output, template, estimated) in enumerate(self._estimated, start=turn + 1):
                found.add(output, p.at, number, template.fill_rows(p.stamps, estimated(block.estimates)))
        for rows, data in self._residual_rows(residuals):
            found.add(Output.RESIDUALS, residuals.at[rows], first + rows, data)
        for row, health in block.health.items():
            for number, (output, message) in enumerate(self._fill_health(health), start=last):
                found.add_one(output, row, number, message)
        for row in sorted(p.outlines):
            found.add_one(Output.SHAPE, int(p.at[row]), last + 2, self._markers.fill(p.one(row)))
        return found.block(block.stamps)

    def _template(self, key: Output, put: Callable[[Any, NumberFields], None]) -> Template:
        msg, fields = new_message(TYPES[key]), NumberFields()
        stamped(msg.header, self._frame)
        put(msg, fields)
        return Template(TYPES[key], msg, fields)

    def _joint_states(self, names: list[str], count: int) -> Template:
        """Joints first, cylinders after them, those of the tip and passive ones last; only cylinders have an effort."""
        others = len(names) - 2 * count

        def put(msg: Any, fields: NumberFields) -> None:
            own, efforts, more = (fields.row(number) for number in (2 * count, count, others))
            msg.name, msg.position = names, np.array(own + more)
            msg.effort = np.array([nan] * count + efforts + [nan] * others)

        return self._template(Output.JOINT_STATES, put)

    def _fill_joint_states(self, p: Prediction) -> bytes:
        """With the passive joints where there is a shape."""
        if p.shape is None:
            return self._joints.fill(p.stamp, self._joint_numbers(p))
        return self._all_joints.fill(p.stamp, [*self._joint_numbers(p), *self._passive.positions(p.joints)])

    def _joint_numbers(self, p: Prediction | PredictionBlock) -> Array:
        """What ``joint_states`` tells of joints, cylinders and the tip; of a block a column for every prediction."""
        tip = self._tip.positions(p.joints, p.tip_position, p.tip_angle)
        return np.concatenate([p.joints.T, p.strokes.T, p.cylinder_forces.T, tip])

    def _joint_states_rows(self, p: PredictionBlock) -> Iterator[tuple[Integers, Bytes]]:
        """Of all predictions, by rows of the block; those with a shape apart."""
        numbers, has_shape = self._joint_numbers(p), np.zeros(len(p.at), bool)
        has_shape[list(p.outlines)] = True
        bare, shaped = np.flatnonzero(~has_shape), np.flatnonzero(has_shape)
        yield bare, self._joints.fill_rows(p.stamps[bare], numbers[:, bare])
        passive = np.array([self._passive.positions(joints) for joints in p.joints[shaped]])
        columns = passive.reshape(len(shaped), len(self._passive.names)).T
        yield shaped, self._all_joints.fill_rows(p.stamps[shaped], np.concatenate([numbers[:, shaped], columns]))

    def _fill_residuals(self, residuals: Residuals) -> bytes:
        """Named channels: ``position`` residual, ``velocity`` normalised residual, ``effort`` standard deviation."""
        template = self._residual_template(residuals.names)
        return template.fill(residuals.stamp, _residual_numbers(residuals.values, residuals.sigmas))

    def _residual_rows(self, residuals: ResidualBlock) -> Iterator[tuple[Integers, Bytes]]:
        """Of all residuals, by rows of the block, each stream apart."""
        for code in set(residuals.streams.tolist()):
            rows, names = np.flatnonzero(residuals.streams == code), self._channels[STREAMS[code]]
            values, sigmas = (array[rows, : len(names)] for array in (residuals.values, residuals.sigmas))
            yield rows, self._residual_template(names).fill_rows(residuals.stamps[rows], _residual_numbers(values, sigmas))

    def _residual_template(self, names: tuple[str, ...]) -> Template:
        def put(msg: Any, fields: NumberFields) -> None:
            msg.name = list(names)
            msg.position, msg.velocity, msg.effort = (np.array(fields.row(len(names))) for _ in range(3))

        if names not in self._residuals:
            self._residuals[names] = self._template(Output.RESIDUALS, put)
        return self._residuals[names]

    def _fill_health(self, health: Health) -> Messages:
        uncertainty = self._uncertainty.fill(health.stamp, health.tip_sigmas)
        return [(Output.HEALTH, encode_health(health, self._frame)), (Output.TIP_UNCERTAINTY, uncertainty)]


def _residual_numbers(values: Array, sigmas: Array) -> Array:
    """Residual, normalised residual, standard deviation of all channels; of many residuals a column for each."""
    return np.concatenate([values.T, (values / sigmas).T, sigmas.T])
