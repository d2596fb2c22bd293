"""Reads a model's table over speed and deflection: HDF5 by h5py, CSV by numpy."""

import json
import sys

import h5py
import numpy

with h5py.File(sys.argv[1]) as file:
    shape = list(file["force_N"].shape)
    speeds, deflections = len(file["speed_m_per_s"]), len(file["deflection_m"])
    assert isinstance(file.attrs["force_kind"], str)
lines = [line for line in open(sys.argv[2]) if line[0].isdigit()]
table = numpy.loadtxt(lines, delimiter=",")
keep = abs(table[:, 0] - 50 / 3.6) < 1e-6
json.dump(
    {
        "shape": shape,
        "speeds": speeds,
        "deflections": deflections,
        "at_50kmh": [table[keep, 1].tolist(), table[keep, 2].tolist()],
    },
    sys.stdout,
)
