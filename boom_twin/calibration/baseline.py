"""Learn a health baseline from recorded healthy sessions, and read and write its file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from io import StringIO
from pathlib import Path

from ruamel.yaml import YAML

from ..bag.time_window import WHOLE, TimeWindow
from ..config.settings import Settings
from ..errors import UsageError
from ..health.baseline import Baseline
from ..health.inference.block_problem import BlockProblem
from ..health.inference.fault_catalogue import parameters
from ..health.learning import learn
from ..health.suspicion import load_levels
from ..scene.edit import loaded
from ..scene.schema import Scene
from ..system.atomic_files import write_atomic
from ..twin.driver import drive
from ..twin.twin import Twin
from ..types import Mount, Sample, StrokeReading
from .run import common_mapping, refuse_lengths
from .sessions import read_sessions


def learn_baseline(
    scene: Scene,
    settings: Settings,
    sessions: Iterable[Iterable[Sample]],
    names: Sequence[str],
    mounts: Sequence[Mount | None] = (),
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> Baseline:
    """What model and sensors are off by in `sessions`, called `names`, in which all was well.

    A pump or wind may have shaken them. `progress` is told the share done and what comes next.

    Raises
    ------
    UsageError
        Too few usable samples to learn from.
    """
    problems: list[list[BlockProblem]] = []
    for name, session in zip(names, sessions, strict=True):
        progress(0.3 * len(problems) / len(names), name)
        problems.append(_problems(scene, settings, session, mounts))
    scene = loaded(scene, *settings.load)

    def tell(share: float) -> None:
        progress(0.3 + 0.7 * share, "learning")

    return learn(problems, parameters(scene), len(scene.joints), names, tell, load_levels(scene).tolist())


def _problems(
    scene: Scene, settings: Settings, session: Iterable[Sample], mounts: Sequence[Mount | None]
) -> list[BlockProblem]:
    """The linear problems that a twin makes of one session."""
    found: list[BlockProblem] = []
    for _ in drive(Twin(scene, settings, mounts, Baseline(), found.append, StrokeReading.DRIVE), session):
        pass
    return found


WIDTH = 120


def baseline_of(
    bags: Sequence[str | Path],
    scene: Scene,
    settings: Settings | None = None,
    mapping: str | Path | None = None,
    progress: Callable[[float, str], None] = lambda share, what: None,
    window: TimeWindow = WHOLE,
) -> Baseline:
    """What model and sensors are off by in sessions in which all was well.

    Parameters
    ----------
    bags : sequence of path
        Recorded sessions of one rig, with moves, a minute or more in all.
    settings : Settings, optional
        Noise of the sensors; the package's own by default.
    mapping : path, optional
        Of topics and sensors; by default as the sessions were recorded.
    progress : callable, optional
        Told the share done and what comes next.
    window : TimeWindow, optional
        The part of each session that is used.

    Returns
    -------
    Baseline
        Mean and covariance of the parameters, and the errors that stay; see `boom_twin.health.baseline`.

    Raises
    ------
    UsageError
        Sessions with different mappings, or too short.
    BagError
        A session that cannot be used.
    """
    paths, joints = [Path(bag) for bag in bags], len(scene.joints)
    progress(0.0, "reading")
    mapped = common_mapping(paths, Path(mapping) if mapping else None, joints)
    refuse_lengths(paths, mapped)
    topics = mapped.topics.of_joints(joint.range_deg for joint in scene.joints)
    sessions = read_sessions(paths, topics, joints, window)
    mounts = topics.mounts(joints)
    names = [f"{session.name} {session.digest}" for session in sessions]
    return learn_baseline(scene, settings or Settings(), (session.samples() for session in sessions), names, mounts, progress)


def write_baseline(baseline: Baseline, path: Path, credit: str, force: bool) -> None:
    """Write the file that `boom_twin.health.baseline.load_baseline` reads; `credit` tells when and by what.

    Raises
    ------
    UsageError
        The file is there already, and `force` is false.
    """
    if path.exists() and not force:
        raise UsageError(f"{path} is there already. Give another name, or --force.")
    values = baseline.model_dump() | {"description": f"learnt {credit}"}
    text, yaml = StringIO(), YAML(typ="safe", pure=True)
    yaml.width, yaml.default_flow_style = WIDTH, None
    yaml.dump({key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}, text)
    path.parent.mkdir(parents=True, exist_ok=True)
    head = "# What boom_twin takes for healthy on one rig; SI units. Do not edit mean and covariance.\n"
    write_atomic(path, head + text.getvalue())
