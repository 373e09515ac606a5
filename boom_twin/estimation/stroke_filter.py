"""Fixed-lag Kalman smoother of the cylinder strokes.

Each stroke is an integrated white jerk of density q (m^2/s^5), measured with variance r (m^2). A node is a stamp in the
window; for each stroke it holds the estimate x = (position, velocity, acceleration) given everything up to now, and the
covariance C of that estimate's error with the newest one's:

    predict:   x- = F x,  P- = F P F^T + q Q,  C_j <- C_j F^T           (newest node, then every older node j)
    measure:   nu = y - x-_0,  s = P-_00 + r,  x_j += C_j[:, 0] nu / s,  C_j <- C_j (I - k h^T)^T

Node 0 is the newest, with C_0 = P. (Rauch-Tung-Striebel smoothing in its fixed-lag form; Anderson and Moore, Optimal
Filtering, 1979, ch. 7.)

What noise it passes on is written again, in the frequency domain, in `boom_twin.analysis.modal.stroke_noise` and in
`boom_twin.calibration.sessions`: change them together.
"""

from __future__ import annotations

import math

from ..kernels.jit import inner

QUIET = 1e-12  # variance of velocity and acceleration at the start: the boom starts at rest


@inner
def start_node(x, c, y, variance):
    """First node: strokes at rest at y, shape (n,); x is (nodes, n, 3), c (nodes, n, 3, 3)."""
    for i in range(y.shape[0]):
        x[0, i, 0], x[0, i, 1], x[0, i, 2] = y[i], 0.0, 0.0
        for a in range(3):
            for b in range(3):
                c[0, i, a, b] = 0.0
        c[0, i, 0, 0], c[0, i, 1, 1], c[0, i, 2, 2] = variance, QUIET, QUIET


@inner
def add_node(x, c, count, h, density):
    """Shift `count` nodes back by one, and predict a new node 0 at h seconds later."""
    for j in range(count, 0, -1):
        for i in range(x.shape[1]):
            for a in range(3):
                x[j, i, a] = x[j - 1, i, a]
                for b in range(3):
                    c[j, i, a, b] = c[j - 1, i, a, b]
    f, g = h, 0.5 * h * h
    for i in range(x.shape[1]):
        x[0, i, 0] = x[1, i, 0] + f * x[1, i, 1] + g * x[1, i, 2]
        x[0, i, 1] = x[1, i, 1] + f * x[1, i, 2]
        x[0, i, 2] = x[1, i, 2]
        for j in range(1, count + 1):
            for a in range(3):
                c[j, i, a, 0] += f * c[j, i, a, 1] + g * c[j, i, a, 2]
                c[j, i, a, 1] += f * c[j, i, a, 2]
        new, old = c[0, i], c[1, i]
        for b in range(3):
            new[0, b] = old[0, b] + f * old[1, b] + g * old[2, b]
            new[1, b] = old[1, b] + f * old[2, b]
            new[2, b] = old[2, b]
        new[0, 0] += density * h**5 / 20.0
        new[0, 1] += density * h**4 / 8.0
        new[1, 0] += density * h**4 / 8.0
        new[0, 2] += density * h**3 / 6.0
        new[2, 0] += density * h**3 / 6.0
        new[1, 1] += density * h**3 / 3.0
        new[1, 2] += density * h**2 / 2.0
        new[2, 1] += density * h**2 / 2.0
        new[2, 2] += density * h


@inner
def measure(x, c, count, y, variance):
    """Correct all `count` nodes by strokes y, shape (n,); NaN = not measured."""
    for i in range(y.shape[0]):
        if not math.isfinite(y[i]):
            continue
        surprise, spread = y[i] - x[0, i, 0], c[0, i, 0, 0] + variance
        gain = (c[0, i, 0, 0] / spread, c[0, i, 1, 0] / spread, c[0, i, 2, 0] / spread)
        for j in range(count):
            for a in range(3):
                first = c[j, i, a, 0]
                x[j, i, a] += first / spread * surprise
                for b in range(3):
                    c[j, i, a, b] -= first * gain[b]


@inner
def drive_between(old, new, span, share):
    """Position and velocity on the quintic through two nodes of one stroke, (3,) each, `span` s apart; share in [0, 1]."""
    v, a = old[1] * span, 0.5 * old[2] * span * span
    gap = new[0] - old[0] - v - a
    speed = new[1] * span - v - 2.0 * a
    bend = new[2] * span * span - 2.0 * a
    c3 = 10.0 * gap - 4.0 * speed + 0.5 * bend
    c4 = -15.0 * gap + 7.0 * speed - bend
    c5 = 6.0 * gap - 3.0 * speed + 0.5 * bend
    u = share
    position = old[0] + u * (v + u * (a + u * (c3 + u * (c4 + u * c5))))
    velocity = (v + u * (2.0 * a + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / span
    return position, velocity
