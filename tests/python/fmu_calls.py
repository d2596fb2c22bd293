"""What an FMU does with wrong calls, saved states, events and several instances.

    python fmu_calls.py FMU OTHER_FMU

Prints a JSON object: the checks that were made, and those that failed.
"""

import json
import math
import sys
from ctypes import c_double

from fmu_spring import OUTPUTS, FMICallException, Spring, Unpacked, to_bits

failed, made = [], []


def check(what, is_right):
    made.append(what)
    if not is_right:
        failed.append(what)


def refuses(spring, what, call):
    """An error with a message, and the outputs as before."""
    before = len(spring.messages)
    try:
        call()
        check(f"{what}: refused", False)
    except FMICallException as error:
        check(f"{what}: error", error.status == 3)
        said = spring.messages[before:]
        check(f"{what}: message", len(said) == 1 and "fmi" in said[0] and "%" not in said[0])


def bits(values):
    return [to_bits(value) for value in values]


def crush(spring, steps, start=0):
    """Up and down again."""
    found = []
    for n in range(start, steps):
        spring.set(0.5 * math.sin(math.pi * (n + 1) / 100))
        spring.step(1e-3)
        found.append(bits(spring.outputs()))
    return found


def wrong_order(fmu, kind):
    with Spring(fmu, kind, is_started=False) as s:
        refuses(s, f"{kind} output before initialization", lambda: s.get("force"))
        if kind == "cs":
            refuses(s, "step before initialization", lambda: s.i.doStep(0.0, 1e-3))
        refuses(s, f"{kind} exit without enter", s.i.exitInitializationMode)
        refuses(s, f"{kind} terminate before initialization", s.i.terminate)
        s.start()
        refuses(s, f"{kind} initialization twice", s.i.enterInitializationMode)
        if kind == "me":
            s.continuous()
            s.set(0.1)
            refuses(s, "parameter in continuous time", lambda: s.set(2.0, "force_scale"))
            refuses(s, "time that is none", lambda: s.i.setTime(math.nan))
            s.i.enterEventMode()
            s.set(2.0, "force_scale")
            refuses(s, "accepted point in event mode", s.i.completedIntegratorStep)
        else:
            s.set(0.1)
            for step in [0.0, -1e-3, math.nan, math.inf]:
                refuses(s, f"step of {step}", lambda: s.i.doStep(0.0, step))
            refuses(s, "step from elsewhere", lambda: s.i.doStep(1.0, 1e-3))
        for value in [math.nan, math.inf]:
            refuses(s, f"{kind} deflection {value}", lambda: s.set(value))
        check(f"{kind} deflection is as before", s.get("deflection") == 0.1)
        for value in [0.0, -1.0, math.nan]:
            refuses(s, f"{kind} scale {value}", lambda: s.set(value, "force_scale"))
        refuses(s, f"{kind} stiffness after initialization", lambda: s.set(1e6, "unloading_stiffness"))
        refuses(s, f"{kind} derivative by the stiffness after initialization",
                lambda: s.partial("stored_energy", "unloading_stiffness"))
        refuses(s, f"{kind} output set", lambda: s.set(1.0, "force"))
        setter = s.i.setReal if fmu.version == 2 else s.i.setFloat64
        getter = s.i.getReal if fmu.version == 2 else s.i.getFloat64
        for reference in [0 if fmu.version == 2 else 11, 2, 99, 2**32 - 1]:
            refuses(s, f"{kind} get of {reference}", lambda: getter([reference]))
            refuses(s, f"{kind} set of {reference}", lambda: setter([reference], [1.0]))
        refuses(s, f"{kind} several, one unknown", lambda: setter([1, 99], [0.3, 1.0]))
        check(f"{kind} all or none", s.get("deflection") == 0.1)
        integers = s.i.getInteger if fmu.version == 2 else s.i.getInt32
        refuses(s, f"{kind} integer", lambda: integers([1]))
        refuses(s, f"{kind} string", lambda: s.i.getString([1]))
        refuses(s, f"{kind} derivative of an input", lambda: s.partial("deflection"))
        refuses(s, f"{kind} derivative by an output", lambda: s.partial("force", "force"))
        if kind == "me":
            x = (c_double * 1)()
            refuses(s, "states", lambda: s.i.getContinuousStates(x, 1))
            check("no states are fine", s.i.getContinuousStates(x, 0) in (None, 0))


def without_arguments(fmu):
    """No instance, and no arrays: errors, and no crash."""
    prefix = f"fmi{fmu.version}"
    real = "Real" if fmu.version == 2 else "Float64"
    more = [] if fmu.version == 2 else [1]
    with Spring(fmu, "cs") as s:
        for call in [f"Get{real}", f"Set{real}"]:
            refuses(s, f"{call} without arrays",
                    lambda: s.i._call(prefix + call, s.i.component, None, 1, None, *more))
        for call in ["Terminate", "Reset", "EnterInitializationMode", "ExitInitializationMode"]:
            more = [False, 0.0, 0.0, False, 0.0] if call.startswith("Enter") and fmu.version == 3 else []
            try:
                s.i._call(prefix + call, None, *more)
                check(f"{call} without an instance", False)
            except FMICallException:
                check(f"{call} without an instance", True)


def instances(fmu, other):
    for token in ["{0}", ""]:
        try:
            Spring(fmu, "cs", token=token or " ")
            check("wrong token", False)
        except Exception:
            check("wrong token", True)
    with Spring(fmu, "cs") as one, Spring(fmu, "cs") as two, Spring(other, "cs") as three:
        alone = crush(one, 150)
        both = []
        for n in range(150):
            both += crush(two, n + 1, n)
            crush(three, n + 1, n)
        check("instances do not meet", alone == both)
        check("another curve", three.get("force") != two.get("force") or alone != crush(three, 1))
        state = three.i.getFMUState()
        refuses(two, "state of another curve", lambda: two.i.setFMUState(state))
        three.i.freeFMUState(state)


def states(fmu, kind):
    with Spring(fmu, kind) as one:
        whole = crush(one, 150)
    with Spring(fmu, kind) as one, Spring(fmu, kind) as fresh:
        crush(one, 70)
        time = one.time
        state = one.i.getFMUState()
        saved = one.i.serializeFMUState(state)
        check(f"{kind} goes on", crush(one, 150, 70) == whole[70:])
        one.i.setFMUState(state)
        one.time = time
        check(f"{kind} goes on from a state", crush(one, 150, 70) == whole[70:])
        one.i.freeFMUState(state)
        read = fresh.i.deserializeFMUState(saved)
        fresh.i.setFMUState(read)
        fresh.time = time
        check(f"{kind} another goes on from bytes", crush(fresh, 150, 70) == whole[70:])
        fresh.i.freeFMUState(read)
        check(f"{kind} size of a state", len(saved) <= 256)
        refuses(fresh, f"{kind} bytes that are not a state",
                lambda: fresh.i.deserializeFMUState(b"\x07" * len(saved)))
        refuses(fresh, f"{kind} too few bytes", lambda: fresh.i.deserializeFMUState(saved[:20]))
        fresh.i.terminate()
        fresh.i.reset()
        fresh.time = 0.0
        fresh.start()
        if kind == "me":
            fresh.continuous()
        check(f"{kind} after a reset", crush(fresh, 150) == whole)


def memory(fmu, kind):
    with Spring(fmu, kind) as s:
        s.set(0.2)
        s.step(1e-3)
        top = s.get("force")
        s.set(0.4)
        check(f"{kind} a trial shows the envelope", s.get("max_deflection") == 0.4)
        s.set(0.199)
        check(f"{kind} and leaves no trace", s.get("max_deflection") == 0.2)
        below = s.get("force")
        check(f"{kind} unloads", 0.0 < below < top)
        s.step(1e-3)
        s.set(0.2)
        check(f"{kind} reloads to the same", abs(s.get("force") - top) <= 1e-9 * top)
        stored, dissipated = s.get("stored_energy", "dissipated_energy")
        check(f"{kind} scale by derivative", s.partial("force", "force_scale") == s.get("force"))
        if kind == "me":
            s.i.enterEventMode()
        s.set(3.0, "force_scale")
        check(f"{kind} scale", s.get("force") == 3.0 * top)
        check(f"{kind} energies scale", s.get("stored_energy") == 3.0 * stored
              and s.get("dissipated_energy") == 3.0 * dissipated)
        if kind == "me":
            s.events()
            s.i.enterContinuousTimeMode()
    with Spring(fmu, kind, is_started=False) as s:
        s.start(deflection=0.3)
        check(f"{kind} compressed at the start", s.get("max_deflection") == 0.3)
        s.set(0.29)
        check(f"{kind} which is remembered", s.get("max_deflection") == 0.3)


def unloading_stiffness(fmu, kind):
    """Set in the initialization it goes with the state, and a reset brings back the curve's own."""
    own = float(next(v.start for v in fmu.description.modelVariables if v.name == "unloading_stiffness"))

    def unloaded(s):
        s.set(0.3)
        s.step(1e-3)
        s.set(0.299)
        return bits(s.outputs())

    def within(s):
        for value in [0.0, -1.0, math.nan, math.inf]:
            refuses(s, f"{kind} stiffness {value}", lambda: s.set(value, "unloading_stiffness"))
        for d in [0.01, 0.1, 0.3, 0.5, -0.1]:
            s.set(d)
            for name in OUTPUTS + ["past_knot"]:
                partial = s.partial(name, "unloading_stiffness")
                ends = []
                for factor in [1 - 1e-6, 1 + 1e-6]:
                    s.set(factor * own, "unloading_stiffness")
                    ends.append(s.get(name))
                s.set(own, "unloading_stiffness")
                energy = max(s.get("stored_energy"), 1e-9)
                off = abs((ends[1] - ends[0]) / 2e-6 - partial * own)
                check(f"{kind} {name} by the stiffness at {d}", off <= 1e-4 * energy)
        check(f"{kind} stiffness has a derivative", s.set(0.5) or s.partial("stored_energy", "unloading_stiffness") < 0)
        s.set(0.0)

    with Spring(fmu, kind, stiffness=own) as s, Spring(fmu, kind, stiffness=0.5 * own) as soft:
        check(f"{kind} stiffness reads as it was set", soft.get("unloading_stiffness") == 0.5 * own)
        state = soft.i.getFMUState()
        first, softly = unloaded(s), unloaded(soft)
        check(f"{kind} stiffness changes the unloading", first != softly)
        s.i.setFMUState(state)
        s.time = 0.0
        check(f"{kind} stiffness of a state", unloaded(s) == softly)
        soft.i.freeFMUState(state)
        soft.i.terminate()
        soft.i.reset()
        soft.time = 0.0
        soft.start(within=lambda: within(soft))
        if kind == "me":
            soft.continuous()
        check(f"{kind} stiffness after a reset", unloaded(soft) == first)


def input_derivatives(fmu):
    """The same end of step and memory as from the value itself; a turn within a step counts."""
    with Spring(fmu, "cs") as s:
        s.set(0.1)
        s.i.setRealInputDerivatives([s.vr["deflection"]], [1], [20.0])
        s.step(1e-2)
        check("derivative moves the input", abs(s.get("deflection") - 0.3) < 1e-15)
        force = s.get("force")
        s.step(1e-2)
        check("and ends with its step", abs(s.get("deflection") - 0.3) < 1e-15)
        # d = 0.3 + 10 t - 500 t²: 0.35 at the turn, 0.3 again at the end.
        s.i.setRealInputDerivatives([s.vr["deflection"]] * 2, [1, 2], [10.0, -1000.0])
        s.step(2e-2)
        check("turn within a step", abs(s.get("max_deflection") - 0.35) < 1e-12)
        check("end of a step with a turn", abs(s.get("deflection") - 0.3) < 1e-12)
        check("unloaded from the turn", s.get("force") != force)
        refuses(s, "derivative of order 3",
                lambda: s.i.setRealInputDerivatives([s.vr["deflection"]], [3], [1.0]))
        refuses(s, "derivative of an output",
                lambda: s.i.setRealInputDerivatives([s.vr["force"]], [1], [1.0]))
        refuses(s, "output derivative", lambda: s.i.getRealOutputDerivatives([3], [1]))


def events(fmu):
    """FMI 3 co-simulation with event mode: trials in it leave no trace until states are updated."""
    with Spring(fmu, "cs", events=True) as s:
        s.set(0.1)
        s.step(1e-3)
        s.i.enterEventMode()
        for trial in [0.5, 0.3, 0.2]:
            s.set(trial)
            check("trial in event mode", s.get("max_deflection") == trial)
        s.i.updateDiscreteStates()
        s.set(0.1)
        check("updated states remember", s.get("max_deflection") == 0.2)
        refuses(s, "step in event mode", lambda: s.i.doStep(s.time, 1e-3))
        s.i.enterStepMode()
        s.step(1e-3)
        refuses(s, "continuous time in co-simulation", s.i.enterContinuousTimeMode
                if hasattr(s.i, "enterContinuousTimeMode")
                else lambda: s.i._call("fmi3EnterContinuousTimeMode", s.i.component))
    with Spring(fmu, "cs") as s:
        refuses(s, "event mode that was not asked for", s.i.enterEventMode)
        adjoint = s.i.getAdjointDerivative
        s.set(0.2)
        partials = [s.partial(name) for name in OUTPUTS]
        references = [s.vr[name] for name in OUTPUTS]
        found = adjoint(references, [s.vr["deflection"]], [1.0, 2.0, 3.0, 4.0], 1)[0]
        wanted = sum(w * p for w, p in zip([1.0, 2.0, 3.0, 4.0], partials))
        check("adjoint derivative", abs(found - wanted) <= 1e-12 * abs(wanted))
        check("time", s.get("time") == s.time)


def main(path, other_path):
    with Unpacked(path) as fmu, Unpacked(other_path) as other:
        for kind in ["cs", "me"]:
            wrong_order(fmu, kind)
            states(fmu, kind)
            memory(fmu, kind)
            unloading_stiffness(fmu, kind)
        with Spring(fmu, "cs", stop=1e-2) as s:
            s.step(1e-2)
            refuses(s, "step beyond the stop time", lambda: s.i.doStep(1e-2, 1e-3))
        if fmu.version == 2:
            input_derivatives(fmu)
        else:
            events(fmu)
        without_arguments(fmu)
        instances(fmu, other)
    print(json.dumps({"made": len(made), "failed": failed}))


if __name__ == "__main__":
    main(*sys.argv[1:])
