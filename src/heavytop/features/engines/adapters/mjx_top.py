"""MJX, MuJoCo on JAX: RK4-64 computes in double, RK4-32 in single precision, which is its default."""

import os
import sys
from importlib.metadata import version

METHOD, BITS = sys.argv[1].split("-")
os.environ["JAX_ENABLE_X64"] = str(BITS == "64")

import jax  # noqa: E402
from heavytop_engine import mujoco_model, serve  # noqa: E402
from mujoco import mjx  # noqa: E402


@jax.jit
def steps(model, data, count):
    """The data after so many steps."""
    return jax.lax.fori_loop(0, count, lambda _, data: mjx.step(model, data), data)


class Engine:
    """MJX with a body about a fixed point."""

    def __init__(self, body):
        model, data = mujoco_model(body, METHOD)
        self.model, self.data = mjx.put_model(model), mjx.put_data(model, data)

    def advance(self, step, count):
        model = self.model.replace(opt=self.model.opt.replace(timestep=jax.numpy.asarray(step)))
        self.data = steps(model, self.data, count)

    def read(self):
        return self.data.qpos, self.data.qvel


serve(f"MJX:{sys.argv[1]} {version('mujoco-mjx')}", Engine)
