"""Writes and reads MDF files with asammdf.

    mdf.py write FOLDER CURVE.csv    CURVE as a test department's tool would save it, in many ways
    mdf.py read FILE                 channels with unit, number of samples, first and last value, as JSON
"""

import json
import sys

import numpy as np
from asammdf import MDF, Signal

# Version, compression, how it is encoded.
WAYS = [
    ("4.10", 0, "double"),
    ("4.10", 1, "double"),
    ("4.10", 2, "double"),
    ("4.20", 2, "single"),
    ("4.11", 2, "integers"),
    ("4.10", 1, "millimetres"),
    ("4.10", 1, "big"),
]


def signals(how, time, deflection, force):
    if how == "integers":
        # mm = 0.1 raw + 5
        raw = np.round((1e3 * deflection - 5.0) / 0.1).astype("<i2")
        return [
            Signal(raw, time, name="Weg", unit="mm", conversion={"a": 0.1, "b": 5.0}),
            Signal((force / 1e3).astype("<f4"), time, name="Kraft", unit="kN"),
        ]
    if how == "millimetres":
        return [Signal(1e3 * deflection, time, name="crush", unit="mm"), Signal(force / 1e3, time, name="load", unit="kN")]
    kind = {"double": "<f8", "single": "<f4", "big": ">f8"}[how]
    return [
        Signal(deflection.astype(kind), time, name="crush", unit="m"),
        Signal(np.round(force).astype(kind), time, name="load", unit="N"),
    ]


def write(folder, curve):
    time, deflection, force = np.loadtxt(curve, delimiter=",", skiprows=1).T
    for k, (version, compression, how) in enumerate(WAYS):
        file = MDF(version=version)
        file.append(signals(how, time, deflection, force), comment="test 17", common_timebase=True)
        other = np.arange(10.0)
        file.append([Signal(other, other, name="temperature", unit="C")])
        file.save(f"{folder}/way{k}.mf4", overwrite=True, compression=compression)
    # Several groups with a curve, and one that is not a curve.
    file = MDF(version="4.10")
    for share in (1.0, 0.5):
        file.append(signals("double", time, deflection, share * force), common_timebase=True)
    file.save(f"{folder}/two.mf4", overwrite=True)
    file = MDF(version="4.10")
    for name, unit, values in (("Displacement", "m", deflection), ("Force", "N", force)):
        file.append([Signal(values, time, name=name, unit=unit)])
    file.save(f"{folder}/apart.mf4", overwrite=True)
    file = MDF(version="4.10")
    file.append([Signal(np.arange(10.0), np.arange(10.0), name="temperature", unit="C")])
    file.save(f"{folder}/none.mf4", overwrite=True)
    # Every tenth force is marked as invalid, and wrong; arrays; conversions by a table; a comment like our facts.
    bad = np.arange(len(time)) % 10 == 5
    file = MDF(version="4.10")
    marked = Signal(np.where(bad, 0.0, force), time, name="load", unit="N", invalidation_bits=bad)
    file.append([Signal(deflection, time, name="crush", unit="m"), marked], common_timebase=True)
    file.header.comment = "force_kind: both & more"
    file.save(f"{folder}/marked.mf4", overwrite=True)
    for name, force_of in [
        ("table", Signal(np.arange(len(time), dtype="u2"), time, name="load", unit="N",
                         conversion={"raw_0": 0.0, "phys_0": 0.0, "raw_1": 400.0, "phys_1": 4e6})),
        ("array", Signal(np.array(list(zip(np.stack([force] * 3, axis=1))), dtype=[("load", "<f8", (3,))]), time, name="load", unit="N")),
    ]:
        file = MDF(version="4.10")
        file.append([Signal(deflection, time, name="crush", unit="m"), force_of], common_timebase=True)
        file.save(f"{folder}/{name}.mf4", overwrite=True)
    MDF(version="3.30").save(f"{folder}/old.mdf", overwrite=True)
    print(json.dumps([" ".join(map(str, way)) for way in WAYS]))


def read(path):
    with MDF(path) as file:
        found = {"comment": file.header.comment, "version": file.version, "channels": {}}
        for name in file.channels_db:
            signal = file.get(name)
            ends = [float(signal.samples[0]), float(signal.samples[-1])]
            times = [float(signal.timestamps[0]), float(signal.timestamps[-1])]
            peak = float(signal.samples.max())
            found["channels"][name] = [signal.unit, len(signal.samples), times, ends, peak]
    print(json.dumps(found))


{"write": write, "read": read}[sys.argv[1]](*sys.argv[2:])
