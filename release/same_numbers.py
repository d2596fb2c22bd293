"""Compares what several machines have computed: python same_numbers.py REFERENCE OTHER...

Bytes may differ where a processor's or a C library's functions do; numbers of the JSON and text files may by 1e-9 of the
larger, and by 1e-9 (of any unit) where both are small.
"""

import json
import pathlib
import re
import sys

NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def inside(value):
    """The numbers of a JSON document, in its order."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [number for item in value for number in inside(item)]
    return [value] if isinstance(value, (int, float)) else []


def numbers(path):
    text = path.read_text(errors="replace")
    return inside(json.loads(text)) if text.startswith("{") else [float(number) for number in NUMBER.findall(text)]


reference = pathlib.Path(sys.argv[1])
for other in map(pathlib.Path, sys.argv[2:]):
    for name in ("validation.json", "law.model", "p.csv", "p.k", "sweep.csv"):
        if (reference / name).read_bytes() == (other / name).read_bytes():
            continue
        a, b = numbers(reference / name), numbers(other / name)
        if name.endswith("model"):
            head = [json.loads((folder / name).read_text())["training_hash"] for folder in (reference, other)]
            assert head[0] == head[1], f"{other / name}: trained on another data set"
        assert len(a) == len(b), f"{other / name}: {len(b)} numbers, {len(a)} expected"
        pairs = [(x, y) for x, y in zip(a, b) if x != y]
        worst = max((abs(x - y) / max(abs(x), abs(y), 1.0) for x, y in pairs), default=0.0)
        print(f"{other.name}/{name}: {len(pairs)} of {len(a)} numbers differ, by at most {worst:.1e}")
        assert worst < 1e-9, "more than functions of another C library may do"
