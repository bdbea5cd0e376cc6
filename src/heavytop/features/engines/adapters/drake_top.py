"""Drake: the body on a BallRpyJoint, whose angles are singular at a pitch of 90 degrees."""

import sys
from importlib.metadata import version

from heavytop_engine import serve
from pydrake.all import (
    BallRpyJoint,
    MultibodyPlant,
    Quaternion,
    ResetIntegratorFromFlags,
    RollPitchYaw,
    RotationMatrix,
    Simulator,
    SpatialInertia,
    UnitInertia,
)

SCHEME = sys.argv[1]  # discrete, or an integration scheme


class Engine:
    """Drake with a body on a ball joint, in fixed steps."""

    def __init__(self, body):
        self.given, self.simulator = body, None

    def build(self, step):
        """Make plant and simulator: the step of a discrete plant is fixed when it is made."""
        config, plant = self.given, MultibodyPlant(step if SCHEME == "discrete" else 0.0)
        a, b, c, d, e, f = config.about_pivot[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]] / config.mass
        self.body = plant.AddRigidBody("top", SpatialInertia(config.mass, config.centre, UnitInertia(a, b, c, d, e, f)))
        joint = plant.AddJoint(BallRpyJoint("ball", plant.world_frame(), self.body.body_frame()))
        plant.mutable_gravity_field().set_gravity_vector([0, 0, -config.gravity])
        plant.Finalize()
        self.plant, self.simulator = plant, Simulator(plant)
        self.context = self.simulator.get_mutable_context()
        joint.set_angles(self.context, RollPitchYaw(RotationMatrix(Quaternion(config.quaternion))).vector())
        joint.set_angular_velocity(self.context, config.omega_space)
        if SCHEME != "discrete":
            ResetIntegratorFromFlags(self.simulator, SCHEME, step)

    def advance(self, step, count):
        if self.simulator is None:
            self.build(step)
            self.simulator.get_mutable_integrator().set_fixed_step_mode(SCHEME != "discrete")
        self.simulator.AdvanceTo(self.context.get_time() + count * step)

    def read(self):
        rotation = self.plant.EvalBodyPoseInWorld(self.context, self.body).rotation().matrix()
        omega = self.plant.EvalBodySpatialVelocityInWorld(self.context, self.body).rotational()
        return rotation, rotation.T @ omega


class Adaptive(Engine):
    """The same body, by a tolerance."""

    advance = None

    def reach(self, time, tolerance):
        if self.simulator is None:
            self.build(0.1)
            self.simulator.get_mutable_integrator().set_target_accuracy(tolerance)
        self.simulator.AdvanceTo(time)
        self.steps = self.simulator.get_integrator().get_num_steps_taken()


serve(f"Drake:{SCHEME} {version('drake')}", Adaptive if sys.argv[2:] else Engine)
