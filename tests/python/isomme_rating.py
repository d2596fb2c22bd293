"""Rates pairs of CSV files by pyisomme's ISO/TS 18571.

Arguments: a JSON list of [reference.csv, prediction.csv, column]. Prints a list of ratings, in
the same order. The channels are made of 10 kHz from time 0, as test laboratories deliver them:
pyisomme compares channels at the times they share, and FE histories share few.
"""

import csv
import json
import sys

import numpy as np
import pandas as pd
from pyisomme import Channel, Code
from pyisomme.correlation import Correlation_ISO18571


INTERVAL = 1e-4


def channel(path, column):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    index = rows[0].index(column)
    table = np.array([[float(row[0]), float(row[index])] for row in rows[1:]])
    time = INTERVAL * np.arange(int(np.floor(table[-1, 0] / INTERVAL + 1e-6)) + 1)
    values = np.interp(time, table[:, 0], table[:, 1])
    return Channel(code=Code("11VEHCCG0000VEXP"), data=pd.DataFrame(values, index=time), unit="m/s")


def rating(reference, prediction, column):
    rated = Correlation_ISO18571(channel(reference, column), channel(prediction, column))
    return {
        "corridor": rated.corridor_rating(-1),
        "phase": rated.phase_rating(-1),
        "magnitude": rated.magnitude_rating(-1),
        "slope": rated.slope_rating(-1),
        "rating": rated.overall_rating(-1),
    }


json.dump([rating(*pair) for pair in json.loads(sys.argv[1])], sys.stdout, default=float)
