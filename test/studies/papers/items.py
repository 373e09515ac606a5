"""Every equation, figure, table and claim of both papers, in their order, with its counterpart in this project.

The text of the papers that this was made from breaks off in one ([Z] after its equation (5)) and lacks most formulas and all
numbers of tables in the other. Where an item is known only by what the text says of it, the row says so by the words "not
printed".
"""

from __future__ import annotations

Z, R = "Zhang 2016", "Ren 2014"
NO_RIG = "none can exist here: rig and data are not public"

ITEMS: tuple[tuple[str, str, str], ...] = (
    (Z, "figure 1: base, cylinders, links, booms of A + B1 + B2 + B3", "the default scene, drawn in docs/boom.png"),
    (
        Z,
        "A a slider-crank, B a six-bar; B1, B2, B3 by which link bears the cylinder",
        "`kernels/transfer/slider_crank.py`, `six_bar.py`: one program, B1 to B3 differ in the rod pin's place",
    ),
    (Z, "every boom is A + Bi + Bj + ..", "`compile_scene`: any number of sections; `study stability` has booms of up to 200"),
    (
        Z,
        "(1) state vector [x y theta M qx qy 1], signs",
        "`element_matrices.py`; the kernels carry (x, y, theta), (qx, qy, M) and increments",
    ),
    (
        Z,
        "(2) with three modal coordinates",
        "the coordinates stay inside the element and are eliminated there; three a part by default",
    ),
    (
        Z,
        "matrices of the elements, by reference only (not printed)",
        "`element_matrices.py`, derived in docs/method.md and here",
    ),
    (Z, "(3) branches of A", "section 1 below"),
    (Z, "(4) what holds at P1", "E1, E2, E3 in `substructures.py`"),
    (Z, "(5) A assembled; lines 2 and 3 print output vectors, which have to be inputs", "section 1: equal to the sweep"),
    (Z, "(6) and on, B1 to B3, overall matrix (not printed)", "section 1: eight unknowns a six-bar; the product of all"),
    (
        Z,
        "discrete time, numerical integration",
        "Newmark, Wilson, Houbolt, Park and generalised-alpha: docs/study/error.md, stability.md",
    ),
    (Z, "cantilever modes up to order three", 'section 3: kept as `basis="cantilever"`, and why it is not the default'),
    (Z, "stiffness and damping of cylinders", "`cylinder.k`, `cylinder.d`, in series with the drive"),
    (Z, "experiment on a test rig", NO_RIG),
    (
        Z,
        "accuracy and time beside ADAMS (figures not printed)",
        "ADAMS is not free; Exudyn stands in: docs/study/error.md has error against run time. No speed-up of the paper is "
        "quoted: none can be read",
    ),
    (
        Z,
        "high flexibility, low damping; stress, pressure, vibration",
        "docs/method.md; stresses in `replay --report`; damping of mode 1 in section 3",
    ),
    (R, "(1) contact force of Lankarani and Nikravesh", "`kernels/elements/pin_contact.py`, law `lankarani-nikravesh`"),
    (
        R,
        "(2) to (4) K by radii and materials, exponent 1.5, restitution 0.9",
        "`contact_stiffness`; an impact keeps 0.913 of its speed where 0.9 is asked for: docs/method.md",
    ),
    (R, "table 1, pins and bushes (numbers not printed)", "`boom_twin scene --clearance`: surrogates"),
    (R, "oil springs of 40, 30, 20, 6 kN/mm", "the default scene's `cylinder.k`"),
    (R, "figure 1, 12 elements, two substructures A and B", "B is the chain B1, B2, B3 of section 1"),
    (
        R,
        "Euler-Bernoulli sections; cylinder an elastic beam and a spring; joint clearance a spring and damper",
        "beams, oil spring; clearance as real contact, or `treatment: spring-damper` linearised at its preload. Barrel and rod "
        "are rigid",
    ),
    (R, "low speed: no Coriolis and centrifugal accelerations", "they are in; section 4 says what leaving them out costs"),
    (R, "(5) state vector", "as Zhang's (1)"),
    (R, "figure 2, (6) to (11) substructure A", "section 1"),
    (R, "figure 3, (12) to (15) substructure B", "section 1"),
    (
        R,
        "(16) to (20) overall matrix, boundary vectors with 21 zero elements, solved by dichotomy with a tolerance of 1e-7",
        "section 2: equal to Newton's method",
    ),
    (R, "(21) a posture needs nothing but new angles", "`statics(posture=..)`: any strokes, no new matrices by hand"),
    (R, "table 2, parameters of the booms (numbers not printed)", "surrogates of a boom of the same 13.46 m"),
    (R, "figure 4, table 3, four postures (angles not printed)", "postures `horizontal`, `arch`, `high`, `low`: surrogates"),
    (R, "figure 5, tip displacements beside Recurdyn", "section 5 beside Exudyn, with and without clearance in four pins"),
    (R, "vibration lasts several seconds after the stop", "section 3, damping of mode 1; docs/study/clearance.md"),
    (R, "the tip moves down at first, by gravity, and then up", "section 4: a boom that starts undeflected does so"),
    (
        R,
        "tip 0.2 to 0.4 m below Recurdyn's (text), 150 mm at most (conclusion)",
        "the paper contradicts itself; here the programs differ by what section 5 says",
    ),
    (R, "the horizontal posture is the worst", "section 3: sag by posture"),
    (R, "figure 6, rig of 13.46 m, instruments", NO_RIG),
    (
        R,
        "figure 7, measured accelerations; largest about 20 m/s²",
        NO_RIG + "; section 5 has the accelerations of our stop, which is another motion",
    ),
    (
        R,
        "the test's acceleration is larger, for only the joints bend in their model",
        "here sections bend: section 5; `study parts` has rigid sections beside",
    ),
    (R, "fast modelling and posture changes", "docs/study/error.md: time of a step"),
    (R, "real-time monitoring", "the live node: docs/measured.md"),
)
