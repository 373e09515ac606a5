"""Tables of a compiled boom: operations along the chain, records of each kind of element, work arrays, status codes.

The operations stand in the order from the base to the tip. Positions are placed in that order, forces are swept in against
it, increments are swept out along it. A kind of element that a scene does not have is a table of length 0.
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

SLOTS = 9  # most of a cut: x, y, theta, a pin C (2), the force of cylinder 1, and three of the plain product

CORRECTIONS = 3  # of a step's guess that are remembered

JOINT_A, JOINT_B, OFFSET, BODY, BEAM, STATION, ROD_PIN = range(7)

# Places of a joint's unknowns from `z` of its row on. Both: angle of the section. A: N. B: angles of the links, force in pin Q
# (2), N. Behind them in both: offsets (2) of the pins with clearance.
Z_SECTION, Z_FORCE_A, Z_LINK_L, Z_LINK_R, Z_LAMBDA, Z_FORCE_B, Z_OFFSETS_B = 0, 1, 1, 2, 3, 5, 6

# Columns of `State.frames`, and of `State.turns`, where the sine stands behind its cosine.
FRAME_X, FRAME_Y, FRAME_ANGLE, FRAME_COS, FRAME_SIN = range(5)
HEAD_TURN, SECTION_TURN, LINK_L_TURN, LINK_R_TURN = 0, 2, 4, 6

OPERATION = np.dtype([("kind", np.int64), ("row", np.int64)])

JOINT = np.dtype(
    [
        ("z", np.int64),  # place of the joint's first unknown
        ("x", float), ("y", float),  # pivot of joint A in the base, m
        ("first_link", np.int64), ("links", np.int64),  # rows of LINK: those that have mass
        ("first_clearance", np.int64), ("clearances", np.int64),  # rows of CLEARANCE: pivot and link pins
    ]
)  # fmt: skip

OFFSET_ROW = np.dtype([("x", float), ("y", float)])

BODY_ROW = np.dtype(
    [
        ("history", np.int64),  # place of x, y, theta among the histories
        ("x", float), ("y", float),  # centre from the frame it sits on, m
        ("mass", float),  # kg
        ("inertia", float),  # about the centre, kg m^2
    ]
)  # fmt: skip

OUTLET = np.dtype([("cylinder", np.int64), ("x", float), ("y", float)])  # pin of that cylinder, from the frame, m

LINK = np.dtype(
    [
        ("side", np.int64),  # LINK_L or LINK_R
        ("history", np.int64),  # place of x, y, alpha among the histories
        ("middle", float),  # half the length, m
        ("mass", float),  # kg
        ("inertia", float),  # about the middle, kg m^2
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
}
"""What a row of every record array of `Tables` is."""


@by_reference
class Tables(NamedTuple):
    """A compiled boom. Record arrays, one row an element; see the dtypes for units."""

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
    gravity: Array  # (2,), m/s^2
    moving: Array  # (unknowns,): 1 for coordinates, 0 for forces
    scale: Array  # (unknowns,): turns an increment into an angle, rad; 0 for forces
    tip: int  # place of x, y, theta of the tip among the histories


class Motion(NamedTuple):
    """Coefficients by which histories give accelerations and velocities: a = gain (x - hat), v = rate x + offset.

    renew : whether a sweep makes tangents anew, or only forces, with the tangents that `Condensed` holds.
    """

    gain: float
    rate: float
    hat: Array
    offset: Array
    renew: bool = True


@by_reference
class State(NamedTuple):
    """State of the boom between steps.

    z : (unknowns,) coordinates and forces, see the tables.
    history : (depth, histories) of every unknown and then of every mass point; rows: see `kernels.integrators`.
    frames : (operations + 1, 5) x, y, theta, cos, sin before every operation, and at the tip.
    turns : (joints, 8) cosine and sine of a six-bar's head, section, link L, link R.
    pins : (cylinders, 4) ends C and R of every cylinder, m.
    contacts : (clearances, 8) what pins with clearance remember, see `kernels.elements.pin_contact`.
    drives : (2, cylinders) length (m) and rate (m/s) of the drives at the newest history.
    pace : (1,) ticks of the last sub-step, see `kernels.transfer.time_step`.
    """

    z: Array
    history: Array
    frames: Array
    turns: Array
    pins: Array
    contacts: Array
    drives: Array
    pace: np.ndarray


@by_reference
class Condensed(NamedTuple):
    """Result of an inward sweep (`kernels.transfer.riccati_sweep.sweep_in`), for the sweeps that go on from it.

    gains : (operations, rows, SLOTS) decrements of the condensed unknowns by increments of the cut, and
    free : (operations, rows) those that do not depend on it.
    factors : (operations, rows, rows) of what an operation condenses, and order : (operations, rows) of its rows, see
    `kernels.plane_algebra`: a beam's L D L^T, a joint's L U.
    blocks : (joints, inner, inner) H_qq of what a joint condenses, inner: most unknowns of a joint.
    ends : (clearances, 2, 2) the same of the end of a cylinder. end_gains : (clearances, 2, 5), end_free : (clearances, 2).
    """

    gains: Array
    free: Array
    factors: Array
    order: np.ndarray
    blocks: Array
    ends: Array
    end_gains: Array
    end_free: Array


@by_reference
class Work(NamedTuple):
    """Scratch of one step; no meaning between steps."""

    position: Array  # (histories,), as are those that follow
    velocity: Array  # at the instant that a step solved for
    acceleration: Array
    hat: Array  # x_hat and D of the step
    offset: Array
    weights: Array  # of the scheme, see `kernels.integrators`
    finer: Array  # of a sub-step's
    s: Array  # (SLOTS, SLOTS)
    p: Array  # (SLOTS,)
    g: Array  # (size,) of a six-bar's system
    h: Array  # (size, size)
    own_g: Array  # (5,) of a cylinder
    own_h: Array  # (5, 5)
    right: Array  # (inner, SLOTS), inner: most unknowns of a joint
    condensed: Condensed
    hold: Array  # (clearances, 9) what holds a journal back, columns as named in `kernels.elements.pin_contact`
    apart: Array  # (2, size + 1) rows of a six-bar's system, kept while it is assembled
    rho: Array  # (beams, P+1, 2)
    drho: Array  # (beams, P+1, n+1, 2)
    turn: Array  # (beams, TURN_ROWS, P+1)
    local: Array  # (LOCAL_ROWS, P)
    drive: Array  # (cylinders,) of a sub-step, m
    drive_rate: Array  # (cylinders,), m/s
    dz: Array  # (unknowns,)
    guess: Array  # (unknowns,) without the last step's correction, see `kernels.transfer.kept_tangent`
    corrections: Array  # (CORRECTIONS, unknowns), the newest first
    kept_z: Array  # (unknowns,) at which tangents were made
    kept: Array  # (4,) as named there
    cut: Array  # (SLOTS,)


OF_FORCES = (
    "offset", "s", "p", "g", "h", "own_g", "own_h", "right", "hold", "apart", "local", "drive", "drive_rate", "dz", "cut",
)  # fmt: skip
"""Fields of `Work` that hold forces, tangents, increments and drives; positions and shapes are the others."""


def complex_scratch(work: Work) -> Work:
    """`work` with complex arrays for forces, tangents, increments and drives; positions and shapes are the same arrays.

    For the sweeps with complex weights, see `kernels.transfer.frequency_response`.
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
