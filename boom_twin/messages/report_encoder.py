"""Encode a `Report` of the twin as ROS messages: tip, residuals, joint states, changes, health."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import nan
from typing import Any

import numpy as np

from ..config.settings import Settings
from ..errors import BagError, UsageError
from ..health.alarms import alarm_of, values_of
from ..scene.kinematics import PassiveJoints
from ..scene.schema import Scene
from ..twin.blocks import STREAMS, Integers, ReportBlock, ResidualBlock
from ..twin.report_rows import ReportRows
from ..types import Alarm, Array, Change, Health, Prediction, Report, Residuals, channels_of
from .cdr_encoder import NumberFields, Template, stamped
from .encoded_block import Bytes, EncodedBlock, EncodedBlockBuilder
from .marker_encoder import ShapeMarkers
from .message_fields import FRAME, fill_header
from .numeric_outputs import ESTIMATED, PREDICTED, Selection, put_vector
from .prediction_numbers import JOINTS, TIP_JOINTS, Chain, number_columns
from .row_encoder import RowEncoder
from .sample_decoder import stamp_of
from .topic_table import TYPES, Output
from .type_store import jazzy, new_message

OK, WARN, ERROR = range(3)
"""Levels of diagnostic_msgs/DiagnosticStatus: the alarm has ended; its cause is unknown; its cause is named."""


def encode_health(health: Health, frame: str = FRAME) -> bytes:
    """Return `health` as a diagnostic_msgs/DiagnosticArray in CDR, with its stamp; see ``topics.yaml`` for its values."""
    msg = new_message(TYPES[Output.HEALTH])
    fill_header(msg.header, health.stamp, frame)
    msg.status = [_status(alarm) for alarm in health.alarms]
    return bytes(jazzy().serialize_cdr(msg, TYPES[Output.HEALTH]))


def decode_health(msg: Any) -> tuple[Alarm, ...]:
    """Return the alarms of a DiagnosticArray, see `boom_twin.health.alarms.alarm_of`. A status without an alarm is left out."""
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
    """Return the message of a change in CDR."""
    values = {FROM_REST: NEW if change.is_new else float(change.from_rest), **change.settings, **change.zeros}
    msg = new_message(TYPES[Output.CHANGES])
    fill_header(msg.header, change.stamp, frame)
    msg.name, msg.position = list(values), np.array(list(values.values()), dtype=float)
    return bytes(jazzy().serialize_cdr(msg, TYPES[Output.CHANGES]))


def decode_changes(msg: Any) -> Change:
    """Return the change in a decoded message.

    Raises
    ------
    BagError
        The message has names or values that a change cannot have.
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


Messages = list[tuple[Output, bytes]]


class ReportEncoder:
    """Encoder of reports as messages in CDR, to publish or to record. Equal reports in equal order give equal bytes.

    Parameters
    ----------
    scene : Scene
        Scene of the reports.
    settings : Settings
        Settings of the drawing ``shape``.
    frame : str
        Frame in all headers, that of the base.
    """

    def __init__(self, scene: Scene, settings: Settings, frame: str = FRAME) -> None:
        count, self._frame = len(scene.joints), frame
        self._passive = PassiveJoints(scene)
        self._chain = Chain(np.array(scene.base.pivot), np.array([section.length for section in scene.sections]))
        own = [f"{kind}_{number}" for kind in ("joint", "stroke", "force") for number in range(1, count + 1)]
        names = [f"{kind}_{number}" for kind in ("joint", "cylinder") for number in range(1, count + 1)]
        joints = self._joint_states([*names, *TIP_JOINTS], count), Selection.named([*own, *TIP_JOINTS], count)
        self._all_joints = self._joint_states([*names, *TIP_JOINTS, *self._passive.names], count)
        predicted, self._estimated = (
            [(row.output, self._template(row.output, row.put), Selection.named(row.numbers, count)) for row in table]
            for table in (PREDICTED, ESTIMATED)
        )
        self._predicted = [*predicted, (Output.JOINT_STATES, *joints)]
        self._uncertainty = self._template(Output.TIP_UNCERTAINTY, put_vector)
        self._channels = channels_of(count)
        self._residuals: dict[tuple[str, ...], Template] = {}
        self._compiled: RowEncoder | None = None
        self._markers = ShapeMarkers(settings.exaggeration, settings.force_scale, frame)
        for output in Output:  # their encoders are compiled here, not when the first message waits
            jazzy().get_msgdef(TYPES[output])

    def warm_up(self) -> None:
        """Compile the encoder of single reports now; without this call, the first report compiles it."""
        residuals = [(self._residual_template(names), 3 * len(names)) for names in self._channels.values()]
        self._compiled = RowEncoder(self._chain, [*self._predicted, *self._estimated], residuals)

    def fill(self, report: Report, is_wanted: Callable[[Output], bool] = lambda output: True) -> Messages:
        """Return the messages of one report.

        Parameters
        ----------
        report : Report
        is_wanted : callable
            Returns True for an output that is wanted; by default for all.

        Returns
        -------
        list of (Output, bytes)
            With a prediction: the outputs `PREDICTED`, ``joint_states``, `ESTIMATED`, and ``shape`` if it has one.
            ``residuals`` for each set of residuals. ``changes`` with a change. ``health`` and ``tip_uncertainty`` (m) with
            new health.
        """
        rows: ReportRows | None = report.rows
        if rows is None:
            messages, has_shape = self._fill_numbers(report, is_wanted), _has_shape(report.prediction)
        else:
            messages, has_shape = self._fill_rows(rows, is_wanted), rows.outline is not None
        if report.change is not None and is_wanted(Output.CHANGES):
            messages.append((Output.CHANGES, encode_changes(report.change, self._frame)))
        if report.health is not None:
            messages += [each for each in self._fill_health(report.health) if is_wanted(each[0])]
        if has_shape and is_wanted(Output.SHAPE):
            assert report.prediction is not None
            messages.append((Output.SHAPE, self._markers.fill(report.prediction)))
        return messages

    def _fill_rows(self, rows: ReportRows, is_wanted: Callable[[Output], bool]) -> Messages:
        """Return the messages of prediction, estimate and residuals, encoded from the rows of the report by compiled code."""
        if self._compiled is None:
            self.warm_up()
        assert self._compiled is not None
        messages = [] if rows.row is None else self._compiled.fill(rows, is_wanted)
        if rows.outline is not None:
            numbers = self._compiled.numbers[:, np.newaxis]
            messages = [
                (key, self._fill_joint_states(rows.stamp, numbers, True) if key is Output.JOINT_STATES else message)
                for key, message in messages
            ]
        if rows.streams and is_wanted(Output.RESIDUALS):
            messages += [(Output.RESIDUALS, each) for each in self._compiled.fill_residuals(rows)]
        return messages

    def _fill_numbers(self, report: Report, is_wanted: Callable[[Output], bool]) -> Messages:
        """Return the messages of prediction, estimate and residuals, encoded without compiled code."""
        p, e, messages = report.prediction, report.estimate, Messages()
        told = [(each.stamp, outputs) for each, outputs in ((p, self._predicted), (e, self._estimated)) if each is not None]
        numbers = number_columns(self._chain, p, e, 1) if told else np.zeros((0, 1))
        for stamp, outputs in told:
            for key, template, chosen in outputs:
                if key is Output.JOINT_STATES and is_wanted(key):
                    messages.append((key, self._fill_joint_states(stamp, numbers, _has_shape(p))))
                elif is_wanted(key):
                    messages.append((key, template.fill(stamp, chosen.of(numbers)[:, 0])))
        if report.residuals and is_wanted(Output.RESIDUALS):
            messages += [(Output.RESIDUALS, self._fill_residuals(residuals)) for residuals in report.residuals]
        return messages

    def fill_block(self, block: ReportBlock) -> EncodedBlock:
        """Return the messages of many reports, equal to those of `fill` for one report after the other."""
        p, residuals, found = block.predictions, block.residuals, EncodedBlockBuilder()
        turn = len(self._predicted)  # of estimates among the messages of one sample; residuals follow
        first = turn + len(self._estimated)
        last = first + len(residuals.at)  # of health; shape follows
        if len(p.at):
            numbers = number_columns(self._chain, p, block.estimates, len(p.at))
            shaped = np.zeros(len(p.at), bool)
            shaped[list(p.outlines)] = True
            for number, (output, template, chosen) in enumerate([*self._predicted, *self._estimated]):
                rows = np.flatnonzero(~shaped) if output is Output.JOINT_STATES else slice(None)
                found.add(output, p.at[rows], number, template.fill_rows(p.stamps[rows], chosen.of(numbers[:, rows])))
            rows, data = np.flatnonzero(shaped), self._shaped_joint_states(p.stamps[shaped], numbers[:, shaped])
            found.add(Output.JOINT_STATES, p.at[rows], turn - 1, data)
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
        """Return a template with joints, cylinders, joints of the tip and passive joints. Only cylinders have an effort."""
        others = len(names) - 2 * count

        def put(msg: Any, fields: NumberFields) -> None:
            own, efforts, more = (fields.row(number) for number in (2 * count, count, others))
            msg.name, msg.position = names, np.array(own + more)
            msg.effort = np.array([nan] * count + efforts + [nan] * others)

        return self._template(Output.JOINT_STATES, put)

    def _fill_joint_states(self, stamp: int, numbers: Array, is_shaped: bool) -> bytes:
        """Return the joint states of numbers, shape (all, 1), with passive joints if `is_shaped`."""
        _, template, chosen = self._predicted[-1]
        own = chosen.of(numbers)[:, 0]
        if not is_shaped:
            return template.fill(stamp, own)
        passive = self._passive.positions(numbers[JOINTS : JOINTS + len(self._chain.lengths), 0])
        return self._all_joints.fill(stamp, [*own, *passive])

    def _shaped_joint_states(self, stamps: Integers, numbers: Array) -> Bytes:
        """Return joint states with passive joints, a row for each of the stamps (ns), from numbers, shape (all, k)."""
        _, _, chosen = self._predicted[-1]
        joints = numbers[JOINTS : JOINTS + len(self._chain.lengths)]
        passive = np.array([self._passive.positions(column) for column in joints.T])
        others = passive.reshape(len(stamps), len(self._passive.names)).T
        return self._all_joints.fill_rows(stamps, np.concatenate([chosen.of(numbers), others]))

    def _fill_residuals(self, residuals: Residuals) -> bytes:
        """Return a message of residuals: ``position`` residual, ``velocity`` normalised, ``effort`` standard deviation."""
        template = self._residual_template(residuals.names)
        return template.fill(residuals.stamp, _residual_numbers(residuals.values, residuals.sigmas))

    def _residual_rows(self, residuals: ResidualBlock) -> Iterator[tuple[Integers, Bytes]]:
        """Yield rows of the block and their messages of residuals, one stream after the other."""
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


def _has_shape(prediction: Prediction | None) -> bool:
    return prediction is not None and prediction.shape is not None


def _residual_numbers(values: Array, sigmas: Array) -> Array:
    """Return residuals, normalised residuals and standard deviations of all channels; a column for each of many residuals."""
    return np.concatenate([values.T, (values / sigmas).T, sigmas.T])
