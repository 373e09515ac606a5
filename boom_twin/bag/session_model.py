"""Choose scene, settings and mapping of a session: a given file, else the session's, else the package's.

An invalid given file raises UsageError (a scene: SceneError). An invalid text of the session raises BagError, with the
option that gives another.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ..config.settings import Settings, checked, load_settings
from ..config.yaml_text import plain
from ..errors import BagError, Fault, SceneError, UsageError
from ..messages.mapping import load_mapping, mapping_from
from ..messages.topic_table import Topics
from ..scene.edit import anew
from ..scene.load import DEFAULT_NAME, SceneSource, as_scene, default_text, examine_text, read_text
from ..scene.schema import Scene
from ..types import Stream, StrokeReading
from .session_sheet import KeptText, kept, kept_parameters, rig_version, sha256

DEFAULT_MAPPING = "default mapping"
DEFAULT_PARAMETERS = "default parameters"
GIVEN = "given as a Scene"  # source of a scene that came by no file
LENGTHS_SINCE = 0, 2  # first version of the virtual rig whose transducers read lengths


@dataclass(frozen=True)
class SessionScene:
    """A scene, its text, and the source of the text."""

    scene: Scene
    text: str
    source: str  # path, place in a ``session.yaml``, or `DEFAULT_NAME`
    oddities: tuple[Fault, ...] = ()  # values that can be computed but are implausible

    @property
    def sha256(self) -> str:
        """SHA-256 of the text."""
        return sha256(self.text)


@dataclass(frozen=True, slots=True)
class Mapped:
    """Mapping of topics and sensors, and its source."""

    topics: Topics
    source: str


def scene_from(source: SceneSource | SessionScene) -> SessionScene:
    """Return a scene with its text, from a file or a program, or that of the package for None; see `boom_twin.load_scene`."""
    if isinstance(source, SessionScene):
        return source
    if source is not None and not isinstance(source, str | Path):
        scene = as_scene(source)
        return SessionScene(scene, anew(scene), GIVEN)
    name = DEFAULT_NAME if source is None else str(source)
    text = default_text() if source is None else read_text(Path(source))
    scene, oddities = examine_text(text, name)
    return SessionScene(scene, text, name, tuple(oddities))


def scene_of(session: Path, given: SceneSource | SessionScene = None) -> SessionScene:
    """Return the scene of a session: what is `given`, else from its ``session.yaml``, else from the package."""
    own = kept(session, "scene", "--scene") if given is None else None
    if own is None:
        return scene_from(given)
    try:
        scene, oddities = examine_text(own.text, own.source, whole=_recorded_sha256(session) == sha256(own.text))
    except SceneError as error:
        more = f" (and {len(error.faults) - 1} more)" if len(error.faults) > 1 else ""
        raise BagError(f"{own.source}: {error.faults[0]}{more} Give the scene by --scene.") from None
    return SessionScene(scene, own.text, own.source, (*_changed(session, own), *oddities))


def _changed(session: Path, own: KeptText) -> list[Fault]:
    """Return a fault if the text differs from the recorded one."""
    digest = _recorded_sha256(session)
    if digest in (None, sha256(own.text)):
        return []
    bound = f"{own.source} has {sha256(own.text)[:12]}..: it was changed since the session was made"
    return [Fault("scene_sha256", digest, bound, "Give the scene that is right by --scene.")]


def _recorded_sha256(session: Path) -> str | None:
    """Return the SHA-256 of the scene's text at the time of the session; None if it was not kept."""
    digest = kept(session, "scene_sha256", "--scene")
    return None if digest is None else digest.text


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """Settings of the twin and their source."""

    settings: Settings
    source: str

    @property
    def others(self) -> dict[str, float]:
        """Settings that differ from the defaults of the package."""
        usual = Settings().model_dump()
        return {name: value for name, value in self.settings.model_dump().items() if value != usual[name]}


def settings_of(session: Path, given: Path | None = None, namespace: str = "") -> SessionSettings:
    """Return the settings of a session's twin.

    The source is the parameter file `given` for the node in `namespace`, else the node that ran during the recording, else the
    package.
    """
    if given is not None:
        return SessionSettings(load_settings(given, namespace), str(given))
    values, source = kept_parameters(session)
    own = {name: value for name, value in values.items() if name in Settings.model_fields}  # the rest belongs to the node
    try:
        return SessionSettings(checked(Settings, own, source), source if own else DEFAULT_PARAMETERS)
    except UsageError as error:
        raise BagError(f"{error} Give the parameters by --params.") from None


def mapping_of(session: Path, given: Path | None = None, joints: int | None = None, namespace: str = "") -> Mapped:
    """Return the mapping of a session, from the same sources as the scene in `scene_of`.

    Parameters
    ----------
    namespace : str
        Namespace of the node, to which names without a leading slash are relative.

    Raises
    ------
    UsageError
        The mapping, given or the session's, has faults.
    """
    own = kept(session, "mapping", "--mapping") if given is None else None
    if own is None:
        found = Mapped(load_mapping(given, joints), DEFAULT_MAPPING if given is None else str(given))
    else:
        try:
            found = Mapped(mapping_from(plain(own.text), own.source, joints), own.source)
        except ValueError as error:
            raise BagError(f"{own.source}: not YAML ({error}). Give the mapping by --mapping.") from None
    return Mapped(found.topics.in_namespace(namespace), found.source) if namespace.strip("/") else found


@dataclass(frozen=True, slots=True)
class SessionStrokes:
    """Quantity that drives the model in a session, and the source of this."""

    reading: StrokeReading
    source: str


def strokes_of(session: Path | None, mapped: Mapped) -> SessionStrokes:
    """Return the quantity that drives the model in a session. `session` is None for a running rig.

    It is angles if the mapping says so, else what stroke transducers read. The mapping's ``reads`` comes first, then
    ``strokes`` of ``session.yaml``. The default is lengths. It is drives for the virtual rig before version 0.2.
    """
    if mapped.topics.drive == "angles":
        return SessionStrokes(StrokeReading.ANGLE, f"{mapped.source}, drive")
    if told := mapped.topics.inputs[Stream.STROKES].reads:
        return SessionStrokes(StrokeReading(told), f"{mapped.source}, inputs.cylinder_strokes.reads")
    if session is not None and (own := kept(session, "strokes", "--mapping")):
        try:
            return SessionStrokes(StrokeReading(own.text), own.source)
        except ValueError:
            bound = f"it must be {' or '.join(StrokeReading)}"
            raise BagError(f"{own.source}: {own.text[:60]!r}: {bound}. Give reads in a mapping by --mapping.") from None
    version = rig_version(session) if session is not None else ""
    made = re.match(r"(\d{1,9})\.(\d{1,9})", version)
    if made and (int(made[1]), int(made[2])) < LENGTHS_SINCE:
        return SessionStrokes(StrokeReading.DRIVE, f"made by the virtual rig of version {version}")
    return SessionStrokes(StrokeReading.LENGTH, "nothing else is said; for drives give reads: drive in a mapping")
