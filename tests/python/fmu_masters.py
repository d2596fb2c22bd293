"""One mass against a wall through an FMU's spring, by masters of our own. Nothing of crumple runs here.

    python fmu_masters.py FMU RUNS.json

RUNS.json holds mass, speed, duration and two runs of crumple at every 0.05 ms: velocity Verlet with
a step of its own, and the reference. Prints a JSON object with

- verlet, reference: largest differences of x, v and force from these runs, in shares of their largest
  values, for co-simulation (cs) and model exchange (me);
- rk4: restitution over that of the reference, less 1, of Runge-Kutta by model exchange at 0.75 ms;
- held, extrapolated: crush and restitution over those of the reference, less 1, where the input is that
  of the step's begin, by step in ms; extrapolated ones come with the derivative of the input (FMI 2).
"""

import json
import sys

from fmu_spring import Spring, Unpacked

INTERVAL_S = 5e-5


def verlet(spring, asked, step, every):
    """x, v, force at every so many steps. The force follows from the deflection at the step's end."""
    mass, x, v = asked["mass"], 0.0, asked["speed"]
    rows = [(x, v, spring.get("force"))]
    force = rows[0][2]
    for n in range(1, round(asked["duration"] / step) + 1):
        v -= 0.5 * step * force / mass
        x += step * v
        spring.set(x)
        spring.step(step)
        force = spring.get("force")
        v -= 0.5 * step * force / mass
        if n % every == 0:
            rows.append((x, v, force))
    return rows


def rk4(spring, asked, step):
    """Velocity at the end."""
    mass, x, v = asked["mass"], 0.0, asked["speed"]

    def pull(x):
        spring.set(x)
        return -spring.get("force") / mass

    for n in range(round(asked["duration"] / step)):
        t = n * step
        spring.i.setTime(t)
        a1 = pull(x)
        spring.i.setTime(t + 0.5 * step)
        a2 = pull(x + 0.5 * step * v)
        a3 = pull(x + 0.5 * step * (v + 0.5 * step * a1))
        spring.i.setTime(t + step)
        a4 = pull(x + step * (v + 0.5 * step * a2))
        x, v = x + step * v + step * step / 6 * (a1 + a2 + a3), v + step / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        spring.set(x)
        spring.step(step)
    return v


def held(spring, asked, step, with_derivative):
    """A common master: the input of the step's begin, the force of its end. The mass has the force of the
    last step (Heun within the step where there is a new one): largest x and last v."""
    mass, x, v, top = asked["mass"], 0.0, asked["speed"], 0.0
    force = 0.0
    for _ in range(round(asked["duration"] / step)):
        spring.set(x)
        if with_derivative:
            spring.i.setRealInputDerivatives([spring.vr["deflection"]], [1], [v])
        spring.step(step)
        # Both go on side by side over the same step: the mass knows the force of its begin.
        x += step * v - 0.5 * step * step * force / mass
        v -= step * force / mass
        force = spring.get("force")
        top = max(top, x)
    return top, v


def worst(rows, run):
    found = {}
    for k, name in enumerate(["x", "v", "force"]):
        largest = max(map(abs, run[name]))
        found[name] = max(abs(row[k] - value) for row, value in zip(rows, run[name])) / largest
        assert len(rows) == len(run[name])
    return found


def main(path, runs):
    asked = json.load(open(runs))
    found = {"verlet": {}, "reference": {}, "held": {}, "extrapolated": {}}
    with Unpacked(path) as fmu:
        for kind in ["cs", "me"]:
            with Spring(fmu, kind) as spring:
                every = round(INTERVAL_S / asked["step"])
                rows = verlet(spring, asked, asked["step"], every)
                found["verlet"][kind] = worst(rows, asked["verlet"])
            with Spring(fmu, kind) as spring:
                rows = verlet(spring, asked, INTERVAL_S / 5, 5)
                found["reference"][kind] = worst(rows, asked["reference"])
        with Spring(fmu, "me") as spring:
            v = rk4(spring, asked, 7.5e-4)
            found["rk4"] = {"restitution": -v / asked["speed"] / asked["restitution"] - 1}
        for name in ["held"] + ["extrapolated"] * (fmu.version == 2):
            for step in [5e-5, 1e-4, 1e-3]:
                with Spring(fmu, "cs") as spring:
                    top, v = held(spring, asked, step, name == "extrapolated")
                found[name][f"{1e3 * step:g}"] = {
                    "crush": top / asked["crush"] - 1,
                    "restitution": -v / asked["speed"],
                    "restitution_error": -v / asked["speed"] / asked["restitution"] - 1,
                }
    found["restitution"] = asked["restitution"]
    found["crush"] = asked["crush"]
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
