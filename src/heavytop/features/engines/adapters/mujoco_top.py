"""MuJoCo: a ball joint and a body; contacts off, no damping, an unstable run is not reset."""

import sys

import mujoco
from heavytop_engine import serve

MODEL = """
<mujoco>
  <option gravity="0 0 {down}" integrator="{method}"><flag contact="disable"/></option>
  <worldbody><body>
    <joint type="ball"/><inertial pos="{centre}" mass="{mass}" fullinertia="{inertia}"/>
  </body></worldbody>
</mujoco>"""
mujoco.set_mju_user_warning(lambda message: None)  # else it writes MUJOCO_LOG.TXT


def text(values):
    """Numbers of an attribute of MJCF, each exactly."""
    return " ".join(repr(float(value)) for value in values)


class Engine:
    """MuJoCo with a body about a fixed point."""

    def __init__(self, body):
        six = body.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        numbers = {"centre": text(body.centre), "mass": body.mass, "inertia": text(six), "down": -body.gravity}
        self.model = mujoco.MjModel.from_xml_string(MODEL.format(method=sys.argv[1], **numbers))
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:], self.data.qvel[:] = body.quaternion, body.omega

    def advance(self, step, count):
        self.model.opt.timestep = step
        mujoco.mj_step(self.model, self.data, count)

    def read(self):
        return self.data.qpos, self.data.qvel


serve(f"MuJoCo:{sys.argv[1]} {mujoco.__version__}", Engine)
