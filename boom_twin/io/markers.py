"""The boom as markers: deflected, exaggerated, undeflected, its cylinders by force, the trace of its tip."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

from ..records import Array, Prediction
from .places import fill_header, fill_xz
from .topics import TYPES, Output

if TYPE_CHECKING:
    from .factory import Types

LINE_STRIP, TEXT, ADD = 4, 9, 0
LIFETIME = 1
"""Seconds that a marker stays when no other comes."""
TRACE = 5_000_000_000
"""Nanoseconds of the tip's trace."""
TEXT_HEIGHT = 0.35
"""m."""

Colour = tuple[float, float, float, float]
BOOM: Colour = (0.90, 0.45, 0.10, 1.0)
LARGE: Colour = (0.55, 0.30, 0.75, 0.8)
GHOST: Colour = (0.60, 0.60, 0.60, 0.5)
TIP: Colour = (0.10, 0.60, 0.35, 1.0)
NO_FORCE, TENSION, COMPRESSION = (np.array(rgb) for rgb in ((0.75, 0.75, 0.75), (0.80, 0.05, 0.05), (0.05, 0.20, 0.85)))


class ShapeMarkers:
    """Fills one MarkerArray; namespaces and ids are the same in every message.

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

    Parameters
    ----------
    types : Types
        Makes the empty messages.
    exaggeration : float
        Factor of the displacements.
    force_scale : float
        Force that has the full colour, N.
    """

    def __init__(self, types: Types, exaggeration: float, force_scale: float) -> None:
        self._types, self._factor, self._scale = types, exaggeration, force_scale
        self._message = types.make(TYPES[Output.SHAPE])
        self._boom = self._line("boom", 0, 0.12, BOOM)
        self._large = self._line("boom_exaggerated", 0, 0.06, LARGE)
        self._text = self._label("boom_exaggerated", 1, f"displacements x {exaggeration:g}")
        self._ghost = self._line("boom_undeflected", 0, 0.06, GHOST)
        self._trace = self._line("tip_trace", 0, 0.03, TIP)
        self._cylinders: list[Any] = []
        self._past: deque[tuple[int, Any]] = deque()

    def fill(self, prediction: Prediction) -> Any:
        """The message of a prediction that has a shape; it is filled anew at the next call."""
        line, straight, pins = prediction.shape, prediction.undeflected, prediction.pins
        assert line is not None and straight is not None and pins is not None
        large = straight + self._factor * (line - straight)
        for marker, points in ((self._boom, line), (self._large, large), (self._ghost, straight)):
            self._put(marker, points)
        fill_xz(self._text.pose.position, large[-1] + (0.0, 2.0 * TEXT_HEIGHT))
        self._draw_cylinders(pins, prediction.cylinder_forces)
        self._extend_trace(prediction.stamp, prediction.tip_position)
        markers = [self._boom, self._large, self._text, self._ghost, *self._cylinders, self._trace]
        for marker in markers:
            fill_header(marker.header, prediction.stamp)
        self._message.markers = markers
        return self._message

    def _draw_cylinders(self, pins: Array, forces: Array) -> None:
        while len(self._cylinders) < len(pins):
            self._cylinders.append(self._line("cylinders", len(self._cylinders) + 1, 0.09, GHOST))
        for marker, ends, force in zip(self._cylinders, pins.reshape(-1, 2, 2), forces, strict=True):
            self._put(marker, ends)
            _paint(marker, force_colour(float(force) / self._scale))

    def _extend_trace(self, stamp: int, tip: Array) -> None:
        """Forget what is too old, and what is to come where time was set back; add the newest."""
        while self._past and self._past[-1][0] >= stamp:
            self._past.pop()
        while self._past and self._past[0][0] < stamp - TRACE:
            self._past.popleft()
        point = self._types.make("geometry_msgs/msg/Point")
        fill_xz(point, tip)
        self._past.append((stamp, point))
        self._trace.points = [place for _, place in self._past]

    def _put(self, marker: Any, points: Array) -> None:
        """Give a line its points."""
        if len(marker.points) != len(points):
            marker.points = [self._types.make("geometry_msgs/msg/Point") for _ in points]
        for point, (x, y) in zip(marker.points, points.tolist(), strict=True):
            point.x, point.z = x, y

    def _line(self, namespace: str, number: int, width: float, colour: Colour) -> Any:
        marker = self._marker(namespace, number, LINE_STRIP, colour)
        marker.scale.x = width
        return marker

    def _label(self, namespace: str, number: int, text: str) -> Any:
        marker = self._marker(namespace, number, TEXT, LARGE)
        marker.scale.z, marker.text = TEXT_HEIGHT, text
        return marker

    def _marker(self, namespace: str, number: int, kind: int, colour: Colour) -> Any:
        marker = self._types.make("visualization_msgs/msg/Marker")
        marker.ns, marker.id, marker.type, marker.action = namespace, number, kind, ADD
        marker.pose.orientation.w, marker.lifetime.sec = 1.0, LIFETIME
        _paint(marker, colour)
        return marker


def force_colour(share: float) -> Colour:
    """Grey without force, red at a tension of `share` 1, blue at a compression of -1; grey and pale for NaN."""
    if share != share:
        return GHOST
    end = TENSION if share > 0.0 else COMPRESSION
    red, green, blue = (NO_FORCE + min(abs(share), 1.0) * (end - NO_FORCE)).tolist()
    return red, green, blue, 1.0


def _paint(marker: Any, colour: Colour) -> None:
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = colour
