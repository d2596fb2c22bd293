"""The package without the program: its size, that it reads and predicts as the installed one, and what commands do.

    module_alone.py WHEEL DEMO_FOLDER PROGRAM
"""

import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import crumple

wheel, demo, program = (Path(argument).resolve() for argument in sys.argv[1:])
size = wheel.stat().st_size
assert size <= 2_000_000, f"{wheel} has {size} bytes"

# Without the packages that a release's empty environment lacks.
VALUES = """
import crumple, numpy as np
print("main" in dir(crumple._crumple))
print(crumple.read("fe/lead-car-wall/36kmh/nodout").only()["x_velocity"].array.sum())
print(crumple.Database("curves.h5")["lead-car-wall"]["36kmh"].force.sum())
print(hash(str(crumple.Model("lead.model").predict("50km/h").document)))
x = np.linspace(0, 1, 50)
forest = crumple._crumple.Forest.fit(x.tobytes(), 1, (x * x).tobytes(), 3, 1, None, 1, None, True, False)
print(np.frombuffer(forest.predict(x.tobytes(), 1)).sum())
"""
COMMAND = """
import crumple
try:
    print(crumple.run("db", "ls", "curves.h5", "-q"))
except crumple.Error as error:
    print("refused:", error)
"""


def said(code, folder=None, **environment):
    """What Python prints of it in the demo's folder, by the package of `folder` or the installed one."""
    variables = {name: value for name, value in os.environ.items() if name not in ("CRUMPLE", "PYTHONPATH")}
    variables |= {"PYTHONHASHSEED": "0"} | environment | ({"PYTHONPATH": folder} if folder else {})
    words = [sys.executable, *(["-c", code] if isinstance(code, str) else code)]
    ended = subprocess.run(words, cwd=demo, env=variables, capture_output=True, text=True)
    return ended.stdout + (ended.stderr if ended.returncode else "")


with tempfile.TemporaryDirectory() as folder:
    zipfile.ZipFile(wheel).extractall(folder)
    whole, alone = said(VALUES).splitlines(), said(VALUES, folder).splitlines()
    assert whole[0] == "True" and alone[0] == "False", (whole, alone)
    assert len(whole) == 5 and whole[1:] == alone[1:], (whole, alone)

    without = said(COMMAND, folder)
    assert without == (
        "refused: this package was built without the program: set CRUMPLE to the path of the crumple program, which every release contains\n"
    ), without
    assert said(COMMAND, folder, CRUMPLE="nowhere") == "refused: CRUMPLE=nowhere: there is no program of that name\n"
    other = said(COMMAND, folder, CRUMPLE=sys.executable)
    assert other.startswith("refused: CRUMPLE=") and f"expected crumple {crumple.__version__}, found Python" in other, other
    listed = said(COMMAND, folder, CRUMPLE=str(program))
    assert listed == said(COMMAND) and "lead-car-wall" in listed, listed
    words = ["-m", "crumple", "--version"]
    assert said(words, folder, CRUMPLE=str(program)) == said(words) == f"crumple {crumple.__version__}\n"
    assert said(words, folder).startswith("error: this package was built without the program")
print(f"the package without the program: {size} bytes")
