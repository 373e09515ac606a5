"""Cases of the error study: ways of stepping the boom, here and in Exudyn."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import product

from ....analysis.methods import Method
from ....compiler.compile import BasisName
from ....scene.schema import Scene
from ..scene_changes import with_modes

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
LUMPED_ELEMENTS = (1, 2, 3, 4)
LUMPED_SCHEMES = ((1, 1e-3), (1, 5e-4), (1, 3e-4), (2, 3e-3), (2, 1e-3), (0, 1e-3))  # passes with a kept tangent, tolerance
ELEMENTS = (4, 8, 16)
SCHEMES = ((1, 1e-4), (2, 1e-3), (0, 1e-3))


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
        """Return all settings but the step."""
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
        """Return the scene as this case models it; sections that the scene makes rigid stay so."""
        changed = scene if self.modes is None else with_modes(scene, self.modes)
        parts = {"axial": self.axial and scene.axial, "geometric": self.geometric and scene.geometric}
        return changed if all(parts.values()) else changed.model_copy(update=parts)


PAPERS = Own(method=Method("newmark", 0.5, passes=1, product="plain"), modes=3, basis="cantilever")
"""The papers' way: Newmark, one linearised pass, the plain product, three cantilever modes."""
VARIANTS = (
    *(Own(method=method) for method in INTEGRATORS),
    Own(method=Method(passes=1)),
    Own(method=Method(product="plain")),
    PAPERS,
    *(Own(modes=modes, basis=basis) for modes in range(1, 7) for basis in ("end-shapes", "cantilever")),
    *(Own(axial=axial, geometric=geometric) for axial, geometric in ((False, True), (True, False), (False, False))),
    *(Own(modes=modes, method=Method(passes=1)) for modes in (1, 2)),
)
FEW_VARIANTS = (Own(method=Method("newmark", 0.6)), Own(method=Method(passes=1)), Own(modes=1))


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
        """Return the model of the boom, in words."""
        return f"Exudyn, {self.elements} element{'s' if self.elements > 1 else ''}{', lumped' if self.lumped else ''}"

    @property
    def label(self) -> str:
        """Return all settings but the step."""
        times = {0: "anew", 1: "kept for 1 pass"}.get(self.kept, f"kept for {self.kept} passes")
        return f"{self.model}, tangent {times}, tolerance {self.tolerance:g}"


Case = Own | Peer


def own_cases(scene: Scene, quick: bool) -> list[Own]:
    """Return every variant of the default at every step; the default itself first, and only once."""
    variants = FEW_VARIANTS if quick else VARIANTS
    kept = [variant for variant in variants if replace(variant, modes=None) != Own() or variant.scene(scene) != scene]
    return [replace(variant, step=step) for variant in (Own(), *kept) for step in (STEPS[2:6] if quick else STEPS)]


def peer_cases(quick: bool) -> list[Peer]:
    """Return elements and steps with every way to solve a step that may be the fastest; bodies for all parts where it shows."""
    if quick:
        return [Peer(step, elements, *LUMPED_SCHEMES[0]) for elements in LUMPED_ELEMENTS[1::2] for step in STEPS[2:6]]
    lumped = product(LUMPED_ELEMENTS, LUMPED_SCHEMES, STEPS[2:], (True,))
    whole = product(ELEMENTS, SCHEMES, STEPS[1:], (False,))
    return [Peer(step, n, kept, tolerance, lumps) for n, (kept, tolerance), step, lumps in (*lumped, *whole)]
