"""A ball or weld constraint between a body and the world in a discrete MultibodyPlant: the process ends with SIGSEGV.

Drake 1.51.1, with its default contact solver: "world" and "weld" end the process at the first step; "bodies", the ball
constraint between two bodies, does not.
    pip install drake; python drake_ball_constraint.py world
"""

import sys

from pydrake.all import MultibodyPlant, RigidTransform, Simulator, SpatialInertia, UnitInertia

which = (*sys.argv[1:], "world")[0]
plant = MultibodyPlant(1e-3)
inertia = SpatialInertia(1.0, [0, 0, 0], UnitInertia(1.0, 1.0, 1.0))
first, second = plant.AddRigidBody("first", inertia), plant.AddRigidBody("second", inertia)
if which == "world":
    plant.AddBallConstraint(plant.world_body(), [0, 0, 0], first, [0, 0, 0])
elif which == "bodies":
    plant.AddBallConstraint(first, [0, 0, 0], second, [0, 0, 0])
else:
    plant.AddWeldConstraint(plant.world_body(), RigidTransform(), first, RigidTransform())
plant.Finalize()
Simulator(plant).AdvanceTo(0.01)
print(which, "ends well", flush=True)
