"""changeDynamics(localInertiaDiagonal=...) of a link alone, and in one call with damping: the second drops the inertia.

PyBullet 3.2.7: the joint's quaternion after 0.5 s is the same for "with damping" and "never set"; one call with
maxJointVelocity drops it too, one with jointDamping does not.
    pip install pybullet numpy; python pybullet_inertia.py
"""

import pybullet as bullet

INERTIA = [1.2, 0.9, 0.6]
LINK = {"linkCollisionShapeIndices": [-1], "linkVisualShapeIndices": [-1], "linkParentIndices": [0]}
PLACE = {"linkPositions": [[0, 0, 0]], "linkOrientations": [[0, 0, 0, 1]]}
CENTRE = {"linkInertialFramePositions": [[0.3, -0.2, 0.4]], "linkInertialFrameOrientations": [[0, 0, 0, 1]]}
JOINT = {"linkJointTypes": [bullet.JOINT_SPHERICAL], "linkJointAxis": [[1, 0, 0]]}


def joint_after(calls):
    bullet.resetSimulation()
    bullet.setGravity(0, 0, -9.81)
    bullet.setTimeStep(1e-3)
    top = bullet.createMultiBody(0, linkMasses=[2.0], **LINK, **PLACE, **CENTRE, **JOINT)
    for options in calls:
        bullet.changeDynamics(top, 0, **options)
    off = {"positionGain": 0, "velocityGain": 0, "force": [0, 0, 0]}
    bullet.setJointMotorControlMultiDof(top, 0, bullet.POSITION_CONTROL, [0, 0, 0, 1], **off)
    bullet.resetJointStateMultiDof(top, 0, [0, 0.6, 0, 0.8], [1, 2, 6])
    for _ in range(500):
        bullet.stepSimulation()
    return [round(value, 5) for value in bullet.getJointStateMultiDof(top, 0)[0]]


bullet.connect(bullet.DIRECT)
damping = {"linearDamping": 0, "angularDamping": 0}
print("never set     ", joint_after([damping]))
print("with damping  ", joint_after([{"localInertiaDiagonal": INERTIA, **damping}]))
print("before damping", joint_after([{"localInertiaDiagonal": INERTIA}, damping]))
