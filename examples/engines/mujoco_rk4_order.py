"""The order of integrator="RK4" on a ball joint: three steps of a free body, each against one a quarter as long.

MuJoCo 3.3.0: the error falls by 4 where the step is halved (order 2).  MuJoCo 4.0.0: by 16 (order 4).
    pip install mujoco==3.3.0; python mujoco_rk4_order.py
"""

import mujoco
import numpy as np

MODEL = """
<mujoco>
  <option gravity="0 0 -9.81" integrator="RK4"><flag contact="disable"/></option>
  <worldbody><body><joint type="ball"/>
    <inertial pos="0.3 -0.2 0.4" mass="2" diaginertia="1.2 0.9 0.6"/>
  </body></worldbody>
</mujoco>"""


def velocity_after(seconds, step):
    model = mujoco.MjModel.from_xml_string(MODEL)
    model.opt.timestep = step
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = [0.8, 0, 0.6, 0], [1, 2, 6]
    mujoco.mj_step(model, data, round(seconds / step))
    return data.qvel.copy()


true = velocity_after(1, 1 / 6400)
errors = [np.abs(velocity_after(1, 1 / n) - true).max() for n in (50, 100, 200)]
print("MuJoCo", mujoco.__version__, "errors of the angular velocity at t = 1:", errors)
print("order", np.log2(errors[0] / errors[1]), np.log2(errors[1] / errors[2]))
