"""Runs a chain of masses by Exudyn: 1D masses, a spring with a force table between neighbours.

Arguments: the name of a JSON file with masses_kg, speeds_m_per_s, gaps_m, deflections_m and
forces_N (a table per interface), step_s, interval_s and outputs. Prints the velocities in m/s,
one list per output, from the start on.
"""

import json
import sys
from bisect import bisect_right

import exudyn as exu
from exudyn.itemInterface import (
    CoordinateSpringDamper,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
    SensorNode,
)


def spring(gap, deflections, forces):
    """Force over elongation, by linear interpolation of the table on the deflection."""
    slopes = [
        (f1 - f0) / (d1 - d0)
        for d0, d1, f0, f1 in zip(deflections, deflections[1:], forces, forces[1:])
    ]

    def force(mbs, t, item, elongation, rate, stiffness, damping, offset):
        deflection = -elongation - gap
        if deflection <= 0.0:
            return 0.0
        k = min(bisect_right(deflections, deflection), len(slopes)) - 1
        return -(forces[k] + slopes[k] * (deflection - deflections[k]))

    return force


with open(sys.argv[1]) as file:
    chain = json.load(file)

exu.config.suppressWarnings = True
system = exu.SystemContainer()
mbs = system.AddSystem()
markers, sensors = [], []
for mass, speed in zip(chain["masses_kg"], chain["speeds_m_per_s"]):
    node = mbs.AddNode(
        Node1D(referenceCoordinates=[0.0], initialCoordinates=[0.0], initialVelocities=[speed])
    )
    mbs.AddObject(Mass1D(physicsMass=mass, nodeNumber=node))
    markers.append(mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=0)))
    sensors.append(
        mbs.AddSensor(
            SensorNode(
                nodeNumber=node,
                storeInternal=True,
                outputVariableType=exu.OutputVariableType.Coordinates_t,
            )
        )
    )
tables = zip(chain["gaps_m"], chain["deflections_m"], chain["forces_N"])
for k, (gap, deflections, forces) in enumerate(tables):
    mbs.AddObject(
        CoordinateSpringDamper(
            markerNumbers=[markers[k], markers[k + 1]],
            springForceUserFunction=spring(gap, deflections, forces),
        )
    )
mbs.Assemble()

steps = round(chain["outputs"] * chain["interval_s"] / chain["step_s"])
settings = exu.SimulationSettings()
settings.timeIntegration.numberOfSteps = steps
settings.timeIntegration.endTime = chain["outputs"] * chain["interval_s"]
settings.timeIntegration.verboseMode = 0
settings.solutionSettings.writeSolutionToFile = False
settings.solutionSettings.sensorsWritePeriod = chain["interval_s"]
mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44)

histories = [mbs.GetSensorStoredData(sensor) for sensor in sensors]
times = histories[0][:, 0]
assert len(times) == chain["outputs"] + 1, times
assert max(abs(times[i] - i * chain["interval_s"]) for i in range(len(times))) < 1e-9, times
json.dump([[h[row, 1] for h in histories] for row in range(len(times))], sys.stdout)
