"""Text of alarms: what is the matter, how much of it, what else may explain it, and which move would tell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..scene.schema import Scene
from ..types import NANO, Alarm, Array, Ranked, Stream
from .baseline import JUDGED, judged_channels
from .delay_monitor import delay_cause, delay_remedy
from .inference.fault_catalogue import Form, Parameter, physical
from .inference.holds import HoldProblem
from .inference.hypotheses import Cause, Explanation, Verdict
from .inference.sensitivities import Signature, Signatures

NAMED, GROWING = 0.95, 0.99  # probability of a cause beside the others that is taken for certain; of one that grows
SHAKEN = 0.999  # likewise, of one that grows under a load
PLAIN = 60.0  # ln of how much more probable than none a fault must be for a name under a load
LED, MOVED = 10.0, 0.1  # time (s), and travel of the strokes (m), for which it has to lead where it is less plain than that
BORNE_OUT = 0.7  # likewise, by blocks in which the boom does not vibrate
REFUTED = 1e-3  # probability of a cause below which evidence that fits rules it out; of that which was named, another may be
GROWTH_AFTER, STEADY = 8.0, 0.9  # evidence (s) that gives a slope; share of the steepest that a lasting growth keeps
FITS = 1.5  # squares over those of noise that a cause may leave, to be told by name
NAMED_AFTER, GROWING_AFTER = 3.0, 20.0  # time (s) that it takes to be so probable without a break; evidence of one that grows
LISTED, MOST = 0.02, 5  # least probability of a cause that is told, and how many are
DRIFTING = (Form.ANGLE, Form.STROKE, Form.IMU)  # of sensors whose zero may wander
CLEAR = 3.0  # deviations of the model's error that tell two causes apart
LIMIT_OF = "told_from_"  # and a cause: how the figures of `ResidualMonitor.limits` are called
SI = {"k": "N/m", "EI": "N m^2", "mass": "kg"}  # of parameters of a scene that are judged by their share
SAYABLE = 9.2  # ln of ten thousand, the largest odds that are told
RATES_LAST = 1.0  # s, in which a rate may change by as much as it is
MOVE = 0.15  # of a cylinder's travel, the moves that are thought through


def limits_as_text(figures: Mapping[str, Any]) -> list[str]:
    """A sentence where a load limits what can be told, by figures as in `Health.noise`; none without a load."""
    found = {name.removeprefix(LIMIT_OF): share for name, share in figures.items() if name.startswith(LIMIT_OF)}
    if not found:
        return []
    shares = ", ".join(f"{cause} from {100.0 * share:.0f} %" for cause, share in found.items())
    return [f"limited by a load that shakes the tip: softer cylinders can be told where the loss is large: {shares} on"]


class AlarmText:
    """Puts explanations into words.

    Parameters
    ----------
    scene : Scene
        With its load.
    known : tuple of Parameter
    signatures : Signatures
    errors : ndarray, shape (channels,)
        Standard deviation of the model's error in one posture.
    """

    def __init__(self, scene: Scene, known: tuple[Parameter, ...], signatures: Signatures, errors: Array) -> None:
        self._scene, self._known, self._signatures, self._errors = scene, known, signatures, errors
        self._names = judged_channels(len(scene.joints))
        self._advised: tuple[str, str] | None = None
        self._advice = ""
        self._leading: tuple[str, int, float] = "", 0, 0.0
        self._steepest: dict[int, float] = {}

    def begin_anew(self) -> None:
        """The evidence begins anew: how long a cause has been probable by what was outdated does not count."""
        self._leading = "", 0, 0.0

    def alarm(
        self, alarm: Alarm, whole: Verdict, calm: Verdict, is_told_apart: bool, span: float, travel: float, stamp: int,
        is_calm: bool, signature: Signature | None,
    ) -> Alarm:  # fmt: skip
        """The alarm with its explanation at `stamp` (ns), of evidence of `span` s and `travel` m; a name stays until refuted.

        A name is given by the whole of the evidence; what the blocks in which the boom does not vibrate say has to bear it out,
        and is what is told until then. `is_calm`: no load shakes the boom. `is_told_apart`: nothing else that was measured
        speaks against the likeliest cause.
        """
        if self._is_certain(alarm, whole, calm, is_told_apart, span, travel, stamp, is_calm):
            ranks = self._likely(whole)
            told = self._sentence(ranks[0], whole.best)
            return replace(alarm, kind=ranks[0].parts[0][0], cause=whole.causes[0].name, told=told, ranked=ranks)
        if alarm.cause is not None:
            return alarm
        ranks, best = self._likely(calm), calm.causes[0]
        if calm.excess > FITS and span >= NAMED_AFTER:
            told = f"{alarm.channel} deviates as no single fault that is known would make it; nearest is {best.name}"
            return replace(alarm, kind="unknown", cause=None, told=told, ranked=ranks)
        if best.probability >= NAMED and not is_told_apart:
            told = f"{alarm.channel} deviates as {best.name} would, but not in all that was measured: another fault, or two"
            return replace(alarm, kind="residual", cause=None, told=told, ranked=ranks)
        if len(ranks) == 1:
            return replace(alarm, kind="residual", cause=None, told=f"{best.name} most likely, not yet certain", ranked=ranks)
        told = "cannot be told apart in this posture: " + " or ".join(rank.cause for rank in ranks)
        move = self._advised_move(calm, signature)
        return replace(alarm, kind="residual", cause=None, told=told + move, ranked=ranks)

    def of_holds(self, alarm: Alarm, verdict: Verdict, tip: float, is_borne_out: bool) -> Alarm:
        """The alarm with what holds say together; `tip` (m): by how much the most probable fault puts the tip off.

        `is_borne_out`: no single frequency makes it the most probable one.
        """
        ranks = self._likely(verdict)
        best, off = verdict.causes[0], f"; that puts the tip off by {1e3 * tip:.0f} mm"
        if best.probability >= NAMED and verdict.excess <= FITS and is_borne_out:
            told = self._sentence(ranks[0], verdict.best) + off
            return replace(alarm, kind=ranks[0].parts[0][0], cause=best.name, told=told, ranked=ranks)
        if alarm.cause is not None:
            return alarm
        names = " or ".join(rank.cause for rank in ranks)
        if sum(cause.probability for cause in verdict.causes if cause.name.startswith("section_")) >= NAMED:
            told = f"a section is softer, which one is not told yet: {names}{off}; hold still in other postures"
            return replace(alarm, kind="softer", cause=None, told=told, ranked=ranks)
        told = f"holds are off in mean and frequency, why is not told yet: {names}{off}; hold still in other postures"
        return replace(alarm, kind="residual", cause=None, told=told, ranked=ranks)

    def of_far_tip(self, alarm: Alarm, verdict: Verdict, tip: float, hold: HoldProblem) -> Alarm:
        """The alarm of a tip that is far off (by `tip`, m), as holds suggest, though the baseline allows for it; no name.

        `hold`: the newest that tells of frequencies; the words say by how much these, angles and IMU are off.
        """
        ranks = self._likely(verdict)
        odds = math.exp(min(verdict.strength, SAYABLE))
        names = " or ".join(rank.cause for rank in ranks)
        told = (
            f"the tip is off by about {1e3 * tip:.0f} mm: {self._deviations(hold)}; a fault explains that {odds:.0f} times as "
            f"well as what the baseline allows; nearest: {names}; look at the boom, or learn a baseline of this rig while all "
            "is well (boom_twin calibrate --baseline)"
        )
        return replace(alarm, kind="residual", cause=None, told=told, ranked=ranks)

    def _deviations(self, hold: HoldProblem) -> str:
        """By how much a hold is off from what is predicted: every frequency, the angle and the IMU's axis that are most."""
        count, left = len(self._scene.joints), hold.table[:, 0]
        found = [
            f"natural frequency {mode + 1} by {100.0 * off:+.1f} %"
            for mode, off in zip(hold.modes.tolist(), hold.frequencies[:, 0].tolist(), strict=True)
        ]
        for own, factor, unit in ((left[:count], 1e3, "mrad"), (left[count:], 1.0, "m/s^2")):
            if np.isfinite(own).any():
                place = int(np.nanargmax(np.abs(own)))
                name = self._names[place if unit == "mrad" else count + place]
                found.append(f"{name} by {factor * own[place]:+.2g} {unit}")
        return ", ".join(found)

    def _likely(self, verdict: Verdict) -> tuple[Ranked, ...]:
        """Causes that are told."""
        likely = [cause for cause in verdict.causes if cause.probability >= LISTED][:MOST]
        return tuple(self._ranked(cause, verdict.excess) for cause in likely)

    def _is_certain(
        self,
        alarm: Alarm,
        whole: Verdict,
        calm: Verdict,
        is_told_apart: bool,
        span: float,
        travel: float,
        stamp: int,
        is_calm: bool,
    ) -> bool:
        """Whether the most probable cause is named: it fits, and has been probable enough for some time.

        Whatever else changes meanwhile may look like growth, and a neighbour's offset like a drift. So a fault that grows is
        named on a calm boom, a drift as long as it is as fast as it was; under a load where it is surer, or the cause the same
        if nothing grows: then the name does not depend on the shape. Under a load that hides most of a fault the onset is not
        seen, nor the shape, and of a wrong one the neighbour makes up better for a while: so a name takes one that is plainly
        there, or that leads for longer and while the boom moves. Vibration that a load makes is out of step with what is
        predicted, for that knows none: under one it is no lag of what feels little else.
        """
        best, borne_out = whole.causes[0], calm.causes[0]
        is_out_of_step = not is_calm and best.name == delay_cause(Stream.IMU)
        is_growing = whole.best.is_growing or calm.best.is_growing
        is_drift = calm.best.is_growing and self._known[calm.best.place].form in DRIFTING
        is_lasting = self._grows_still(alarm, calm, span) or not is_drift
        is_shapeless = best.steady >= NAMED and borne_out.steady >= BORNE_OUT
        is_surer = min(best.probability, best.alone) >= SHAKEN and min(borne_out.probability, borne_out.alone) >= NAMED
        has_shape = not is_growing or (span >= GROWING_AFTER and (is_shapeless or (is_lasting and (is_calm or is_surer))))
        leads = min(best.probability, best.alone) >= (GROWING if is_growing else NAMED)
        leads = leads and min(borne_out.probability, borne_out.alone) >= BORNE_OUT and is_told_apart
        shares = {cause.name: cause.probability for cause in whole.causes}
        is_held = alarm.cause not in (None, best.name) and shares[alarm.cause or ""] > REFUTED
        if is_out_of_step or not (leads and has_shape and max(whole.excess, calm.excess) <= FITS) or is_held:
            self._leading = "", stamp, travel
            return False
        if not alarm.told or self._leading[0] != best.name:
            self._leading = best.name, stamp, travel
        _, since, before = self._leading
        led = (stamp - since) * NANO
        is_plain = is_calm or whole.best.log_factor >= PLAIN
        return led >= NAMED_AFTER if is_plain else led >= LED and travel - before >= MOVED

    def _grows_still(self, alarm: Alarm, verdict: Verdict, span: float) -> bool:
        """Whether growth is as fast as it was: of what grew and then stayed, the slope over all its evidence becomes less."""
        if not alarm.told:
            self._steepest = {}
        if span > GROWTH_AFTER:
            for part in (part for cause in verdict.causes for part in cause.parts if part.is_growing):
                surely = abs(part.rate) - 2.0 * part.sigma / span
                self._steepest[part.place] = max(surely, self._steepest.get(part.place, 0.0))
        return abs(verdict.best.rate) >= STEADY * self._steepest.get(verdict.best.place, 0.0)

    def _ranked(self, cause: Cause, excess: float) -> Ranked:
        """With each of its faults in the shape that is more probable."""
        shapes: dict[int, Explanation] = {}
        for part in cause.parts:
            shapes.setdefault(part.place, part)
        parts = tuple(
            (self._kind(part), part.value, self._deviation(part, excess), self._known[part.place].unit)
            for part in shapes.values()
        )
        return Ranked(cause.name, cause.probability, parts)

    def _deviation(self, part: Explanation, excess: float) -> float:
        """Of a size; a lag is taken for so many times the rates, which change while it lasts."""
        own = part.sigma * excess**0.5
        return math.hypot(own, part.value**2 / RATES_LAST) if self._known[part.place].form is Form.DELAY else own

    def _kind(self, part: Explanation) -> str:
        """In a word what is the matter."""
        each = self._known[part.place]
        return "drift" if part.is_growing and each.form in DRIFTING else each.kind

    def _sentence(self, rank: Ranked, best: Explanation) -> str:
        """Cause, amount, trend and certainty."""
        kind, value, sigma, unit = rank.parts[0]
        each = self._known[best.place]
        if each.form is Form.SCENE and not unit:
            now, own = physical(each, self._scene, value), physical(each, self._scene, 0.0)
            spread = abs(physical(each, self._scene, value + sigma) - now)
            si = SI[each.cause.rpartition(".")[2]]
            amount = f"{now:.3g} +- {spread:.1g} {si}, {100 * (now / own - 1):+.0f} % of the scene's"
        else:
            amount = f"{value:+.3g} +- {sigma:.1g} {unit}".rstrip()
            amount += f" ({np.degrees(value):+.2g} deg)" if unit == "rad" else ""
        trend = f", {best.rate:+.2g} {unit}/s" if best.is_growing and unit else ", growing" if best.is_growing else ""
        remedy = delay_remedy(tuple(JUDGED)[each.index]) if each.form is Form.DELAY else ""
        return f"{rank.cause} {kind}: {amount}{trend} (probability {rank.probability:.3f}){remedy}"

    def _advised_move(self, verdict: Verdict, signature: Signature | None) -> str:
        """The move that would best tell the two most probable causes apart; worked out once for every pair."""
        one, other = verdict.causes[0], verdict.causes[1]
        pair = (one.name, other.name)
        if signature is None:
            return ""
        if pair != self._advised:
            self._advised, self._advice = pair, self._best_move(one.parts[0], other.parts[0], signature.strokes)
        return self._advice

    def _best_move(self, one: Explanation, other: Explanation, strokes: Array) -> str:
        best, told = CLEAR, ""
        for i, joint in enumerate(self._scene.joints):
            for way in (1.0, -1.0):
                aim = strokes.copy()
                aim[i] += way * MOVE * joint.cylinder.max_stroke
                if not 0.0 <= aim[i] <= joint.cylinder.max_stroke:
                    continue
                there = self._signatures.at(aim)
                if there is not None and (apart := self._apart(one, other, there)) > best:
                    best = apart
                    told = f"; moving cylinder_{i + 1} to {aim[i]:.2f} m would tell"
        self._signatures.at(strokes)
        return told

    def _apart(self, one: Explanation, other: Explanation, there: Signature) -> float:
        """How far the two would be apart, in deviations of the model's error."""
        first, second = (there.channels[:, each.place] * each.value for each in (one, other))
        return float(np.linalg.norm((first - second) / self._errors))
