"""Interacting models (H. Blom and Y. Bar-Shalom, IEEE Trans. Automat. Control 33 (1988), 780-783): mixing and weighing."""

from __future__ import annotations

import math

from ..kernels.jit import inner
from .states import ALL_VALVES, BURST, OPEN, PREDICTION, VALVES

MODELS = BURST + 1  # of a mixture
LEAST_CHANCE = 1e-9
OPENS, CLOSES = 0.3, 1.0  # 1/s, rates at which valves open, and are closed again
COMES, STAYS = 0.2, 1.0  # 1/s, rates at which a load comes while all valves are closed, and is usual again


@inner
def copy_model(f, source, target, size):
    """Copy state and covariance of a model."""
    for i in range(size):
        f.x[target, i] = f.x[source, i]
        for k in range(size):
            f.p[target, i, k] = f.p[source, i, k]


@inner
def first_model(mixture):
    """Return the first of the `MODELS` of a mixture."""
    return VALVES if mixture == PREDICTION else ALL_VALVES


@inner
def interact(f, mixture, size, h):
    """Mix the models of a mixture before a step of `h` (s), by the rates at which valves and load change.

    No sudden load is expected while a valve is open: another that opens explains the same lengths, and is far likelier.
    """
    first, switch, closed = first_model(mixture), f.switch, 1
    for i in range(f.is_open.shape[1]):
        closed *= 1 - f.is_open[mixture, i]
    opens, closes = 1.0 - math.exp(-OPENS * h), 1.0 - math.exp(-CLOSES * h)
    comes, stays = 1.0 - math.exp(-COMES * closed * h), 1.0 - math.exp(-STAYS * h)
    switch[VALVES, VALVES], switch[VALVES, OPEN], switch[VALVES, BURST] = 1.0 - opens - comes, opens, comes
    switch[OPEN, VALVES], switch[OPEN, OPEN], switch[OPEN, BURST] = closes, 1.0 - closes, 0.0
    switch[BURST, VALVES], switch[BURST, OPEN], switch[BURST, BURST] = stays, opens, 1.0 - stays - opens
    for target in range(MODELS):
        new = 0.0
        for source in range(MODELS):
            new += f.chances[first + source] * switch[source, target]
        f.likely[target] = new
        for source in range(MODELS):
            f.shares[source] = f.chances[first + source] * switch[source, target] / new
        blend(f, first, f.mixed_x[target], f.mixed_p[target], size)
    for target in range(MODELS):
        f.chances[first + target] = f.likely[target]
        for i in range(size):
            f.x[first + target, i] = f.mixed_x[target, i]
            for k in range(size):
                f.p[first + target, i, k] = f.mixed_p[target, i, k]


@inner
def blend(f, first, mean, spread, size):
    """Write mean and covariance of a mixture from its models with the probabilities `f.shares`."""
    one, two, three = f.shares[0], f.shares[1], f.shares[2]
    x, y, z = f.x[first], f.x[first + 1], f.x[first + 2]
    for i in range(size):
        mean[i] = one * x[i] + two * y[i] + three * z[i]
    for i in range(size):
        to_x, to_y, to_z = one * (x[i] - mean[i]), two * (y[i] - mean[i]), three * (z[i] - mean[i])
        line, by_x, by_y, by_z = spread[i], f.p[first, i], f.p[first + 1, i], f.p[first + 2, i]
        for k in range(size):
            line[k] = one * by_x[k] + two * by_y[k] + to_x * (x[k] - mean[k]) + to_y * (y[k] - mean[k])
        for k in range(size):
            line[k] += three * by_z[k] + to_z * (z[k] - mean[k])


@inner
def mix(f, mixture, size):
    """Write mean and covariance of a mixture."""
    first = first_model(mixture)
    for k in range(MODELS):
        f.shares[k] = f.chances[first + k]
    blend(f, first, f.mean[mixture], f.spread[mixture], size)


@inner
def weigh_models(f, mixture):
    """Update the probabilities of a mixture's models by their likelihoods; return the log likelihood of the mixture."""
    first = first_model(mixture)
    most, total = f.likely[first], 0.0
    for k in range(1, MODELS):
        most = max(most, f.likely[first + k])
    for k in range(MODELS):
        f.chances[first + k] = max(f.chances[first + k] * math.exp(f.likely[first + k] - most), LEAST_CHANCE)
        total += f.chances[first + k]
    for k in range(MODELS):
        f.chances[first + k] /= total
    return most + math.log(total)
