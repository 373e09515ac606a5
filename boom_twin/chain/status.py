"""Status codes of kernels, and what each means, in one sentence with its remedy."""

from __future__ import annotations

OK, NOT_CONVERGED, SINGULAR, NOT_FINITE, DIGITS_LOST = range(5)

SENTENCES = {
    OK: "ok",
    NOT_CONVERGED: "the equations did not converge; take a smaller step or a smoother stroke, or keep off a dead centre",
    SINGULAR: "the equations are singular: a linkage stands at its dead centre, or a part is neither held nor has mass",
    NOT_FINITE: "the equations gave a value that is not finite; check the strokes and take a smaller step",
    DIGITS_LOST: "the plain product of transfer matrices lost its digits; take the Riccati form or a larger step",
}
