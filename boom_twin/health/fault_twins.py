"""Name a fault of a boom by fault twins: twins of a changed scene that take the same samples.

The filter of a twin tells the logarithm of the likelihood of all that was read (`BoomPredictor.evidence`). A fault hypothesis
is a twin whose scene has the fault, or a twin that lets a sensor's zero drift. Its gain over the twin of the scene itself, from
the best onset on until the end, is the evidence of that fault. A load that comes at once may pass for a softer part for some
seconds, but not for longer. A cause is named if its posterior probability is high enough.

Innovations of one sample are not independent of those of the next, so gains count for less than they say: `TEMPER`. A healthy
rig whose parameters are 2 % off the scene gains up to 60 nats by a softer part: a name needs 75, `HEAD_START` and the odds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..scene.edit import loaded, parameter, parameter_names, with_parameters
from ..scene.schema import Scene
from ..scene.summary import explain
from ..types import SECOND, Alarm, Change, Ranked, Stream, channels_of

LOSS = 0.25  # share of k or EI that a hypothesis takes off
LOAD = 0.02  # share of the boom's mass that a hypothesis adds to the load, or takes off
NAME_ODDS = 0.95  # posterior probability required to name a cause
HEAD_START = 50.0  # nats of the hypothesis that nothing is wrong
TEMPER = math.log(20.0) / 25.0  # power of likelihoods: 25 nats more make a cause 20 times as probable
SETTLING = 2.0  # s from a start in which the filters find vibration and zeros


class Follower(Protocol):
    """Interface of a twin as far as fault twins need it; see `boom_twin.Twin`."""

    @property
    def evidence(self) -> float:
        """Log likelihood of all readings."""

    @property
    def requests(self) -> Any:
        """Requested changes that wait for the next stroke sample."""

    def update_block(self, block: Any, /) -> object:
        """Take the samples of a block."""


class Hypothesis(NamedTuple):
    """Fault hypothesis of a boom.

    cause : parameter of the scene, or a sensor; empty if nothing is wrong. kind : the fault in a word. scene : with the fault.
    payload, line_fill : how much more the boom carries, kg and kg/m. doubted : channels whose zeros may drift by any amount.
    """

    cause: str
    kind: str
    scene: Scene
    payload: float = 0.0
    line_fill: float = 0.0
    doubted: tuple[str, ...] = ()

    @property
    def is_softer(self) -> bool:
        """Return True if a part of the boom is softer."""
        return self.kind == "softer"

    def load(self, payload: float, line_fill: float) -> dict[str, float]:
        """Return the load (kg, kg/m) of a twin where the load is said to be this; below 0 it is that of the scene."""
        told = loaded(self.scene, payload, line_fill)
        return {
            "payload": max(parameter(told, "tip.payload") + self.payload, 0.0),
            "line_fill": max(parameter(told, "line_fill") + self.line_fill, 0.0),
        }


def hypotheses(scene: Scene) -> list[Hypothesis]:
    """Return everything that is compared for a boom; the first is that nothing is wrong."""
    mass, names = explain(scene).mass, parameter_names(scene)
    found = [Hypothesis("", "", scene)]
    for name in names:
        if name.endswith((".k", ".EI")):
            softer = with_parameters(scene, {name: (1.0 - LOSS) * parameter(scene, name)})
            found.append(Hypothesis(name, "softer", softer))
    for sign, kind in ((1.0, "more"), (-1.0, "less")):
        if sign > 0.0 or parameter(scene, "tip.payload") > 0.0:
            found.append(Hypothesis("tip.payload", kind, scene, payload=sign * LOAD * mass))
        if sign > 0.0 or parameter(scene, "line_fill") > 0.0:
            found.append(Hypothesis("line_fill", kind, scene, line_fill=sign * LOAD * mass / scene.reach))
    channels = channels_of(len(scene.joints))
    doubts = [(name,) for name in channels[Stream.ANGLES]] + [channels[Stream.IMU]]
    return found + [Hypothesis(f"{each[0]}.sensor", "off", scene, doubted=each) for each in doubts]


class FaultTwins:
    """Twins of all fault hypotheses, which take the same samples.

    Parameters
    ----------
    scene : Scene
        With its load.
    make : callable
        Hypothesis -> its twin.

    Attributes
    ----------
    hypotheses : list of Hypothesis
    twins : list of Follower
        One for each of them.
    """

    def __init__(self, scene: Scene, make: Callable[[Hypothesis], Follower]) -> None:
        self.hypotheses = hypotheses(scene)
        self.twins = [make(each) for each in self.hypotheses]
        self._stamps: list[int] = []
        self._evidence: list[list[float]] = []

    def take(self, block: Any) -> None:
        """Let all twins take a block of samples, a second of it at a time."""
        cuts = (np.flatnonzero(np.diff(block.stamps // SECOND) > 0) + 1).tolist()
        for rows in map(slice, [0, *cuts], [*cuts, len(block.stamps)]):
            part = block._replace(streams=block.streams[rows], stamps=block.stamps[rows], values=block.values[rows])
            for twin in self.twins:
                twin.update_block(part)
            self._stamps.append(int(part.stamps[0]))
            self._evidence.append([twin.evidence for twin in self.twins])

    def change(self, change: Change) -> None:
        """Repeat a change from the recorded session; each twin adds the load of its hypothesis."""
        load = change.settings["payload"], change.settings["line_fill"]
        for each, twin in zip(self.hypotheses, self.twins, strict=True):
            twin.requests.repeat(replace(change, settings=change.settings | each.load(*load)))

    def judge(self) -> Alarm | None:
        """Return an alarm with the cause that explains what was read, or None if nothing is wrong or no cause is certain.

        Only lost stiffness is named. A load or a sensor that explains the readings as well keeps a name away.
        """
        stamps = np.array(self._stamps, np.int64)
        settled = stamps >= stamps[:1] + round(SETTLING * SECOND)  # no evidence is counted before
        if not settled.any():
            return None
        evidence = np.array(self._evidence)[settled]
        gains = evidence[:, 1:] - evidence[:, :1]
        onsets = len(gains) - 1 - gains[::-1].argmin(axis=0)  # the latest of the lows
        rises = gains[-1] - gains.min(axis=0)
        best = int(np.argmax(rises))
        causes: dict[str, float] = {"": HEAD_START}
        for each, rise in zip(self.hypotheses[1:], rises.tolist(), strict=True):
            causes[each.cause] = max(causes.get(each.cause, 0.0), rise)
        weights = np.exp(TEMPER * (np.array(list(causes.values())) - max(causes.values())))
        chances = dict(zip(causes, (weights / weights.sum()).tolist(), strict=True))
        named = self.hypotheses[1 + best]
        if chances[named.cause] < NAME_ODDS or not named.is_softer:
            return None
        ranked = sorted((Ranked(cause, chance, ()) for cause, chance in chances.items() if cause), key=lambda r: -r.probability)
        channel = named.cause.partition(".")[0]
        since = int(stamps[settled][onsets[best] + 1] if onsets[best] else stamps[0])
        part = "oil spring of " if named.cause.endswith(".k") else ""
        told = (
            f"{part}{channel.replace('_', ' ')} is softer than the scene says (probability {chances[named.cause]:.3f}); "
            "look for air in the oil and loose pins, or cracks"
        )
        return Alarm(channel, named.kind, since, None, named.cause, told, tuple(ranked[:3]))
