"""The node's parameters: declared from the table of `Settings`, frozen while the node is configured."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic.fields import FieldInfo
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, ParameterType, SetParametersResult
from rclpy.exceptions import InvalidParameterTypeException, ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..errors import UsageError
from ..settings import Settings, settings_from
from ..thresholds import Thresholds, thresholds_from
from .context import one_line

SOURCE = "parameters of the node"
_LARGEST = sys.float_info.max


def declare(node: Node) -> None:
    """Declare ``scene``, ``autostart``, all settings and thresholds.

    Raises
    ------
    UsageError
        A value given at start has the wrong type or is out of range.
    """
    try:
        node.declare_parameter("scene", "", _text("path of the scene file; empty = the scene of the package"))
        node.declare_parameter("autostart", True, _switch("the node configures and activates itself"))
        for name, field in {**Settings.model_fields, **Thresholds.model_fields}.items():
            node.declare_parameter(name, float(field.default), _number(name, field))
    except InvalidParameterTypeException as error:
        raise UsageError(f"{SOURCE}: {one_line(error)}. A number needs a decimal point: 1.0, not 1.") from error
    except ParameterException as error:
        raise UsageError(f"{SOURCE}: {one_line(error)}. See msg_config/twin.yaml.") from error


def refuse_while(node: Node, frozen: Callable[[], bool]) -> None:
    """Refuse changes of these parameters while `frozen`, and values out of bounds at any time."""
    own = {"scene", *Settings.model_fields}

    def check(parameters: list[Parameter[Any]]) -> SetParametersResult:
        changed = {parameter.name: parameter.value for parameter in parameters if parameter.name in own}
        if changed and frozen():
            reason = f"{', '.join(changed)}: fixed while the node is configured. Deactivate and clean it up first."
            return SetParametersResult(successful=False, reason=reason)
        changed.pop("scene", None)
        live = {parameter.name: parameter.value for parameter in parameters if parameter.name in Thresholds.model_fields}
        try:
            settings_from(changed, SOURCE)
            thresholds_from(live, SOURCE)
        except UsageError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(check)


def on_thresholds(node: Node, tune: Callable[[Thresholds], None]) -> None:
    """Call `tune` with the thresholds as they stand, now and after every change of one."""

    def apply(parameters: list[Parameter[Any]]) -> None:
        if any(parameter.name in Thresholds.model_fields for parameter in parameters):
            tune(_thresholds_of(node))

    tune(_thresholds_of(node))
    node.add_post_set_parameters_callback(apply)


def _thresholds_of(node: Node) -> Thresholds:
    return thresholds_from({name: node.get_parameter(name).value for name in Thresholds.model_fields}, SOURCE)


def scene_path(node: Node) -> Path | None:
    """The scene to load; None = the package's own."""
    text: str = node.get_parameter("scene").value
    return Path(text) if text else None


def settings_of(node: Node) -> Settings:
    """The settings as the parameters stand; UsageError if a value is out of bounds."""
    return settings_from({name: node.get_parameter(name).value for name in Settings.model_fields}, SOURCE)


def _text(description: str) -> ParameterDescriptor:
    return ParameterDescriptor(type=ParameterType.PARAMETER_STRING, description=description)


def _switch(description: str) -> ParameterDescriptor:
    return ParameterDescriptor(type=ParameterType.PARAMETER_BOOL, description=description, read_only=True)


def _number(name: str, field: FieldInfo) -> ParameterDescriptor:
    """Type, meaning and bounds of one setting; a ROS range includes its ends, so words say where they are out."""
    keys = ("gt", "ge", "lt", "le")
    bounds = {key: float(getattr(rule, key)) for rule in field.metadata for key in keys if hasattr(rule, key)}
    words = {"gt": f"{name} > {bounds.get('gt')}", "lt": f"{name} < {bounds.get('lt')}"}
    low = bounds.get("gt", bounds.get("ge", -_LARGEST))
    high = bounds.get("lt", bounds.get("le", _LARGEST))
    return ParameterDescriptor(
        type=ParameterType.PARAMETER_DOUBLE,
        description=field.description or "",
        additional_constraints=", ".join(text for key, text in words.items() if key in bounds),
        floating_point_range=[FloatingPointRange(from_value=low, to_value=high, step=0.0)],
    )
