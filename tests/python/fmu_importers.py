"""Whether importers take an FMU and get the same forces from it.

    python fmu_importers.py FMU

FMPy validates it, simulates it by co-simulation and model exchange, and again after compiling its
sources; fmutool checks it; libcosim (FMI 2) and Ecos step it. Prints a JSON object: what was done and
what failed.
"""

import contextlib
import ctypes
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import fmpy
import numpy
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu

BIN = pathlib.Path(sys.executable).parent
STEP_S = 1e-3
CRUSH_M = 0.5
done, failed = {}, []


def check(what, is_right, seen=True):
    done[what] = seen
    if not is_right:
        failed.append(f"{what}: {seen}")


def simulate(fmu, kind, step_s=STEP_S):
    """Forces at every step, along a deflection that grows and falls."""
    times = numpy.arange(0, 0.1001, STEP_S)
    motion = CRUSH_M * numpy.sin(numpy.pi * times / 0.1)
    signal = numpy.array(list(zip(times, motion)), dtype=[("time", float), ("deflection", float)])
    more = {"solver": "Euler", "step_size": step_s} if kind == "ModelExchange" else {}
    result = fmpy.simulate_fmu(
        fmu, fmi_type=kind, stop_time=0.1, output_interval=step_s, input=signal,
        output=["force", "stored_energy", "dissipated_energy", "max_deflection"],
        record_events=False, **more
    )
    return numpy.array([list(row) for row in result])


def with_fmpy(path, folder):
    problems = validate_fmu(path)
    check("FMPy validates", not problems, problems or True)
    before = {}
    for kind in ["CoSimulation", "ModelExchange"]:
        rows = simulate(path, kind)
        before[kind] = rows
        forces = rows[:, 1]
        is_right = len(rows) == 101 and forces.max() > 1e5 and forces[-1] == 0.0
        check(f"FMPy simulates {kind}", is_right, [len(rows), forces.max(), rows[-1, 4]])
    # The same FMU, with a library compiled from its own sources in place of ours.
    unpacked = folder / "unpacked"
    fmpy.extract(path, unpacked)
    ours = next(unpacked.glob("binaries/*linux*/*.so"))
    old = ours.read_bytes()
    shutil.rmtree(unpacked / "binaries")
    os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
    build_platform_binary(unpacked, generator="Ninja", all_warnings=True)
    check("FMPy compiles the sources", ours.read_bytes() != old)
    for kind in ["CoSimulation", "ModelExchange"]:
        check(f"{kind} of the sources", numpy.array_equal(simulate(unpacked, kind), before[kind]))


def with_fmutool(path):
    run = subprocess.run([BIN / "fmutool", "-input", path, "-check"], capture_output=True, text=True)
    text = run.stdout + run.stderr
    said = [line for line in text.splitlines() if "compliant" in line or "semantic" in line]
    is_right = run.returncode == 0 and len(said) >= 2 and "ERROR" not in text
    check("fmutool -check", is_right, said or text)


def expected_force(path, steps, deflection):
    """Of FMPy's own call of the FMU, after so many steps with that deflection."""
    from fmu_spring import Spring, Unpacked

    with Unpacked(path) as fmu, Spring(fmu, "cs") as spring:
        for _ in range(steps):
            spring.set(deflection)
            spring.step(STEP_S)
        return spring.get("force")


def with_libcosim(path):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(step_size=round(STEP_S * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=path, instance_name="spring"))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    manipulator = CosimManipulator.create_override()
    execution.add_manipulator(manipulator)
    manipulator.slave_real_values(slave, [1], [0.3])
    is_stepped = execution.step(10)
    force = observer.last_real_values(slave, [3])[0]
    check("libcosim steps", is_stepped and force == expected_force(path, 10, 0.3), force)


def with_ecos(path):
    # Ecos needs it; the package tbb brings it, where no loader looks.
    for library in (BIN.parent / "lib").glob("libtbb.so.12"):
        ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    structure.add_model("spring", path)
    structure.add_parameter_set("start", {"spring::deflection": 0.3})
    with EcosSimulation(structure=structure, step_size=STEP_S) as simulation:
        simulation.init(parameter_set="start")
        simulation.step(10)
        force = simulation.get_real("spring::force")
        simulation.terminate()
    check("Ecos steps", force == expected_force(path, 10, 0.3), force)


def main(path):
    # What clients print must not come between us and our reader.
    with contextlib.redirect_stdout(sys.stderr), tempfile.TemporaryDirectory() as folder:
        output = os.dup(1)
        os.dup2(2, 1)
        with_fmpy(path, pathlib.Path(folder))
        with_fmutool(path)
        if fmpy.read_model_description(path).fmiVersion == "2.0":
            with_libcosim(path)
        with_ecos(path)
        sys.stdout.flush()
        os.dup2(output, 1)
    print(json.dumps({"done": done, "failed": failed}, default=str))


if __name__ == "__main__":
    main(sys.argv[1])
