"""A baseline from samples of healthy sessions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from .health.baseline import Baseline
from .health.learning import learn
from .health.linear import Problem
from .health.parameters import parameters
from .load import loaded
from .records import Mount, Sample
from .scene.parts import Scene
from .settings import Settings
from .twin import Twin


def learn_baseline(
    scene: Scene,
    settings: Settings,
    sessions: Iterable[Iterable[Sample]],
    names: Sequence[str],
    mounts: Sequence[Mount | None] = (),
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> Baseline:
    """What model and sensors are off by in `sessions`, called `names`, in which all was well.

    `progress` is told the share done and what comes next.

    Raises
    ------
    UsageError
        Too few usable samples to learn from.
    """
    problems: list[list[Problem]] = []
    for name, session in zip(names, sessions, strict=True):
        progress(0.3 * len(problems) / len(names), name)
        problems.append(_problems(scene, settings, session, mounts))
    scene = loaded(scene, *settings.load)
    return learn(problems, parameters(scene), len(scene.joints), names, lambda share: progress(0.3 + 0.7 * share, "learning"))


def _problems(scene: Scene, settings: Settings, session: Iterable[Sample], mounts: Sequence[Mount | None]) -> list[Problem]:
    """The linear problems that a twin makes of one session."""
    twin = Twin(scene, settings, mounts, Baseline())
    assert twin.judge is not None
    found: list[Problem] = []
    twin.judge.residuals.listener = found.append
    for sample in session:
        twin.update(sample)
    return found
