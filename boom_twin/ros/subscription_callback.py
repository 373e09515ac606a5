"""Callback of a raw subscription that gets a message's information too, by either executor of rclpy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import Parameter, Signature
from typing import Any

_BOTH = Signature([Parameter(name, Parameter.POSITIONAL_ONLY) for name in ("data", "info")])


def with_information(take: Callable[[bytes, Mapping[str, Any]], None]) -> Callable[..., None]:
    """Wrap `take` for ``create_subscription(.., raw=True)``.

    rclpy tells by the signature that the information is wanted; its events executor (7.1) then gives the two as one argument.

    Parameters
    ----------
    take : callable
        Is given the encoded message and its information: ``received_timestamp``, ``source_timestamp`` (ns) and
        ``publication_sequence_number``.
    """

    def put(*received: Any) -> None:
        data, info = received if len(received) == 2 else received[0]
        take(data, info)

    put.__signature__ = _BOTH  # type: ignore[attr-defined]
    return put
