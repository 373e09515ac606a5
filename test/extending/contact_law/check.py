"""The law is taken by scenes, gives force and restitution as in closed form."""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from boom_twin import BoomTwinError, load_scene
from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels.elements.pin_contact import APPROACH, CLOSED, COLUMNS, Journal, pin_force
from boom_twin.scene.load import default_text
from boom_twin.scene.schema import Clearance, ContactLaw, Pin

E, SPEED, MASS = 0.8, 0.1, 20.0  # restitution; m/s; kg
CHI = 3.0 * (1.0 - E**2) / 4.0 * math.exp(2.0 * (1.0 - E))


def work(u):
    """G(u) of an impact, see `boom_twin.kernels.elements.pin_contact.restitution_of`."""
    return u / CHI - math.log1p(CHI * u) / CHI**2


given = brentq(lambda e: work(-e) - work(1.0), 1e-9, 1.0)  # what this chi really gives, in closed form
law = ContactLaw(law="zhiying-qishao", restitution=E)
worn = Clearance(contact=law, pins=(Pin(at="cylinder_1.rod", pin_radius=0.03, radial_clearance=1e-4),))
row = compile_scene(load_scene().model_copy(update={"clearance": worn})).tables.clearances[0]
assert math.isclose(row.loss, CHI)
assert abs(law.given_restitution - given) < 1e-6

memory = np.zeros(COLUMNS)
memory[CLOSED], memory[APPROACH] = 1.0, SPEED


def force(x, v):
    """Of the pin, N, outward along x (m) at v (m/s)."""
    return pin_force(row, memory, Journal(x, 0.0, v, 0.0, v, 0.0, 0.0, 1.0, 0.0), 0.0).x


depth = 5e-5
assert math.isclose(force(1e-4 + depth, 0.04), row.stiffness * depth**1.5 * (1.0 + CHI * 0.4), rel_tol=1e-3)


def free(t, z):
    return z[0] - 0.5e-4


free.terminal, free.direction = True, -1.0
start = [0.5e-4 + 1e-9, SPEED]
hit = solve_ivp(lambda t, z: [z[1], -force(*z) / MASS], (0.0, 1.0), start, events=free, rtol=1e-8, atol=1e-12, max_step=1e-4)
assert abs(-hit.y[1, -1] / SPEED - given) < 3e-3

block = "\nclearance: {contact: {law: zhiying}, pins: [{at: cylinder_1.rod, pin_radius: 0.03, radial_clearance: 1.0e-4}]}\n"
with open("scene.yaml", "w") as file:
    file.write(default_text() + block)
try:
    load_scene("scene.yaml")
except BoomTwinError as error:
    assert "'hunt-crossley-exact' or 'zhiying-qishao'" in str(error) and ContactLaw.model_fields["law"].description in str(
        error
    )
else:
    raise AssertionError("zhiying is no law")
