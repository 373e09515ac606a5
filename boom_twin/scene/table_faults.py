"""Faults of a scene that was worked out from a table, told at the keys and lines of the table, where they are mended."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..config.yaml_text import Document, Place
from ..errors import ABSENT, Fault

ORIGINS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (r"(sections\[\d+\])\.(A|I|rho_I)", (r"\1.wall",)),
    (r"(sections\[\d+\])\.rho_A", (r"\1.pipe", "pipe", r"\1.wall")),
    (r"(sections\[\d+\])\.(root|head)\b.*", (r"\1.beam",)),
    (r"sections\[\d+\]\.beta", ("damping_ratio",)),
    (r"joints\[\d+\]\.cylinder\.d", ("damping_ratio",)),
    (r"joints\[\d+\]\.cylinder\.oil\.bulk_modulus", ("bulk_modulus",)),
    (r"(joints\[\d+\])\.cylinder\.oil\.(\w+)", (r"\1.\2",)),
    (r"(joints\[\d+\])\.cylinder\.(closed_length|max_stroke)", (r"\1.\2", r"\1.range_deg")),
    (r"(joints\[\d+\])\.cylinder\.rod\b.*", (r"\1.rod",)),
    (r"(joints\[\d+\])\.cylinder\..*", (r"\1.bore",)),
    (r"tip\.payload", ("payload",)),
)
"""Paths of a scene, and the keys of a table that they come from, of which the first that is there is told."""


def in_table(faults: Sequence[Fault], table: Document) -> list[Fault]:
    """The faults with paths, values and lines of the table, in the order of these; one of each value that others come from."""
    told = [table.fault(place_of(each.path), each.value, each.bound, each.remedy) for each in faults if not _origins(each.path)]
    blocks = {place_of(each.path)[:2] for each in told}
    of_origins: dict[str, Fault] = {}
    for fault in faults:
        if (places := _origins(fault.path)) and place_of(fault.path)[:2] not in blocks:  # else it follows from what is told
            moved = _at_origin(fault, places, table)
            of_origins.setdefault(moved.path, moved)
    return sorted([*told, *of_origins.values()], key=lambda fault: fault.line or 0)


def _at_origin(fault: Fault, places: list[Place], table: Document) -> Fault:
    """The fault at the first of `places` that is in the table, else at the first."""
    place = next((place for place in places if table.written(place) is not None), places[0])
    written = table.written(place)
    value = f" = {fault.value:.4g}" if isinstance(fault.value, float) else ""
    bound = f"it gives the scene {fault.path}{value}: {fault.bound}"
    return table.fault(place, ABSENT if written is None else written, bound, fault.remedy)


def _origins(path: str) -> list[Place]:
    for pattern, keys in ORIGINS:
        if found := re.fullmatch(pattern, path):
            return [place_of(found.expand(key)) for key in keys]
    return []


def place_of(path: str) -> Place:
    """The place that `boom_twin.scene.yaml_reader.words` writes so: ``sections[1].root.mass``."""
    return tuple(int(index) if index else key for key, index in re.findall(r"(\w+)|\[(\d+)\]", path))
