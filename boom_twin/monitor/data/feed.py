"""Where the page's numbers come from."""

from __future__ import annotations

from ..io.topics import Topics
from ..scene import load_scene
from ..scene.load import DEFAULT_NAME
from ..scene.parts import Scene
from .catch import Catch
from .store import Store

STROKE = "stroke_"


class Feed:
    """A store and what fills it; `boom_twin.monitor.bag` and `boom_twin.ros.monitor` have the two kinds.

    Parameters
    ----------
    title : str
        What is shown, in words.
    store : Store
    topics : Topics
        Their names, and how sensors are read.
    scene : Scene, optional
        By default the package's own, if the node says that it uses that. No file is opened that a message names.
    end : float, optional
        Length of a recorded session, s; None if it is live.

    Attributes
    ----------
    trouble : str
        Why there is not more to be had; empty as long as all is well.
    """

    def __init__(self, title: str, store: Store, topics: Topics, scene: Scene | None = None, end: float | None = None) -> None:
        self.title, self.store, self.end = title, store, end
        self.catch = Catch(store, topics)
        self.trouble = ""
        self._scene = scene

    def poll(self) -> None:
        """Take what has come; called often."""

    def publish(self, words: str) -> None:
        """Tell an event, so that a recording of the session holds it."""
        raise NotImplementedError

    def let_go(self) -> str:
        """Ask the node to let go of alarms that ended; says whether that could be asked."""
        raise NotImplementedError

    def close(self) -> None:
        """Let go of what is held."""

    def now(self) -> float:
        """The time that lamps count by, s."""
        return self.store.newest

    def scene(self) -> Scene | None:
        """The scene, as soon as it is known."""
        if self._scene is None and self.catch.scene == DEFAULT_NAME:
            self._scene = load_scene()
        return self._scene

    def strokes(self, time: float) -> list[float]:
        """The strokes (m) at `time` (s); empty if they are not known."""
        table = self.store.tables.get("shape")
        if table is None:
            return []
        row = table.until(time)
        values = table.rows(row - 1, row)[1]
        places = [place for place, name in enumerate(table.columns) if name.startswith(STROKE)]
        return [float(values[0, place]) for place in places] if len(values) else []
