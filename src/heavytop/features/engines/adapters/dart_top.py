"""DART: a skeleton of one body on a ball joint; World.step is semi-implicit Euler."""

import dartpy as dart
import numpy as np
from heavytop_engine import serve


class Engine:
    """DART with a body about a fixed point."""

    def __init__(self, body):
        self.world, skeleton = dart.simulation.World(), dart.dynamics.Skeleton("top")
        self.world.setGravity([0, 0, -body.gravity])
        self.joint, self.node = skeleton.createBallJointAndBodyNodePair()
        inertia = dart.dynamics.Inertia()
        inertia.setMass(body.mass)
        inertia.setLocalCOM(body.centre)
        inertia.setMoment(body.inertia)
        self.node.setInertia(inertia)
        self.world.addSkeleton(skeleton)
        self.joint.setPositions(dart.dynamics.BallJoint.convertToPositions(body.rotation))
        self.joint.setVelocities(body.omega)

    def advance(self, step, count):
        self.world.setTimeStep(step)
        for _ in range(count):
            self.world.step()

    def read(self):
        return self.node.getWorldTransform().rotation(), self.joint.getVelocities()

    def pivot(self):
        return np.array(self.node.getWorldTransform().translation())


serve(f"DART {dart.__version__}", Engine)
