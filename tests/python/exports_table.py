"""Reads a model's table over speed and deflection: HDF5 by h5py, CSV by numpy."""

import json
import sys

import h5py
import numpy

with h5py.File(sys.argv[1]) as file:
    shape = list(file["force_N"].shape)
    speeds, deflections = len(file["speed_m_per_s"]), len(file["deflection_m"])
    assert isinstance(file.attrs["force_kind"], str)
    # Each row's work to its maximum crush, against the curve that crumple gives at that speed.
    curves = json.load(open(sys.argv[3]))
    deflection = file["deflection_m"][:]
    worst = 0.0
    for speed, end, row in zip(file["speed_m_per_s"], file["max_deflection_m"], file["force_N"]):
        own = next((c for c in curves if abs(c["speed_m_per_s"] / speed - 1) < 1e-9), None)
        if own:
            fine = numpy.unique(numpy.append(deflection[deflection < end], end))
            work = numpy.trapezoid(numpy.interp(fine, deflection, row), fine)
            energy = numpy.trapezoid(own["body_force_N"], own["deflection_m"])
            worst = max(worst, abs(work / energy - 1))
# The edges of each force's band, against those that crumple gives at a speed; where it gives none, no numbers.
worst_band, compared = 0.0, 0
for path, prefix in [(sys.argv[1], "body_"), (sys.argv[4], "")]:
    with h5py.File(path) as file:
        assert "band" in file.attrs
        deflection = file["deflection_m"][:]
        for k, (speed, end) in enumerate(zip(file["speed_m_per_s"], file["max_deflection_m"])):
            own = next((c for c in curves if abs(c["speed_m_per_s"] / speed - 1) < 1e-9), None)
            if own is None:
                continue
            for edge in ["force_low_N", "force_high_N"]:
                row = file[edge][k]
                if prefix + edge not in own:
                    assert numpy.isnan(row).all()
                    continue
                fine = deflection[deflection < end]
                edge_n = numpy.interp(fine, own["deflection_m"], own[prefix + edge])
                off = abs(row[: len(fine)] - edge_n).max()
                worst_band = max(worst_band, off / max(own[prefix + "force_high_N"]))
            compared += prefix + "force_low_N" in own
lines = [line for line in open(sys.argv[2]) if line[0].isdigit()]
table = numpy.loadtxt(lines, delimiter=",")
keep = abs(table[:, 0] - 50 / 3.6) < 1e-6
json.dump(
    {
        "shape": shape,
        "speeds": speeds,
        "deflections": deflections,
        "worst_energy": worst,
        "worst_band": worst_band,
        "compared_bands": compared,
        "at_50kmh": [table[keep, 1].tolist(), table[keep, 2].tolist()],
    },
    sys.stdout,
)
