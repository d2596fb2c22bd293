"""Measures the readers in one run and prints a table of ratios; started by benches/readers.

CPU time, user and system, of a process of its own each time (of libraries: of the reading
alone, without their start), the smallest of several runs that take turns. Machines are
shared and noisy: compare ratios, not times.
"""

import ctypes
import json
import mmap
import os
import subprocess
import sys
import time

ROUNDS = 5
COMPONENTS = [f"{axis}_{kind}" for kind in ("displacement", "velocity", "acceleration", "coordinate") for axis in "xyz"]
IN_PYTHON = """
import resource, sys
{setup}
def cpu():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime
best = None
for _ in range({repeat}):
    start = cpu()
    {work}
    best = min(cpu() - start, best or 1e9)
print(best)
"""


class Run:
    """One process: CPU and wall time in seconds, peak memory in MiB."""

    def __init__(self, *arguments, cpu=None):
        start = time.perf_counter()
        child = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        self.output = child.stdout.read().decode()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode:
            raise RuntimeError(f"{arguments} failed")
        # Of a reading that is only a part of its process there is none.
        self.wall = None if cpu else time.perf_counter() - start
        self.cpu = usage.ru_utime + usage.ru_stime if cpu is None else cpu(self.output)
        self.memory = usage.ru_maxrss / 1024


def python(setup, work, repeat=3):
    code = IN_PYTHON.format(setup=setup, work=work, repeat=repeat)
    return lambda: Run(sys.executable, "-c", code, cpu=float)


def crumple(program, *arguments, output=None):
    def run():
        if output and os.path.exists(output):
            os.remove(output)
        return Run(program, *arguments)

    return run


def library():
    """Reads a file into memory with crumple, in a process of its own."""
    built = subprocess.run(
        ["cargo", "bench", "--locked", "--bench", "readers", "--no-run", "--message-format", "json"],
        check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    messages = [json.loads(line) for line in built.stdout.splitlines() if line.startswith("{")]
    program = next(m["executable"] for m in messages
                   if m.get("executable") and m["target"]["name"] == "readers")

    def smallest(output):
        return min(float(line.split()[0]) for line in output.splitlines())

    return lambda *arguments: lambda: Run(program, *arguments, cpu=smallest)


def pages(path, arguments):
    """Share of a file's pages that are in memory after a run that began with none of them."""
    size = os.path.getsize(path)
    with open(path, "r+b") as file:
        os.fsync(file.fileno())
        os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
        Run(*arguments)
        libc = ctypes.CDLL(None, use_errno=True)
        with mmap.mmap(file.fileno(), 0) as mapped:
            address = ctypes.addressof(ctypes.c_char.from_buffer(mapped))
            count = -(-size // mmap.PAGESIZE)
            resident = (ctypes.c_ubyte * count)()
            if libc.mincore(ctypes.c_void_p(address), ctypes.c_size_t(size), resident):
                raise OSError(ctypes.get_errno(), "mincore")
            return sum(page & 1 for page in resident) / count


def best(runs):
    """Runs take turns, so that a slow minute slows all of them."""
    results = {name: None for name in runs}
    for _ in range(ROUNDS):
        for name, run in runs.items():
            result = run()
            if results[name] is None or result.cpu < results[name].cpu:
                results[name] = result
    return results


def table(title, reference, results):
    """Peak memory is that of the whole process, with the mapped pages of the file."""
    print(f"\n{title}\n{'':42} {'CPU':>9} {'ratio':>8} {'memory':>9} {'wall':>9}")
    for name, run in results.items():
        ratio = run.cpu / results[reference].cpu
        wall = f"{run.wall:7.3f} s" if run.wall is not None else f"{'-':>9}"
        print(f"{name:42} {run.cpu:7.3f} s {ratio:7.2f}x {run.memory:5.0f} MiB {wall}")


def main(folder, program):
    nodout, small, binout = (os.path.join(folder, name) for name in ("nodout", "nodout_small", "binout0000"))
    hdf5 = os.path.join(folder, "out.h5")
    full = crumple(program, "histories", nodout, "-o", hdf5, output=hdf5)
    mapped = crumple(program, "histories", nodout, "-o", hdf5, "--map", output=hdf5)
    nodes = [word for k in range(10) for word in ("--id", str(1_006_001 + 3 * k))]
    ten = [program, "histories", nodout, *nodes]
    table("nodout, 5 000 nodes x 400 states, 310 MB", "wc -l", best({
        "wc -l": lambda: Run("wc", "-l", nodout),
        "crumple: all into HDF5": full,
        "crumple: all into HDF5, --map": mapped,
        "crumple: inspect (every field checked)": crumple(program, "inspect", nodout),
        "crumple: 10 nodes as CSV": crumple(*ten),
    }))
    share = pages(nodout, ten)
    print(f"pages of the file touched for 10 nodes: {share:.2%}")

    wide = [(0, 10)] + [(10 + 12 * k, 22 + 12 * k) for k in range(12)]
    fields = ", ".join(f"pl.col('line').str.slice({a}, {b - a}).str.strip_chars().cast(pl.Float64).alias('c{k}')"
                       for k, (a, b) in enumerate(wide))
    def in_polars(path):
        return python(
            "import polars as pl",
            f"pl.read_csv({path!r}, has_header=False, separator='\\x01', quote_char=None, new_columns=['line'])"
            f".filter(pl.col('line').str.len_bytes() == 154).filter(pl.col('line').str.starts_with('  1'))"
            f".select({fields})", repeat=1)

    def from_python(path):
        return python("import crumple", f"crumple.read({path!r})", repeat=1)

    pandas = python(
        "import pandas as pd",
        f"pd.read_fwf({small!r}, colspecs={wide!r}, header=None, skiprows=2)", repeat=1)
    read = library()
    table("nodout, 5 000 nodes x 40 states, 31 MB, into memory", "crumple", best({
        "crumple": read(small), "crumple.read in Python": from_python(small),
        "polars: slices of lines": in_polars(small), "pandas.read_fwf": pandas}))
    table("nodout, 310 MB, into memory from Python", "crumple.read in Python", best({
        "crumple.read in Python": from_python(nodout), "polars: slices of lines": in_polars(nodout)}))

    table("binout, the same values in single precision, 96 MB, 12 channels into memory", "dynars", best({
        "crumple": read(binout, "nodout"),
        "crumple.read in Python": python("import crumple", f"crumple.read({binout!r}, section='nodout')"),
        "dynars": python("from dynars import Binout",
                         f"b = Binout({binout!r}); r = [b.read('nodout', n) for n in {COMPONENTS!r}]; del b, r", 5),
        "lasso-python": python("from lasso.dyna import Binout",
                               f"b = Binout({binout!r}); r = [b.read('nodout', n) for n in {COMPONENTS!r}]; del b, r", 1),
    }))
    one = ["--section", "nodout", "--id", "1006001"]
    table("binout, 12 channels of one node", "dynars", best({
        "crumple (with its start)": crumple(program, "histories", binout, *one),
        "dynars": python("from dynars import Binout",
                         f"b = Binout({binout!r}); r = [b.read('nodout', n, id=1006001) for n in {COMPONENTS!r}]", 5),
    }))


def check(folder):
    """What crumple.read gives in Python is what dynars reads of a binout, and what the file says of a nodout."""
    import crumple
    import numpy as np
    from dynars import Binout

    binout, small = os.path.join(folder, "binout0000"), os.path.join(folder, "nodout_small")
    ours, theirs = crumple.read(binout, section="nodout").only(), Binout(binout)
    for name in COMPONENTS:
        assert np.array_equal(ours[name].array, theirs.read("nodout", name)), name
    ours = crumple.read(small).only()
    with open(small) as lines:
        rows = [line for line in lines if len(line) == 155 and line.startswith("  1")]
    for k, name in enumerate(COMPONENTS):
        fields = np.array([float(line[10 + 12 * k : 22 + 12 * k]) for line in rows])
        assert np.array_equal(ours[name].array.ravel(), fields), name
    print("crumple.read in Python: values equal to those of dynars and of the file")


main(*sys.argv[1:])
check(sys.argv[1])
