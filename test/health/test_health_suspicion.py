"""What a suspicion says of its own evidence, and what a name takes beside a probability."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drive_twin import drive_twin

from boom_twin import load_scene
from boom_twin.health.alarm_text import AlarmText
from boom_twin.health.baseline import Baseline
from boom_twin.health.inference.block_problem import BLOCK, BlockProblem
from boom_twin.health.inference.fault_catalogue import Form, Parameter, parameters
from boom_twin.health.inference.hypotheses import Cause, Explanation, HypothesisTest, Verdict
from boom_twin.health.inference.innovation_filter import ModalStates
from boom_twin.health.inference.sensitivities import Signatures
from boom_twin.health.residual_monitor import _KnownFault
from boom_twin.health.suspicion import SURE, Suspicion, refuted
from boom_twin.types import Alarm, Ranked

KNOWN = (
    Parameter("joint_1.sensor", "bias", Form.ANGLE, 0, "rad", 1e-4, 5e-3),
    Parameter("joint_2.sensor", "bias", Form.ANGLE, 1, "rad", 1e-4, 5e-3),
)
NOISE, ERROR = 4e-5, 5e-5  # rad, of a block's mean and of the model in one posture
STIFF = ModalStates(*(np.zeros(shape) for shape in ((0,), (0, 0), (0, 0), (0, 0), (0, 0), (2, 0), (2,), (0, 2), (2, 2))))
"""Of a boom without a mode below 8 Hz, that no load bends."""


LIMP = STIFF._replace(lifted=np.array([[0.0, 0.0], [1e-5, 0.0]]))
"""Likewise, but a force of 1 N at the tip turns the second joint by 1e-5 rad."""


def suspicion_of(
    offsets: np.ndarray, seed: int = 1, forces: np.ndarray | None = None, levels: tuple[float, ...] = (0.0,)
) -> Suspicion:
    """Of blocks of two angles, the first of which is off by so much (rad) in each; forces (N) at the tip turn the second."""
    rng, mean = np.random.default_rng(seed), np.zeros(2)
    found = Suspicion(
        HypothesisTest(KNOWN), 0, mean, np.diag([1e-8, 1e-8]), np.full(2, ERROR**2), np.ones(2), np.array(levels), 0.15, {}
    )
    modes, bent = (STIFF, np.zeros(len(offsets))) if forces is None else (LIMP, 1e-5 * forces)
    for k, (offset, other) in enumerate(zip(offsets, bent, strict=True)):
        left = np.array([offset, other]) + NOISE * rng.normal(size=2)
        table = np.column_stack([left, np.eye(2)])
        found.take(BlockProblem(k * BLOCK, table, np.full(2, NOISE**2), np.zeros((2, 2)), 0.0, 0.0, modes), forces is not None)
    return found


GROWING, STAYING = np.linspace(0.0, 6e-4, 60), np.full(60, 6e-4)


@pytest.mark.parametrize("seed", range(3))
def test_a_size_that_has_changed_is_seen_within_a_few_seconds(seed):
    """Growth that is over within 3 s of its end, though squares are those of noise; what grows on or stays is the same."""
    over = suspicion_of(np.concatenate([GROWING, STAYING[:25]]), seed)
    verdict = over.explain()
    assert verdict.best.is_growing and verdict.excess < 1.5
    assert over.recent_fit(verdict).is_resized and not over.recent_fit(verdict).is_outdated
    for offsets in (GROWING, STAYING, np.concatenate([STAYING, STAYING])):
        steady = suspicion_of(offsets, seed)
        assert not any(steady.recent_fit(steady.explain()))


@pytest.mark.parametrize("seed", range(3))
def test_a_load_that_becomes_less_refutes_no_fault(seed):
    """The wind drops: two seconds without it suit the lowest level far better, but refute nothing."""
    gusts = 50.0 * np.sin(np.arange(60) / 3.0)
    found = suspicion_of(np.full(85, 2e-3), seed, np.concatenate([gusts, np.zeros(25)]), (0.0, 50.0))
    verdict = found.explain()
    assert verdict.level == 1 and verdict.causes[0].name == "joint_1.sensor" and verdict.strength > SURE
    assert not any(found.recent_fit(verdict))
    healthy = suspicion_of(np.zeros(85), seed, np.concatenate([gusts, np.zeros(25)]), (0.0, 50.0))
    assert healthy.recent_fit(healthy.explain()).is_outdated, "where there is no fault it shows sooner without a load"


def verdict_of(
    shares: dict[str, tuple[float, float]], excess: float = 1.0, rate: float = 0.0, steady: float = 1.0, strength: float = 80.0
) -> Verdict:
    """Of causes with their probability, and that by this evidence alone; of the first, if nothing grows; perhaps all grow."""
    known = parameters(load_scene())
    places = {each.cause: place for place, each in enumerate(known)}
    others = (1.0 - steady) / max(len(shares) - 1, 1)
    causes = []
    for i, (name, (share, alone)) in enumerate(shares.items()):
        part = Explanation(places[name], 0, strength, 0.4, 0.02, rate, 0.01 * rate)
        causes.append(Cause(name, share, (part,), alone, others if i else steady))
    return Verdict(tuple(causes), excess, 1.0, 0, strength / excess)


def test_what_fits_rules_out_other_causes():
    shares = {"cylinder_3.k": (0.7, 0.7), "joint_3.sensor": (0.298, 0.298), "tip.payload": (0.002, 1e-9)}
    assert refuted(verdict_of(shares)) == {"tip.payload"}
    assert refuted(verdict_of(shares, excess=1.6)) == frozenset(), "what does not fit rules nothing out"


def test_a_name_takes_present_evidence_that_says_so_itself():
    """Odds that older evidence has left, or calm blocks that say otherwise than all of them, make no name."""
    scene = load_scene()
    known = parameters(scene)

    def cause_after(alone: float, is_told_apart: bool, calmly: float = 0.99) -> tuple[str | None, str]:
        tell = AlarmText(scene, known, Signatures(scene, known, (None,) * 4), np.full(6, 1e-4))
        alarm = Alarm("joint_3", "residual", 0, None, None, "")
        whole = verdict_of({"cylinder_3.k": (0.99, alone), "joint_3.sensor": (0.01, 1.0 - alone)})
        calm = verdict_of({"cylinder_3.k": (calmly, calmly), "joint_3.sensor": (1.0 - calmly, 1.0 - calmly)})
        for second in range(6):
            alarm = tell.alarm(alarm, whole, calm, is_told_apart, 10.0 + second, 0.0, second * 10**9, True, None)
        return alarm.cause, alarm.told

    assert cause_after(0.99, True)[0] == "cylinder_3.k"
    assert cause_after(0.9, True) == (None, "cylinder_3.k most likely, not yet certain")
    cause, told = cause_after(0.99, False)
    assert cause is None and "as cylinder_3.k would, but not in all that was measured" in told
    cause, told = cause_after(0.99, True, calmly=0.8)
    assert cause == "cylinder_3.k" and "(probability 0.990)" in told, "few calm blocks bear it out as far as they go"
    cause, told = cause_after(0.99, True, calmly=0.6)
    assert cause is None and "cylinder_3.k or joint_3.sensor" in told


def told_of(whole: Verdict, calm: Verdict, is_calm: bool, seconds: int = 25, speed: float = 0.0) -> Alarm:
    """The alarm after looks once a second; names of what grows take 20 s; strokes travel at `speed` (m/s)."""
    scene = load_scene()
    known = parameters(scene)
    tell = AlarmText(scene, known, Signatures(scene, known, (None,) * 4), np.full(6, 1e-4))
    alarm = Alarm("joint_2", "residual", 0, None, None, "")
    for second in range(seconds):
        alarm = tell.alarm(alarm, whole, calm, True, float(second), speed * second, second * 10**9, is_calm, None)
        assert alarm.cause is None or second >= 20 or not whole.best.is_growing, "growth takes time to be told"
    return alarm


@pytest.mark.parametrize(
    "share, steady, is_calm, strength, cause",
    [
        (0.995, 0.6, True, 80.0, "line_fill"),
        (0.995, 0.6, False, 80.0, None),
        (0.995, 0.97, False, 80.0, "line_fill"),
        (0.995, 0.97, False, 50.0, None),
        (0.9995, 0.6, False, 80.0, "line_fill"),
        (0.9995, 0.6, False, 50.0, None),
    ],
)
def test_what_grows_under_a_load_is_named_where_it_is_plain_and_does_not_depend_on_the_growth_or_is_surer(
    share, steady, is_calm, strength, cause
):
    """Slow gusts look like growth."""
    shares = {"line_fill": (share, share), "joint_2.sensor": (1.0 - share, 1.0 - share)}
    verdict = verdict_of(shares, rate=0.1, steady=steady, strength=strength)
    assert told_of(verdict, verdict, is_calm).cause == cause


def test_under_a_load_a_name_takes_a_fault_that_is_plainly_there():
    """Of a drift that has begun within the evidence a steady loss of stiffness makes up better for the wrong onset."""
    shares = {"cylinder_4.k": (0.993, 0.993), "joint_4.sensor": (0.007, 0.007)}
    for strength, is_calm, cause in ((80.0, False, "cylinder_4.k"), (50.0, False, None), (50.0, True, "cylinder_4.k")):
        verdict = verdict_of(shares, strength=strength)
        assert told_of(verdict, verdict, is_calm).cause == cause
    less_plain = verdict_of(shares, strength=50.0)
    for seconds, cause in ((9, None), (12, "cylinder_4.k")):
        assert told_of(less_plain, less_plain, False, seconds, 0.02).cause == cause, "it leads for long, while the boom moves"


@pytest.mark.parametrize(
    ("cause", "is_calm", "is_named"),
    [("tip_imu.delay", True, True), ("tip_imu.delay", False, False), ("joint_angles.delay", False, True)],
)
def test_a_load_that_shakes_the_imu_is_no_lag_of_it(cause, is_calm, is_named):
    """What it makes is out of step with the prediction: 0.16 +- 0.03 s, with a probability of 1, of a rig without a lag."""
    verdict = verdict_of({cause: (0.9999, 0.9999), "joint_4.sensor": (0.0001, 0.0001)})
    assert told_of(verdict, verdict, is_calm).cause == (cause if is_named else None)


def test_a_name_takes_its_time_by_evidence_that_does_not_begin_anew():
    scene = load_scene()
    known = parameters(scene)
    tell = AlarmText(scene, known, Signatures(scene, known, (None,) * 4), np.full(6, 1e-4))
    verdict = verdict_of({"cylinder_4.k": (0.993, 0.993), "joint_4.sensor": (0.007, 0.007)})
    alarm = Alarm("joint_4", "residual", 0, None, None, "")
    for second in range(9):
        alarm = tell.alarm(alarm, verdict, verdict, True, 5.0, 0.0, second * 10**9, False, None)
        assert alarm.cause == (None if second < 8 else "cylinder_4.k")
        if second in (1, 4):
            tell.begin_anew()


def test_what_a_known_fault_does_in_motion_is_as_unsure_as_the_acceleration_is_large():
    """A weight of 20 kg bends the boom by a tenth more or less at 1 m/s^2; an encoder's offset is the same in any motion."""
    scene = load_scene()
    places = {each.cause: place for place, each in enumerate(parameters(scene))}
    table = np.full((6, 1 + len(parameters(scene))), 1e-4)
    problem = BlockProblem(0, table, np.zeros(6), np.zeros((6, 6)), 1.0, 0.0, STIFF)
    alarm = Alarm("joint_4", "changed", 0, None, "tip.payload", "")
    for cause, share in (("tip.payload", 1.0 / 9.81), ("joint_2.sensor", 0.0)):
        monitor = drive_twin(scene, baseline=Baseline()).judge.residuals
        monitor._known = {cause: _KnownFault(alarm, places[cause], 20.0)}
        assert np.sqrt(monitor._known_in_motion2(problem)) == pytest.approx(share * 20.0 * 1e-4)


def test_what_is_blamed_is_told_with_the_offset_that_it_would_be():
    monitor = drive_twin(load_scene(), baseline=Baseline()).judge.residuals
    ranked = (
        Ranked("cylinder_2.sensor", 0.6, (("scale", 0.01, 1e-3, ""), ("drift", 2.5e-3, 4e-5, "m"))),
        Ranked("cylinder_2.k", 0.4, (("softer", 0.3, 0.02, ""),)),
    )
    monitor._alarm = Alarm("joint_2", "residual", 0, None, None, "", ranked)
    assert monitor.blamed["cylinder_2.sensor"] == 2.5e-3 and math.isnan(monitor.blamed["cylinder_2.k"])
