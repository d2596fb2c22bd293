"""Reads a curve database with h5py, as schemas/curve_database.md says, and prints JSON."""

import json
import sys

import h5py

with h5py.File(sys.argv[1]) as database:
    cases = [
        {
            "group": group_name,
            "name": name,
            "speed_m_per_s": float(case.attrs["speed_m_per_s"]),
            "speed_kind": case.attrs["speed_kind"],
            "time_s": case["time_s"][:].tolist(),
            "deflection_m": case["deflection_m"][:].tolist(),
            "force_N": case["force_N"][:].tolist(),
            "original_force_N": case["original/force_N"][:].tolist(),
        }
        for group_name, group in database.items()
        for name, case in group.items()
    ]
    order = {name: list(group.attrs["cases"]) for name, group in database.items()}
print(json.dumps({"cases": cases, "order": order}))
