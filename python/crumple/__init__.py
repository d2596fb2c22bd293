"""Force-deflection curves for multi-body crash models, from the histories of FE runs.

From folders of runs to a curve at a speed that was never run:

    import crumple

    crumple.init("runs", "study.toml")                # looks at the runs, and writes what it found as a study
    crumple.build("study.toml", "curves.h5")          # the curve of each run
    database = crumple.Database("curves.h5")          # database["runs"]["36kmh"].force
    database.validate()                               # each speed left out, predicted, and compared with FE
    model = database.train("runs.model")
    curve = model.predict("50km/h")                   # curve.deflection, curve.force, curve.body_force, curve.band
    curve.to_pandas().to_csv("curve.csv")
    curve.export("curve.k", units="mm-t-s")           # for another tool

Numbers of databases, models, curves and multi-body runs are SI: m, s, N, kg, J, speeds m/s. What `read` gives is in the units
of its file.

`init`, `build`, `add`, `validate`, `train`, `sweep`, `rate` and `run` are the program's commands. Their options are keyword
arguments: `--nsdm-seeds 3` is `nsdm_seeds=3`, a flag such as `--extrapolate` is `extrapolate=True`. `crumple build --help` in
a shell, or `python -m crumple build --help`, describes them. They return the document that `--json` prints, as a dict.
"""

import importlib
import json
import math
import os
import re
import tempfile
from collections.abc import Mapping
from itertools import islice
from numbers import Number
from pathlib import Path

import numpy as np

from crumple import _crumple
from crumple._commands import Warned, _warn, add, build, init, rate, run, sweep, train, validate
from crumple._errors import Error

__version__ = _crumple.__version__
__all__ = [
    "Case", "Component", "Curve", "Database", "Error", "Group", "Histories", "Model", "Run", "Section", "Warned",
    "add", "build", "init", "rate", "read", "run", "simulate", "sweep", "train", "validate",
]


def _array(floats):
    """The numbers, without a copy; they cannot be written to."""
    return np.frombuffer(floats, dtype=np.float64)


def _quantity(name, value, unit):
    """A number in SI, or text with a unit, which the program reads."""
    if isinstance(value, str):
        return value
    try:
        if not isinstance(value, (bool, np.bool_)):
            return float(value)
    except (TypeError, ValueError):
        pass
    raise TypeError(f"{name} {value!r}: expected one number in {unit}, or text with a unit")


def _id(text):
    """An id as users write it: a number where it is one."""
    return int(text) if text is not None and re.fullmatch("-?[0-9]+", text) else text


def _key(entity):
    """An id as it is looked up: 900001, 900001.0 (as pandas has it), "900001" and NumPy's numbers are one."""
    if entity is None or isinstance(entity, str):
        return _id(entity)
    entity = entity.item() if isinstance(entity, np.ndarray) and entity.ndim == 0 else entity
    # NaN, infinity and what is not a number are not an entity's id.
    is_whole = isinstance(entity, Number) and math.isfinite(entity) and entity == int(entity)
    return int(entity) if is_whole else entity


def _locked(state):
    """What an unpickled object is made of, with its arrays as they were: they cannot be written to."""
    for values in state.values():
        if isinstance(values, np.ndarray):
            values.flags.writeable = False
    return state


def _plain(of):
    """An array, Series or NumPy number as JSON has it."""
    if hasattr(of, "tolist"):
        return of.tolist()
    raise TypeError(f"{type(of).__name__} cannot be written as JSON")


def _listed(of):
    """One item or several, as a list of texts; None stays."""
    if of is None:
        return None
    of = of.tolist() if isinstance(of, np.ndarray) else of
    all_of = [of] if isinstance(of, (str, bytes, Number)) else list(of)
    for one in all_of:
        if isinstance(one, bytes):
            raise TypeError(f"ids and components are numbers and texts, not bytes: {one!r}")
    return [str(_key(one)) for one in all_of]


class _Mapping(Mapping):
    """A mapping over a dict, which says what there is if something is not."""

    _what = "key"

    def __init__(self, items):
        self._items = items

    def __getitem__(self, name):
        try:
            return self._items[name]
        except KeyError:
            known = "expected one of " + ", ".join(map(str, self._items)) if self._items else "there is none at all"
            raise KeyError(f"there is no {self._what} {name!r}: {known}") from None

    def __iter__(self):
        return iter(self._items)

    def __len__(self):
        return len(self._items)

    def __setstate__(self, state):
        self.__dict__.update(_locked(state))

    # Two with equal arrays are not one, and arrays have no single truth value.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def _ipython_key_completions_(self):
        return list(self)

    def __repr__(self):
        return f"<{type(self).__name__}: {', '.join(map(str, self._items)) or 'empty'}>"


class _Table:
    """Shown as a table in notebooks, where pandas is installed."""

    def _repr_html_(self):
        try:
            return self._shown()._repr_html_()
        except ImportError:
            return None

    def _shown(self):
        return self.to_pandas()


class Component(_Mapping):
    """One component of a section: an array per id, over time; `None` is the id of a global quantity.

    `ids` and `titles` are lists, `time` has shape (states,), `array` (states, ids) in the file's units. NaN stands where
    the file holds no number.
    """

    _what = "id"

    def __contains__(self, entity):
        return _key(entity) in self._items

    def __init__(self, name, time, values, titles):
        # Thousands of ids: an array is made of the values of those that are asked for.
        super().__init__(values)
        self.name, self.time, self._titles = name, time, titles

    def __getstate__(self):
        return {**self.__dict__, "_items": {entity: self[entity] for entity in self}}

    def __setstate__(self, state):
        _locked(state["_items"])
        super().__setstate__(state)

    @property
    def ids(self):
        return list(self._items)

    @property
    def titles(self):
        return [self._titles.get(entity) for entity in self._items]

    @property
    def array(self):
        """All ids beside one another, as a new array of shape (states, ids)."""
        return np.column_stack(list(self.values())) if self else np.empty((len(self.time), 0))

    def __array__(self, dtype=None, copy=None):
        if copy is False:
            raise ValueError("each id has its own array, so a combined array is always a copy")
        return self.array.astype(np.float64 if dtype is None else dtype, copy=False)

    def __getitem__(self, entity):
        """The values of an id, given as a number, as text ("3:surfa"), or None."""
        return _array(super().__getitem__(_key(entity)))


class Section(_Table, _Mapping):
    """A section of a file: components by name. `time` has shape (states,), in the file's unit.

    `problems` says what is damaged or missing, `notes` what was done to the values.
    """

    _what = "component"

    def __init__(self, name, title, solver, problems, notes, time, histories):
        self.name, self.title, self.solver, self.problems, self.notes = name, title, solver, problems, notes
        self.time = _array(time)
        components, titles, ids = {}, {}, {}
        for component, entity, entity_title, values in histories:
            if entity not in ids:
                ids[entity] = _id(entity)
                titles[ids[entity]] = entity_title
            components.setdefault(component, {})[ids[entity]] = values
        super().__init__({name: Component(name, self.time, of, titles) for name, of in components.items()})

    def _columns(self):
        for component in self.values():
            for entity, values in component.items():
                yield component.name, entity, values

    def to_pandas(self):
        """A DataFrame over time with columns (component, id), in the file's units: `frame["x_velocity", 900001]`."""
        return self._frame(self._columns())

    def _shown(self):
        # A notebook shows no more columns, however many there are.
        return self._frame(islice(self._columns(), 20))

    def _frame(self, histories):
        import pandas as pd

        columns = {(component, "" if entity is None else entity): values for component, entity, values in histories}
        frame = pd.DataFrame(columns, index=pd.Index(self.time, name="time"))
        frame.columns = pd.MultiIndex.from_tuples(frame.columns, names=["component", "id"])
        return frame

    def to_polars(self):
        """A DataFrame with the column `time` and one for each history, named as by `crumple histories`."""
        import polars as pl

        columns = {c if e is None else f"{c}[{e}]": v for c, e, v in self._columns()}
        return pl.DataFrame({"time": self.time, **columns})

    def to_xarray(self):
        """A Dataset with a variable for each component, over time and id; global quantities over time alone."""
        import xarray as xr

        variables = {}
        for name, component in self.items():
            is_global = component.ids == [None]
            # Each component has its own ids where these differ.
            dims = ("time",) if is_global else ("time", self._dimension(component))
            variables[name] = (dims, component[None] if is_global else component.array)
        coords = {"time": self.time}
        for component in self.values():
            if component.ids != [None]:
                coords[self._dimension(component)] = component.ids
        return xr.Dataset(variables, coords=coords, attrs={"title": self.title or ""})

    def _dimension(self, component):
        all_ids = [other.ids for other in self.values() if other.ids != [None]]
        return "id" if all(ids == all_ids[0] for ids in all_ids) else f"id_{component.name}"


class Histories(_Table, _Mapping):
    """What a solver wrote, in its units: sections by name. A text file has one, named after its format.

    `histories["nodout"]["x_velocity"][900001]` is an array over time; `to_pandas()` a table of all.
    """

    _what = "section"

    def __init__(self, path, sections):
        super().__init__({section.name: section for section in sections})
        self.path = path

    @property
    def problems(self):
        """What is damaged or missing, of all sections."""
        return [problem for section in self.values() for problem in section.problems]

    def only(self):
        """The only section."""
        if len(self) != 1:
            raise ValueError(f"there are {len(self)} sections: choose one of {', '.join(self)}")
        return next(iter(self.values()))

    def to_pandas(self):
        """`Section.to_pandas` of the only section: a DataFrame over time with columns (component, id)."""
        return self.only().to_pandas()

    def to_polars(self):
        """`Section.to_polars` of the only section."""
        return self.only().to_polars()

    def to_xarray(self):
        """`Section.to_xarray` of the only section."""
        return self.only().to_xarray()

    def _shown(self):
        import pandas as pd

        def row(section, component):
            first, last = (section.time[0], section.time[-1]) if len(section.time) else (None, None)
            ids = len(component)
            return {"section": section.name, "component": component.name, "ids": ids, "states": len(section.time), "from": first, "to": last}

        return pd.DataFrame([row(section, component) for section in self.values() for component in section.values()])


def read(path, ids=None, components=None, section=None, format=None):
    """Read a solver's file: any that the program reads (nodout, rcforc, binout, T01, ...). Values are in the file's units.

    Of a run's folder all these files are read, each for those of the ids and components that it has, without those that have none;
    of two sections of one name each has that of its file before it, "binout0000/nodout".

    Only what is selected is parsed: `ids` (numbers, or texts such as "3:surfa"), `components` (named as in binout), one or
    several, a `section` of a binout. Damage is not an error: `problems` names it.

    Raises `crumple.Error` if the file cannot be opened or read.
    """
    # Here, since an iterator has its items once, and a folder has several files.
    ids, components = _listed(ids), _listed(components)

    def sections(file, ids=ids, components=components):
        return [Section(*of) for of in _crumple.read(os.fspath(file), ids, components, section, format)]

    def held(all_of, is_held):
        several = all_of is not None and len(all_of) > 1
        return [one for one in all_of if is_held(one)] or all_of if several else all_of

    def read_if_there(file, *selected):
        try:
            return sections(file, *selected)
        except Error:
            return None

    def fitting(file):
        """The sections of a file for what it has of several ids and components; most files have all or none."""
        of_ids, of_components = ids, components
        read = read_if_there(file)
        if read is None:
            of_components = held(components, lambda one: read_if_there(file, [], [one]) is not None)
            read = read_if_there(file, ids, of_components) if of_components != components else None
        if read is None:
            of_ids = held(ids, lambda one: read_if_there(file, [one], of_components) is not None)
            read = sections(file, of_ids, of_components)
        missing.difference_update(of_ids or (), of_components or ())
        return read

    if not os.path.isdir(path):
        return Histories(Path(path), sections(path))
    missing = {*(ids or ()), *(components or ())}
    found, error = [], Error(f"{os.fspath(path)}: there are no solver files in this folder")
    for file in _crumple.files(os.fspath(path)):
        try:
            found += [(file, of) for of in fitting(file)]
        except Error as unread:
            if ids is components is section is None:
                raise
            # A file that can be read lacks what is selected, unless that lies in a part that is damaged.
            if any(problems for _, _, _, problems, *_ in _crumple.read(os.fspath(file), [], None, None, format)):
                _warn(f"{unread}; the file is damaged, and left out")
            error = unread
    if not found:
        raise error
    if missing:
        raise Error(f"{os.fspath(path)}: no file of this folder has {', '.join(sorted(missing))} with what else is selected")
    names = [of.name for _, of in found]
    for file, of in found:
        if names.count(of.name) > 1:
            of.name = f"{file.name}/{of.name}"
    return Histories(Path(path), [of for _, of in found])


class Case(_Table):
    """One FE run of a database. Arrays have shape (states,), from contact to the end of the record: after the largest
    deflection they go back along the unloading.

    `time` in s, `deflection` in m, `force` in N (which one says `force_kind`), `closing_speed` in m/s; `speed` in m/s is
    measured against what `speed_kind` says, masses are in kg. `body_force` in N is the force that slows the body: its mass
    times its deceleration, filtered and scaled to the energy that it loses; of a table without times, `force`.
    """

    def __init__(self, name, speed, masses, force_kind, curves, tags, warnings):
        self.name, (self.speed, self.speed_kind) = name, speed
        (self.mass, self.other_mass), self.force_kind = masses, force_kind
        self.time, self.deflection, self.force, self.body_force, self.closing_speed = map(_array, curves)
        self.tags, self.warnings = tuple(tags), tuple(warnings)
        self._is_read = True

    def __setattr__(self, name, value):
        if "_is_read" in self.__dict__:
            raise AttributeError(f"{name}: a case cannot be changed, because its group gives the same one to every caller; copy its arrays instead")
        super().__setattr__(name, value)

    def __delattr__(self, name):
        self.__setattr__(name, None)

    def __setstate__(self, state):
        self.__dict__.update(_locked(state))

    def to_pandas(self):
        """A DataFrame over time: deflection, force, body_force, closing_speed, in SI."""
        import pandas as pd

        columns = {name: getattr(self, name) for name in ("deflection", "force", "body_force", "closing_speed")}
        return pd.DataFrame(columns, index=pd.Index(self.time, name="time"))

    def __repr__(self):
        return f"<Case {self.name}: {self.speed * 3.6:.4g} km/h ({self.speed_kind})>"


class Group(_Table, _Mapping):
    """Cases by name, in order of speed. Each is read from the file when it is first asked for, and no other with it."""

    _what = "case"

    def __init__(self, path, name, cases, state):
        super().__init__(dict.fromkeys(cases))
        self.path, self.name, self._state = path, name, state

    def __contains__(self, name):
        return name in self._items

    def __getitem__(self, name):
        case = super().__getitem__(name)
        if case is None:
            read = _crumple.case(os.fspath(self.path), self.name, name)
            # Afterwards, so that what was read is of the file that was opened.
            if _state(self.path) != self._state:
                raise Error(f"{self.path} has changed since it was opened, and its cases with it: open it again")
            case = self._items[name] = Case(*read)
        return case

    def to_pandas(self):
        """A DataFrame of all samples: case, speed, time, deflection, force, body_force."""
        import pandas as pd

        def frame(case):
            columns = {name: getattr(case, name) for name in ("time", "deflection", "force", "body_force")}
            return pd.DataFrame({"case": case.name, "speed": case.speed, **columns})

        return pd.concat([frame(case) for case in self.values()], ignore_index=True)

    def _shown(self):
        """A row for each case, of the first ones if there are many: a notebook shows no more, and each is read."""
        import pandas as pd

        def row(case):
            crush, force = case.deflection.max(), case.force.max()
            return {"case": case.name, "speed": case.speed, "mass": case.mass, "deflection.max()": crush, "force.max()": force}

        return pd.DataFrame([row(self[name]) for name in islice(self, 50)])


class Database(_Mapping):
    """A curve database: groups by name. Open it again after the file was changed, by `build` or another program."""

    _what = "group"

    def __init__(self, path):
        # Cases are read later, perhaps from another folder.
        self.path = Path(path).resolve()
        # Before it is read: a change in between is then found.
        state = _state(self.path)
        groups = _crumple.database(os.fspath(path))
        super().__init__({name: Group(self.path, name, cases, state) for name, cases in groups})

    def validate(self, group=None, **options):
        """As `crumple.validate`."""
        return validate(self.path, group, **options)

    def train(self, output, group=None, **options):
        """As `crumple.train`."""
        return train(self.path, output, group, **options)

    def _repr_svg_(self):
        return _picture(self.path, "--group", next(iter(self))) if len(self) else None


class Model:
    """A trained model: curves at speeds that were never run."""

    def __init__(self, path):
        self.path = Path(path).resolve()
        self._model = _crumple.TrainedModel(os.fspath(path))
        self.group, self.name, self.range = self._model.facts()

    def predict(
        self, speed=None, extrapolate=False, *, crush=None, mass=None, max_crush=None, parameters=None, energy_correct=False
    ):
        """The curve at a speed: a number in m/s, or text with a unit, "50km/h".

        `crush` (m, or "620mm") replaces the speed, and cannot be combined with `extrapolate`: the speed between the runs that gives
        this maximum crush is used. `document["found_by_crush"]` holds that speed, and the speeds for a crush smaller and larger
        by the model's mean error.

        `mass` (kg, or "30t") is that of the body if it is not the runs'; `max_crush` the rule for the largest deflection: "spline",
        "monotone", "energy" or "motion" (default: "motion", if it has an answer at every speed left out); `parameters` a dict of
        the model's further parameters; `energy_correct` scales the forces so that the one that moves
        the body takes up the impact's energy.

        What the program warns of is a Python warning (`crumple.Warned`), and in `Curve.warnings`.

        Raises `crumple.Error` far outside the speeds of the runs (`range`, in m/s), unless `extrapolate`.
        """
        if parameters is not None and not hasattr(parameters, "items"):
            raise TypeError(f"parameters {parameters!r}: expected a dict, such as {{'other_mass_kg': 22e3}}")
        further = list((parameters or {}).items())
        if (speed is None) == (crush is None) or (extrapolate and crush is not None):
            raise TypeError("give a speed, with or without extrapolate, or a crush")
        speed = None if speed is None else _quantity("speed", speed, "m/s")
        crush = None if crush is None else _quantity("crush", crush, "m")
        mass = None if mass is None else _quantity("mass", mass, "kg")
        document = self._model.predict(speed, crush, extrapolate, mass, max_crush, further, energy_correct)
        curve = Curve(json.loads(document))
        for warning in curve.warnings:
            _warn(warning["message"])
        return curve

    # A copy is the same model, whatever has become of its file.
    def __getstate__(self):
        return {**self.__dict__, "_model": self._model.to_json()}

    def __setstate__(self, state):
        self.__dict__.update(state, _model=_crumple.TrainedModel.of_json(os.fspath(state["path"]), state["_model"]))

    def __repr__(self):
        low, high = (3.6 * speed for speed in self.range)
        return f"<Model {self.name} of {self.group}, {low:.4g} to {high:.4g} km/h>"


class Curve:
    """A predicted curve, up to its largest deflection `max_deflection` in m.

    `deflection` in m. `force` in N is of the kind that `force_kind` names: "contact", the force on the obstacle, or "body",
    that which slows the body down; `body_force` is the latter, or None if it is not known. They differ where the crush
    zone has mass of its own.

    `band` and `body_band` are pairs of arrays in N, low and high, or None: at each deflection by itself, FE's force is
    expected within them with the probability `band_level` (0.9), by how far left-out runs were off. A whole curve leaves such a
    band somewhere more often than that. `document["provenance"]` has `band` and `body_band`, which say what they rest on:
    `pointwise_share`, the half width as a share of the level of the force around a deflection; `simultaneous_share`, how
    wide it would be to hold whole curves; `whole_curves`, the share of left-out curves that such a wide one held.

    `document` is what `crumple predict --json` prints. The others follow from it, and cannot be replaced.
    """

    def __init__(self, document):
        def array(key):
            if document.get(key) is None:
                return None
            values = np.array(document[key])
            # `document` is what is exported: a change here would be lost.
            values.flags.writeable = False
            return values

        self.document = document
        self.speed, self.max_deflection = document["speed_m_per_s"], document["max_deflection_m"]
        self.deflection, self.force = array("deflection_m"), array("force_N")
        self.body_force = array("body_force_N")
        self.force_kind = document["provenance"]["force_kind"]

        def band(low, high):
            return None if low is None or high is None else (low, high)

        self.band = band(array("force_low_N"), array("force_high_N"))
        self.body_band = band(array("body_force_low_N"), array("body_force_high_N"))
        of = document["provenance"].get("band")
        forces = (self.force, self.body_force, *(self.band or ()), *(self.body_band or ()))
        if self.deflection is None or any(of is not None and of.shape != self.deflection.shape for of in forces):
            raise Error("a curve has deflections (deflection_m), and one force for each in every array")
        self.band_level = None if of is None else of["level"]
        self.warnings = document.get("warnings", [])
        self._of_document = frozenset(self.__dict__)

    def __setattr__(self, name, value):
        if name in self.__dict__.get("_of_document", ()):
            keys = {"force": "force_N", "body_force": "body_force_N", "deflection": "deflection_m"}
            key = keys.get(name)
            how = f"crumple.Curve({{**curve.document, '{key}': list(...)}})" if key else "from a changed document"
            is_other = name == "force" and self.force_kind == "contact"
            of_force = "; export writes the body force, with force='contact' this one" if is_other else ""
            raise AttributeError(
                f"{name} is that of the document, which is what is exported: give a changed one, {how}{of_force}"
            )
        super().__setattr__(name, value)

    def __reduce__(self):
        # The arrays of a copy cannot be written to, either.
        own = self._of_document | {"_of_document"}
        return (type(self), (self.document,), {name: v for name, v in self.__dict__.items() if name not in own})

    def to_pandas(self):
        """A DataFrame over deflection: force, body_force and their bands (force_low, ...), where they are known."""
        import pandas as pd

        columns = {"force": self.force, "body_force": self.body_force}
        for name, band in [("force", self.band), ("body_force", self.body_band)]:
            columns |= {} if band is None else {f"{name}_low": band[0], f"{name}_high": band[1]}
        known = {name: values for name, values in columns.items() if values is not None}
        return pd.DataFrame(known, index=pd.Index(self.deflection, name="deflection"))

    def export(self, output, to=None, **options):
        """Write the curve for another tool; the format is that of the extension, or `to`: lsdyna, modelica, fmi3, ...

        Options are those of `crumple export`: `force="body"`, the default, is what drives a single-mass body, `force="contact"` is for
        bodies whose crush zone is a separate mass; `units="mm-t-s"`. The file goes on beyond `max_deflection` by an assumption,
        which it states, so that a run that crushes further has a force; with `tail="none"` it ends there.
        """
        from crumple._commands import _options, _output

        with tempfile.TemporaryDirectory() as folder:
            curve = self._written(folder)
            return run("export", *_output(output), *_options({"to": to, **options}), "--", curve)

    def _repr_svg_(self):
        with tempfile.TemporaryDirectory() as folder:
            return _picture(self._written(folder))

    def _written(self, folder):
        """A file of the document, in which arrays may stand for lists."""
        curve = Path(folder) / "curve.json"
        curve.write_text(json.dumps(self.document, default=_plain), encoding="utf-8")
        return curve

    def __repr__(self):
        return f"<Curve at {self.speed * 3.6:.4g} km/h up to {self.max_deflection:.3f} m>"


class Run(_Table, _Mapping):
    """A multi-body run: arrays over time by column, such as `v_m_per_s[A1]`; `summary` and `ledger` are dicts."""

    _what = "column"

    def __init__(self, document):
        self.summary, self.ledger = document.pop("summary"), document.pop("ledger")
        self.warnings = document.pop("warnings")
        super().__init__({name: np.array(values) for name, values in document.items()})

    def to_pandas(self):
        """A DataFrame over time."""
        import pandas as pd

        return pd.DataFrame({name: values for name, values in self.items() if name != "time_s"}, index=pd.Index(self["time_s"], name="time_s"))


def simulate(scenario):
    """Run a scenario (TOML)."""
    return Run(run("simulate", "--", scenario))


def _state(path):
    """What differs once a file was written anew; of no file None."""
    try:
        of = os.stat(path)
    except OSError:
        return None
    return of.st_size, of.st_mtime_ns


def __getattr__(name):
    if name == "sklearn":
        return importlib.import_module("crumple.sklearn")
    raise AttributeError(f"module 'crumple' has no attribute {name!r}")


def __dir__():
    return [*(name for name in globals() if name.startswith("__")), *__all__, "sklearn"]


def _picture(path, *arguments):
    # Nothing is shown where nothing can draw it.
    if not hasattr(_crumple, "main") and not os.environ.get("CRUMPLE"):
        return None
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.svg"
        run("plot", *arguments, "-o", picture, "--", path)
        return picture.read_text(encoding="utf-8")
