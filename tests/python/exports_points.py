"""Reads the points of exported files, by clients where there are some.

    python exports_points.py CURVE.json FILE...

Prints, for each file, the largest difference of its force from the curve's body force at 200
deflections (linear, over the largest force), and the energy to the maximum crush over the curve's,
minus 1, as the points are interpolated linearly, by Akima's and by cubic splines.
"""

import json
import pathlib
import re
import sys

import numpy
from scipy.interpolate import Akima1DInterpolator, CubicSpline
from scipy.io import loadmat

NUMBER = re.compile(r"[-+]?\d\.\d+E[-+]\d\d")


def rows(lines):
    return numpy.array([[float(n) for n in NUMBER.findall(line)[:2]] for line in lines])


def ansys_dyna(path):
    """Curve of a deck by ansys-dyna-core, and what the deck holds."""
    from ansys.dyna.core import Deck

    deck = Deck()
    deck.loads(path.read_text())
    if deck.string_keywords:
        raise ValueError(f"{path.name}: not understood: {deck.string_keywords}")
    curve = next(k for k in deck.all_keywords if type(k).__name__ == "DefineCurve")
    return curve.curves[["a1", "o1"]].to_numpy(float)


def dynakw(path):
    from dynakw import DynaKeywordReader, KeywordType

    for keyword in DynaKeywordReader(str(path)).keywords():
        if keyword.type == KeywordType.DEFINE_CURVE:
            card = keyword.cards["Card 2"]
            return numpy.column_stack([card["A1"], card["O1"]])


def dynars(path):
    """Cards of the keyword as dynars splits them."""
    import dynars

    file = dynars.parse_keyword_file(str(path))
    names = file.block_names()
    at = next(i for i, name in enumerate(names) if name.startswith("DEFINE_CURVE"))
    cards = file.keyword(at)["cards"]
    return rows("".join(card) for card in cards[2:])


def after(path, start, stop=None):
    """The lines behind one that begins with `start`, to one that begins with `stop`."""
    lines = iter(path.read_text().splitlines())
    next(line for line in lines if line.startswith(start))
    found = []
    for line in lines:
        if stop and line.startswith(stop):
            break
        found.append(line)
    return found


def named(path, name):
    """Numbers of `x=` or `y=` of an Adams statement."""
    text = path.read_text()
    found = re.search(rf"\b{name}=((?:[-+\d.E,\s&]|\n,\s)*)", text)
    return [float(n) for n in NUMBER.findall(found.group(1))]


def points(path):
    """Deflection in m and force in N, by reader."""
    kind = path.suffix
    if kind == ".k":
        units = numpy.array([1e-3, 1.0])
        return {f"{path.name} {r.__name__}": r(path) * units for r in (ansys_dyna, dynakw, dynars)}
    if kind == ".csv":
        lines = [line for line in path.read_text().splitlines() if line[0].isdigit()]
        return {path.name: rows(lines)}
    if kind == ".rad":
        return {path.name: rows(after(path, "/FUNCT", "/PROP")[2:]) * [1e-3, 1.0]}
    if kind == ".inp":
        table = rows(after(path, "*SPRING", "*STEP")[1:])
        return {path.name: table[:, ::-1]}
    if kind in (".cmd", ".adm"):
        x, y = ("x", "y") if kind == ".cmd" else ("X", "Y")
        table = numpy.column_stack([named(path, x), named(path, y)])
        return {path.name: table * [1e-3, 1.0]}
    if kind == ".spr":
        return {path.name: rows(after(path, "{ disp")) * [1e-3, 1.0]}
    if kind == ".mat":
        return {f"{path.name} scipy": loadmat(path)["fd_load"]}
    if kind == ".txt":
        return {path.name: rows(after(path, "double fd_load", "double fd_unload"))}
    if kind == ".mo":
        text = path.read_text()
        array = lambda name: [
            float(n) for n in NUMBER.findall(re.search(rf"Real {name}\[\d+\] = {{(.*?)}}", text, re.S)[1])
        ]
        return {path.name: numpy.column_stack([array("d"), array("f")])}
    raise ValueError(f"{path}: no reader")


def in_compression(table):
    """Rising deflections, compression positive."""
    if table[numpy.argmax(abs(table[:, 1])), 1] < 0:
        table = -table
    return table[numpy.argsort(table[:, 0], kind="stable")]


curve = json.loads(pathlib.Path(sys.argv[1]).read_text())
deflection = numpy.array(curve["deflection_m"])
force = numpy.array(curve.get("body_force_N") or curve["force_N"])
end = curve["max_deflection_m"]
energy = numpy.trapezoid(force, deflection)
at = numpy.linspace(0, end, 200)
expected = numpy.interp(at, deflection, force)
found = {}
for file in sys.argv[2:]:
    for name, table in points(pathlib.Path(file)).items():
        x, y = in_compression(numpy.array(table, dtype=float)).T
        assert (numpy.diff(x) > 0).all(), f"{name}: equal abscissas"
        fine = numpy.unique(numpy.concatenate([numpy.linspace(0, end, 200_001), x[(x > 0) & (x < end)]]))
        ahead = numpy.linspace(min(x[0], 0), 0, 100_001)
        splines = (Akima1DInterpolator, CubicSpline)
        of = lambda values: numpy.trapezoid(values, fine) / energy - 1
        found[name] = {
            "force": float(abs(numpy.interp(at, x, y) - expected).max() / force.max()),
            "linear": float(of(numpy.interp(fine, x, y))),
            "akima": float(of(Akima1DInterpolator(x, y)(fine))),
            "cubic": float(of(CubicSpline(x, y)(fine))),
            "points": len(x),
            "beyond": float(x[-1] / end),
            "before": [float(abs(spline(x, y)(ahead)).max() / force.max()) for spline in splines],
            "over": [float(abs(spline(x, y)(fine) - numpy.interp(fine, x, y)).max() / force.max()) for spline in splines],
        }
json.dump(found, sys.stdout)
