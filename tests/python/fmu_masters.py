"""One mass against a wall through an FMU's spring, by masters of our own. Nothing of crumple runs here.

    python fmu_masters.py FMU RUNS.json

RUNS.json holds mass, speed, duration and runs at every 0.05 ms: crumple's velocity Verlet, plain velocity
Verlet on its law with the same step, and crumple's reference. Prints a JSON object with

- verlet, plain, reference: largest differences of x, v and force from these runs, in shares of their
  largest values, for co-simulation (cs) and model exchange (me); those from the reference at 0.01 ms;
- mean_force: the same of Verlet with the mean force of each step, from crumple's own;
- events: by model exchange with state events, that of Verlet from crumple's own; rebound of Runge-Kutta at
  0.75 ms over that of the reference, less 1; how many events there were;
- rk4: of Runge-Kutta without events by model exchange at 0.75 ms, rebound over that which the law gives from its own
  crush, less 1; rebound and crush over those of the reference, less 1;
- held: crush and rebound over those of the reference, less 1, and restitution, of co-simulation whose
  inputs are those of the step's begin; extrapolated comes with the input's derivative (FMI 2).
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


def by_mean_force(spring, asked, step, every):
    """Verlet whose impulse is that of the mean force of the step: its work over its deflection."""
    mass, x, v = asked["mass"], 0.0, asked["speed"]
    force, work = spring.get("force"), 0.0
    rows = [(x, v, force)]
    for n in range(1, round(asked["duration"] / step) + 1):
        after = x + step * v - 0.5 * step * step * force / mass
        spring.set(after)
        spring.step(step)
        new, stored, dissipated = spring.get("force", "stored_energy", "dissipated_energy")
        # Where it hardly moves, the difference of the works is their rounding.
        moves = abs(after - x) > 1e-9
        mean = (stored + dissipated - work) / (after - x) if moves else 0.5 * (force + new)
        v -= step * mean / mass
        x, force, work = after, new, stored + dissipated
        if n % every == 0:
            rows.append((x, v, force))
    return rows


def pull(spring, asked, t, x):
    """Acceleration at a trial."""
    spring.i.setTime(t)
    spring.set(x)
    return -spring.get("force") / asked["mass"]


def verlet_step(spring, asked, t, step, x, v):
    v -= 0.5 * step * -pull(spring, asked, t, x)
    x += step * v
    return x, v - 0.5 * step * -pull(spring, asked, t + step, x)


def rk4_step(spring, asked, t, step, x, v):
    a1 = pull(spring, asked, t, x)
    a2 = pull(spring, asked, t + 0.5 * step, x + 0.5 * step * v)
    a3 = pull(spring, asked, t + 0.5 * step, x + 0.5 * step * (v + 0.5 * step * a1))
    a4 = pull(spring, asked, t + step, x + step * (v + 0.5 * step * a2))
    return x + step * v + step * step / 6 * (a1 + a2 + a3), v + step / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def with_events(spring, asked, one_step, step, every):
    """Model exchange as the standard has it: a step that makes an event indicator negative is taken only to
    just behind that point, where the FMU gets its event. x, v, force at every so many steps; events."""
    x, v, events = 0.0, asked["speed"], 0
    rows = [(x, v, spring.get("force"))]
    for n in range(1, round(asked["duration"] / step) + 1):
        t, end = (n - 1) * step, n * step
        while t < end:

            def knots_after(step):
                spring.set(one_step(spring, asked, t, step, x, v)[0])
                return min(spring.knots())

            taken = end - t
            is_crossed = knots_after(taken) < 0.0
            if is_crossed:
                before = 0.0
                while taken - before > 1e-7 * step:
                    middle = 0.5 * (before + taken)
                    before, taken = (before, middle) if knots_after(middle) < 0.0 else (middle, taken)
            x, v = one_step(spring, asked, t, taken, x, v)
            t = end if taken == end - t else t + taken
            spring.set(x)
            if spring.accept(t) or is_crossed:
                spring.event()
                events += 1
        if n % every == 0:
            rows.append((x, v, spring.get("force")))
    return rows, events


def rk4(spring, asked, step):
    """Velocity at the end, of a master that knows no events."""
    x, v = 0.0, asked["speed"]
    for n in range(round(asked["duration"] / step)):
        x, v = rk4_step(spring, asked, n * step, step, x, v)
        spring.set(x)
        spring.accept((n + 1) * step)
    return v


def held(spring, asked, step, order):
    """Co-simulation with inputs of the step's begin; both sides go exactly along what they are given.
    Side by side, the mass has the force that is there when the step begins; with the spring first, that of
    the step's end. Returns the largest x and the last v."""
    mass, x, v, top, force = asked["mass"], 0.0, asked["speed"], 0.0, 0.0
    for _ in range(round(asked["duration"] / step)):
        spring.set(x)
        if order == "extrapolated":
            spring.i.setRealInputDerivatives([spring.vr["deflection"]], [1], [v])
        spring.step(step)
        new = spring.get("force")
        pushed = new if order == "spring_first" else force
        x += step * v - 0.5 * step * step * pushed / mass
        v -= step * pushed / mass
        force = new
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
    found = {"verlet": {}, "plain": {}, "mean_force": {}, "reference": {}, "held": {}}
    with Unpacked(path) as fmu:
        for kind in ["cs", "me"]:
            with Spring(fmu, kind) as spring:
                every = round(INTERVAL_S / asked["step"])
                rows = verlet(spring, asked, asked["step"], every)
                found["verlet"][kind] = worst(rows, asked["verlet"])
                found["plain"][kind] = worst(rows, asked["plain"])
            with Spring(fmu, kind) as spring:
                rows = by_mean_force(spring, asked, asked["step"], every)
                found["mean_force"][kind] = worst(rows, asked["verlet"])
            with Spring(fmu, kind) as spring:
                rows = verlet(spring, asked, INTERVAL_S / 5, 5)
                found["reference"][kind] = worst(rows, asked["reference"])
        with Spring(fmu, "me") as spring:
            v = rk4(spring, asked, 7.5e-4)
            crush = spring.get("max_deflection")
            spring.set(crush)
            of_law = (2 * spring.get("stored_energy") / asked["mass"]) ** 0.5
        found["rk4"] = {
            "of_law": -v / of_law - 1,
            "of_reference": v / asked["reference"]["v"][-1] - 1,
            "crush": crush / asked["crush"] - 1,
        }
        with Spring(fmu, "me") as spring:
            rows, count = with_events(spring, asked, rk4_step, 7.5e-4, 400)
            rebound = rows[-1][1] / asked["reference"]["v"][-1] - 1
        with Spring(fmu, "me") as spring:
            rows, _ = with_events(spring, asked, verlet_step, asked["step"], every)
            found["events"] = {"rk4": rebound, "count": count, "verlet": worst(rows, asked["verlet"])}
        for order in ["side_by_side", "spring_first"] + ["extrapolated"] * (fmu.version == 2):
            for step in [5e-5, 1e-4, 1e-3]:
                with Spring(fmu, "cs") as spring:
                    top, v = held(spring, asked, step, order)
                found["held"][f"{order}, {1e3 * step:g} ms"] = {
                    "crush": top / asked["crush"] - 1,
                    "restitution": -v / asked["speed"],
                    "rebound": v / asked["reference"]["v"][-1] - 1,
                }
    found["restitution"] = -asked["reference"]["v"][-1] / asked["speed"]
    found["crush"] = asked["crush"]
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
