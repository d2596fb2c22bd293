"""The law inside an FMU against numbers of ours.

    python fmu_law.py FMU PAIRS.json [UNLOADING_STIFFNESS]

PAIRS.json holds deflections, largest deflections and our force and energies, as bits; the stiffness in N/m is set in
the initialization. Prints a JSON
object: pairs, how many of the numbers differ, the largest relative difference, the largest difference of
the directional derivatives from central differences, in the scale of the largest, and how far the force
is from a straight line between two knots, in shares of the largest force.
"""

import json
import sys

from fmu_spring import Spring, Unpacked, from_bits, to_bits

QUANTITIES = ["force", "stored_energy", "dissipated_energy"]
# Derivatives are looked at for every so many pairs.
EVERY = 25


def central(spring, name, deflection, width):
    values = []
    for d in [deflection - width, deflection, deflection + width]:
        spring.set(d)
        values.append(spring.get(name))
    left, right = (values[1] - values[0]) / width, (values[2] - values[1]) / width
    return left, right


def bent(spring, deflection):
    """How far the force at a deflection is from the line between the knots beside it."""
    spring.set(deflection)
    force, past, before = spring.get("force", "past_knot", "before_knot")
    ends = []
    for d in [deflection - 0.999 * past, deflection + 0.999 * before]:
        spring.set(d)
        ends.append(spring.get("force"))
    return abs(ends[0] + (ends[1] - ends[0]) * past / (past + before) - force)


def main(path, pairs, stiffness=None):
    asked = json.load(open(pairs))
    numbers = {key: [from_bits(text) for text in asked[key]] for key in ["deflection", "largest"]}
    different, worst, bends, top = 0, 0.0, [], 0.0
    slopes = {name: [] for name in QUANTITIES}
    with Unpacked(path) as fmu, Spring(fmu, "cs", stiffness=stiffness and float(stiffness)) as spring:
        fresh = spring.i.getFMUState()
        for k, (d, largest) in enumerate(zip(numbers["deflection"], numbers["largest"])):
            spring.i.setFMUState(fresh)
            spring.set(largest)
            spring.i.doStep(0.0, 1.0)
            spring.set(d)
            for name, value in zip(QUANTITIES, spring.get(*QUANTITIES)):
                if to_bits(value) != asked[name][k]:
                    ours = from_bits(asked[name][k])
                    different += 1
                    worst = max(worst, abs(value - ours) / max(abs(ours), 1e-300))
            top = max(top, from_bits(asked["force"][k]))
            if k % EVERY == 1 and d < largest:
                bends.append(bent(spring, d))
            if k % EVERY != 1 or d <= 1e-3:
                continue
            for on_envelope in [False, True]:
                if on_envelope:
                    # Nothing is remembered: the same deflection is the largest.
                    spring.i.setFMUState(fresh)
                    bends.append(bent(spring, d))
                for name in QUANTITIES:
                    spring.set(d)
                    partial = spring.partial(name)
                    left, right = central(spring, name, d, 1e-7)
                    # Not where a kink lies within the difference.
                    if abs(left - right) <= 1e-3 * max(abs(left), abs(right)):
                        slopes[name].append((partial, 0.5 * (left + right)))
        spring.i.freeFMUState(fresh)
    off = 0.0
    for name, pairs in slopes.items():
        largest = max(abs(slope) for _, slope in pairs) or 1.0
        off = max(off, max(abs(a - b) for a, b in pairs) / largest)
    print(json.dumps({
        "pairs": len(numbers["largest"]),
        "different": different,
        "worst": worst,
        "derivative": off,
        "bent": max(bends) / top,
        "pieces": len(bends),
        "slopes": sum(map(len, slopes.values())),
    }))


if __name__ == "__main__":
    main(*sys.argv[1:])
