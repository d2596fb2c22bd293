"""Writes the files of the reader benches: a nodout of 5 000 nodes and 400 states (310 MB), the
same of 40 states, a binout with the same values in single precision (96 MB), and an rcforc, elout, matsum and
glstat of 190 to 270 MB.

    python make_files.py FOLDER
"""

import pathlib
import struct
import sys

import numpy as np

NODES, STATES, SMALL = 5_000, 400, 40
COMPONENTS = [f"{axis}_{kind}" for kind in ("displacement", "velocity", "acceleration", "coordinate") for axis in "xyz"]
IDS = np.arange(NODES) * 3 + 1_000_001
HEAD = " bench".ljust(73) + "\n" + " " * 20 + "ls-dyna smp d R14 R14.0_515_8a12796 date 12/12/2022\n"
COLUMNS = " nodal point  " + "      ".join(
    ["x-disp", "y-disp", "z-disp", "x-vel ", "y-vel ", "z-vel ", "x-accl", "y-accl", "z-accl", "x-coor", "y-coor", "z-coor"])


def values():
    """One array of nodes by components per state: sizes from 1e-8 to 1e8, both signs."""
    random = np.random.default_rng(1)
    size = random.normal(size=(NODES, 12)) * 10.0 ** random.integers(-8, 8, size=(NODES, 12))
    for state in range(STATES):
        yield state * 7.5e-4, size * (1 + 0.3 * np.sin(0.01 * state))


def nodout(path, small):
    with path.open("w") as out, small.open("w") as few:
        for file in (out, few):
            file.write(HEAD)
        for number, (time, rows) in enumerate(values()):
            text = "\n\n\n n o d a l   p r i n t   o u t   f o r   t i m e  s t e p%8d" % (number * 10)
            text += " " * 30 + "( at time %.7E )\n\n%s\n" % (time, COLUMNS)
            text += "".join("%9d %s\n" % (i, "".join("%12.5E" % v for v in row)) for i, row in zip(IDS, rows))
            out.write(text)
            if number < SMALL:
                few.write(text)


def binout(path):
    """An LSDA container with one symbol table, at its end."""
    symbols = []
    size = {1: 1, 3: 4, 4: 8, 9: 4, 10: 8}
    with path.open("wb") as out:

        def record(command, payload):
            out.write(struct.pack("<QB", len(payload) + 9, command) + payload)

        def directory(name):
            symbols.append(name)
            record(2, name.encode())

        def data(name, kind, content):
            symbols.append((name, kind, out.tell(), len(content) // size[kind]))
            record(3, bytes([kind, len(name)]) + name.encode() + content)

        out.write(bytes([8, 8, 8, 1, 1, 1, 0, 0]))
        record(7, struct.pack("<Q", 0))
        directory("/nodout/metadata")
        data("title", 1, b"bench".ljust(80))
        data("version", 1, b"smp s R11.1 ")
        data("revision", 1, b"139588    ")
        data("date", 1, b"08/12/2019")
        data("ids", 4, IDS.astype("<i8").tobytes())
        for number, (time, rows) in enumerate(values()):
            directory("/nodout/d%06d" % (number + 1))
            data("time", 10, struct.pack("<d", time))
            data("cycle", 3, struct.pack("<i", number * 10))
            for k, name in enumerate(COMPONENTS):
                data(name, 9, rows[:, k].astype("<f4").tobytes())
        table_at = out.tell()
        table = b""
        for symbol in symbols:
            if isinstance(symbol, str):
                table += struct.pack("<QB", len(symbol) + 9, 2) + symbol.encode()
            else:
                name, kind, at, count = symbol
                table += struct.pack("<QB", len(name) + 26, 4) + name.encode() + struct.pack("<BQQ", kind, at, count)
        table += struct.pack("<QBQ", 17, 6, 0)
        record(5, table)
        out.seek(8)
        record(7, struct.pack("<Q", table_at))


def repeated(path, states, body):
    """States of a text file; `body` writes one with other numbers, of which few are made and then repeated at other times."""
    random = np.random.default_rng(2)
    number = lambda form: form % (random.normal() * 10.0 ** random.integers(-8, 8))
    bodies = [body(number) for _ in range(8)]
    with path.open("w") as out:
        out.write(HEAD)
        for state in range(states):
            out.write(bodies[state % len(bodies)].replace("TIME-------E", "%12.5E" % (state * 1e-5)).replace(
                "TIME----E4", "%10.4E" % (state * 1e-5)).replace("CYCLE--", "%7d" % state))


def rcforc(number):
    """200 sides of interfaces."""
    return "".join("  %-6s%11d timeTIME-------E" % (side, 1000 + k) + "".join(
        label + number("%12.5E") for label in ("  x ", "  y ", "  z ", " mass ", "  mx ", "  my ", "  mz ")) + "\n"
        for k in range(100) for side in ("slave", "master"))


def elout(number):
    """Stresses of 200 solids."""
    return ("\n\n\n e l e m e n t   s t r e s s   c a l c u l a t i o n s   f o r   t i m e  s t e p  CYCLE--"
            "   ( at timeTIME-------E )\n\n element  materl\n     ipt  stress       sig-xx      sig-yy      sig-zz"
            "      sig-xy      sig-yz      sig-zx                       yield\n           state" + " " * 82
            + "effsg      function\n" + "".join(
                "%8d-%7d\n%8d elastic " % (1001 + k, 3, 1) + "".join(number("%12.4E") for _ in range(6))
                + number("%14.4E") + number("%14.4E") + "\n" for k in range(200)))


def matsum(number):
    """100 parts."""
    lines = (("inten", "     kinen", "     eroded_ie", "     eroded_ke"), (" x-mom", "     y-mom", "     z-mom"),
             (" x-rbv", "     y-rbv", "     z-rbv"), (" " * 25 + "hgeng",))
    return "\n\n\n time =   TIME----E4\n" + "".join(" mat.#=%5d             " % (10 + k) + "".join(
        "".join(label + "=" + number("%13.4E") for label in line) + "\n" for line in lines) + "\n\n"
        for k in range(100))


def glstat(number):
    """The labels of an explicit run."""
    labels = ("time step", "kinetic energy", "internal energy", "stonewall energy", "spring and damper energy",
              "hourglass energy ", "system damping energy", "sliding interface energy", "external work",
              "eroded kinetic energy", "eroded internal energy", "eroded hourglass energy", "total energy",
              "total energy / initial energy", "energy ratio w/o eroded energy", "global x velocity",
              "global y velocity", "global z velocity")
    return (" dt of cycle CYCLE-- is controlled by solid         100449 of part        10\n\n time"
            + "." * 27 + "  TIME-------E\n" + "".join(
                " " + label.ljust(31, ".") + number("%14.5E") + "\n" for label in labels)
            + " time per zone cycle.(nanosec)..%14d\n\n\n" % 42)


def main(folder):
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    nodout(folder / "nodout", folder / "nodout_small")
    binout(folder / "binout0000")
    for name, states, body in (("rcforc", 8_000, rcforc), ("elout", 9_200, elout), ("matsum", 6_000, matsum),
                               ("glstat", 262_000, glstat)):
        repeated(folder / name, states, body)


if __name__ == "__main__":
    main(sys.argv[1])
