"""Tables of a compiled boom: operations along the chain, records of each kind of element, work arrays, status codes.

Operations are in order from base to tip. Positions and increments are computed in that order, forces in reverse. Elements
absent from a scene have a table of length 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..types import Array
from .elements.beam import BEAM as BEAM_ROW
from .elements.cylinder import CYLINDER, CYLINDER_PART, OIL
from .elements.linkage import LINKAGE
from .elements.pin_contact import CLEARANCE
from .jit import by_reference

SLOTS = 9  # largest size of a cut: x, y, theta, pin C (2), force of cylinder 1, three for the plain product or one for the base

CORRECTIONS = 3  # stored corrections of a step's initial guess

JOINT_A, JOINT_B, OFFSET, BODY, BEAM, STATION, ROD_PIN = range(7)

# Indices of a joint's unknowns relative to `z` of its row. Joints A: angle of the section, N. Joints B: angle of the
# section, angles of the links, force in pin Q (2), N. Last: offsets (2) of pins with clearance.
Z_SECTION, Z_FORCE_A, Z_LINK_L, Z_LINK_R, Z_LAMBDA, Z_FORCE_B, Z_OFFSETS_B = 0, 1, 1, 2, 3, 5, 6

# Columns of `State.frames` and `State.turns`. In `turns` the sine follows its cosine.
FRAME_X, FRAME_Y, FRAME_ANGLE, FRAME_COS, FRAME_SIN = range(5)
HEAD_TURN, SECTION_TURN, LINK_L_TURN, LINK_R_TURN = 0, 2, 4, 6

OPERATION = np.dtype([("kind", np.int64), ("row", np.int64)])

JOINT = np.dtype(
    [
        ("z", np.int64),  # index of the joint's first unknown
        ("x", float), ("y", float),  # pivot of joint A in the base, m
        ("first_link", np.int64), ("links", np.int64),  # rows of LINK: links with mass
        ("first_clearance", np.int64), ("clearances", np.int64),  # rows of CLEARANCE: pivot and link pins
    ]
)  # fmt: skip

OFFSET_ROW = np.dtype([("x", float), ("y", float)])

BODY_ROW = np.dtype(
    [
        ("history", np.int64),  # index of x, y, theta in the histories
        ("x", float), ("y", float),  # centre of mass in its frame, m
        ("mass", float),  # kg
        ("inertia", float),  # about the centre, kg m^2
    ]
)  # fmt: skip

OUTLET = np.dtype([("cylinder", np.int64), ("x", float), ("y", float)])  # the cylinder's pin in the frame, m

LINK = np.dtype(
    [
        ("side", np.int64),  # LINK_L or LINK_R
        ("history", np.int64),  # index of x, y, alpha in the histories
        ("middle", float),  # half the length, m
        ("mass", float),  # kg
        ("inertia", float),  # about the middle, kg m^2
    ]
)

HINGE = np.dtype(
    [
        ("z", np.int64),  # index of phi, the rotation of an elastic base, among the unknowns
        ("stiffness", float),  # N m/rad
        ("damping", float),  # N m s/rad
    ]
)


RECORDS = {
    "operations": OPERATION,
    "joints": JOINT,
    "linkages": LINKAGE,
    "links": LINK,
    "offsets": OFFSET_ROW,
    "bodies": BODY_ROW,
    "beams": BEAM_ROW,
    "outlets": OUTLET,
    "cylinders": CYLINDER,
    "parts": CYLINDER_PART,
    "oils": OIL,
    "clearances": CLEARANCE,
    "hinges": HINGE,
}
"""Dtypes of the record arrays of `Tables`."""


@by_reference
class Tables(NamedTuple):
    """Compiled boom. Record arrays have one row per element; see the dtypes for units."""

    operations: np.recarray
    joints: np.recarray
    linkages: np.recarray
    links: np.recarray
    offsets: np.recarray
    bodies: np.recarray
    beams: np.recarray
    psi: Array  # (beams, P+1, n)
    weights: Array  # (beams, P+1, P), m
    stiffness: Array  # (beams, n, n), N m
    point_mass: Array  # (beams, P), kg
    point_rotary: Array  # (beams, P), kg m^2
    outlets: np.recarray
    cylinders: np.recarray
    parts: np.recarray
    oils: np.recarray
    clearances: np.recarray  # pins that are not ideal, see `kernels.elements.pin_contact`
    hinges: np.recarray  # of an elastic base
    gravity: Array  # (2,), m/s^2
    moving: Array  # (unknowns,): 1 for coordinates, 0 for forces
    scale: Array  # (unknowns,): factor from increment to angle, rad; 0 for forces
    tip: int  # index of the tip's x, y, theta in the histories


class Motion(NamedTuple):
    """Coefficients of accelerations a = gain (x - hat) and velocities v = rate x + offset."""

    gain: float
    rate: float
    hat: Array
    offset: Array
    renew: bool = True  # True if a sweep computes new tangents; False to keep those of `Condensed`


@by_reference
class State(NamedTuple):
    """State of the boom between steps."""

    z: Array  # (unknowns,), coordinates and forces, see the tables
    history: Array  # (depth, histories), of unknowns, then mass points; rows: see `kernels.integrators`
    frames: Array  # (operations + 1, 5), x, y, theta, cos, sin before every operation, and at the tip
    turns: Array  # (joints, 8), cosine and sine of a joint's head, and of a six-bar's section, link L, link R
    pins: Array  # (cylinders, 4), ends C and R of every cylinder, m
    contacts: Array  # (clearances, 8), memory of pins with clearance, see `kernels.elements.pin_contact`
    drives: Array  # (2, cylinders), length (m) and rate (m/s) of the drives at the newest history
    pace: np.ndarray  # (1,), length of the last sub-step in ticks, see `kernels.transfer.time_step`


@by_reference
class Condensed(NamedTuple):
    """Result of an inward sweep (`kernels.transfer.riccati_sweep.sweep_in`), used by later sweeps."""

    gains: Array  # (operations, rows, SLOTS), decrements of condensed unknowns per increment of the cut
    free: Array  # (operations, rows), decrements independent of the cut
    factors: Array  # (operations, rows, rows), of the condensed matrix: L D L^T for a beam, L U for a joint
    order: np.ndarray  # (operations, rows), row order of the factors, see `kernels.plane_algebra`
    blocks: Array  # (joints, inner, inner), matrix H_qq of a joint; inner: largest number of unknowns of a joint
    ends: Array  # (clearances, 2, 2), the same of a cylinder's end
    end_gains: Array  # (clearances, 2, 5)
    end_free: Array  # (clearances, 2)


@by_reference
class Work(NamedTuple):
    """Work arrays of one step; tangent and corrections are kept for the next."""

    position: Array  # (histories,), as the next four
    velocity: Array  # at the solved instant
    acceleration: Array
    hat: Array  # x_hat and D of the step
    offset: Array
    weights: Array  # weights of the scheme, see `kernels.integrators`
    finer: Array  # the same for a sub-step
    s: Array  # (SLOTS, SLOTS)
    p: Array  # (SLOTS,)
    g: Array  # (size,) six-bar's system
    h: Array  # (size, size)
    own_g: Array  # (5,) cylinder's system
    own_h: Array  # (5, 5)
    right: Array  # (inner, SLOTS)
    condensed: Condensed
    hold: Array  # (clearances, 9) forces on journals, columns: see `kernels.elements.pin_contact`
    apart: Array  # (2, size + 1) rows of a six-bar's system during its assembly
    rho: Array  # (beams, P+1, 2)
    drho: Array  # (beams, P+1, n+1, 2)
    turn: Array  # (beams, TURN_ROWS, P+1)
    local: Array  # (LOCAL_ROWS, P)
    drive: Array  # (cylinders,) drives of a sub-step, m
    drive_rate: Array  # (cylinders,), m/s
    load: Array  # (2, 2) force at the tip, x and y (N): at the start of a step, and at its end
    dz: Array  # (unknowns,)
    guess: Array  # (unknowns,) uncorrected, see `kernels.transfer.kept_tangent`
    corrections: Array  # (CORRECTIONS, unknowns), newest first
    kept_z: Array  # (unknowns,) state of the kept tangent
    kept: Array  # (4,) see `kernels.transfer.kept_tangent`
    cut: Array  # (SLOTS,)


OF_FORCES = (
    "offset", "s", "p", "g", "h", "own_g", "own_h", "right", "hold", "apart", "local", "drive", "drive_rate", "dz", "cut",
)  # fmt: skip
"""Fields of `Work` with forces, tangents, increments and drives."""


def complex_scratch(work: Work) -> Work:
    """Return `work` with complex arrays for `OF_FORCES` and shared arrays for the rest.

    Used by sweeps with complex weights, see `kernels.transfer.vibration`.
    """
    own = {name: getattr(work, name).astype(complex) for name in OF_FORCES}
    condensed = Condensed(*(each.astype(complex) if each.dtype == float else each for each in work.condensed))
    return work._replace(**own, condensed=condensed)


OK, NOT_CONVERGED, SINGULAR, NOT_FINITE, DIGITS_LOST = range(5)

SENTENCES = {
    OK: "ok",
    NOT_CONVERGED: "the equations did not converge; take a smaller step or a smoother stroke, or keep off a dead centre",
    SINGULAR: "the equations are singular: a linkage stands at its dead centre, or a part is neither held nor has mass",
    NOT_FINITE: "the equations gave a value that is not finite; check the strokes and take a smaller step",
    DIGITS_LOST: "the plain product of transfer matrices lost its digits; take the Riccati form or a larger step",
}
