"""Moves one mass on exported files by other tools, and compares with crumple's own run.

    python exports_motion.py calculix DECK.inp OWN.csv
    python exports_motion.py modelica PACKAGE.mo OWN.csv
    python exports_motion.py exudyn CURVE.json OWN.csv

OWN.csv is what `crumple simulate` wrote of body A1. Prints the largest differences of way, speed and
force over their maxima, and the restitutions.
"""

import contextlib
import csv
import json
import pathlib
import re
import subprocess
import sys

import numpy


def own(path):
    with open(path, newline="") as file:
        lines = list(csv.reader(file))
    table = numpy.array(lines[1:], dtype=float).T
    return {name: column for name, column in zip(lines[0], table)}


def calculix(deck, run):
    """Node 2 begins at +x and moves towards −x."""
    name = pathlib.Path(deck).stem
    done = subprocess.run(["ccx", "-i", name], cwd=pathlib.Path(deck).parent, capture_output=True, text=True)
    if done.returncode != 0:
        raise ValueError(done.stdout[-2000:] + done.stderr)
    # The first state stands in no file.
    times, ways, speeds = [0.0], [0.0], [run["v_m_per_s[A1]"][0]]
    kind = time = None
    for line in pathlib.Path(deck).with_suffix(".dat").read_text().splitlines():
        head = re.match(r"\s*(displacements|velocities).*time\s+(\S+)", line)
        if head:
            kind, time = head[1], float(head[2])
        numbers = line.split()
        if len(numbers) == 4 and numbers[0] == "2" and kind:
            value = -float(numbers[1])
            if kind == "displacements":
                times.append(time)
                ways.append(value)
            else:
                speeds.append(value)
    return numpy.array(times), numpy.array(ways), numpy.array(speeds), None


def modelica(package, run):
    import rumoca

    name = re.search(r"^package (\w+)", pathlib.Path(package).read_text(), re.M)[1]
    model = rumoca.Session().load(package, model=f"{name}.Impact")
    config = rumoca.SimConfig(rtol=1e-8, atol=1e-8, max_wall_seconds=120)
    times = run["time_s"]
    result = model.simulate(t=(0, times[-1]), dt=times[1], config=config)
    time = json.loads(result.to_json())["time"]
    return tuple(numpy.array(list(c)) for c in (time, result["x"], result["v"], result["F"]))


def exudyn(path, run):
    """The table and its unloading line in a user function, integrated implicitly."""
    import exudyn as exu
    from exudyn.itemInterface import CoordinateSpringDamper, MarkerNodeCoordinate, Mass1D, Node1D
    from exudyn.itemInterface import NodePointGround, SensorNode

    curve = json.loads(pathlib.Path(path).read_text())
    deflection = numpy.array(curve["deflection_m"])
    force = numpy.array(curve["body_force_N"])
    # Beyond the maximum crush the force follows faster runs, at the level with which the curve ends.
    beyond = curve["beyond"]
    further = numpy.array(beyond["body_force_N"])
    deflection = numpy.append(deflection, beyond["deflection_m"][1:])
    force = numpy.append(force, force[-1] / further[0] * further[1:])
    stiffness = curve["body_unloading_stiffness_N_per_m"]
    largest = [0.0]

    def law(x):
        if x <= 0:
            return 0.0
        if x >= largest[0]:
            return numpy.interp(x, deflection, force)
        top = numpy.interp(largest[0], deflection, force)
        return max(0.0, top - stiffness * (largest[0] - x))

    exu.config.suppressWarnings = True
    system = exu.SystemContainer()
    model = system.AddSystem()
    ground = model.AddNode(NodePointGround())
    node = model.AddNode(
        Node1D(referenceCoordinates=[0.0], initialCoordinates=[0.0], initialVelocities=[curve["speed_m_per_s"]])
    )
    model.AddObject(Mass1D(physicsMass=curve["mass_kg"], nodeNumber=node))
    markers = [model.AddMarker(MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in (ground, node)]
    model.AddObject(
        CoordinateSpringDamper(
            markerNumbers=markers, stiffness=1.0,
            springForceUserFunction=lambda m, t, item, x, v, k, d, offset: law(x),
        )
    )
    way = model.AddSensor(
        SensorNode(nodeNumber=node, outputVariableType=exu.OutputVariableType.Coordinates, storeInternal=True)
    )
    speed = model.AddSensor(
        SensorNode(nodeNumber=node, outputVariableType=exu.OutputVariableType.Coordinates_t, storeInternal=True)
    )

    def remember(m, t):
        way = m.GetNodeOutput(node, exu.OutputVariableType.Coordinates)
        largest[0] = max(largest[0], float(numpy.atleast_1d(way)[0]))
        return True

    model.SetPreStepUserFunction(remember)
    model.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = float(run["time_s"][-1])
    settings.timeIntegration.numberOfSteps = int(round(run["time_s"][-1] / 1e-5))
    settings.solutionSettings.sensorsWritePeriod = 1e-5
    settings.solutionSettings.writeSolutionToFile = False
    settings.timeIntegration.verboseMode = 0
    model.SolveDynamic(settings, solverType=exu.DynamicSolverType.VelocityVerlet)
    ways, speeds = model.GetSensorStoredData(way), model.GetSensorStoredData(speed)
    return ways[:, 0], ways[:, 1], speeds[:, 1], None


tool, file, path = sys.argv[1:]
run = own(path)
with contextlib.redirect_stdout(sys.stderr):
    time, x, v, f = {"calculix": calculix, "modelica": modelica, "exudyn": exudyn}[tool](file, run)
keep = run["time_s"] <= time[-1]
at = run["time_s"][keep]


def off(values, name):
    wanted = run[name][keep]
    return float(abs(numpy.interp(at, time, values) - wanted).max() / abs(wanted).max())


found = {"x": off(x, "x_m[A1]"), "v": off(v, "v_m_per_s[A1]"), "until_s": float(at[-1])}
if f is not None:
    found["force"] = off(f, "force_N[A1|wall]")
found["restitution"] = float(-v[-1] / v[0])
found["own_restitution"] = float(-run["v_m_per_s[A1]"][keep][-1] / run["v_m_per_s[A1]"][0])
json.dump(found, sys.stdout)
