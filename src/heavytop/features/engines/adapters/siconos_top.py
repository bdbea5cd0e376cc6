"""Siconos: Newton-Euler equations about the centre of mass, held by a knee joint; Moreau-Jean with theta = 1/2.

Debian's package 4.4.0 calls itself 4.5.0.
"""

import numpy as np
import siconos
import siconos.kernel as kernel
import siconos.mechanics.joints as joints
from heavytop_engine import matrix, serve

LONG = 1e6


class Engine:
    """Siconos with a body about a fixed point."""

    def __init__(self, body):
        self.centre, self.simulation = body.centre, None
        centre = body.rotation @ body.centre
        speed = body.rotation @ np.cross(body.omega, body.centre)
        start, twist = np.r_[centre, body.quaternion], np.r_[speed, body.omega]
        self.body = kernel.NewtonEulerDS(start, twist, body.mass, body.inertia)
        self.weight = np.array([0, 0, -body.mass * body.gravity])
        self.body.setFExtPtr(self.weight)
        self.model = kernel.NonSmoothDynamicalSystem(0, LONG)
        self.model.insertDynamicalSystem(self.body)
        # KneeJointR asserts that its place fits to eps, which it does exactly without a rotation
        upright = kernel.NewtonEulerDS(np.r_[self.centre, 1, 0, 0, 0], np.zeros(6), body.mass, body.inertia)
        self.joint = joints.KneeJointR([0, 0, 0], True, upright)
        held = kernel.EqualityConditionNSL(self.joint.numberOfConstraints())
        self.model.link(kernel.Interaction(held, self.joint), self.body)

    def advance(self, step, count):
        if self.simulation is None:
            grid, method = kernel.TimeDiscretisation(0, step), kernel.MoreauJeanOSI(0.5)
            self.simulation = kernel.TimeStepping(self.model, grid, method, kernel.MLCP())
            self.simulation.setNewtonTolerance(1e-12)
            self.simulation.setNewtonMaxIteration(50)
        for _ in range(count):
            self.simulation.computeOneStep()
            self.simulation.nextStep()

    def read(self):
        return self.body.q()[3:], self.body.twist()[3:]

    def pivot(self):
        return self.body.q()[:3] - matrix(self.body.q()[3:]) @ self.centre


serve(f"Siconos:Moreau-Jean {siconos.version}", Engine)
