"""A digital twin of a concrete placing boom by the transfer-matrix method.

The stable API, imported when first used::

    load_scene(path=None) -> Scene                      the boom; without a path, the default scene
    statics(scene, "arch")                              equilibrium, forces, natural frequencies; or at strokes
    simulate(scene, times, strokes, dt=1e-3)            the boom's answer to given strokes
    frequency_response(scene, frequencies, posture=..)  the boom's answer to a harmonic force or stroke
    Twin(scene, settings=None).update(sample)           sample by sample: prediction, residuals
    replay(bag, scene, out)                             a recorded session or a table of readings through the twin
    SessionWriter(out, scene).write(sample)             a session from samples of a live source
    LivePage(twin).update(sample)                       the live page of a twin in this process
    TimeWindow(start, duration)                         a part of a session, for replay
    BoomTwinError                                       every error of the package, and its kinds

A scene is a `Scene`, a file, a dict with its keys, or None for the default one.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .analysis.equilibrium import statics
    from .analysis.frequency_response import frequency_response
    from .analysis.simulate import simulate
    from .bag.session_file import TimeWindow
    from .bag.session_writer import SessionWriter
    from .config.settings import Settings, load_settings
    from .errors import BagError, BoomTwinError, SceneError, SceneWarning, SolverError, UsageError
    from .monitor.live_page import LivePage
    from .offline.replay import replay
    from .scene import Scene, load_scene
    from .twin.twin import Twin
    from .types import Report, Sample, Stream

__version__ = "0.2.0"

_NAMES = {
    "analysis.equilibrium": "statics",
    "analysis.frequency_response": "frequency_response",
    "analysis.simulate": "simulate",
    "bag.session_writer": "SessionWriter",
    "bag.session_file": "TimeWindow",
    "config.settings": "Settings load_settings",
    "errors": "BagError BoomTwinError SceneError SceneWarning SolverError UsageError",
    "monitor.live_page": "LivePage",
    "offline.replay": "replay",
    "scene": "Scene load_scene",
    "twin.twin": "Twin",
    "types": "Report Sample Stream",
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = [
    "BagError", "BoomTwinError", "LivePage", "Report", "Sample", "Scene", "SceneError", "SceneWarning", "SessionWriter",
    "Settings", "SolverError", "Stream", "TimeWindow", "Twin", "UsageError", "frequency_response", "load_scene",
    "load_settings", "replay", "simulate", "statics",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value
    return value
