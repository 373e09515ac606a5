"""Interacting models (H. Blom and Y. Bar-Shalom, IEEE Trans. Automat. Control 33 (1988), 780-783): mixing and weighing."""

from __future__ import annotations

import math

from ..kernels.jit import inner
from .rows import clear
from .states import ALL_VALVES, BURST, OPEN, PREDICTION, VALVES

OPENS, CLOSES = 0.3, 1.0  # 1/s, rates at which valves open, and are closed again
COMES, STAYS = 0.2, 1.0  # 1/s, rates at which a load comes, and is usual again


@inner
def copy_model(f, source, target, size):
    """Copy state and covariance of a model."""
    for i in range(size):
        f.x[target, i] = f.x[source, i]
        for k in range(size):
            f.p[target, i, k] = f.p[source, i, k]


@inner
def models_of(mixture):
    """Return the first model of a mixture, and how many it has."""
    return (VALVES, ALL_VALVES - VALVES) if mixture == PREDICTION else (ALL_VALVES, 4)


@inner
def interact(f, mixture, size, h):
    """Mix the models of a mixture before a step of `h` (s): valves and load change independently of each other.

    Without a model of open valves under a new load, one in which all are open stands for it.
    """
    first, count = models_of(mixture)
    switch = f.switch
    for source in range(count):
        clear(switch[source], count)
        turns = 1.0 - math.exp(-(CLOSES if source % 2 == OPEN else OPENS) * h)
        changes = 1.0 - math.exp(-(STAYS if source >= BURST else COMES) * h)
        for target in range(4):
            valves = 1.0 - turns if source % 2 == target % 2 else turns
            load = 1.0 - changes if source // 2 == target // 2 else changes
            switch[source, target if target < count else OPEN] += valves * load
    for target in range(count):
        new = 0.0
        for source in range(count):
            new += f.chances[first + source] * switch[source, target]
        f.likely[target] = new
        for source in range(count):
            f.shares[source] = f.chances[first + source] * switch[source, target] / new
        blend(f, first, count, f.mixed_x[target], f.mixed_p[target], size)
    for target in range(count):
        f.chances[first + target] = f.likely[target]
        for i in range(size):
            f.x[first + target, i] = f.mixed_x[target, i]
            for k in range(size):
                f.p[first + target, i, k] = f.mixed_p[target, i, k]


@inner
def blend(f, first, count, mean, spread, size):
    """Write mean and covariance of `count` models with the probabilities `f.shares`, two models at a time."""
    clear(mean, size)
    for k in range(count):
        for i in range(size):
            mean[i] += f.shares[k] * f.x[first + k, i]
    for i in range(size):
        line = spread[i]
        for k in range(0, count, 2):
            other = min(k + 1, count - 1)
            one, two = f.shares[k], f.shares[other] if other > k else 0.0
            if k > 0 and one + two < 1e-12:
                continue
            x, y, by_x, by_y = f.x[first + k], f.x[first + other], f.p[first + k, i], f.p[first + other, i]
            to_x, to_y = one * (x[i] - mean[i]), two * (y[i] - mean[i])
            if k == 0:
                for j in range(size):
                    line[j] = one * by_x[j] + two * by_y[j] + to_x * (x[j] - mean[j]) + to_y * (y[j] - mean[j])
            else:
                for j in range(size):
                    line[j] += one * by_x[j] + two * by_y[j] + to_x * (x[j] - mean[j]) + to_y * (y[j] - mean[j])


@inner
def mix(f, mixture, size):
    """Write mean and covariance of a mixture."""
    first, count = models_of(mixture)
    for k in range(count):
        f.shares[k] = f.chances[first + k]
    blend(f, first, count, f.mean[mixture], f.spread[mixture], size)


@inner
def weigh_models(f, mixture):
    """Update the probabilities of a mixture's models by their likelihoods; return the log likelihood of the mixture."""
    first, count = models_of(mixture)
    most, total = f.likely[first], 0.0
    for k in range(1, count):
        most = max(most, f.likely[first + k])
    for k in range(count):
        f.chances[first + k] = max(f.chances[first + k] * math.exp(f.likely[first + k] - most), 1e-9)
        total += f.chances[first + k]
    for k in range(count):
        f.chances[first + k] /= total
    return most + math.log(total)
