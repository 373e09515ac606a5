"""The scene of a boom with physical faults."""

from __future__ import annotations

from collections.abc import Sequence

from ..scene.named import parameter, with_parameters
from ..scene.parts import Scene
from .faults import Fault


def with_faults(scene: Scene, faults: Sequence[Fault]) -> Scene:
    """`scene` with the physical ones of `faults`; those of sensors are passed over.

    Raises
    ------
    UsageError
        The scene has no such parameter, for instance no oil spring.
    """
    for fault in faults:
        if fault.is_physical:
            now = parameter(scene, fault.cause)
            changed = now + fault.size if fault.kind == "more" else now * (1.0 - fault.size)
            scene = with_parameters(scene, {fault.cause: changed})
    return scene
