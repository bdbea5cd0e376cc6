"""A pendulum whose reference point is held by three CoordinateConstraints, in implicit and explicit solvers.

The body of 1 kg has its centre of mass 1 m beside that point, and 0.1 kg m^2 about it: it falls with m g c/(J + m c^2)
= 8.92 rad/s^2, so that omega_y is 0.89 after 0.1 s.  Exudyn 1.13.6: GeneralizedAlpha gives 0.89, RK44 and RK67 give 0.
With the centre of mass at the reference point and the weight as a force, all give 0.89.
    pip install exudyn; python exudyn_constraint_elimination.py
"""

import exudyn as exu
import numpy as np
from exudyn import utilities as make

exu.config.printToConsole = False


def omega_after(solver, centre_off):
    system, inertia = exu.SystemContainer().AddSystem(), np.diag([0.1, 0.1, 0.1])
    if centre_off:
        body = make.RigidBodyInertia(1, inertia, [1, 0, 0], inertiaTensorAtCOM=True)
    else:
        body = make.RigidBodyInertia(1, inertia + np.diag([0, 1, 1]), [0, 0, 0])
    node = exu.NodeType.RotationRotationVector
    down = [0, 0, -9.81] if centre_off else [0, 0, 0]
    made = system.CreateRigidBody(inertia=body, nodeType=node, gravity=down, returnDict=True)
    if not centre_off:
        at = system.AddMarker(make.MarkerBodyPosition(bodyNumber=made["bodyNumber"], localPosition=[1, 0, 0]))
        system.AddLoad(make.Force(markerNumber=at, loadVector=[0, 0, -9.81]))
    ground = system.AddMarker(
        make.MarkerNodeCoordinate(nodeNumber=system.AddNode(make.NodePointGround()), coordinate=0)
    )
    for place in range(3):
        held = system.AddMarker(make.MarkerNodeCoordinate(nodeNumber=made["nodeNumber"], coordinate=place))
        system.AddObject(make.CoordinateConstraint(markerNumbers=[ground, held]))
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 0.1, 1000
    system.SolveDynamic(settings, solverType=getattr(exu.DynamicSolverType, solver))
    return system.GetNodeOutput(made["nodeNumber"], exu.OutputVariableType.AngularVelocityLocal)[1]


for name in ("GeneralizedAlpha", "RK44", "RK67"):
    print(name, "centre off the point held:", omega_after(name, True), "on it:", omega_after(name, False))
