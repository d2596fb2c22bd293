"""Holds what crumple reads of a binout against lasso-python, value by value.

    python binout.py CRUMPLE BINOUT…
"""

import json
import subprocess
import sys

import numpy as np
from lasso.dyna import Binout

# What a section says of itself, and what is not a result of an entity.
NOT_COMPARED = {"time", "cycle", "ids", "misc", "setid", "legend_ids", "side", "force_ids",
                "moment_ids", "spc_ids", "spc_mids", "factor_ids"}


def sections(binout, path=()):
    """Paths of the directories that hold arrays over states."""
    names = binout.read(*path)
    if "time" in names:
        yield path
        return
    for name in names:
        below = binout.read(*path, name)
        if isinstance(below, list) and all(isinstance(n, str) for n in below):
            # lasso lists the states of a section that has no values.
            if not (name.startswith("d") and name[1:].isdigit()):
                yield from sections(binout, (*path, name))


def crumple(program, path, section):
    """Histories of a section: component to array of states by entities."""
    run = [program, "histories", path, "--section", "/".join(section), "--json", "-q"]
    document = json.loads(subprocess.run(run, check=True, capture_output=True).stdout)
    columns = {}
    for history in document["histories"]:
        columns.setdefault(history["component"], []).append(history["values"])
    return np.array(document["time"]), {k: np.array(v, float).T for k, v in columns.items()}


def main(program, paths):
    compared = 0
    for path in paths:
        binout = Binout(path)
        for section in sections(binout):
            time, ours = crumple(program, path, section)
            assert np.array_equal(time, binout.read(*section, "time")), (path, section)
            for name in binout.read(*section):
                theirs = np.asarray(binout.read(*section, name))
                if name in NOT_COMPARED or theirs.dtype.kind not in "if" or theirs.shape[0] != len(time):
                    continue
                if theirs.size == 0:
                    continue
                mine = ours[name]
                theirs = theirs.reshape(mine.shape)
                assert np.array_equal(mine, theirs, equal_nan=True), (path, section, name)
                compared += theirs.size
    print(compared)


main(sys.argv[1], sys.argv[2:])
