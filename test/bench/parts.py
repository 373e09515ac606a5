"""How much cheaper a boom is with less in it: rigid against flexible, and bare of masses.

Run ``python test/bench/parts.py`` on an idle machine; least of 30 interleaved runs of the move of `boom_twin study`.
"""

from __future__ import annotations

from boom_twin import load_scene
from boom_twin.reduction.deviation import course_of, size, step_times, unknowns
from boom_twin.reduction.variants import KINDS, without

ROUNDS = 30
BARE = ("link masses", "barrel masses", "rod masses")
MASSES = (*BARE, "rotary inertia")


def main() -> None:
    """Measure and print a Markdown table."""
    full = load_scene()
    everywhere = range(len(full.sections))

    def less(*names: str):
        scene = full
        for kind in KINDS:
            variant = without(scene, kind, everywhere) if kind.name in names else None
            scene = scene if variant is None else variant.of(scene)
        return scene

    booms = {
        "flexible, as the default scene": full,
        "flexible, modes: 1": full.model_copy(update={"modes": 1}),
        "flexible, modes: 2": full.model_copy(update={"modes": 2}),
        "flexible, modes: 4": full.model_copy(update={"modes": 4}),
        "flexible, without axial coordinate": less("axial coordinate"),
        "flexible, without geometric stiffness": less("geometric stiffness"),
        "flexible, links and cylinders massless, no rotary inertia": less(*MASSES),
        "rigid": less("bending"),
        "rigid, links and cylinders massless": less("bending", *BARE),
        "rigid, links massless, cylinders massless and incompressible": less("bending", "cylinder compliance", *BARE),
    }
    times = step_times(list(booms.values()), course_of(full), ROUNDS)
    print("| boom | unknowns | step of 1 ms, us | times cheaper | counted share of the cost |\n|---|---|---|---|---|")
    for (name, scene), seconds in zip(booms.items(), times, strict=True):
        counted = size(scene) / size(full)
        print(f"| {name} | {unknowns(scene)} | {1e6 * seconds:.2f} | {times[0] / seconds:.2f} | {counted:.2f} |")


if __name__ == "__main__":
    main()
