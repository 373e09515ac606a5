"""The slider-crank with play in Exudyn: rigid bodies and joints of its own, the contact as a user's spring, fixed steps."""

from __future__ import annotations

import contextlib
import io
from dataclasses import dataclass

import exudyn
import numpy as np
from exudyn import itemInterface as items


@dataclass
class Bush:
    """The contact as Exudyn asks for it; the approach speed is frozen at the first step that starts in contact."""

    contact: object
    entry: float | None = None

    def spring(self, system, time, item, displacement, velocity, stiffness, damping, offset):
        """Force (N) on the pin's marker, against; called by Exudyn."""
        force = -self.contact.force(_complex(displacement), _complex(velocity), self.entry)
        return [force.real, force.imag, 0.0]

    def before_step(self, offset, rate):
        """Touch and release."""
        touching = self.contact.gap(offset) >= 0.0
        if not touching:
            self.entry = None
        elif self.entry is None:
            self.entry = abs((rate * offset.conjugate()).real) / abs(offset)


def simulate(mechanism, angle, step, rho=0.8):
    """Times (s), offset of the pin in the bush (m, complex) and place of the slider (m) up to a crank angle (rad).

    Parameters
    ----------
    mechanism : SliderCrank
        Its start is the one of `SliderCrank.run`.
    step : float
        s.
    rho : float
        Spectral radius of generalised-alpha at infinite frequency.
    """
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    bush, sides = Bush(mechanism.contact), _assemble(system, mechanism)
    spring = items.ObjectConnectorCartesianSpringDamper(markerNumbers=[*sides], springForceUserFunction=bush.spring)
    system.AddObject(spring)
    rows = []

    def before(system, time):
        # Exudyn's time is the end of the step, the places are those of its start
        placed, moving = (
            [_complex(system.GetMarkerOutput(side, kind)) for side in sides]
            for kind in (exudyn.OutputVariableType.Position, exudyn.OutputVariableType.Velocity)
        )
        rows.append([time - step, placed[1] - placed[0], placed[1].real])
        bush.before_step(placed[1] - placed[0], moving[1] - moving[0])
        return True

    system.SetPreStepUserFunction(before)
    system.Assemble()
    with contextlib.redirect_stdout(io.StringIO()):
        system.SolveDynamic(_settings(angle / mechanism.speed, step, rho))
    times, offsets, places = zip(*rows, strict=True)
    return np.array(times), np.array(offsets), np.array(places)


def _assemble(system, mechanism):
    """Crank on a prescribed angle, rod, slider on its line; gives the markers of bush and pin."""
    psi, x, turn, speed = mechanism.closed(0.0)
    crank, rod, omega = mechanism.crank, mechanism.rod, mechanism.speed
    ground = system.AddObject(items.ObjectGround())
    fixed = system.AddNode(items.NodePointGround())
    still = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))

    def body(mass, inertia, place, rates):
        node = items.NodeRigidBody2D(referenceCoordinates=place, initialVelocities=rates)
        number = system.AddNode(node)
        return number, system.AddObject(items.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=number))

    def marker(body, x):
        return system.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=[x, 0.0, 0.0]))

    def coordinate(node, index, **law):
        moved = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=index))
        system.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[still, moved], **law))

    wheel, wheel_body = body(1.0, 1e-3, [0.0, 0.0, 0.0], [0.0, 0.0, omega])
    middle = [crank + 0.5 * rod * np.cos(psi), 0.5 * rod * np.sin(psi), psi]
    swing = [-0.5 * rod * np.sin(psi) * turn, crank * omega + 0.5 * rod * np.cos(psi) * turn, turn]
    _, rod_body = body(mechanism.rod_mass, mechanism.rod_inertia, middle, swing)
    slide = system.AddNode(items.NodePoint2D(referenceCoordinates=[x, 0.0], initialVelocities=[speed, 0.0]))
    slider = system.AddObject(items.ObjectMassPoint2D(mass=mechanism.slider_mass, nodeNumber=slide))
    for one, other in (
        (marker(ground, 0.0), marker(wheel_body, 0.0)),
        (marker(wheel_body, crank), marker(rod_body, -0.5 * rod)),
    ):
        system.AddObject(items.ObjectJointRevolute2D(markerNumbers=[one, other]))
    coordinate(wheel, 2, offsetUserFunction=lambda system, time, item, offset: omega * time)
    coordinate(slide, 1)
    return marker(rod_body, 0.5 * rod), system.AddMarker(items.MarkerBodyPosition(bodyNumber=slider))


def _settings(duration, step, rho):
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(duration / step)
    settings.timeIntegration.endTime = step * round(duration / step)
    settings.timeIntegration.generalizedAlpha.spectralRadius = rho
    settings.timeIntegration.newton.relativeTolerance = 1e-6
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    return settings


def _complex(vector):
    return complex(vector[0], vector[1])
