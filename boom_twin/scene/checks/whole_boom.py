"""Plausibility of the stretched-out boom: payload, pressures, give of oil, first natural frequency, damping.

The stretched-out boom is estimated by the flexibility of a cantilever, also for first guesses. It lies along x (a joint that
cannot be straight is at the end of its range). Its beams are cut into cells that bend, its cylinders are springs in the joints,
its masses are points on the line. With B_pj the moment at spring p by a unit load at mass j, and c_p its compliance, the
singular values of sqrt(c_p) B_pj sqrt(m_j) are 1/omega. Damping that grows with stiffness, time constant tau, gives a mode the
damping ratio omega tau/2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...config.yaml_text import Place
from ...errors import Fault
from ...kernels.elements.linkage import cylinder_length
from ...types import Array
from ..kinematics import linkage
from ..schema import Scene
from . import Draft, Findings

FREQUENCY = (4.0, 70.0)  # first one times the length of the boom, m/s
DAMPING = (2e-4, 0.05)  # damping ratio of the first mode by one part alone
FASTEST = 5.0  # Hz; damping is judged at this frequency if the first mode is faster, as of a short boom
PRESSURE = (2.0, 45.0)  # MPa, of the chamber that bears the stretched-out boom; placing booms have up to 30 to 40 MPa


TAKES = frozenset(
    ("E", "rho", "A", "I", "k", "rho_A", "mass", "com", "mL", "mR", "payload", "line_fill", "length", "beam", "gravity")
) | {"inclination", "bulk_modulus", "stiffness"}
"""Keys on which all of it depends: where one of these is odd, it would be told again."""


def whole_boom(draft: Draft, odd: Sequence[str]) -> list[Fault]:
    """Return the first implausibility that only all parts together show.

    Payload, pressure, oil, frequency and damping are checked in this order: the first that is irregular causes what follows.
    `odd` are paths that have a finding already.
    """
    if any(path.rpartition(".")[2] in TAKES for path in odd):
        return []
    scene = draft.scene
    found = straight_boom(scene, np.array([joint.cylinder.middle_stiffness for joint in scene.joints]))
    checks = (_payload, _pressure, _give, _stiff, _frequency, _damping)
    turned = [path.removesuffix("range_deg") for path in odd if path.endswith("range_deg")]  # joints whose levers are no use
    findings = ([each for each in check(draft, scene, found) if not each.path.startswith(tuple(turned))] for check in checks)
    return next(filter(None, findings), [])


def _frequency(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    if len(found.frequencies):
        first, of_all = float(found.frequencies[0]), all(joint.cylinder.is_compressible for joint in scene.joints)
        limits = FREQUENCY if of_all else (FREQUENCY[0], math.inf)  # what was left out is not too stiff
        says = f"stretched out, this boom of {scene.reach:.3g} m has its first natural frequency at about {first:.2g} Hz; "
        remedy = "Check E, I and k for what is too soft or too stiff, masses for what is too heavy or too light."
        place, count = ("sections",), len(scene.sections)
        yield from draft.expect(place, count, limits, 1.0 / scene.reach, " Hz", remedy, measured=first, says=says)


def _damping(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    """Yield a warning of each part by whose damping alone the first mode has a damping ratio outside `DAMPING`."""
    if not len(found.frequencies):
        return
    parts: list[tuple[Place, float, float]] = []  # place, value, and the stiffness that it is a multiple of; beta has 1
    for i, (section, joint) in enumerate(zip(scene.sections, scene.joints, strict=True)):
        parts.append((("sections", i, "beta"), section.beta or 0.0, 1.0))
        parts.append((("joints", i, "cylinder", "d"), joint.cylinder.d or 0.0, joint.cylinder.middle_stiffness))
    parts.append((("base", "damping"), scene.base.damping or 0.0, scene.base.stiffness or math.inf))
    frequency = min(float(found.frequencies[0]), FASTEST)
    remedy = "beta is 2 zeta / omega (s), zeta the damping ratio; d, and damping of a base, are that times the stiffness."
    for place, value, stiffness in parts:
        if value > 0.0 and 0.0 < stiffness < math.inf:
            ratio = math.pi * frequency * value / stiffness
            says = f"alone it damps a mode of {frequency:.2g} Hz by {100 * ratio:.2g} %; "
            unit = stiffness / (math.pi * frequency)  # of `value`, per damping ratio
            yield from draft.expect(place, value, DAMPING, unit, "", remedy, says=says)


def _pressure(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    """Yield warnings of oil pressure in the chamber that bears the weight of the stretched-out boom."""
    for i, joint in enumerate(scene.joints):
        oil, lever, moment = joint.cylinder.oil, float(found.levers[i]), float(found.moments[i])
        if oil is None or lever == 0.0:
            continue
        area, acts, side = (oil.cap_area, "pushes", "cap") if lever > 0.0 else (oil.rod_area, "pulls", "rod")
        force = moment / abs(lever)
        says = f"stretched out, the cylinder {acts} with about {force / 1e3:.3g} kN, "
        says += f"{1e-6 * force / area:.3g} MPa on the {side} side; "
        remedy = "Give bore and rod as diameters, not radii (m), and check pins and masses."
        place = ("joints", i, "cylinder", "oil", "bore")
        yield from draft.expect(place, oil.bore, PRESSURE, 1.0, " MPa", remedy, measured=1e-6 * force / area, says=says)


def _give(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    give = 0.02  # of the stroke, by which the oil gives way under the weight of the boom
    for i, joint in enumerate(scene.joints):
        k, lever = joint.cylinder.middle_stiffness, abs(float(found.levers[i]))
        if math.isfinite(k) and lever > 0.0:
            force, most = float(found.moments[i]) / lever, give * joint.cylinder.max_stroke
            if force > k * most:
                bound = (
                    f"stretched out, the boom loads the cylinder with about {force / 1e3:.3g} kN, and its oil gives way by "
                    f"{1e3 * force / k:.3g} mm; expected at most {1e3 * most:.3g} mm, 2 % of its stroke"
                )
                key, remedy = ("k", "k (N/m)") if joint.cylinder.oil is None else ("oil", "bore and rod (diameters, m)")
                yield draft.warning(("joints", i, "cylinder", key), k, bound, f"Check {remedy}, and the masses.")


def _stiff(draft: Draft, scene: Scene, _found: StraightBoom) -> Findings:
    """Check a constant k against the cylinder that could have it: amid its stroke s, k = 4 B A / s."""
    oil, widest_bore = 1.5e9, 0.8  # bulk modulus, Pa; bore that a constant k needs, of the height of the section it lies along
    for i, joint in enumerate(scene.joints):
        k, depth = joint.cylinder.k or 0.0, scene.sections[max(0, i - 1)].depth
        bore = math.sqrt(k * joint.cylinder.max_stroke / (math.pi * oil))
        says = f"amid its stroke a cylinder has it with a bore of {bore:.2g} m; "
        where, remedy = f" m beside a section {depth:.2g} m high", "Check k (N/m), and its decimals."
        place, limits = ("joints", i, "cylinder", "k"), (0.0, widest_bore)
        yield from draft.expect(place, k, limits, depth, where, remedy, measured=bore, says=says)


# -- estimate of the stretched-out boom ----------------------------------------------------------------------------------

CELLS = 12  # of a beam


@dataclass(frozen=True)
class StraightBoom:
    """A stretched-out boom of n sections with k modes."""

    frequencies: Array  # natural frequencies, Hz, ascending, at most n + 2 of them, shape (k,)
    levers: Array  # change of stroke by angle, m/rad, shape (n,)
    moments: Array  # about the pivots, of the weight of all that lies outboard, N m, shape (n,)
    mass: float  # of all that moves, kg


@np.errstate(all="ignore")  # of absurd values
def straight_boom(scene: Scene, stiffnesses: Array) -> StraightBoom:
    """Estimate the stretched-out boom; `stiffnesses` (n,) of the oil springs in N/m, infinite where there is none."""
    starts = np.concatenate([[0.0], np.cumsum([section.length for section in scene.sections])])
    angles = [np.clip(0.0, *np.radians(joint.range_deg)) for joint in scene.joints]
    levers = np.nan_to_num([float(cylinder_length(linkage(scene, i), angle)[1]) for i, angle in enumerate(angles)])
    places, masses = _masses(scene, starts)
    at, compliance = _springs(scene, starts, levers, stiffnesses)
    arms = np.maximum(places[None, :] - at[:, None], 0.0)
    response = np.sqrt(compliance)[:, None] * arms * np.sqrt(masses)[None, :]
    if not np.isfinite(response).all():  # absurd values: no mode can be told
        response[:] = 0.0
    sizes = np.linalg.svd(response, compute_uv=False)
    sizes = sizes[sizes > 1e-9 * sizes.max(initial=0.0)][: len(scene.sections) + 2]
    moments = np.maximum(places[None, :] - starts[:-1, None], 0.0) @ masses * float(np.hypot(*scene.gravity))
    return StraightBoom(1.0 / (2.0 * np.pi * sizes), levers, moments, float(masses.sum()))


def _masses(scene: Scene, starts: Array) -> tuple[Array, Array]:
    """Return the places (m from the base pivot) and masses (kg) along the line; links and cylinders hang in the pivots."""
    points = [(float(starts[-1]), scene.payload)]
    for start, section, joint in zip(starts, scene.sections, scene.joints, strict=False):
        points.append((float(start), joint.mass))
        points += [(start + part.com[0], part.mass) for part in (section.root, section.head) if part is not None]
        points += _spread(start, (0.0, section.length), scene.line_fill or 0.0)
        points += _spread(start, section.beam or (0.0, 0.0), section.rho_A or 0.0)
    places, masses = np.array(points).T
    return places, masses


def _spread(start: float, ends: tuple[float, float], density: float) -> list[tuple[float, float]]:
    return [(start + place, density * (ends[1] - ends[0]) / CELLS) for place in _cells(ends)]


def _cells(ends: tuple[float, float]) -> Array:
    return np.asarray(ends[0] + (ends[1] - ends[0]) * (np.arange(CELLS) + 0.5) / CELLS)


def _springs(scene: Scene, starts: Array, levers: Array, stiffnesses: Array) -> tuple[Array, Array]:
    """Return places (m) and compliances (rad/(N m)) of all that gives way."""
    found = []
    for i, section in enumerate(scene.sections):
        if section.beam is not None and section.I is not None and scene.is_flexible(i):
            cell = (section.beam[1] - section.beam[0]) / CELLS
            found += [(starts[i] + place, cell / np.float64(scene.material.E * section.I)) for place in _cells(section.beam)]
        if np.isfinite(stiffnesses[i]) and abs(levers[i]) > 0.0:
            found.append((starts[i], 1.0 / (stiffnesses[i] * levers[i] ** 2)))
    if scene.base.stiffness is not None:
        found.append((starts[0], 1.0 / np.float64(scene.base.stiffness)))
    places, compliances = np.array(found or np.zeros((0, 2))).reshape(-1, 2).T
    return places, compliances


def _payload(draft: Draft, scene: Scene, found: StraightBoom) -> Findings:
    most_payload = 0.5  # of the boom's mass
    if (boom := found.mass - scene.payload) > 0.0:
        where, remedy = " kg, half of what the boom weighs", "Give kg; concrete in the pipe line is line_fill."
        yield from draft.expect(("tip", "payload"), scene.payload, (0.0, most_payload), boom, where, remedy)
