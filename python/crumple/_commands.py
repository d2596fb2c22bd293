"""Commands of the program as functions: they give the document that `--json` prints, as a dict."""

import json
import os
import subprocess
import sys
import warnings

from crumple._errors import Error


class Warned(UserWarning):
    """A warning of the program."""


def run(*arguments, check=True):
    """Run a command of the program and return its JSON document.

    `run("validate", "curves.h5", "--group", "lead-car-wall")`; warnings become Python warnings (`crumple.Warned`).

    Raises `crumple.Error` if the command fails.
    """
    words = [sys.executable, "-m", "crumple", *(os.fspath(a) if isinstance(a, os.PathLike) else str(a) for a in arguments)]
    done = subprocess.run([*words, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
    for line in done.stderr.decode(errors="replace").splitlines():
        if line.startswith("warning: "):
            warnings.warn(line.removeprefix("warning: "), Warned, stacklevel=3)
    try:
        document = json.loads(done.stdout) if done.stdout.strip() else None
    except ValueError:
        document = None
    failed = isinstance(document, dict) and set(document) == {"error"}
    if check and failed:
        raise Error.of_document(done.stdout)
    if check and done.returncode not in (0, 3) and document is None:
        raise Error(done.stderr.decode(errors="replace").strip() or f"crumple ended with code {done.returncode}")
    return document


def _options(options):
    """Keyword arguments as options: `nsdm_seeds=3` is `--nsdm-seeds 3`, `True` a flag, a list an option each."""
    words = []
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")
        for one in value if isinstance(value, (list, tuple)) else [value]:
            if one is True:
                words.append(option)
            elif one is not None and one is not False:
                words.append(f"{option}={one}")
    return words


def build(study, output, **options):
    """Build a study (TOML) into a database; only changed runs are read again."""
    return run("build", study, "-o", output, *_options(options))


def init(runs, output=None, **options):
    """Examine run folders and write a study of them."""
    return run("init", *([runs] if isinstance(runs, (str, os.PathLike)) else runs), *(["-o", output] if output else []), *_options(options))


def validate(database, group=None, **options):
    """Leave out every speed in turn, predict it with every model, and compare with FE."""
    return run("validate", database, *_options({"group": group, **options}))


def train(database, output, group=None, **options):
    """Train a model and write it; gives the model."""
    from crumple import Model

    run("train", database, "-o", output, *_options({"group": group, **options}))
    return Model(output)


def sweep(scenario, output, **options):
    """Run a scenario many times; the rows are in `output`, the report is returned."""
    return run("sweep", scenario, "-o", output, *_options(options))


def rate(reference, prediction, **options):
    """Rate a prediction against a reference by every measure."""
    return run("rate", reference, prediction, *_options(options))
