"""Exudyn: implicit solvers hold the body by a spherical joint; explicit ones eliminate constraints on its coordinates,
without the coupling of the mass matrix: there the tensor is about the pivot, and the weight a force.
"""

import sys

import exudyn as exu
import numpy as np
from exudyn import utilities as make
from heavytop_engine import serve

SOLVER, NODE = sys.argv[1].split("-")  # RK44-LG: the node is of a Lie group; -EP: of Euler parameters
NODES = {"EP": exu.NodeType.RotationEulerParameters, "LG": exu.NodeType.RotationRotationVector}
EXPLICIT = SOLVER not in ("GeneralizedAlpha", "TrapezoidalIndex2")
exu.config.printToConsole = False


class Engine:
    """Exudyn with a body about a fixed point."""

    def __init__(self, body):
        self.time, self.settings, system = 0.0, exu.SimulationSettings(), exu.SystemContainer().AddSystem()
        about_pivot = make.RigidBodyInertia(body.mass, body.about_pivot, [0, 0, 0])
        about_centre = make.RigidBodyInertia(body.mass, body.inertia, body.centre, inertiaTensorAtCOM=True)
        start = {"referenceRotationMatrix": body.rotation, "initialAngularVelocity": list(body.omega_space)}
        options = {"inertia": about_pivot if EXPLICIT else about_centre, "nodeType": NODES[NODE]}
        down = [0, 0, 0 if EXPLICIT else -body.gravity]
        made = system.CreateRigidBody(gravity=down, returnDict=True, **options, **start)
        self.node, number, self.system = made["nodeNumber"], made["bodyNumber"], system
        if EXPLICIT:
            centre = system.AddMarker(make.MarkerBodyPosition(bodyNumber=number, localPosition=list(body.centre)))
            system.AddLoad(make.Force(markerNumber=centre, loadVector=[0, 0, -body.mass * body.gravity]))
            places = [(system.AddNode(make.NodePointGround()), 0), *((self.node, k) for k in range(3))]
            markers = [make.MarkerNodeCoordinate(nodeNumber=node, coordinate=k) for node, k in places]
            ground, *held = map(system.AddMarker, markers)
            for marker in held:
                system.AddObject(make.CoordinateConstraint(markerNumbers=[ground, marker]))
        else:
            system.CreateSphericalJoint(bodyNumbers=[system.CreateGround(), number], position=[0, 0, 0], show=False)
        system.Assemble()
        self.settings.solutionSettings.writeSolutionToFile = False
        newton = self.settings.timeIntegration.newton
        newton.relativeTolerance, newton.absoluteTolerance = 1e-10, 1e-12

    def advance(self, step, count):
        run, kind = self.settings.timeIntegration, getattr(exu.DynamicSolverType, SOLVER)
        run.startTime, run.endTime, run.numberOfSteps = self.time, self.time + count * step, count
        self.system.SolveDynamic(self.settings, solverType=kind, updateInitialValues=True)
        self.time = run.endTime

    def output(self, name):
        """A quantity of the node of the body."""
        return self.system.GetNodeOutput(self.node, getattr(exu.OutputVariableType, name))

    def read(self):
        return np.reshape(self.output("RotationMatrix"), (3, 3)), self.output("AngularVelocityLocal")

    def pivot(self):
        return self.output("Position")


serve(f"Exudyn:{sys.argv[1]} {exu.config.Version()}", Engine)
