"""The text of `study error`."""

from __future__ import annotations

from collections.abc import Sequence

from .error_cases import Own, Peer, Stiff
from .error_choice import paragraph
from .error_front import Duel, matches, of
from .error_problem import Problem
from .error_run import Row
from .error_text import (
    cheapest_table,
    equal_error_table,
    failures_table,
    feeding_share,
    front_table,
    matrices,
    order_table,
)
from .exudyn import build
from .report import provenance


def report(problem: Problem, rows: Sequence[Row], duel: Duel | None) -> str:
    """The whole report in Markdown."""
    parts = [
        "# Error against run time", provenance(), _setting(problem), "![Error against run time](error.png)",
        "## The default", paragraph(rows, problem.scene), order_table(rows, Own().label),
        "## At equal error of the tip", _equal(problem, rows, duel),
        "## The fastest of boom_twin at an error", cheapest_table(rows),
        "## The Pareto front", front_table(rows),
        "## All methods", "![Methods of boom_twin](error_methods.png)", "### boom_twin", matrices(rows, Own),
    ]  # fmt: skip
    for title, kind in (("Exudyn", Peer), ("SciPy", Stiff)):
        if of(rows, kind):
            parts += [f"### {title}", matrices(rows, kind)]
    if any(not row.good for row in rows):
        parts += ["## What failed", failures_table(rows)]
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def _setting(problem: Problem) -> str:
    """What was moved, what the errors are, and what the times are."""
    own, other = problem.own, problem.exudyn
    if other is None or problem.apart is None:
        second = f"There is no independent reference: {problem.missing}"
    else:
        tip, acceleration = problem.apart
        second = (
            f"The independent one is {other.what}; about {other.tip_mm:.2g} mm and {100 * other.acceleration:.2g} % are left "
            f"in it. Both differ by {tip:.2g} mm and {100 * acceleration:.2g} %. Where one error is given, it is the larger of "
            "both, so that no program is judged by itself alone. Exudyn's rows have GA = 10 EA as the rig has; of the default "
            "boom's tip, 0.016 mm are that."
        )
    return (
        f"Motion: {problem.motion.label}. Errors are root mean squares over the motion of the tip's place, and of its "
        f"acceleration over that acceleration's own. The own reference is {own.what}; about {own.tip_mm:.2g} mm and "
        f"{100 * own.acceleration:.2g} % are left in it. {second}\n\nRun time is that of the stepping alone, compiled, without "
        "assembly and equilibrium, median of runs that lie apart, in milliseconds per simulated second; every program on one "
        "core."
    )


def _equal(problem: Problem, rows: Sequence[Row], duel: Duel | None) -> str:
    """Tables against the other programs, and how these were run."""
    parts = [equal_error_table(matches(rows), "Exudyn")] if problem.exudyn else [problem.missing + "\n"]
    parts.append(equal_error_table(matches(rows, Stiff), "SciPy"))
    if duel is not None:
        own, peer = (1e6 * seconds * duel.case.step for seconds in duel.medians)
        share = feeding_share(rows)
        parts.append(
            f"At the same step of {1e3 * duel.case.step:g} ms, in turn: boom_twin {own:.3g} us a step; {duel.case.label}, "
            f"{peer:.4g} us, {peer / own:.3g} times as long (of the fastest runs: {duel.ratio_of_minima:.3g})."
        )
        parts.append(
            f"Exudyn: build {build()}, sparse solver, one thread, generalised-alpha 0.8, all ways of Newton's method that the "
            "tables below name; its drives get their lengths from a Python function before every step, "
            + (f"which takes {100 * share:.2g} % of its time." if share else "whose time was not measured.")
        )
    parts.append(
        "SciPy: `solve_ivp` on finite segments with all kinematics closed, vectorised in numpy, with the Jacobian of the stiff "
        "forces; steps are its own. Cutting into segments errs by the square of their length whatever the tolerance"
        f"{_segments(rows)}."
    )
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def _segments(rows: Sequence[Row]) -> str:
    """What cutting into segments alone errs by: the rows of Radau at the least tolerance."""
    listed = [row for row in of(rows, Stiff) if isinstance(row.case, Stiff) and row.case.solver == "Radau" and row.good]
    least = min((row.case.tolerance for row in listed if isinstance(row.case, Stiff)), default=0.0)
    told = [
        f"{row.tip_mm:.2g} mm with {4 * row.case.fineness} a section"
        for row in listed
        if isinstance(row.case, Stiff) and row.case.tolerance == least
    ]
    return f": {', '.join(told)}" if told else ""
