"""A digital twin of a concrete placing boom by the transfer-matrix method.

The stable API, imported when first used::

    load_scene(path=None) -> Scene                      the boom; without a path, the default scene
    statics(scene, strokes=None, posture=None)          equilibrium, forces, natural frequencies
    simulate(scene, times, strokes, dt=1e-3)            the boom's answer to given strokes
    Twin(scene, settings=None).update(sample)           sample by sample: prediction, residuals
    replay(bag, scene, out)                             a recorded session through the twin
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .analysis.simulate import simulate
    from .analysis.statics import statics
    from .offline.replay import replay
    from .records import Report, Sample, Stream
    from .scene import Scene, load_scene
    from .settings import Settings, load_settings
    from .twin import Twin

__version__ = "0.1.0"

_HOMES = {
    "Report": "records",
    "Sample": "records",
    "Scene": "scene",
    "Settings": "settings",
    "Stream": "records",
    "Twin": "twin",
    "load_scene": "scene",
    "load_settings": "settings",
    "replay": "offline.replay",
    "simulate": "analysis.simulate",
    "statics": "analysis.statics",
}

__all__ = [
    "Report",
    "Sample",
    "Scene",
    "Settings",
    "Stream",
    "Twin",
    "load_scene",
    "load_settings",
    "replay",
    "simulate",
    "statics",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value
    return value
