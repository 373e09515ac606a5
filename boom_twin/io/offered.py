"""The quality of service that a bag's publishers offered, from any version of its metadata."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from ..plain import plain
from .topics import Qos

DEEPEST = 10_000
"""Largest depth that is taken over."""

_RELIABILITY = {1: "reliable", 2: "best_effort", "reliable": "reliable", "best_effort": "best_effort"}
_DURABILITY = {1: "transient_local", 2: "volatile", "transient_local": "transient_local", "volatile": "volatile"}
_LONGEST = 100_000  # characters of YAML in one entry


def profiles(value: Any) -> list[Qos]:
    """The profiles of one topic, in the words of ``topics.yaml``; what cannot be read is left out.

    Parameters
    ----------
    value : object
        ``offered_qos_profiles`` of ``metadata.yaml`` or of a channel: a list, or YAML of one.
    """
    if isinstance(value, str):
        try:
            value = plain(value) if len(value) <= _LONGEST else []
        except ValueError:
            return []
    found = [_profile(entry) for entry in (value if isinstance(value, list) else []) if isinstance(entry, dict)]
    return [qos for qos in found if qos is not None]


def _profile(entry: dict[Any, Any]) -> Qos | None:
    try:
        return Qos.model_validate(
            {
                "reliability": _RELIABILITY.get(entry.get("reliability"), "reliable"),
                "durability": _DURABILITY.get(entry.get("durability"), "volatile"),
                "depth": min(max(int(entry.get("depth") or 1), 1), DEEPEST),
            }
        )
    except (ValidationError, TypeError, ValueError):
        return None
