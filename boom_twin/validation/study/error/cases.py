"""Cases of the error study: ways of stepping the boom, here and in two other programs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from ....analysis.methods import Method
from ....compiler.compile import BasisName
from ....scene.schema import Scene
from ...reference.segments.stiff_solver import Solver

STEPS = (2.5e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 4e-2)  # s; every one divides the longest
DEFAULT_STEP = 1e-3
INTEGRATORS = (
    *(Method(parameter=rho) for rho in (0.0, 0.5, 0.9, 1.0)),
    Method("newmark", 0.5),
    Method("newmark", 0.6),
    Method("wilson", 1.4),
    Method("houbolt", 0.0),
    Method("park", 0.0),
)
EXUDYN_STEPS = STEPS[1:]
LUMPED_ELEMENTS = (1, 2, 3, 4)
LUMPED_SCHEMES = ((1, 1e-3), (1, 5e-4), (1, 3e-4), (2, 3e-3), (2, 1e-3), (0, 1e-3))  # passes with a kept tangent, tolerance
ELEMENTS = (4, 8, 16)
SCHEMES = ((1, 1e-4), (2, 1e-3), (0, 1e-3))
FINENESS = (1, 2, 4)
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)


@dataclass(frozen=True)
class Own:
    """The transfer-matrix boom; `modes` None keeps the scene's."""

    step: float = DEFAULT_STEP
    method: Method = field(default_factory=Method)
    modes: int | None = None
    basis: BasisName = "end-shapes"
    axial: bool = True
    geometric: bool = True

    @property
    def label(self) -> str:
        """All but the step."""
        method, scheme = self.method, self.method.integrator
        if scheme in ("generalised-alpha", "newmark", "wilson"):
            scheme += f" {method.parameter:g}"
        parts = [scheme]
        parts += [] if self.modes is None else [f"{self.modes} modes" if self.modes > 1 else "1 mode"]
        parts += ["cantilever modes"] if self.basis == "cantilever" else []
        parts += ["one pass"] if method.passes == 1 else []
        parts += ["plain product"] if method.product == "plain" else []
        parts += [] if self.axial else ["no axial coordinate"]
        parts += [] if self.geometric else ["no geometric stiffness"]
        return ", ".join(parts)

    def scene(self, scene: Scene) -> Scene:
        """The scene as this case models it; sections that the scene makes rigid stay so."""
        changed = scene if self.modes is None else with_modes(scene, self.modes)
        parts = {"axial": self.axial and scene.axial, "geometric": self.geometric and scene.geometric}
        return changed if all(parts.values()) else changed.model_copy(update=parts)


PAPERS = Own(method=Method("newmark", 0.5, passes=1, product="plain"), modes=3, basis="cantilever")
"""The papers' way: Newmark, one linearised pass, the plain product, three cantilever modes."""


@dataclass(frozen=True)
class Peer:
    """Exudyn's geometrically exact beams, generalised-alpha; see `rig.Scheme` for `kept`, `rig.exudyn` for `lumped`."""

    step: float
    elements: int
    kept: int
    tolerance: float
    lumped: bool = True

    @property
    def model(self) -> str:
        """Model of the boom, in words."""
        return f"Exudyn, {self.elements} element{'s' if self.elements > 1 else ''}{', lumped' if self.lumped else ''}"

    @property
    def label(self) -> str:
        """All but the step."""
        times = {0: "anew", 1: "kept for 1 pass"}.get(self.kept, f"kept for {self.kept} passes")
        return f"{self.model}, tangent {times}, tolerance {self.tolerance:g}"


@dataclass(frozen=True)
class Stiff:
    """The finite-segment boom stepped by a stiff solver of SciPy."""

    fineness: int
    tolerance: float
    solver: Solver

    @property
    def label(self) -> str:
        """All but the tolerance."""
        return f"SciPy {self.solver}, {4 * self.fineness} segments"


Case = Own | Peer | Stiff


def with_modes(scene: Scene, modes: int) -> Scene:
    """The scene with `modes` bending coordinates in every part that bends."""
    own = {"modes": modes}
    sections = tuple(section.model_copy(update=own) if section.modes else section for section in scene.sections)
    return scene.model_copy(update={"sections": sections, **own})


def own_cases(scene: Scene, quick: bool) -> list[Own]:
    """Every variant of the default at every step; the default itself first, and only once."""
    steps = STEPS[2:6] if quick else STEPS
    variants = _few_variants() if quick else _variants()
    kept = [variant for variant in variants if replace(variant, modes=None) != Own() or variant.scene(scene) != scene]
    return [replace(variant, step=step) for variant in [Own(), *kept] for step in steps]


def _few_variants() -> Iterator[Own]:
    yield Own(method=Method("newmark", 0.6))
    yield Own(method=Method(passes=1))
    yield Own(modes=1)


def _variants() -> Iterator[Own]:
    for method in INTEGRATORS:
        yield Own(method=method)
    yield Own(method=Method(passes=1))
    yield Own(method=Method(product="plain"))
    yield PAPERS
    for modes in range(1, 7):
        yield Own(modes=modes)
        yield Own(modes=modes, basis="cantilever")
    for axial, geometric in ((False, True), (True, False), (False, False)):
        yield Own(axial=axial, geometric=geometric)
    for modes in (1, 2):
        yield Own(modes=modes, method=Method(passes=1))


def peer_cases(quick: bool) -> list[Peer]:
    """Elements and steps with every way to solve a step that may be the fastest; with bodies for all parts where that shows."""
    if quick:
        return [Peer(step, n, *LUMPED_SCHEMES[0]) for n in LUMPED_ELEMENTS[1::2] for step in EXUDYN_STEPS[1:5]]
    kinds = ((LUMPED_ELEMENTS, LUMPED_SCHEMES, EXUDYN_STEPS[1:], True), (ELEMENTS, SCHEMES, EXUDYN_STEPS, False))
    return [
        Peer(step, n, *scheme, lumped) for elements, schemes, steps, lumped in kinds
        for n in elements for scheme in schemes for step in steps
    ]  # fmt: skip


def stiff_cases(quick: bool) -> list[Stiff]:
    """Radau at every subdivision; the other solvers at the middle one."""
    if quick:
        return [Stiff(1, tolerance, "Radau") for tolerance in TOLERANCES[1:3]]
    cases = [Stiff(fineness, tolerance, "Radau") for fineness in FINENESS for tolerance in TOLERANCES]
    others: tuple[Solver, ...] = ("BDF", "LSODA")
    return cases + [Stiff(2, tolerance, solver) for solver in others for tolerance in TOLERANCES[1:]]
