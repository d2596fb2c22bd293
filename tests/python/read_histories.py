"""Reads histories written as HDF5 with h5py and prints JSON."""

import json
import sys

import h5py

with h5py.File(sys.argv[1]) as file:
    print(
        json.dumps(
            {
                "time": file["time"][:].tolist(),
                "components": {
                    name: {"values": data[:].tolist(), "ids": data.attrs["ids"].tolist()}
                    for name, data in file.items()
                    if name != "time"
                },
            }
        )
    )
