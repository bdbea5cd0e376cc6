"""PyBullet: a link on a spherical joint of a fixed base, whose frame is that of its principal axes; no damping."""

from importlib.metadata import version

import numpy as np
import pybullet as bullet
from heavytop_engine import matrix, quaternion, serve

JOINT = {"linkParentIndices": [0], "linkJointTypes": [bullet.JOINT_SPHERICAL], "linkJointAxis": [[1, 0, 0]]}
SHAPES = {"linkCollisionShapeIndices": [-1], "linkVisualShapeIndices": [-1]}
PLACE = {"linkPositions": [[0, 0, 0]], "linkOrientations": [[0, 0, 0, 1]]}


class Engine:
    """PyBullet with a body about a fixed point."""

    def __init__(self, body):
        bullet.resetSimulation()
        bullet.setGravity(0, 0, -body.gravity)
        moments, self.axes = body.principal
        centre = {
            "linkInertialFramePositions": [self.axes.T @ body.centre],
            "linkInertialFrameOrientations": [[0, 0, 0, 1]],
        }
        self.top = bullet.createMultiBody(0, linkMasses=[body.mass], **JOINT, **SHAPES, **PLACE, **centre)
        bullet.changeDynamics(self.top, 0, localInertiaDiagonal=moments)  # in one call with damping it is dropped
        bullet.changeDynamics(self.top, 0, jointDamping=0, maxJointVelocity=1e6)
        for link in (-1, 0):
            bullet.changeDynamics(self.top, link, linearDamping=0, angularDamping=0)
        off = {"positionGain": 0, "velocityGain": 0, "force": [0, 0, 0]}
        bullet.setJointMotorControlMultiDof(self.top, 0, bullet.POSITION_CONTROL, [0, 0, 0, 1], **off)
        start = np.roll(quaternion(body.rotation @ self.axes), -1)
        bullet.resetJointStateMultiDof(self.top, 0, start, self.axes.T @ body.omega)

    def advance(self, step, count):
        bullet.setTimeStep(step)
        for _ in range(count):
            bullet.stepSimulation()

    def read(self):
        state = bullet.getLinkState(self.top, 0, computeLinkVelocity=1, computeForwardKinematics=1)
        rotation = matrix(np.roll(state[5], 1)) @ self.axes.T
        return quaternion(rotation), rotation.T @ state[7]

    def pivot(self):
        return bullet.getLinkState(self.top, 0, computeForwardKinematics=1)[4]


bullet.connect(bullet.DIRECT)
serve(f"PyBullet {version('pybullet')}", Engine)
