"""Services of the node: start again from rest, set the zero of a sensor, acknowledge alarms; log lines of their effect."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.service import Service
from std_srvs.srv import Trigger

from ...errors import UsageError
from ...twin.adjustments import WHOLE
from ...twin.twin import Twin
from ...types import SENSORS, Change, Report, Stream, StrokeReading, streams_of
from ..runtime import Log

FROM_REST = re.compile(r"reset|rezero/cylinder_\d+")
INACTIVE = "the node is not active, so nothing is measured. Activate it first."


class Services:
    """Services of the node, all of type std_srvs/Trigger.

    ``~/reset``, ``~/acknowledge`` and by sensor ``~/rezero/joint_i``, ``cylinder_i``, ``cylinder_force_i``, ``tip_imu``.
    ``~/scene`` answers with `scene`, the text from which the model was built. `acknowledge` releases ended alarms and returns
    them in words. `catch_up` lets the twin take what arrived before a request.
    """

    def __init__(
        self,
        node: Node,
        twin: Twin,
        acknowledge: Callable[[], str],
        is_active: Callable[[], bool],
        catch_up: Callable[[], None],
        scene: str,
    ) -> None:
        self._node, self._twin, self._is_active, self._catch_up = node, twin, is_active, catch_up
        numbers = range(1, twin.plan.joints + 1)
        driven = (Stream.STROKES, Stream.ANGLES) if twin.reads is StrokeReading.ANGLE else ()
        there = [SENSORS[stream] for stream in streams_of(twin.places) if stream not in driven]
        single = [kind.stem for kind in there if not kind.ends]
        whole = [kind.stem for kind in there if kind.stem in WHOLE and not kind.beside]
        sensors = [f"{stem}_{number}" for stem in single for number in numbers] + whole
        acts: dict[str, Callable[[], str]] = {"reset": self._reset, "acknowledge": acknowledge}
        acts |= {f"rezero/{sensor}": partial(self._rezero, sensor) for sensor in sensors}
        self._called: dict[str, float] = {}
        self._services: list[Service] = [
            node.create_service(Trigger, f"~/{name}", partial(self._answer, name, act)) for name, act in acts.items()
        ]
        self._services.append(node.create_service(Trigger, "~/scene", partial(_tell, scene)))

    def close(self) -> None:
        """Withdraw the services."""
        for service in self._services:
            self._node.destroy_service(service)

    def _answer(self, name: str, act: Callable[[], str], request: Any, response: Any) -> Any:
        try:
            if not self._is_active():
                raise UsageError(INACTIVE)
            self._limit(name)
            self._catch_up()
            response.success, response.message = True, act()
        except UsageError as error:
            response.success, response.message = False, str(error)
        return response

    def _limit(self, name: str) -> None:
        """Raise UsageError if a service that restarts the model from static equilibrium is called again too soon."""
        pause = 1.0  # s between two calls: a start from rest takes as long as hundreds of steps
        now = time.monotonic()
        if FROM_REST.fullmatch(name):
            if now - self._called.get(name, -pause) < pause:
                told = f"{name} was called less than {pause:g} s ago, and the model starts from rest with it"
                raise UsageError(f"{told}. Call it again later.")
            self._called[name] = now

    def _reset(self) -> str:
        self._twin.requests.rest()
        return "starts again from rest with the next full stroke sample"

    def _rezero(self, sensor: str) -> str:
        found = self._twin.rezero(sensor)
        told = ", ".join(f"zero of {name}: {value:g}" for name, value in found.items())
        return f"{told}; holds from the next full stroke sample on"


def _tell(text: str, request: Any, response: Any) -> Any:
    response.success, response.message = True, text
    return response


LOG_PERIOD = 1.0
"""Least time (s) between starts that are told: a source whose clock jumps at every sample does not fill the log."""


class StartLog:
    """Log of the changes from which on the model runs with other settings or zeros, or restarts from static equilibrium."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._before: dict[str, float] | None = None
        self._told = -LOG_PERIOD

    def tell(self, report: Report, change: Change) -> None:
        """Log one line on a report that has a change."""
        now = {**change.settings, **{f"zero of {name}": value for name, value in change.zeros.items()}}
        before, self._before = now if self._before is None else self._before, now
        words = [f"{name} {value:g}" for name, value in now.items() if before.get(name) != value]
        if not words and time.monotonic() < self._told + LOG_PERIOD:
            return
        if not report.accepted:
            words.insert(0, f"could not start: {report.status}")
        elif change.from_rest:
            words.insert(0, f"started from rest ({', '.join(report.events) or 'first strokes'})")
        if not words:  # the requested values were set before
            return
        self._told = time.monotonic()
        self._log.info(f"at {change.stamp // 10**9}.{change.stamp % 10**9:09d}: {'; '.join(words)}")
