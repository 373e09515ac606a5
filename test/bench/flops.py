"""Floating-point work of one step, counted, and how far the compiled step is from the machine's own rate.

    python test/bench/flops.py

The kernels run once as plain Python on numbers that count what is done with them. The machine's rate is that of a compiled
loop of independent multiplications and additions on one core, scalar and as wide as the machine allows.
"""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from types import SimpleNamespace

COUNTS: Counter[str] = Counter()


class Number(float):
    """A float that counts its operations."""


def _counting(name: str, kind: str):
    plain = getattr(float, name)

    def operation(*values):
        COUNTS[kind] += 1
        result = plain(*(float(value) for value in values))
        return Number(result) if isinstance(result, float) else result

    return operation


for _names, _kind in (("add radd sub rsub", "add"), ("mul rmul", "multiply"), ("truediv rtruediv", "divide")):
    for _name in _names.split():
        setattr(Number, f"__{_name}__", _counting(f"__{_name}__", _kind))


class Rows(list):
    """A list of rows with the shape that an array has."""

    @property
    def shape(self):
        return (len(self),)


def counting(value):
    """Arrays of floats as arrays of counting numbers, records as rows of them."""
    import numpy as np

    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.names:
        kinds = value.dtype
        return Rows(
            SimpleNamespace(**{name: Number(row[name]) if kinds[name].kind == "f" else int(row[name]) for name in kinds.names})
            for row in value
        )
    if value.dtype.kind != "f":
        return value
    new = np.empty(value.shape, object)
    for index, number in np.ndenumerate(value):
        new[index] = Number(number)
    return new


def counted() -> Counter[str]:
    """Operations of one step of the default boom at 1 ms, by kind."""
    import numpy as np

    from boom_twin import load_scene
    from boom_twin.analysis.equilibrium import settle
    from boom_twin.compiler.compile import compile_scene
    from boom_twin.kernels.integrators import GENERALISED_ALPHA, prepare
    from boom_twin.kernels.transfer.time_step import advance
    from boom_twin.scene.kinematics import posture_angles, strokes_of_posture

    scene = load_scene()
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    strokes = strokes_of_posture(scene, "arch")
    settle(plan, state, work, strokes, posture_angles(scene, "arch"))
    tables, state, work = (type(part)(*(counting(array) for array in part)) for part in (plan.tables, state, work))
    scheme = prepare(GENERALISED_ALPHA, 0.8, 1e-3, work.weights)
    COUNTS.clear()
    drive = counting(plan.closed_lengths + strokes + 1e-6)
    status, _, _ = advance(tables, state, work, scheme, drive, counting(np.full(4, 1e-3)), 1e-6, 1, 0.5, None, False)
    assert status == 0
    return Counter(COUNTS)


def machine_rate() -> tuple[float, float]:
    """Operations a second on one core: a chain-free scalar loop, and one that the compiler may make as wide as it likes."""
    import numba
    import numpy as np

    @numba.njit(error_model="numpy")
    def scalar(n):
        a, b, c, d, e, f, g, h = 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7
        x, y = 0.999999, 1e-7
        for _ in range(n):
            a, b, c, d = a * x + y, b * x + y, c * x + y, d * x + y
            e, f, g, h = e * x + y, f * x + y, g * x + y, h * x + y
            x = 1.9999 - x
        return a + b + c + d + e + f + g + h

    @numba.njit(error_model="numpy", fastmath=True)
    def wide(v, n):
        for _ in range(n):
            for i in range(v.shape[0]):
                v[i] = ((v[i] * 0.999 + 0.1) * 0.998 + 0.2) * 0.997 + 0.3

    v = np.ones(64)
    scalar(1), wide(v, 1)
    rates = []
    for call, work in ((lambda: scalar(1_000_000), 17e6), (lambda: wide(v, 100_000), 64 * 6 * 1e5)):
        best = min(_timed(call) for _ in range(7))
        rates.append(work / best)
    return rates[0], rates[1]


def _timed(call) -> float:
    begun = time.perf_counter()
    call()
    return time.perf_counter() - begun


def main() -> None:
    """Print the count, and the machine's rates beside the step's own."""
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":  # first as Python, in this process; then compiled, in a fresh one
        os.environ["NUMBA_DISABLE_JIT"] = "1"
        found = counted()
        del os.environ["NUMBA_DISABLE_JIT"]
        os.execv(sys.executable, [sys.executable, __file__, *(f"{kind}={count}" for kind, count in found.items())])


def measured(counts: Counter[str]) -> None:
    """Second half: the compiled step."""
    import numpy as np

    from boom_twin import load_scene
    from boom_twin.analysis.methods import integrate_with
    from boom_twin.scene.kinematics import posture_angles, strokes_of_posture

    scene = load_scene()
    strokes = strokes_of_posture(scene, "arch")

    def drive(times):
        return strokes + 0.05 * np.outer(times**3, np.ones(4)), 0.15 * np.outer(times**2, np.ones(4))

    runs = [integrate_with(scene, drive, 0.4, 1e-3, angles=posture_angles(scene, "arch")) for _ in range(31)]
    found = min(runs, key=lambda run: run.seconds)
    step, work = found.seconds / found.steps, sum(counts.values())
    scalar, wide = machine_rate()
    print("| what | figure |\n|---|---|")
    print(f"| operations in a step | {work} ({', '.join(f'{count} {kind}' for kind, count in counts.items())}) |")
    print(f"| a step, {found.passes:g} pass | {1e6 * step:.1f} us, {work / step / 1e9:.2f} G operations/s |")
    print(f"| one core, scalar | {scalar / 1e9:.1f} G operations/s: at this rate {1e6 * work / scalar:.1f} us |")
    print(f"| one core, vectors | {wide / 1e9:.1f} G operations/s: {1e6 * work / wide:.1f} us |")


if __name__ == "__main__":
    if sys.argv[1:]:
        measured(Counter({kind: int(count) for kind, count in (pair.split("=") for pair in sys.argv[1:])}))
    else:
        main()
