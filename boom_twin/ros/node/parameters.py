"""The node's parameters, from one table: its own here, those of others in `Settings` and `Thresholds`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, ParameterType, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ...config.settings import Settings, Table, Thresholds, checked, nearest
from ...errors import UsageError
from ...messages.topic_table import Topics
from ..runtime import one_line

SOURCE = "parameters of the node"
FIXED, LIVE, AT_START = "fixed while the node is configured", "changes at once", "given at start"
_LARGEST = sys.float_info.max


@dataclass(frozen=True, slots=True)
class ParameterRow:
    """Row of the table of parameters. Its type is that of the default; its unit stands at the end of the text."""

    name: str
    default: str | bool | float
    text: str
    when: str
    bounds: dict[str, float] | None = None


def _row(name: str, field: FieldInfo, is_live: bool) -> ParameterRow:
    keys = ("gt", "ge", "lt", "le")
    bounds = {key: float(getattr(rule, key)) for rule in field.metadata for key in keys if hasattr(rule, key)}
    return ParameterRow(name, float(field.default), field.description or "", LIVE if is_live else FIXED, bounds)


TABLE = (
    ParameterRow("scene", "", "path of the scene file; empty: the scene of the package", FIXED),
    ParameterRow("mapping", "", "path of the file of topics and sensors; empty: topics.yaml", AT_START),
    ParameterRow("health", True, "judge the rig's health: ~/health, ~/tip/uncertainty", FIXED),
    ParameterRow("causes", True, "name causes of what health sees, by twins of booms that have a fault", FIXED),
    ParameterRow("frame_prefix", "", "put before the frame of all outputs, as robot_state_publisher does: front/", FIXED),
    ParameterRow("hardware_id", "", "of the boom, in every status of /diagnostics; empty: the node's name", AT_START),
    ParameterRow("autostart", True, "the node configures and activates itself", AT_START),
    ParameterRow("monitor", False, "the live page runs beside the node, in a process of its own", FIXED),
    *(_row(name, field, name in Settings.live_names()) for name, field in Settings.model_fields.items()),
    *(_row(name, field, True) for name, field in Thresholds.model_fields.items()),
)


def declare(node: Node) -> None:
    """Declare every row of the table.

    Raise UsageError if a value given at start has the wrong type or is out of range, or is of a parameter that there is not,
    or no more.
    """
    given = node._parameter_overrides  # rclpy has no public way to see those that were not declared
    try:
        for row in TABLE:
            node.declare_parameter(row.name, row.default, _descriptor(row))
    except InvalidParameterTypeException as error:
        is_whole = "INTEGER" in str(error) and "DOUBLE" in str(error)
        remedy = "A number needs a decimal point: 1.0, not 1." if is_whole else "See msg_config/twin.yaml."
        raise UsageError(f"{SOURCE}: {one_line(error)}. {remedy}") from error
    except ParameterException as error:
        raise UsageError(f"{SOURCE}: {one_line(error)}. See msg_config/twin.yaml.") from error
    if told := _unknown(node, given):
        raise UsageError(f"{SOURCE}: {told}. See msg_config/twin.yaml.")


def _unknown(node: Node, names: Iterable[str]) -> str:
    """Return an error text on the `names` that are no parameters; empty if all are."""
    # rclpy declares QoS overrides with their topics
    unknown = sorted(name for name in names if not (node.has_parameter(name) or name.startswith("qos_overrides.")))
    known = [row.name for row in TABLE]
    return "; ".join(f"{name}: unknown. The nearest is `{nearest(name, known)}`" for name in unknown)


def refusal(node: Node, parameters: Iterable[Parameter[Any]]) -> str:
    """Return why these cannot be set, for faults of which rclpy gives no remedy: unknown name, whole number; else empty."""
    given = {parameter.name: parameter for parameter in parameters}
    if told := _unknown(node, given):
        return f"{told}. `ros2 param list` names all."
    kinds = {row.name: type(row.default) for row in TABLE}
    integers = {name: each.value for name, each in given.items() if each.type_ == Parameter.Type.INTEGER}
    whole = [(name, value) for name, value in integers.items() if kinds.get(name) is float]
    return "; ".join(f"{name}: a number needs a decimal point: {value}.0, not {value}" for name, value in whole)


def guard(node: Node, is_configured: Callable[[], bool], tune: Callable[[dict[str, float]], None]) -> None:
    """Refuse values that cannot be set, with the reason; pass live values that were set to `tune`."""
    fixed = {row.name for row in TABLE if row.when == FIXED}

    def check(parameters: list[Parameter[Any]]) -> SetParametersResult:
        values = {parameter.name: parameter.value for parameter in parameters}
        if is_configured() and (refused := sorted(fixed & values.keys())):
            reason = f"{', '.join(refused)}: {FIXED}. Deactivate and clean it up first."
            return SetParametersResult(successful=False, reason=reason)
        try:
            for table in (Settings, Thresholds):
                checked(table, {name: value for name, value in values.items() if name in table.model_fields}, SOURCE)
        except UsageError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def apply(parameters: list[Parameter[Any]]) -> None:
        live = {row.name for row in TABLE if row.when == LIVE}
        if changed := {each.name: each.value for each in parameters if each.name in live}:
            tune(changed)

    node.add_on_set_parameters_callback(check)
    node.add_post_set_parameters_callback(apply)


def path_of(node: Node, name: str) -> Path | None:
    """Return the path in the parameter ``scene`` or ``mapping``; None = the package's own."""
    text: str = node.get_parameter(name).value
    return Path(text) if text else None


def frame_of(node: Node, topics: Topics) -> str:
    """Return the frame of all outputs; raise UsageError for an invalid prefix."""
    prefix: str = node.get_parameter("frame_prefix").value
    if prefix.startswith("/"):
        told = "names of frames have no leading slash (tf2)"
        raise UsageError(f"{SOURCE}: frame_prefix = {prefix!r}: {told}. Give {prefix.lstrip('/')!r}.")
    return prefix + topics.frame


def current(node: Node, table: type[Table]) -> Table:
    """Return `Settings` or `Thresholds` as the parameters stand; raise UsageError if a value is out of bounds."""
    return checked(table, {name: node.get_parameter(name).value for name in table.model_fields}, SOURCE)


def _descriptor(row: ParameterRow) -> ParameterDescriptor:
    """Return type, meaning and bounds of a parameter. A ROS range includes its ends, so words state where they are excluded."""
    kinds = {str: ParameterType.PARAMETER_STRING, bool: ParameterType.PARAMETER_BOOL, float: ParameterType.PARAMETER_DOUBLE}
    descriptor = ParameterDescriptor(
        type=kinds[type(row.default)], description=row.text, read_only=row.when == AT_START, additional_constraints=row.when
    )
    if row.bounds is not None:
        words = {"gt": f"{row.name} > {row.bounds.get('gt')}", "lt": f"{row.name} < {row.bounds.get('lt')}"}
        told = [text for key, text in words.items() if key in row.bounds]
        descriptor.additional_constraints = "; ".join([*told, row.when])
        low = row.bounds.get("gt", row.bounds.get("ge", -_LARGEST))
        high = row.bounds.get("lt", row.bounds.get("le", _LARGEST))
        descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high, step=0.0)]
    return descriptor
