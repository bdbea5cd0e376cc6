"""Pinocchio: accelerations of a body on a spherical joint; the integrators are those that its users write."""

import sys

import numpy as np
import pinocchio as pin
from heavytop_engine import serve

WEIGHTS = np.array([1, 2, 2, 1]) / 6


class Engine:
    """Pinocchio with a body about a fixed point."""

    def __init__(self, body):
        self.model = pin.Model()
        self.model.gravity.linear = np.array([0, 0, -body.gravity])
        joint = self.model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
        self.model.appendBodyToJoint(joint, pin.Inertia(body.mass, body.centre, body.inertia), pin.SE3.Identity())
        self.data, self.torque = self.model.createData(), np.zeros(3)
        self.q, self.v = np.roll(body.quaternion, -1), body.omega.copy()  # x, y, z, w

    def acceleration(self, q, v):
        """v' by the articulated-body algorithm, without a torque."""
        return pin.aba(self.model, self.data, q, v, self.torque).copy()

    def semi_implicit(self, h, q, v):
        """A step of the semi-implicit Euler method."""
        v = v + h * self.acceleration(q, v)
        return pin.integrate(self.model, q, h * v), v

    def rk4(self, h, q, v, pulled_back=0):
        """Without `pulled_back` velocities are averaged as if they were of one tangent space: of order 2."""
        theta, speed, rates, slopes = np.zeros(3), v, [], []
        for part in (h / 2, h / 2, h, 0):
            bracket = pin.skew(theta)
            cross = bracket @ speed
            rates.append(speed + pulled_back * (cross / 2 + bracket @ cross / 12))
            slopes.append(self.acceleration(pin.integrate(self.model, q, theta), speed))
            theta, speed = part * rates[-1], v + part * slopes[-1]
        return pin.integrate(self.model, q, h * (WEIGHTS @ rates)), v + h * (WEIGHTS @ slopes)

    def rkmk4(self, h, q, v):
        """Munthe-Kaas: each velocity is pulled back by the inverse of dexp."""
        return self.rk4(h, q, v, 1)

    def advance(self, step, count):
        for _ in range(count):
            self.q, self.v = getattr(self, sys.argv[1])(step, self.q, self.v)

    def read(self):
        return np.roll(self.q, 1), self.v


serve(f"Pinocchio:{sys.argv[1]} {pin.__version__}", Engine)
