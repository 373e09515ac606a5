"""Feeds of the live page: live and recorded sources, and a viewer's place in a recording."""

from __future__ import annotations

import numpy as np

from ...analysis.drive import drives_as_read
from ...compiler.compile import compile_scene
from ...compiler.plan import Plan
from ...messages.topic_table import Topics
from ...scene import load_scene
from ...scene.load import DEFAULT_NAME
from ...scene.schema import Scene
from ...types import Array
from .store import Store
from .topic_rows import TopicRows


class Feed:
    """Source of the page's data: a store and the reader that fills it; its `title` says in words what is shown.

    Without a `scene` it is the package's own, if the node says that it uses that; no file is opened that a message names.
    `end` (s) is the length of a recorded session, None if it is live.
    """

    def __init__(self, title: str, store: Store, topics: Topics, scene: Scene | None = None, end: float | None = None) -> None:
        self.title, self.store, self.end = title, store, end
        self.topic_rows = TopicRows(store, topics)
        self.trouble = ""  # fault that ended the reading
        self.phase = ""  # preparation that precedes the first data, in words; empty without one
        self._scene, self._reads = scene, topics.stroke_reading
        self._plan: Plan | None = None

    def poll(self) -> None:
        """Read the data that has arrived; called often."""

    def publish(self, words: str) -> None:
        """Publish an event, so that a recording of the session holds it."""
        raise NotImplementedError

    def close(self) -> None:
        """Release all resources of the feed."""

    def now(self) -> float:
        """Return the time (s) by which status lamps count."""
        return self.store.newest

    def scene(self) -> Scene | None:
        """Return the scene, or None until it is known."""
        if self._scene is None and self.topic_rows.scene == DEFAULT_NAME:
            self._scene = load_scene()
        return self._scene

    def strokes_between(self, first: float, last: float) -> Array:
        """Return the strokes (m) of the drives from one time to another (s), a row for each known shape, shape (k, n)."""
        table, scene = self.store.tables.get("shape"), self.scene()
        if table is None:
            return np.zeros((0, 0))
        rows, names = table.rows(table.until(first), table.until(last))[1].astype(float), table.columns
        strokes, forces = (rows[:, [name.startswith(kind) for name in names]] for kind in ("stroke_", "force_"))
        if scene is None or not strokes.shape[1] == forces.shape[1] == len(scene.joints):
            return strokes
        self._plan = self._plan or compile_scene(scene)
        return drives_as_read(self._plan, strokes, forces, self._reads)


class Playback:
    """Position (s) in a recorded session. Unless held, it advances at a speed, at most to the end of the part that was read."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self.position, self.is_held = 0.0, False
        self.speed = 1.0  # session time over real time

    def advance(self, span: float) -> float:
        """Advance by `span` (s) of real time and return the position; hold at the end."""
        if not self.is_held:
            self.seek(self.position + self.speed * span)
            self.is_held = self.is_at_end
        return self.position

    @property
    def is_at_end(self) -> bool:
        return self.position >= (self._feed.end or 0.0)

    def pace(self, speed: float) -> None:
        slowest_playback, fastest_playback = 0.1, 10.0
        self.speed = min(max(speed, slowest_playback), fastest_playback)

    def hold(self, is_held: float) -> None:
        """Hold, or go on; from the end of the session that is from its beginning."""
        if self.is_at_end and not is_held:
            self.seek(0.0)
        self.is_held = bool(is_held)

    def seek(self, position: float) -> None:
        """Move to `position` (s), limited to the part that was read."""
        self.position = min(max(position, 0.0), self._feed.store.newest, self._feed.end or 0.0)
