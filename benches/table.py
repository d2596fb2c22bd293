"""Measures in one run reading and conversion, the commands on the bundled runs and a clean build, and prints a table; started
by benches/table.

CPU time, user and system, of a process of its own, the smallest of several runs that take turns, its ratio to
`wc -l` of the same file, and peak memory. Machines are shared and noisy: compare ratios, not times.
"""

import os
import shutil
import subprocess
import sys

ROUNDS = 5
ONE = {"nodout": ("--id", "1006001"), "rcforc": ("--id", "1050"), "elout": ("--id", "1100"), "matsum": ("--id", "60"),
       "glstat": ("--component", "kinetic_energy")}


def run(arguments):
    """CPU seconds and peak memory in MiB."""
    with open(os.devnull, "w") as nothing:
        child = subprocess.Popen(arguments, stdout=nothing, stderr=nothing)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise RuntimeError(f"{arguments} failed")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main(folder, program):
    out = os.path.join(folder, "out")
    print(f"{'work':34} {'CPU':>9} {'ratio':>8} {'memory':>9}")
    for name in [*ONE, "binout0000"]:
        path = os.path.join(folder, name)
        histories = [program, "histories", path]
        works = {"wc -l": ["wc", "-l", path], "HDF5": [*histories, "-o", out + ".h5"],
                 "HDF5, --f32": [*histories, "-o", out + ".h5", "--f32"]}
        if name in ONE:
            works |= {"CSV": [*histories, "-o", out + ".csv"], "one of it as CSV": [*histories, *ONE[name]],
                      "inspect": [program, "inspect", path]}
        else:
            node = [*histories, "--section", "nodout", "--id", "1006001"]
            works |= {"one node": node, "one channel of it": [*node, "--component", "x_velocity"]}
        best = {}
        for _ in range(ROUNDS):
            for work, arguments in works.items():
                best[work] = min(best.get(work, (1e9, 0)), run(arguments))
        size = os.path.getsize(path) / 1e6
        for work, (cpu, memory) in best.items():
            title = f"{name}, {size:.0f} MB: {work}"
            print(f"{title:34} {cpu:7.3f} s {cpu / best['wc -l'][0]:7.1f}x {memory:5.0f} MiB", flush=True)


def commands(folder, program):
    """The commands on the bundled runs: what starting costs, models and comparing."""
    demo = os.path.join(folder, "crumple-demo")
    shutil.rmtree(demo, ignore_errors=True)
    run([program, "--quiet", "demo", "-o", demo])
    database, curve = os.path.join(demo, "curves.h5"), os.path.join(folder, "out.csv")
    works = {"--version": ["--version"], "validate": ["validate", database],
             "compare of one group": ["compare", database, "--group", "lead-car-wall"]}
    for kind in ("linear", "crush-law", "forest", "extra"):
        model = os.path.join(folder, kind + ".model")
        train = ["train", database, "--group", "lead-car-wall", "--model", kind, "-o", model]
        works |= {f"train --model {kind}": train, f"predict by {kind}": ["predict", model, "--speed", "50km/h", "-o", curve]}
    print(f"\n{'bundled runs':34} {'CPU':>9} {'memory':>9}")
    for work, arguments in works.items():
        cpu, memory = min(run([program, *arguments]) for _ in range(ROUNDS))
        print(f"{work:34} {cpu:7.3f} s {memory:5.0f} MiB", flush=True)
    size = os.path.getsize(os.path.join(folder, "extra.model")) / 1e6
    print(f"the file of the model extra: {size:.1f} MB")


def clean_build(folder):
    """The program and all that it depends on, from nothing."""
    target = os.path.join(folder, "clean")
    shutil.rmtree(target, ignore_errors=True)
    cpu, memory = run(["cargo", "build", "--release", "--locked", "--target-dir", target])
    shutil.rmtree(target)
    print(f"\nclean build: {cpu:.0f} s of CPU time, {memory:.0f} MiB in its largest process")


if sys.argv[1] == "clean-build":
    clean_build(sys.argv[2])
else:
    main(*sys.argv[1:])
    commands(*sys.argv[1:])
