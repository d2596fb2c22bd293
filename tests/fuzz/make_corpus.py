"""Writes the corpus of the fuzz targets: a few small, valid files for each of them.

    python3 tests/fuzz/make_corpus.py FOLDER

Every file is as the solver (or its converter l2a) writes it, so that mutations start from
where the readers' branches are. Layouts: fixed columns as in the readers' own constants.
"""

import json
import pathlib
import struct
import sys

HEAD = " title".ljust(73) + "\n" + " " * 20 + "ls-dyna smp d R14 R14.0_515_8a12796 date 12/12/2022\n"
LEGEND = "\n{BEGIN LEGEND}\n Entity #        Title\n        7     seven\n{END LEGEND}\n"
TIMES = ["0.00000E+00", "1.00000E-03", "2.00000E-03"]


def e(width, text="1.50000E+00", n=1):
    return text.rjust(width) * n


def nodout():
    out = HEAD + LEGEND
    for cycle, time in enumerate(["0.0000000E+00", "1.0000000E-03", "2.0000000E-03", "3.0000000E-03"]):
        state = (" n o d a l   p r i n t   o u t   f o r   t i m e  s t e p%8d" % cycle
                 + " " * 30 + "( at time %s )\n\n" % time)
        out += "\n\n\n" + state + " nodal point  x-disp     y-disp      z-disp\n"
        for node in (1, 7):
            out += "%9d %s\n" % (node, e(12, "-1.50000E+00", 12))
        out += "\n\n\n" + state + " nodal point  x-rot      y-rot       z-rot\n"
        out += "%9d %s\n" % (7, e(12, "-1.5000-101", 9))
    return out


def rcforc():
    out = HEAD
    for time in TIMES:
        out += " interface number,     10001,is single surface-resultants are undefined\n" * 2
        for side in ("slave ", "SURFB "):
            out += "  %s%11d time%s" % (side, 7, e(12, time))
            out += "".join("  %s %s" % (axis, e(12)) for axis in "xyz") + " mass " + e(12)
            out += "".join("  m%s %s" % (axis, e(12)) for axis in "xyz")
            out += "  tied %10d  tied area %s\n" % (9, e(12))
    return out


def rwforc():
    out = HEAD + "    time       wall#   normal-force    x-force        y-force        z-force\n"
    for time in TIMES:
        for wall in (1, 7):
            out += "%s%8d%s\n" % (e(12, time), wall, e(15, "1.500000E+06", 4))
    return out


def secforc():
    out = HEAD + " line#1  section#   time\n line#2  resultant\n line#3  centroids\n"
    for time in TIMES:
        out += "%12d%s%s%s\n" % (1, e(15, time), e(15, "1.0000E+00"), e(12, "1.0000E+00", 3))
        out += ("              global system".ljust(27) + e(15, "1.0000E+00") + e(12, "1.0000E+00", 3) + "\n")
        out += " " * 27 + e(15, "1.0000E+00") + e(12, "1.0000E+00", 3) + "\n\n"
    return out


def glstat():
    out = HEAD
    for cycle, time in enumerate(TIMES):
        out += "\n\n dt of cycle%8d is controlled by shell\n\n" % cycle
        for label, value in (("time", time), ("kinetic energy", "1.50000E+00"),
                             ("stonewall energy", "2.50000E+00"), ("total energy", "3.50000E+00")):
            out += " " + label.ljust(31, ".") + e(14, value) + (" wall# 1" if "wall" in label else "") + "\n"
    return out


def matsum():
    out = HEAD + LEGEND
    for time in TIMES:
        out += "\n\n time =%s\n" % e(13, time)
        number = e(13, "1.0000E+00")
        out += " mat.#=%5d             inten=%s     kinen=%s     eroded_ie=%s     eroded_ke=%s\n" % (7, number, number, number, number)
        out += " x-mom=%s y-mom=%s z-mom=%s\n x-rbv=%s y-rbv=%s z-rbv=%s\n" % ((number,) * 6)
        out += " " * 25 + "hgeng=%s     +mass=%s     eroded_he=%s\n" % (number, number, number)
    return out


def spcforc():
    out = HEAD + " single point constraint forces\n\n"
    for time in TIMES:
        out += " output at time =%s\n" % e(14, time)
        three = e(14, "1.5000E+00", 3)
        out += " node=%6d local x,y,z forces =%s  setid=%8d\n" % (7, three, 1)
        out += " node=%6d local x,y,z moments=%s  setid=%8d\n" % (7, three, 1)
        out += "             force resultants   =%s\n" % three
    return out


def node_forces(state, headings, marks):
    out = HEAD
    number = e(13, "1.5000E+00")
    for time in TIMES:
        for heading, mark in zip(headings, marks):
            out += "\n" + state + "%s\n\n %s\n\n" % (e(14, time), heading)
            out += " %s%8d  xforce=%s   yforce=%s  zforce=%s   energy=%s" % (mark, 7, number, number, number, number)
            out += "   setid =%8d xmoment=%s ymoment=%s zmoment=%s\n" % (7, number, number, number)
            out += "              xtotal=%s   ytotal=%s  ztotal=%s   etotal=%s\n" % (number, number, number, number)
    return out


def bndout():
    return node_forces(" n o d a l   f o r c e/e n e r g y    o u t p u t  t=",
                       ["velocity boundary condition forces/rigid body moments ",
                        "pressure boundary condition forces "], ["nd#", "mat#"])


def nodfor():
    return node_forces(" n o d a l   f o r c e   g r o u p    o u t p u t   t=",
                       ["nodal group output number  1", "nodal group output number  2"], ["nd#", "nd#"])


def sleout():
    out = HEAD
    for time in ("0.0000000E+00", "0.1000000E-02"):
        out += " contact interface energy file, time=%s\n" % e(14, time)
        out += "    #             slave       master       cycle=             1    frictional\n\n"
        out += "%10d%s%s%s\n" % (7, e(13, "1.0000E+00", 2), " " * 28, e(13, "0.1286E-23"))
        out += "\n summary   total slave side=%s\n" % e(14, "1.0000000E+00")
        for label in ("total mastr side=", "total energy    =", "friction energy ="):
            out += "           %s%s\n" % (label, e(14, "1.0000000E+00"))
    return out


def swforc():
    out = HEAD
    for time in TIMES:
        out += "\n constraint #      axial        shear         time  failure\n"
        for kind in ("spotweld beam  ID", "constraint/weld  ID"):
            head = "%11d%s%s  0.00+00    %s" % (1, e(13, "1.50000E+00", 2), e(13, time), kind)
            out += head + "7".rjust(91 - len(head)) + e(13, "1.50000E+00", 3) + "\n"
        head = "%11d%s%s  failure    spotweld solid ID" % (2, e(13, "1.50000E+00", 2), e(13, time))
        out += head + "8".rjust(91 - len(head)) + "  failure time=%s\n" % e(12, "1.5000E+00")
    return out


def abstat():
    out = HEAD + LEGEND
    for time in TIMES:
        out += "\n      time   airbag/cv #  volume        pressure\n"
        out += "%s%8d%s%s\n" % (e(12, time), 7, e(15, "1.5000E+00", 5), e(11, "1.500E+00", 7))
        area = e(12, "1.5000E+00")
        out += "    Material I.D.=%12d  Unblocked  Area=%s    Blocked  Area=%s    Leakage      =%s\n" % (1, area, area, area)
    return out


def curvout():
    out = HEAD
    for cycle, time in enumerate(TIMES):
        out += "\n curve data for time step%11d ( at time %s )\n\n curve id    ordinate\n%9d %s\n" % (cycle, time, 7, e(12))
    return out


def dotted(entities):
    out = HEAD
    for time in TIMES:
        out += "\n " + "time".ljust(29, ".") + e(14, time) + "\n"
        for entity, labels in entities:
            out += " " + entity.ljust(29, ".") + "%10d\n" % 7
            for label in labels:
                out += " " + label.ljust(29, ".") + e(14) + "\n"
    return out


def deforc():
    return dotted([("spring/damper number", ["x-force", "resultant force", "change in length"])])


def jntforc():
    return dotted([("joint ID", ["x-force  (local) ", "resultant moment"]),
                   ("joint stiffness id number", ["phi (degrees)", "d(phi)/dt (degrees)", "joint energy"])])


def rbdout():
    out = HEAD
    six = e(12, "-1.5000E+00", 6)
    for time in ("0.000000E+00", "1.000000E-03"):
        out += "1\n\n  r i g i d   b o d y   m o t i o n   a t  cycle=%8d    time=%s\n" % (1, e(15, time))
        out += "\n rigid body%8d\n   global             x           y\n   coordinates:  %s\n" % (7, six[:36])
        motion = "".join(" %s  %s\n" % (label.rjust(14), six) for label in ("displacements:", "velocities:", "accelerations:"))
        out += motion + "\nprincipal or user defined local coordinate direction vectors\n                     a           b\n"
        out += "".join("     row %d%s\n" % (row, e(15, "1.0000E+00", 3)) for row in (1, 2, 3))
        out += "\n output in principal or user defined local coordinate directions\n                      a           b\n" + motion
    return out


def elout():
    out = HEAD
    six = e(12, "-1.5000E+00", 6)
    for cycle, time in enumerate(TIMES):
        at = "   f o r   t i m e  s t e p%9d   ( at time %s )\n\n" % (cycle, time)
        out += "\n\n\n e l e m e n t   s t r e s s   c a l c u l a t i o n s" + at
        out += " element  materl\n     ipt  stress       sig-xx                       yield\n           state             effsg      function\n"
        out += "%8d-%7d\n       1 elastic %s%s\n" % (7, 1, six, e(14, "1.5000E+00", 2))
        out += "\n\n\n e l e m e n t   s t r a i n   c a l c u l a t i o n s" + at
        out += " element  strain       eps-xx\n num/ipt   state\n%8d-%7d\n      1  elastic %s\n" % (7, 1, six)
        out += " r e s u l t a n t s   a n d   s t r e s s e s" + at
        out += "\n\n beam/truss # =%8d      part ID  =%10d      material type=%8d\n" % (8, 1, 1)
        out += "\n resultants      axial    shear-s\n" + " " * 11 + e(11, "1.500E+00", 7) + "\n"
        out += "\n integration point stresses\n                       sigma 11\n"
        for point in (1, 2):
            out += "%5d" % point + " " * 11 + e(15, "1.500000E+00", 4) + "\n"
    return out


def eloutdet():
    out = HEAD
    six = e(12, "-1.5000E+00", 6)
    for cycle, time in enumerate(TIMES):
        out += "\n n o d a l  s t r e s s  c a l c u l a t i o n s   f o r   t i m e  s t e p%9d   ( at time %s )\n\n" % (cycle, time)
        out += " node (global)\n          stress       sig-xx       plastic\n"
        out += "%8d-\n mid.  surface   %s%s\n" % (7, six, e(12, "1.5000E+00"))
        out += "%8d-\n lower surface   %s%s\n upper surface   %s%s\n" % (8, six, e(12, "1.5000E+00"), six, e(12, "1.5000E+00"))
    return out


def binout(order="<"):
    def record(command, payload):
        return struct.pack(order + "QB", len(payload) + 9, command) + payload

    def data(name, kind, values):
        return record(3, bytes([kind, len(name)]) + name.encode() + values)

    out = bytes([8, 8, 8, 1, 1, 1 if order == "<" else 0, 0, 0]) + record(7, struct.pack(order + "Q", 0))
    for section in ("nodout", "elout/solid", "rcforc"):
        out += record(2, ("/%s/metadata" % section).encode())
        out += data("title", 1, b"title".ljust(80))
        if section != "elout/solid":
            out += data("ids", 4, struct.pack(order + "2q", 1, 7))
            out += data("legend_ids", 3, struct.pack(order + "i", 7)) + data("legend", 1, b"seven".ljust(80))
        if section == "rcforc":
            out += data("side", 3, struct.pack(order + "2i", 0, 1))
        for state in (1, 2, 3):
            out += record(2, ("../d%06d" % state).encode())
            out += data("time", 10, struct.pack(order + "d", state * 1e-3))
            if section == "elout/solid":
                out += data("ids", 3, struct.pack(order + "2i", 1, 7)) + data("nip", 3, struct.pack(order + "2i", 2, 2))
                out += data("sig_xx", 9, struct.pack(order + "4f", 1, 2, 3, 4))
            else:
                out += data("x_force", 9, struct.pack(order + "2f", 1.5, 2.5))
    table = record(2, b"/nodout/metadata") + record(6, struct.pack(order + "Q", 0))
    return out + struct.pack(order + "QB", len(table) + 9, 5) + table


def t01(code=3040):
    def record(payload):
        return struct.pack(">i", len(payload)) + payload + struct.pack(">i", len(payload))

    width = 40 if code < 3041 else 100
    title = b"title".ljust(width)
    out = record(struct.pack(">i", code) + b"title".ljust(80)) + record(b"OpenRadioss".ljust(80))
    if code > 3050:
        out += record(struct.pack(">i", 1)) + record(struct.pack(">i3f", width, 1, 1, 1))
    groups = [(0, [1, 7], range(1, 10)), (102, [1], range(1, 7)), (101, [3], range(1, 7)), (104, [2], range(1, 7))]
    out += record(struct.pack(">6i", 1, 1, 1, 1, len(groups), 22)) + record(struct.pack(">22i", *range(1, 23)))
    out += record(struct.pack(">i", 1) + title + struct.pack(">4i", 0, 0, 0, 1)) + record(struct.pack(">i", 1))
    out += record(struct.pack(">i", 1) + title) * 2
    out += record(struct.pack(">5i", 1, 0, 0, 1, 0) + title) + record(struct.pack(">i", 1))
    for kind, objects, codes in groups:
        out += record(struct.pack(">5i", 1, kind, 0, len(objects), len(codes)) + title)
        for number in objects:
            out += record(struct.pack(">i", number) + title)
        out += record(struct.pack(">%di" % len(codes), *codes))
    for state in range(4):
        out += record(struct.pack(">f", state * 1e-3)) + record(struct.pack(">22f", *range(22))) + record(struct.pack(">f", 1))
        for _, objects, codes in groups:
            n = len(objects) * len(codes)
            out += record(struct.pack(">%df" % n, *(state + k for k in range(n))))
    return out


DECK = """*KEYWORD
$# Units: kg / mm / ms / kN / GPa
*PARAMETER
R velocity    -10.0I node            7
*TITLE
a car
*INITIAL_VELOCITY
$     NSID    NSIDEX     BOXID
         2
 &velocity         0         0
*RIGIDWALL_PLANAR_ID
         1rigid wall
         3         0         0         0
       0.0       0.0       0.0       1.0       0.0       0.0       0.2
*CONTACT_AUTOMATIC_SINGLE_SURFACE_ID
     10001Global contact
         0         0         0         0
*PART
front
         1         1         1
*DATABASE_NODOUT
   0.00075         3         0         1
*DATABASE_HISTORY_NODE_ID
         7centre of gravity
*DATABASE_HISTORY_NODE
     &node,1,2,3
*CONTROL_UNITS
mm,ms,kg
*INCLUDE
mesh.k
*NODE +
                   1                 0.0
*END
"""
STUDY = """[study]
name = "a"
units = "mm-t-s"
group = "g"
kind = "pair"
half_model = true
[recipe]
deflection = { file = "nodout", node = 1, component = "x_displacement" }
force = { file = "rcforc", id = 3, side = "surfa", component = "x_force" }
filter = "CFC60"
sampling = { states = 400, interval_ms = 0.75 }
[[run]]
path = "25kmh"
speed = "25km/h"
mass = "24.0t"
deck = "25.k"
"""
SCENARIO = """[run]
duration = "300ms"
output_interval = "0.75ms"
interface_speed = "train"
[curves]
nose = { file = "curve.json" }
coupler = { file = "coupler.csv", unloading = "80MN/m", gap = "30mm" }
[[train]]
name = "A"
speed = "36km/h"
inner = "coupler"
vehicles = [ { name = "A1", mass = "24.0t" }, { name = "A2", mass = "20.24t" } ]
[wall]
[contact]
curve = "nose"
gap = "0mm"
"""


def model(name, fitted):
    """A model file of two cases, as crumple train writes it."""
    def case(speed):
        deflection = [0.0, 0.1, 0.2, 0.5 + speed / 100]
        return {"name": str(speed), "speed_m_per_s": speed, "max_deflection_m": deflection[-1],
                "truncated": False, "unloading_stiffness_N_per_m": 1e8, "rebound_speed_m_per_s": 1.0,
                "deflection_m": deflection, "force_N": [0.0, 2e6, 1e6, 3e6],
                "body_force_N": [0.0, 1.9e6, 1e6, 2.9e6], "closing_speed_m_per_s": [speed, 6.0, 4.0, 0.0]}
    return json.dumps({
        "format": "crumple model", "version": 7, "written_by": "crumple", "group": "g", "speed_kind": "wall",
        "force_kind": "contact", "mass_kg": 24e3, "other_mass_kg": None, "training_hash": "0",
        "cases": [case(8.0), case(12.0)], "options": {"model": name}, "max_crush_rule": "motion",
        "fitted": fitted, "fitted_body": fitted}).encode()


POINTS = [(0.0, 0.0), (0.05, 3e6), (0.25, 1e6), (0.5, 1.5e6), (1.0, 2e6)]


def curves():
    """The same curve in the text formats that are read; the first byte is the ending's number."""
    def rows(separator, shape="%g%s%g\n"):
        return "".join(shape % (d, separator, f) for d, f in POINTS)
    k = "*KEYWORD\n*DEFINE_CURVE\n         1\n" + "".join("%20.6f%20.6f\n" % p for p in POINTS) + "*END\n"
    rad = "#RADIOSS STARTER\n/BEGIN\n/FUNCT/1\nnose\n" + "".join("%20.6f%20.6f\n" % p for p in POINTS) + "/END\n"
    record = "t_s,d_m,force_N\n" + "".join("%g,%g,%g\n" % (0.01 * i, d, f) for i, (d, f) in enumerate(POINTS))
    crv = "Curveplot\nnose\nd\nf\ncurve #pts=%d\n" % len(POINTS) + rows(" ") + "endcurve\n"
    texts = [(0, "d_m,force_N\n" + rows(",")), (0, record), (0, "Test 12\nWeg;Kraft\nmm;kN\n" + rows(";")),
             (1, "# x\n" + rows("\t")), (2, json.dumps({"deflection_m": [d for d, _ in POINTS],
                                                     "force_N": [f for _, f in POINTS]})),
             (3, k), (4, rad), (7, crv)]
    return [bytes([number]) + text.encode() for number, text in texts]


def main(folder):
    text = [nodout, rcforc, rwforc, secforc, glstat, matsum, spcforc, bndout, nodfor, sleout, swforc,
            abstat, curvout, deforc, jntforc, rbdout, elout, eloutdet]
    files = {write.__name__: [write().encode(), write().replace("\n", "\r\n").encode(),
                              write().encode()[: len(write()) * 2 // 3]] for write in text}
    files["binout"] = [binout(), binout(">"), binout()[:-20]]
    files["t01"] = [t01(), t01(4021), t01()[:-50]]
    files["deck"] = [DECK.encode(), DECK.replace("*KEYWORD", "*KEYWORD LONG=Y").encode()]
    files["study"] = [STUDY.encode(), STUDY.replace("pair", "wall").replace("half_model = true\n", "").encode()]
    files["scenario"] = [SCENARIO.encode(), SCENARIO.replace("[wall]", "").encode()]
    files["model"] = [model(name, fitted) for name, fitted in (
        ("nearest", "nearest"), ("linear", "linear"),
        ("rate", {"rate": {"sensitivity_sqrt_s_per_m": 0.03}}))]
    files["curve"] = curves()
    databases = pathlib.Path(__file__).parents[2] / "fixtures" / "databases"
    files["database"] = [path.read_bytes() for path in sorted(databases.glob("*.h5"))]
    seeds = pathlib.Path(__file__).parent / "seeds"
    for target in ("plan", "results"):
        files[target] = [path.read_bytes() for path in sorted((seeds / target).iterdir())]
    for target, contents in files.items():
        corpus = pathlib.Path(folder) / target
        corpus.mkdir(parents=True, exist_ok=True)
        for number, content in enumerate(contents):
            (corpus / ("seed%d" % number)).write_bytes(content)


if __name__ == "__main__":
    main(sys.argv[1])
