"""Rates pairs of CSV files: ISO/TS 18571 by objective-rating-metrics, the rest by numpy.

Arguments: a JSON list of [reference.csv, prediction.csv, column, from_s, to_s, cfc]; from_s, to_s
and cfc may be null. Prints a list of measures, in the same order.

No public package was found that computes CORA (pyisomme 1.1.0 has only ISO/TS 18571, which it
takes from objective-rating-metrics), so CORA stands here once more, from the paper and by another
way than in crumple: correlations of all shifts at once by numpy.correlate, energies by running sums.
"""

import csv
import json
import sys

import numpy as np
from objective_rating_metrics.rating import ISO18571
from scipy.signal import filtfilt

INTERVAL = 1e-4


def read(path, column):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    index = rows[0].index(column)
    table = np.array([[float(row[0]), float(row[index])] for row in rows[1:]])
    return table[:, 0], table[:, 1]


def cfc(time, values, frequency):
    """SAE J211 by scipy's own forward and backward filter, which pads by point reflection too."""
    interval = (time[-1] - time[0]) / (len(time) - 1)
    wa = np.tan(2 * np.pi * frequency * 2.0775 * interval / 2)
    scale = 1 + np.sqrt(2) * wa + wa**2
    b = np.array([1, 2, 1]) * wa**2 / scale
    a = np.array([1, 2 * (wa**2 - 1) / scale, (1 - np.sqrt(2) * wa + wa**2) / scale])
    pad = min(max(round(0.01 / interval), 100), len(values) - 1)
    return filtfilt(b, a, values, padtype="odd", padlen=pad)


def common(a, b, start, end):
    first = max(a[0][0], b[0][0], -np.inf if start is None else start)
    last = min(a[0][-1], b[0][-1], np.inf if end is None else end)
    count = int(np.floor((last - first) / INTERVAL + 1e-6)) + 1
    time = first + INTERVAL * np.arange(count)
    return time, np.interp(time, *a), np.interp(time, *b)


def iso18571(time, r, p):
    rated = ISO18571(np.column_stack([time, r]), np.column_stack([time, p]))
    return {
        "corridor": rated.corridor_rating(-1),
        "phase": rated.phase_rating(-1),
        "magnitude": rated.magnitude_rating(-1),
        "slope": rated.slope_rating(-1),
        "rating": rated.overall_rating(-1),
    }


def cora(r, p):
    n = len(r)
    distance = abs(p - r) / max(abs(r))
    corridor = np.mean(np.clip((0.5 - distance) / (0.5 - 0.05), 0, 1) ** 2)
    # Element n - 1 + m: the prediction is m samples late.
    products = np.correlate(p, r, "full")
    energy_r, energy_p = (np.concatenate([[0], np.cumsum(x**2)]) for x in (r, p))
    best = None
    # Of equal correlations the smallest shift, late before early: a signal and its opposite
    # correlate the same way in both directions.
    for m in sorted(range(-(n // 5), n // 5 + 1), key=lambda m: (abs(m), -m)):
        of_r = energy_r[n - m] if m >= 0 else energy_r[n] - energy_r[-m]
        of_p = energy_p[n] - energy_p[m] if m >= 0 else energy_p[n + m]
        correlation = products[n - 1 + m] / np.sqrt(of_r * of_p)
        if best is None or correlation > best[0] + 1e-12:
            best = correlation, m, min(of_r, of_p) / max(of_r, of_p)
    correlation, m, size = best
    progression = (0.5 * (correlation + 1)) ** 10
    phase = np.clip((0.12 - abs(m) / (n - 1)) / (0.12 - 0.01), 0, 1)
    cross_correlation = 0.5 * progression + 0.25 * size + 0.25 * phase
    return {
        "corridor": corridor,
        "progression": progression,
        "size": size,
        "phase": phase,
        "cross_correlation": cross_correlation,
        "rating": (corridor + cross_correlation) / 2,
        "late_s": m * INTERVAL,
    }


def magnitude_phase(r, p):
    # The inverse cosine of the definition loses half of the digits near 1: tangent, then, of the
    # part of p that stands on r over the part along it.
    across = np.linalg.norm(p - r * (r @ p) / (r @ r))
    phase = np.arctan2(across * np.linalg.norm(r), r @ p) / np.pi
    geers = np.sqrt((p @ p) / (r @ r)) - 1
    m = (p @ p - r @ r) / np.sqrt((p @ p) * (r @ r))
    russell = np.sign(m) * np.log10(1 + abs(m))
    both = lambda m, factor: {
        "magnitude": m,
        "phase": phase,
        "combined": np.sqrt(factor * (m**2 + phase**2)),
    }
    return both(geers, 1), both(russell, np.pi / 4)


def measures(reference, prediction, column, start, end, frequency):
    signals = [read(path, column) for path in (reference, prediction)]
    if frequency:
        signals = [(time, cfc(time, values, frequency)) for time, values in signals]
    time, r, p = common(*signals, start, end)
    large = abs(r) >= 0.05 * max(abs(r))
    sprague_geers, russell = magnitude_phase(r, p)
    return {
        "samples": len(time),
        "l1_ratio": np.sum(abs(p - r)) / np.sum(abs(r)),
        "rms_ratio": np.linalg.norm(p - r) / np.linalg.norm(r),
        "peak_norm": np.mean(abs(p - r)) / max(abs(r)),
        "pointwise": {
            "mean": np.mean(abs(p - r)[large] / abs(r)[large]),
            "left_out": 1 - np.mean(large),
        },
        "max_abs": {"value": max(abs(p - r))},
        "sprague_geers": sprague_geers,
        "russell": russell,
        "iso18571": iso18571(time, r, p),
        "cora": cora(r, p),
    }


json.dump([measures(*pair) for pair in json.loads(sys.argv[1])], sys.stdout, default=float)
