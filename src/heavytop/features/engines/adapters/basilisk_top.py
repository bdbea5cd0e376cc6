"""Basilisk: the hub of a spacecraft, which nothing holds: free bodies alone.  Its time counts nanoseconds."""

import sys
from importlib.metadata import version

import numpy as np
from Basilisk.simulation import spacecraft, svIntegrators
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass
from heavytop_engine import serve


class Engine:
    """Basilisk with a body about a fixed point."""

    def __init__(self, body):
        if body.gravity * abs(body.centre).max() or abs(body.centre).max():
            raise ValueError("Basilisk holds no body by a joint: give one that turns about its centre of mass.")
        hub = self.spacecraft = spacecraft.Spacecraft()
        hub.hub.mHub, hub.hub.r_BcB_B = body.mass, [[0.0]] * 3
        hub.hub.IHubPntBc_B = body.inertia.tolist()
        w, *v = body.quaternion * (1 if body.quaternion[0] >= 0 else -1)
        hub.hub.sigma_BNInit = [[part / (1 + w)] for part in v]
        hub.hub.omega_BN_BInit = [[part] for part in body.omega]
        if sys.argv[1] != "RK4":
            self.method = getattr(svIntegrators, f"svIntegrator{sys.argv[1]}")(hub)  # it keeps no reference
            hub.setIntegrator(self.method)
        self.simulation, self.now = None, 0

    def advance(self, step, count):
        nanoseconds = round(step * 1e9)
        if self.simulation is None:
            self.simulation = SimulationBaseClass.SimBaseClass()
            self.simulation.CreateNewProcess("process").addTask(self.simulation.CreateNewTask("task", nanoseconds))
            self.simulation.AddModelToTask("task", self.spacecraft)
            self.simulation.InitializeSimulation()
        self.now += count * nanoseconds
        self.simulation.ConfigureStopTime(self.now)
        self.simulation.ExecuteSimulation()

    def read(self):
        state = self.spacecraft.scStateOutMsg.read()
        return np.array(RigidBodyKinematics.MRP2EP(state.sigma_BN)), np.array(state.omega_BN_B)


serve(f"Basilisk:{sys.argv[1]} {version('bsk')}", Engine)
