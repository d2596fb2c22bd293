"""Commands of the program as functions: they give the document that `--json` prints, as a dict."""

import functools
import html
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import warnings

from numbers import Number

from crumple import _crumple
from crumple._errors import Error


class Warned(UserWarning):
    """A warning of the program."""


def _warn(text):
    """A warning at the line of the user that led to it."""
    level, frame = 1, sys._getframe(0)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "crumple":
        level, frame = level + 1, frame.f_back
    warnings.warn(text, Warned, stacklevel=level)


class Document(dict):
    """What a command prints with `--json`. Notebooks show the lists of rows in it as tables, where pandas is installed."""

    def _repr_html_(self):
        try:
            import pandas as pd
        except ImportError:
            return None
        tables = []

        def look(into, name):
            # Found, and from what, or why not, as by init.
            if set(into) == {"value", "evidence", "from"}:
                tables.append(f"<p>{html.escape(name)}: {html.escape(str(into['value']))} ({html.escape(into['evidence'])}: {html.escape(into['from'])})</p>")
                return
            if set(into) == {"missing"}:
                tables.append(f"<p>{html.escape(name)}: missing ({html.escape(str(into['missing']))})</p>")
                return
            for key, value in into.items():
                title = f"{name} {key}".strip()
                if isinstance(value, dict):
                    look(value, title)
                elif isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
                    rows = pd.json_normalize(value, max_level=1)
                    plain = [name for name in rows if not rows[name].map(lambda cell: isinstance(cell, (dict, list))).any()]
                    if plain:
                        tables.append(f"<p>{html.escape(title)}</p>{rows[plain].to_html(max_rows=20, max_cols=20)}")
                    # Lists within other rows would be a table each.
                    for row in value:
                        if "group" in row:
                            look(row, row["group"])

        look(self, "")
        return "".join(tables) or None


# The program in a Python of its own, which looks into no folder and no setting but the compiled part.
_START = """
import importlib.util, signal, sys
spec = importlib.util.spec_from_file_location("crumple._crumple", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
signal.signal(signal.SIGINT, signal.SIG_DFL)
sys.exit(module.main(["crumple", *sys.argv[2:]]))
"""


@functools.cache
def _version(program):
    """What a program says of its version; empty if it cannot be run."""
    try:
        environment = {name: value for name, value in os.environ.items() if name != "CRUMPLE"}
        return subprocess.run([program, "--version"], capture_output=True, text=True, timeout=60, env=environment).stdout.strip()
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return ""


def _program():
    """How the program is started: it is in the compiled part, or the one that CRUMPLE names."""
    if not hasattr(_crumple, "main"):
        named = os.environ.get("CRUMPLE")
        if not named:
            raise Error("this package was built without the program: set CRUMPLE to the path of the crumple program, which every release contains")
        if not shutil.which(named):
            raise Error(f"CRUMPLE={named}: there is no program of that name")
        if (version := _version(named)) != f"crumple {_crumple.__version__}":
            raise Error(f"CRUMPLE={named}: expected crumple {_crumple.__version__}, found {version or 'another program'}")
        return [named]
    if not sys.executable or getattr(sys, "frozen", False):
        raise Error("commands need a Python interpreter (sys.executable) to run in; this one is embedded or frozen")
    return [sys.executable, "-I", "-S", "-c", _START, _crumple.__file__]


class _Progress:
    """Shows the program's progress by tqdm, where it is installed."""

    def __init__(self, command):
        self.bar = None
        try:
            from tqdm.auto import tqdm
        except ImportError:
            return
        # Not in files and pipes, as the program itself; in notebooks always.
        self.bar = tqdm(desc=f"crumple {command}", disable=None, leave=False)

    def show(self, text):
        if self.bar is None:
            return
        done, _, items = text.partition("/")
        if done.isdigit() and items.isdigit():
            self.bar.total = int(items)
            self.bar.update(int(done) - self.bar.n)
        else:
            self.bar.set_postfix_str(text)

    def close(self):
        if self.bar is not None:
            self.bar.close()


def _ended(child, command):
    """What the program printed on both streams; interrupted with it, as in a terminal."""
    lines, progress = [], _Progress(command)
    try:
        for line in child.stderr:
            line = line.decode(errors="replace").rstrip("\r\n")
            if line.startswith("progress: "):
                progress.show(line.removeprefix("progress: "))
            else:
                lines.append(line)
        child.wait()
    except KeyboardInterrupt:
        # The terminal has sent it to the program as well; it ends when what it writes is whole.
        if child.poll() is None and os.name != "nt":
            child.send_signal(signal.SIGINT)
        try:
            child.wait(timeout=30)
        except subprocess.TimeoutExpired:
            child.kill()
        raise
    finally:
        progress.close()
    return lines


def run(*arguments, check=True):
    """Run a command of the program and return its JSON document, or the text of one that has none (`--version`).

    `run("validate", "curves.h5", "--group", "lead-car-wall")`; warnings become Python warnings (`crumple.Warned`). Progress is
    shown by tqdm, if it is installed, on a terminal and in notebooks.

    Raises `crumple.Error` if the command fails. Where only a part of its work does, such as a run of a study, that is a warning, and
    in the document; with `--strict` (`strict=True`) it is an error, as any warning is, and the document its attribute. With
    `check=False` nothing is raised.
    """
    if any(a is None for a in arguments):
        raise Error(f"crumple {arguments[0]}: an argument is None: expected a path or text")
    words = [os.fspath(a) if isinstance(a, os.PathLike) else str(a) for a in arguments]
    words = [*_program(), "--json", *words]
    environment = {**os.environ, "CRUMPLE_PROGRESS": "lines"}
    with tempfile.TemporaryFile() as out:
        with subprocess.Popen(words, stdout=out, stderr=subprocess.PIPE, env=environment) as child:
            said = _ended(child, arguments[0] if arguments else "")
        out.seek(0)
        printed = out.read()
    try:
        document = json.loads(printed) if printed.strip() else None
    except ValueError:
        document = None
    failed = isinstance(document, dict) and set(document) == {"error"}
    for line in said:
        # Errors besides a document are of parts: a run of a study, a group.
        kind, _, text = line.partition(": ")
        if kind == "warning" or (kind == "error" and document is not None and not failed):
            _warn(text)
    for left in document.get("left_out", ()) if isinstance(document, dict) else ():
        _warn(f"{left['path']} is left out: {left['message']}")
    if check and "--strict" in words and child.returncode and not failed:
        error = Error("there were warnings, damage or failures, which strict does not allow; what could be done is done, and in the error's document")
        error.document = document
        raise error
    if check and failed:
        error = Error.of_document(printed)
        if re.search(r"(^|[\s'(])--[a-z]", str(error)):
            error.add_note("Options are words of crumple.run; of other functions they are keyword arguments: --nsdm-seeds 3 is nsdm_seeds=3, --overwrite is overwrite=True.")
        raise error
    if document is None and child.returncode == 0 and printed:
        # Of --version and --help.
        return printed.decode()
    if check and document is None:
        raise Error("\n".join(said).strip() or f"crumple ended with code {child.returncode}")
    return Document(document) if isinstance(document, dict) else document


_SI = {"--mass": "kg", "--other-mass": "kg", "--speed": "m/s", "--crush": "m", "--unloading": "N/m"}


def _options(options):
    """Keyword arguments as options: `nsdm_seeds=3` is `--nsdm-seeds 3`, `True` a flag, a list an option each."""
    words = []
    for name, value in options.items():
        option = "--" + name.rstrip("_").replace("_", "-")
        # Of NumPy: arrays as lists, its numbers and truth values as Python's.
        value = value.tolist() if hasattr(value, "tolist") else value
        for one in value if isinstance(value, (list, tuple)) else [value]:
            one = one.item() if hasattr(one, "item") else one
            if one is True and option in _SI:
                raise Error(f"{name}: expected a number in {_SI[option]}, or text with its unit, found True")
            if one is True:
                words.append(option)
            elif one is not None and one is not False:
                # Numbers are in SI.
                is_quantity = option in _SI and isinstance(one, Number)
                words.append(f"{option}={float(one)}{_SI[option]}" if is_quantity else f"{option}={one}")
    return words


def _output(path):
    """The option of an output, whatever its name begins with."""
    return [] if path is None else [f"--output={os.fspath(path)}"]


def build(study, output, **options):
    """Build a study (TOML) into a database, a file of HDF5; only changed runs are read again.

    Options are those of `crumple build`: `run="36kmh"`.
    """
    return run("build", *_output(output), *_options(options), "--", study)


def add(database, files, **options):
    """Add measured or legacy curves from files to a database, which is created if it is not there: CSV, MDF, ISO-MME, LS-DYNA, ...

    Options are those of `crumple db add`: `group="tests"`, `speed="36km/h"` (or in m/s; a list for several files), `mass="24t"`,
    `kind="wall"`, `force="body"`, `units="mm-t-s"`, `unloading="80MN/m"` (or in N/m).
    """
    files = [files] if isinstance(files, (str, os.PathLike)) else list(files)
    if not files:
        raise Error("there are no files: name at least one")
    return run("db", "add", *_options(options), "--", database, *files)


def init(runs, output=None, **options):
    """Examine run folders and write a study of them (study.toml in the working folder if `output` is None), which `build` takes.

    Options are those of `crumple init`, where something is not found by itself: `node=900001`, `units="mm-t-s"`, `mass="24t"`.
    Returns what was found, and from what.
    """
    runs = [runs] if isinstance(runs, (str, os.PathLike)) else list(runs)
    if not runs:
        raise Error("there are no run folders: name at least one")
    return run("init", *_output(output), *_options(options), "--", *runs)


def validate(database, group=None, **options):
    """Leave out every speed in turn, predict it with every model, and compare with FE.

    Of each of `["groups"]`, `chosen` is the model that `train` takes, `means` has each model's mean errors: `force_l1`, `velocity_l1` and
    `acceleration_l1` are mean absolute differences over the mean absolute value of FE, `max_crush_error` and `energy_error` relative. `inner`
    marks speeds between others, of which the means are; `floors` say what FE's own curve leaves of the motion. `rows` have the errors at each
    speed, with signs where they have one, `peak_force_error` of the largest force among them; `acceptance` judges the chosen model there by
    the rule for numerical crash models that rail practice quotes from EN 15227.
    Options are those of `crumple validate`: `against="old.json"`.
    """
    return run("validate", *_options({"group": group, **options}), "--", database)


def train(database, output, group=None, **options):
    """Train a model on a group, write it, and give it.

    Options are those of `crumple train`: `model="linear"`, else the one that `validate` chooses.
    """
    from crumple import Model

    run("train", *_output(output), *_options({"group": group, **options}), "--", database)
    return Model(output)


def sweep(scenario, output, **options):
    """Run a scenario (TOML with a plan) many times; the rows are in `output` (.csv or .h5), the report is returned.

    Options are those of `crumple sweep`: `plan="plan.toml"`, `restart=True`, `shard="1/8"`.
    """
    return run("sweep", *_output(output), *_options(options), "--", scenario)


def rate(reference, prediction, **options):
    """Rate a prediction against a reference, two files with histories, by every measure.

    Options are those of `crumple rate`.
    """
    return run("rate", *_options(options), "--", reference, prediction)
