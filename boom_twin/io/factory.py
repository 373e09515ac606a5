"""Empty messages of rosbags by type name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from operator import call
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype

from .typestore import jazzy

Maker = Callable[[], Any]


class RosbagsTypes:
    """Messages as plain dataclasses of rosbags; needs no ROS."""

    def __init__(self) -> None:
        self._makers: dict[str, Maker] = {}

    def make(self, type_name: str) -> Any:
        """A new message of ``package/msg/Name`` with every field zero or empty (a quaternion's w too)."""
        return self._maker(type_name)()

    def doubles(self, values: Iterable[float]) -> Any:
        """`values` as a new float64 array, shape (len(values),)."""
        return np.array(values, dtype=np.float64)

    def _maker(self, type_name: str) -> Maker:
        """The function that makes `type_name`, built once from its definition."""
        if type_name not in self._makers:
            store = jazzy()
            kind: Any = store.types[type_name]
            fields = [self._field(description) for _, description in store.fielddefs[type_name][1]]
            self._makers[type_name] = lambda: kind(*map(call, fields))
        return self._makers[type_name]

    def _field(self, description: Any) -> Maker:
        """The function that makes one field of the given description."""
        node, detail = description
        if node is Nodetype.NAME:
            return self._maker(detail)
        if node is Nodetype.BASE:
            return {"string": str, "bool": bool, "float32": float, "float64": float}.get(detail[0], int)
        element, length = detail if node is Nodetype.ARRAY else (detail[0], 0)
        if element[0] is Nodetype.BASE and element[1][0] != "string":
            kind = {"byte": "uint8", "char": "uint8"}.get(element[1][0], element[1][0])
            return partial(np.zeros, length, dtype=kind)
        single = self._field(element)
        return lambda: [single() for _ in range(length)]
