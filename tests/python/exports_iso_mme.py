"""Reads a test's channels by pyisomme: prints a JSON object of values by channel code."""

import contextlib
import json
import sys

from pyisomme import Isomme

with contextlib.redirect_stdout(sys.stderr):
    test = Isomme().read(sys.argv[1])
found = {str(c.code): [float(v) for v in c.data.to_numpy().ravel()] for c in test.channels}
json.dump(found, sys.stdout)
