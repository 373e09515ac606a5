"""Encode the boom's shape as visualization markers: deflected, exaggerated, undeflected, cylinders by force, tip trace."""

from __future__ import annotations

import struct
from collections import deque
from typing import Any

import numpy as np

from ..predictions import Prediction
from ..types import Array
from .cdr_encoder import NumberFields, Template, stamped
from .topic_table import FRAME, TYPES, Output
from .type_store import fill_xz, new_message

POINT = struct.Struct("<3d")
LINE_STRIP, TEXT, ADD = 4, 9, 0
LIFETIME = 1  # lifetime of a marker, s
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

    Parameters
    ----------
    force_scale : float
        Force that has the full colour, N.
    """

    def __init__(self, exaggeration: float, force_scale: float, frame: str = FRAME) -> None:
        self._factor, self._scale, self._frame = exaggeration, force_scale, frame
        self._template: Template | None = None
        self._past: deque[tuple[int, bytes]] = deque()

    def fill(self, prediction: Prediction) -> bytes:
        """Return the encoded message of a prediction that has a shape."""
        line, straight, pins = prediction.shape, prediction.undeflected, prediction.pins
        assert line is not None and straight is not None and pins is not None
        large = straight + self._factor * (line - straight)
        label = large[-1] + (0.0, 2.0 * TEXT_HEIGHT)
        if self._template is None:
            self._template = self._new_template(len(line), len(pins))
        numbers = np.concatenate([part.ravel() for part in (line, large, label, straight, pins, prediction.tip_position)])
        colours = [value for force in prediction.cylinder_forces for value in force_colour(float(force) / self._scale)]
        self._extend_trace(prediction.stamp, prediction.tip_position)
        (data,) = self._template.fill(np.array([prediction.stamp]), numbers, colours)
        return self._with_trace(data.tobytes())

    def _new_template(self, points: int, cylinders: int) -> Template:
        """Return the template of a message whose lines have `points` points and whose trace has one point."""
        msg, fields = new_message(TYPES[Output.SHAPE]), NumberFields()
        msg.markers = [
            self._line("boom", 0, 0.12, BOOM, fields, points),
            self._line("boom_exaggerated", 0, 0.06, LARGE, fields, points),
            self._label("boom_exaggerated", 1, f"displacements x {self._factor:g}", fields),
            self._line("boom_undeflected", 0, 0.06, GHOST, fields, points),
            *(self._line("cylinders", i + 1, 0.09, None, fields, 2) for i in range(cylinders)),
            self._line("tip_trace", 0, 0.03, TIP, fields, 1),
        ]
        return Template([(TYPES[Output.SHAPE], msg)], fields)

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
        stamped(marker.header, self._frame)
        marker.ns, marker.id, marker.type, marker.action = namespace, number, kind, ADD
        marker.pose.orientation.w, marker.lifetime.sec = 1.0, LIFETIME
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = colour
        return marker


def force_colour(share: float) -> Colour:
    """Return the colour of a cylinder: grey at `share` 0, red at 1 (tension), blue at -1 (compression), pale grey for NaN."""
    if share != share:
        return GHOST
    end = TENSION if share > 0.0 else COMPRESSION
    red, green, blue = (NO_FORCE + min(abs(share), 1.0) * (end - NO_FORCE)).tolist()
    return red, green, blue, 1.0
