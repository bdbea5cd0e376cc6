"""MuJoCo: a ball joint and a body; contacts off, no damping, an unstable run is not reset."""

import sys

import mujoco
from heavytop_engine import mujoco_model, serve

mujoco.set_mju_user_warning(lambda message: None)  # else it writes MUJOCO_LOG.TXT


class Engine:
    """MuJoCo with a body about a fixed point."""

    def __init__(self, body):
        self.model, self.data = mujoco_model(body, sys.argv[1])
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET

    def advance(self, step, count):
        self.model.opt.timestep = step
        mujoco.mj_step(self.model, self.data, count)

    def read(self):
        return self.data.qpos, self.data.qvel


serve(f"MuJoCo:{sys.argv[1]} {mujoco.__version__}", Engine)
