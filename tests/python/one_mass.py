"""One mass on an exported curve, against FE's own motion. Nothing of crumple runs here.

    python one_mass.py NODOUT NODE SCALE CURVE…

Each CURVE (.csv, .k, .json) says itself its points, units, mass, speed and unloading stiffness. scipy
integrates the mass along it to rest, and back along the straight unloading line. Prints a JSON
object with, per file, sum|v - v_FE| / sum|v_FE| until 30 ms after FE's maximum crush, and the separation speed over FE's largest. Where FE's
bodies hook and pull each other back (lead-car-pair), no spring that only pushes can follow: there
it ends when the separation has slowed down by a tenth.
NODE is one id, or two joined by "-" whose difference is the motion. SCALE makes it the closure in m
(0.001 of mm; 0.002 for half a model).
"""

import json
import pathlib
import re
import sys

import numpy
from scipy.integrate import solve_ivp

AFTER_S = 0.030
PULLED = 0.1
LENGTH = {"m": 1.0, "mm": 1e-3}
FORCE = {"N": 1.0, "kN": 1e3, "MN": 1e6}


def facts(lines, mark):
    found = {}
    for line in lines:
        if line.startswith(mark) and ":" in line:
            key, value = line[len(mark):].split(":", 1)
            found[key.strip()] = value.strip()
    return found


def read_csv(text):
    lines = text.splitlines()
    head, *rows = [line for line in lines if not line.startswith("#")]
    deflection, force = head.split(",")[:2]
    points = numpy.array([[float(x) for x in row.split(",")[:2]] for row in rows])
    points *= [LENGTH[deflection.removeprefix("d_")], FORCE[force.removeprefix("force_")]]
    return points, facts(lines, "# ")


def read_keyword(text):
    lines = text.splitlines()
    known = facts(lines, "$ ")
    units = re.search(r"length (\S+) m, force (\S+) N", known["units of the points"])
    start = next(i for i, line in enumerate(lines) if line.startswith("*DEFINE_CURVE"))
    behind = lines[start + 2 :]
    end = next(i for i, line in enumerate(behind) if line.startswith("*"))
    body = [line for line in behind[:end] if not line.startswith("$")]
    points = [[float(line[:20]), float(line[20:40])] for line in body[1:]]
    return numpy.array(points) * [float(units[1]), float(units[2])], known


def read_json(text):
    curve = json.loads(text)
    return numpy.array([curve["deflection_m"], curve["force_N"]]).T, curve


READERS = {".csv": read_csv, ".k": read_keyword, ".json": read_json}


def nodout(path, node):
    """Times, displacements and velocities in x of a node, by fixed columns."""
    rows, time, translations = [], None, False
    for line in open(path):
        if match := re.search(r"at time\s+([0-9.E+-]+)", line):
            time = float(match[1])
        elif "x-disp" in line or "x-rot" in line:
            translations = "x-disp" in line
        elif translations and line[:10].strip() == node:
            rows.append([time, float(line[10:22]), float(line[46:58])])
    return numpy.array(rows).T


def run(points, mass, speed, stiffness, times):
    """Velocity at the times, and when the mass has left the obstacle."""
    deflection, force = points.T

    def loading(_, y):
        return [y[1], -numpy.interp(y[0], deflection, force) / mass]

    def rest(_, y):
        return y[1]

    rest.terminal, rest.direction = True, -1
    options = {"rtol": 1e-7, "atol": 1e-9, "max_step": 5e-4}
    there = solve_ivp(loading, (0, times[-1]), [0, speed], events=rest, dense_output=True, **options)
    turn, crush = there.t[-1], there.y[0, -1]
    top = numpy.interp(crush, deflection, force)

    def unloading(_, y):
        return [y[1], -max(0.0, top - stiffness * (crush - y[0])) / mass]

    back = solve_ivp(unloading, (turn, times[-1]), [crush, 0.0], dense_output=True, **options)
    return numpy.array([(there if t <= turn else back).sol(t)[1] for t in times])


def main(path, node, scale, curves):
    times, *motion = nodout(path, node.split("-")[0])
    for minus in node.split("-")[1:]:
        motion = [a - b for a, b in zip(motion, nodout(path, minus)[1:])]
    displacement, velocity = motion
    direction = numpy.sign(velocity[0]) * float(scale)
    displacement, velocity = displacement * direction, velocity * direction
    parting = -velocity.min()
    turn = displacement.argmax()
    pulled = (-velocity < (1 - PULLED) * parting) & (times > times[velocity.argmin()])
    ends = [times[turn] + AFTER_S, *times[pulled][:1]]
    until = times <= min(ends)
    found = {}
    for name in curves:
        path = pathlib.Path(name)
        points, known = READERS[path.suffix](path.read_text())
        mass = float(known["mass_kg"])
        if known["speed_kind"] == "closing":
            mass /= 2
        speed, stiffness = float(known["speed_m_per_s"]), float(known["unloading_stiffness_N_per_m"])
        v = run(points, mass, speed, stiffness, times)
        error = abs(v - velocity)[until].sum() / abs(velocity)[until].sum()
        found[path.name] = [error, -v[-1] / parting]
    print(json.dumps(found))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3], sys.argv[4:])
