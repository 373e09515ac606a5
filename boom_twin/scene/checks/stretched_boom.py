"""Plausibility of the whole boom: payload, pressures; stretched out its first frequencies, their damping, the give of oil."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...config.yaml_text import Place
from ...errors import Fault
from ..oil_spring import middle_stiffness
from ..schema import Scene, section_depth
from ..straight_boom import StraightBoom, straight_boom
from ..worst_load import worst_loads
from .draft import Draft, Findings

FREQUENCY = (4.0, 70.0)  # first one times the length of the boom, m/s
DAMPING = (1e-3, 0.2)  # ratio of the first mode
PART_DAMPING = (2e-4, 0.2)  # what one part alone would give the first mode, at least, and the second, at most
QUICK = 5.0  # Hz; of a short boom, whose second mode is above, the first mode or this frequency counts
PRESSURE = (5e6, 4.5e7)  # Pa, of the chamber that bears most; placing booms have up to 30 to 40 MPa
GIVE = 0.02  # of the stroke, by which the oil gives way under the weight of the boom
OIL, WIDEST_BORE = 1.5e9, 0.8  # bulk modulus, Pa; bore that a constant k needs, of the height of the section it lies along
TINY = 1e-300
MOST_PAYLOAD = 0.5  # of the boom's mass


TAKES = frozenset(
    ("E", "rho", "A", "I", "k", "rho_A", "mass", "com", "mL", "mR", "payload", "line_fill", "length", "beam", "gravity")
) | {"inclination", "bulk_modulus"}
"""Keys on which all of it depends: where one of these is odd, it would be told again."""


def stretched_boom(draft: Draft, scene: Scene, odd: Sequence[str]) -> list[Fault]:
    """Return the first implausibility that only all parts together show, estimated by `boom_twin.scene.straight_boom`.

    Payload, pressure, oil, frequency and damping are checked in this order: the first that is irregular causes what follows.
    `odd` are paths that have a finding already.
    """
    if any(path.rpartition(".")[2] in TAKES for path in odd):
        return []
    stiffnesses = np.array([middle_stiffness(joint.cylinder) for joint in scene.joints])
    found = straight_boom(scene, stiffnesses)
    checks = (_payload, _pressure, _give, _stiff, _frequency, _damping)
    turned = [path.removesuffix("range_deg") for path in odd if path.endswith("range_deg")]  # joints whose levers are no use
    findings = ([each for each in check(draft, scene, found) if not each.path.startswith(tuple(turned))] for check in checks)
    return next(filter(None, findings), [])


def _frequency(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    low, high = (limit / scene.reach for limit in FREQUENCY)
    if not all(joint.cylinder.is_compressible for joint in scene.joints):
        high = math.inf  # what was left out is not too stiff
    first = float(found.frequencies[0]) if len(found.frequencies) else low
    if not low <= first <= high:
        bound = (
            f"stretched out, this boom of {scene.reach:.3g} m has its first natural frequency at about {first:.2g} Hz; "
            f"expected {low:.2g} to {high:.2g} Hz"
        )
        remedy = "Check E, I and k for what is too soft or too stiff, masses for what is too heavy or too light."
        yield draft.warning(("sections",), len(scene.sections), bound, remedy)


def _damping(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    """Yield warnings of the damping of each part, then of all together; none where no damping is given at all."""
    if not len(found.frequencies):
        return
    parts: list[tuple[Place, float, float]] = []
    for i, (section, joint) in enumerate(zip(scene.sections, scene.joints, strict=True)):
        if section.beta:
            parts.append((("sections", i, "beta"), section.beta, section.beta))
        if joint.cylinder.d:
            delay = joint.cylinder.d / middle_stiffness(joint.cylinder)
            parts.append((("joints", i, "cylinder", "d"), joint.cylinder.d, delay))
    slow, quick = found.frequencies[[0, min(1, len(found.frequencies) - 1)]].tolist()
    first, second = math.pi * slow, math.pi * max(slow, min(quick, QUICK))
    odd = [part for part in parts if first * part[2] < PART_DAMPING[0] or second * part[2] > PART_DAMPING[1]]
    for place, value, delay in odd:
        pace = second if delay * second > PART_DAMPING[1] else first
        low, high = (limit * value / (each * delay or TINY) for limit, each in zip(PART_DAMPING, (first, second), strict=True))
        damped = f"a mode of {pace / math.pi:.2g} Hz by {100 * pace * delay:.2g} %"
        bound = f"alone it would damp {damped}; expected {low:.2g} to {high:.2g}"
        remedy = "beta is 2 zeta / omega in s, d is 2 zeta k / omega in N s/m, zeta being the damping ratio."
        yield draft.warning(place, value, bound, remedy)
    if parts and not odd:
        yield from _damping_of_all(draft, scene, found, parts[0])


def _damping_of_all(draft: Draft, scene: Scene, found: StraightBoom, part: tuple[Place, float, float]) -> Findings:
    betas = np.array([section.beta or 0.0 for section in scene.sections])
    delays = np.array([(joint.cylinder.d or 0.0) / middle_stiffness(joint.cylinder) for joint in scene.joints])
    ratio = float(np.pi * found.frequencies[0] * (found.sections[0] @ betas + found.joints[0] @ delays))
    if not DAMPING[0] <= ratio <= DAMPING[1]:
        low, high = (100.0 * limit for limit in DAMPING)
        bound = f"all damping together gives the first mode a ratio of {100 * ratio:.2g} %; expected {low:g} to {high:g} %"
        yield draft.warning(part[0], part[1], bound, "Give beta (s) of every section and d (N s/m) of every cylinder.")


def _pressure(draft: Draft, scene: Scene, _found: StraightBoom) -> Findings:
    """Yield warnings of oil pressure under the boom's weight in the worst posture: pushing on the bore, pulling on the ring."""
    if all(joint.cylinder.oil is None for joint in scene.joints):
        return
    for i, (joint, loads) in enumerate(zip(scene.joints, worst_loads(scene), strict=True)):
        oil = joint.cylinder.oil
        if oil is None:
            continue
        sides = ((oil.cap_area, "pushes", "cap"), (oil.rod_area, "pulls", "rod"))
        pressures = [abs(load.force) / area for load, (area, *_) in zip(loads, sides, strict=True)]
        worst = max((0, 1), key=pressures.__getitem__)
        if loads[worst].angles and not PRESSURE[0] <= pressures[worst] <= PRESSURE[1]:
            load, (_, acts, side) = loads[worst], sides[worst]
            expected = (
                "at most {1:g} MPa in every posture" if pressures[worst] > PRESSURE[1] else "at least {0:g} MPa in one posture"
            )
            bound = (
                f"at rest with sections at {list(load.angles)} deg cylinder {i + 1} {acts} most, with "
                f"{abs(load.force) / 1e3:.3g} kN, {pressures[worst] / 1e6:.3g} MPa on the {side} side; "
                f"expected {expected.format(*(1e-6 * limit for limit in PRESSURE))}"
            )
            remedy = "Give bore and rod as diameters, not radii (m), and check pins and masses."
            if pressures[worst] > PRESSURE[1]:
                area = 4.0 / math.pi * abs(load.force) / PRESSURE[1] + (oil.rod**2 if worst else 0.0)
                remedy += f" With this rod a bore of {math.ceil(1e3 * math.sqrt(area)) / 1e3:g} m would do."
            yield draft.warning(("joints", i, "cylinder", "oil", "bore"), oil.bore, bound, remedy)


def _give(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    for i, joint in enumerate(scene.joints):
        k, lever = middle_stiffness(joint.cylinder), abs(float(found.levers[i]))
        if math.isfinite(k) and lever > 0.0:
            force, most = float(found.moments[i]) / lever, GIVE * joint.cylinder.max_stroke
            if force > k * most:
                bound = (
                    f"stretched out, the boom loads the cylinder with about {force / 1e3:.3g} kN, and its oil gives way by "
                    f"{1e3 * force / k:.3g} mm; expected at most {1e3 * most:.3g} mm, 2 % of its stroke"
                )
                key, remedy = ("k", "k (N/m)") if joint.cylinder.oil is None else ("oil", "bore and rod (diameters, m)")
                yield draft.warning(("joints", i, "cylinder", key), k, bound, f"Check {remedy}, and the masses.")


def _stiff(draft: Draft, scene: Scene, _found: StraightBoom) -> Findings:
    """Check a constant k against the cylinder that could have it: amid its stroke s, k = 4 B A / s."""
    for i, joint in enumerate(scene.joints):
        bore = math.sqrt((joint.cylinder.k or 0.0) * joint.cylinder.max_stroke / (math.pi * OIL))
        depth = section_depth(scene, max(0, i - 1))
        if bore > WIDEST_BORE * depth:
            bound = (
                f"amid its stroke a cylinder has it with a bore of {bore:.2g} m; "
                f"expected at most {WIDEST_BORE * depth:.2g} m beside a section {depth:.2g} m high"
            )
            yield draft.warning(("joints", i, "cylinder", "k"), joint.cylinder.k, bound, "Check k (N/m), and its decimals.")


def _payload(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    payload, boom = scene.payload, found.mass - scene.payload
    if payload > MOST_PAYLOAD * boom > 0.0:
        bound = f"expected at most {MOST_PAYLOAD * boom:.3g} kg, half of what the boom weighs"
        yield draft.warning(("tip", "payload"), payload, bound, "Give kg; concrete in the pipe line is line_fill.")
