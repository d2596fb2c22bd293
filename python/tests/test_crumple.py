"""The package as it was installed, on the demo's folder (CRUMPLE_DEMO): values, errors, commands, clients, pickles."""

import copy
import json
import math
import multiprocessing
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pytest
import xarray as xr

import crumple

DEMO = Path(os.environ["CRUMPLE_DEMO"])
NODOUT = DEMO / "fe/lead-car-wall/36kmh/nodout"
BINOUT = Path(__file__).parents[2] / "fixtures/samples/lasso-python/binout/lasso_r12_smp_s_sph_rwforc"


def test_histories_are_those_of_the_file():
    histories = crumple.read(NODOUT)
    section = histories.only()
    velocity = section["x_velocity"]
    assert velocity.ids == [900001] and velocity.titles == ["COG of the rigid trailing mass"]
    # The rows of the file itself: node, then x velocity in the fifth column of numbers.
    rows = [line for line in NODOUT.read_text().splitlines() if line.startswith("   900001") or line.lstrip().startswith("900001")]
    numbers = [float(line[10 + 12 * 3 : 10 + 12 * 4]) for line in rows if len(line) > 100]
    assert len(numbers) == 400 and np.array_equal(velocity[900001], numbers)
    assert velocity[900001] is not None and not velocity[900001].flags.writeable
    assert velocity.array.shape == (400, 1) and np.shares_memory(velocity[900001], velocity["900001"])
    assert histories.problems == [] and len(section.time) == 400


def test_a_run_is_read_from_its_folder(tmp_path):
    run = crumple.read(NODOUT.parent)
    assert {"nodout", "rwforc"} <= set(run)
    assert np.array_equal(run["nodout"]["x_velocity"].array, crumple.read(NODOUT).only()["x_velocity"].array)
    assert list(crumple.read(NODOUT.parent, ids=900001)) == ["nodout"]
    for component, name in (("x_velocity", "nodout"), ("normal_force", "rwforc")):
        for components in ([component], iter([component])):
            read = crumple.read(NODOUT.parent, components=components)
            assert {name: list(section) for name, section in read.items()} == {name: [component]}
    # Each file is read for what it has of them.
    for selected in ({"components": ["x_velocity", "normal_force"]}, {"ids": [900001, 1], "components": ["x_velocity", "normal_force"]}):
        read = crumple.read(NODOUT.parent, **selected)
        assert {name: list(section) for name, section in read.items()} == {"nodout": ["x_velocity"], "rwforc": ["normal_force"]}
    for selected in ({"components": ["x_velocity", "no_force"]}, {"ids": [900001, 5], "components": "x_velocity"}):
        with pytest.raises(crumple.Error, match="no file of this folder has (no_force|5)"):
            crumple.read(NODOUT.parent, **selected)
    with pytest.raises(crumple.Error):
        crumple.read(NODOUT.parent, ids=5)
    with pytest.raises(crumple.Error, match="there are no solver files in this folder"):
        crumple.read(tmp_path)
    # What is damaged is not left out silently.
    (tmp_path / "nodout").write_text("garbage\n" * 5)
    shutil.copy(NODOUT.parent / "rwforc", tmp_path)
    assert crumple.read(tmp_path)["nodout"].problems
    with pytest.warns(crumple.Warned, match="the file is damaged, and left out"):
        assert list(crumple.read(tmp_path, ids=1)) == ["rwforc"]
    (tmp_path / "rwforc").unlink()
    for name in ("nodout", "other.nodout"):
        shutil.copy(NODOUT, tmp_path / name)
    assert list(crumple.read(tmp_path)) == ["nodout/nodout", "other.nodout/nodout"]


def test_measured_curves_are_added(tmp_path):
    table = pd.DataFrame({"d_mm": [0.0, 100.0, 200.0, 400.0], "force_kN": [0.0, 900.0, 1100.0, 1300.0]})
    for name in ("a b.csv", "b.csv"):
        table.to_csv(tmp_path / name, index=False)
    database = tmp_path / "tests.h5"
    speeds = [np.float64(6.0), "8m/s"]
    with pytest.warns(crumple.Warned):
        crumple.add(database, [tmp_path / "a b.csv", tmp_path / "b.csv"], group="tests", speed=speeds, mass=24e3, kind="wall", unloading=80e6, accept_energy=True)
    cases = crumple.Database(database)["tests"]
    assert [(case.speed, case.mass, round(case.force.max(), -3)) for case in cases.values()] == [(6.0, 24e3, 1.3e6), (8.0, 24e3, 1.3e6)]
    with pytest.raises(crumple.Error, match="--speed|speed"):
        crumple.add(database, tmp_path / "b.csv", group="tests")
    with pytest.raises(crumple.Error, match="there are no files"):
        crumple.add(database, [])
    with pytest.raises(crumple.Error, match="^speed: expected a number in m/s, or text with its unit, found True"):
        crumple.add(database, tmp_path / "b.csv", group="tests", speed=True, mass=24e3)
    with pytest.raises(crumple.Error, match="crumple simulate: an argument is None"):
        crumple.simulate(None)


def test_numpy_takes_the_values_of_a_component():
    component = crumple.read(NODOUT).only()["x_velocity"]
    assert np.array_equal(np.asarray(component), component.array) and np.max(component) == component[900001].max()
    assert np.asarray(component, dtype=np.float32).dtype == np.float32
    with pytest.raises(ValueError, match="always a copy"):
        np.asarray(component, copy=False)


def test_what_is_left_out_or_fails_is_a_warning(tmp_path):
    runs = tmp_path / "runs"
    for speed in ("25kmh", "36kmh", "48kmh"):
        shutil.copytree(DEMO / "fe/lead-car-wall" / speed, runs / speed)
    study = tmp_path / "study.toml"
    found = crumple.init(runs, study)
    assert "mass_kg.value" in found._repr_html_() and "<p>units: mm-t-s (" in found._repr_html_()
    crumple.build(study, tmp_path / "own.h5")
    database = crumple.Database(tmp_path / "own.h5")
    assert len(database["runs"]["25kmh"].force) > 0
    shutil.copy(study, tmp_path / "all.toml")
    (runs / "36kmh/nodout").unlink()
    with pytest.warns(crumple.Warned, match='36kmh has no file "nodout".*the case of an earlier build is kept'):
        built = crumple.build(study, tmp_path / "own.h5", overwrite=True)
    assert [run["outcome"] for run in built["runs"]] == ["unchanged", "failed", "unchanged"]
    with pytest.raises(crumple.Error, match="already and is not overwritten: name another with -o, or replace it with --overwrite"):
        crumple.init(runs, study)
    with pytest.warns(crumple.Warned, match="36kmh is left out: it has no histories of nodes"):
        crumple.init(runs, study, overwrite=True, mass=24e3)
    with pytest.warns(crumple.Warned, match="gives 24 t: check it"):
        crumple.init(runs, study, overwrite=np.True_, mass=np.array(30e3))
    for strict in (lambda: crumple.init(runs, study, overwrite=True, strict=True), lambda: crumple.build(tmp_path / "all.toml", tmp_path / "own.h5", strict=True)):
        with pytest.raises(crumple.Error, match="strict does not allow") as raised, pytest.warns(crumple.Warned, match="36kmh"):
            strict()
        assert raised.value.document["study" if "study" in raised.value.document else "runs"]
    # The file was written anew since it was opened.
    crumple.build(study, tmp_path / "own.h5")
    assert database["runs"]["25kmh"].mass == 24e3
    with pytest.raises(crumple.Error, match="has changed since it was opened.*open it again"):
        database["runs"]["48kmh"]
    (tmp_path / "own.h5").unlink()
    with pytest.raises(crumple.Error):
        database["runs"]["48kmh"]


def test_only_what_is_selected():
    histories = crumple.read(NODOUT, ids=[900001], components=["x_velocity"])
    assert list(histories.only()) == ["x_velocity"]
    with pytest.raises(crumple.Error, match="has no node 5: it has 900001") as raised:
        crumple.read(NODOUT, ids=[5])
    assert raised.value.code == "solver_file"
    with pytest.raises(crumple.Error) as raised:
        crumple.read(DEMO / "nothing")
    assert raised.value.code == "io"
    with pytest.raises(KeyError, match="there is no component 'speed': expected one of x_velocity"):
        histories.only()["speed"]
    with pytest.raises(ValueError):
        crumple.read(NODOUT, ids=["three"])
    with pytest.raises(crumple.Error, match='it has no section "rwforc": it is a text file with the one section "nodout"'):
        crumple.read(NODOUT, section="rwforc")
    # Of a file with several sections each name is in one at least.
    assert set(crumple.read(BINOUT, components="z_momentum")) >= {"matsum"}
    for wrong, said in [
        ({"components": ["z_momentum", "z_momentun"]}, 'the file has no component "z_momentun": .*did you mean "z_momentum"'),
        ({"ids": [101, 99999999]}, "the file has no entity 99999999: it has 101, 1"),
    ]:
        with pytest.raises(crumple.Error, match=said):
            crumple.read(BINOUT, **wrong)


def test_one_or_several_of_any_kind():
    whole = crumple.read(NODOUT).only()["x_velocity"][900001]
    for ids in (900001, 900001.0, "900001", [np.int64(900001)], np.array([900001]), pd.Series([900001.0]), np.array(900001)):
        for components in ("x_velocity", ["x_velocity"], np.array(["x_velocity"])):
            component = crumple.read(NODOUT, ids=ids, components=components).only()["x_velocity"]
            assert np.array_equal(component[np.int32(900001)], whole) and 900001.0 in component
    assert "\u00b2" not in component and None not in component and np.nan not in component and (900001,) not in component
    assert np.array(900001) in component
    for ids in (b"900001", [b"900001"], np.array([b"900001"])):
        with pytest.raises(TypeError, match="ids and components are numbers and texts, not bytes"):
            crumple.read(NODOUT, ids=ids)
    del component
    histories = crumple.read(NODOUT)
    view = histories.only()["x_velocity"][900001]
    again = pickle.loads(pickle.dumps(histories))
    del histories
    assert np.array_equal(view, whole)
    assert np.array_equal(again.only()["x_velocity"][900001], whole)
    for times in (again.only().time, again.only()["x_velocity"].time):
        with pytest.raises(ValueError, match="read-only"):
            times[0] = 1.0


def test_what_is_exported_cannot_be_changed_by_its_arrays(tmp_path):
    curve = crumple.Model(DEMO / "lead.model").predict(10.0)
    for values in (curve.force, curve.deflection, curve.body_force, *curve.band):
        with pytest.raises(ValueError, match="read-only"):
            values[:] = 1.0
    with pytest.raises(AttributeError, match="^force is that of the document.*'force_N'.*with force='contact' this one"):
        curve.force = 1.2 * curve.force
    with pytest.raises(AttributeError, match="^body_force is that of the document.*'body_force_N'"):
        curve.body_force = 1.2 * curve.body_force
    curve.label = "worst"
    curve.label = "best"
    for copied in (pickle.loads(pickle.dumps(curve)), copy.deepcopy(curve)):
        assert copied.label == "best"
        with pytest.raises(ValueError, match="read-only"):
            copied.body_force[:] *= 2.0
    worse = crumple.Curve({**curve.document, "force_N": list(1.2 * curve.force)})
    assert np.array_equal(pickle.loads(pickle.dumps(worse)).force, 1.2 * curve.force)
    by_array = crumple.Curve({**curve.document, "force_N": 1.2 * curve.force})
    for of in (worse, by_array):
        of.export(tmp_path / "worse.json", force="contact", overwrite=True)
        written = json.loads((tmp_path / "worse.json").read_text())["force_N"]
        assert np.array_equal(written[: len(worse.force)], worse.force)
    with pytest.raises(crumple.Error, match="one force for each"):
        crumple.Curve({**curve.document, "force_N": [0.0, 1.0]})


def test_a_model_is_copied_from_another_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(DEMO)
    model = crumple.Model("lead.model")
    monkeypatch.chdir(tmp_path)
    assert np.array_equal(copy.copy(model).predict(10.0).force, model.predict(10.0).force)


@pytest.mark.parametrize("speed", [np.array([10.0, 12.0]), [10.0], True, np.True_])
def test_what_is_not_one_speed_is_refused(speed):
    with pytest.raises(TypeError, match="^speed .*: expected one number in m/s, or text with a unit"):
        crumple.Model(DEMO / "lead.model").predict(speed)


def test_a_command_without_a_document_gives_its_text():
    assert crumple.run("--version").startswith("crumple ")


def test_folders_of_the_user_are_not_looked_into(tmp_path, monkeypatch):
    for name in ("random.py", "crumple.py", "signal.py"):
        (tmp_path / name).write_text("raise RuntimeError('not this one')\n")
    shutil.copy(DEMO / "scenario.toml", tmp_path / "-x.toml")
    shutil.copy(DEMO / "lead.model", tmp_path / "lead.model")
    monkeypatch.chdir(tmp_path)
    assert len(crumple.simulate("-x.toml")["time_s"]) > 100
    crumple.Model("lead.model").predict(10.0).export("-x.csv")
    assert (tmp_path / "-x.csv").exists()
    model = pickle.loads(pickle.dumps(crumple.Model("lead.model")))
    assert model.predict(10.0).max_deflection == crumple.Model("lead.model").predict(10.0).max_deflection
    monkeypatch.setattr(sys, "executable", "")
    with pytest.raises(crumple.Error, match="embedded or frozen"):
        crumple.simulate("-x.toml")


def test_damage_is_named(tmp_path):
    cut = tmp_path / "nodout"
    text = NODOUT.read_bytes()
    cut.write_bytes(text[: len(text) // 2])
    histories = crumple.read(cut)
    assert histories.problems and 100 < len(histories.only().time) < 300


def test_clients_have_the_same_values():
    section = crumple.read(NODOUT).only()
    values = section["x_velocity"][900001]
    frame = section.to_pandas()
    assert isinstance(frame, pd.DataFrame) and np.array_equal(frame["x_velocity", 900001], values)
    polars = section.to_polars()
    assert isinstance(polars, pl.DataFrame) and np.array_equal(polars["x_velocity[900001]"].to_numpy(), values)
    data = section.to_xarray()
    assert isinstance(data, xr.Dataset) and np.array_equal(data["x_velocity"].sel(id=900001), values)


def test_databases_models_and_curves(tmp_path):
    database = crumple.Database(DEMO / "curves.h5")
    case = database["lead-car-wall"]["36kmh"]
    assert math.isclose(case.speed, 10.0) and case.speed_kind == "wall" and case.mass == 24000.0
    work = np.trapezoid(case.force[: case.deflection.argmax()], case.deflection[: case.deflection.argmax()])
    assert 0.95 < work / (0.5 * case.mass * case.speed**2) < 1.06
    end = case.deflection.argmax()
    body_work = np.trapezoid(case.body_force[: end + 1], case.deflection[: end + 1])
    assert abs(body_work / (0.5 * case.mass * (case.closing_speed[0] ** 2 - case.closing_speed[end] ** 2)) - 1) < 0.01
    frame = database["lead-car-wall"].to_pandas()
    assert set(frame["case"]) == set(database["lead-car-wall"])
    assert np.array_equal(frame[frame["case"] == "36kmh"]["body_force"], case.body_force)
    model = crumple.Model(DEMO / "lead.model")
    curve = model.predict(50 / 3.6)
    # What the command gives.
    document = crumple.run("predict", DEMO / "lead.model", "--speed", "50km/h")
    assert np.array_equal(curve.force, document["force_N"]) and curve.max_deflection == document["max_deflection_m"]
    assert curve.band[0].shape == curve.force.shape and (curve.band[0] <= curve.force + 1e-6).all()
    with pytest.raises(crumple.Error, match="above the highest training speed") as raised:
        model.predict(30.0)
    assert raised.value.code == "prediction"
    assert (curve.force_kind, curve.band_level) == ("contact", 0.9)
    assert curve.body_band[0].shape == curve.body_force.shape and (curve.body_band[0] <= curve.body_force + 1e-6).all()
    frame = curve.to_pandas()
    assert np.array_equal(frame.index, curve.deflection) and np.array_equal(frame["body_force_high"], curve.body_band[1])
    assert list(case.to_pandas()) == ["deflection", "force", "body_force", "closing_speed"] and len(case.to_pandas()) == len(case.time)
    # Speeds with units, and what else the command takes.
    assert np.array_equal(model.predict("50km/h").force, curve.force)
    with pytest.warns(crumple.Warned, match="26.00 t differs"):
        heavier = model.predict("50km/h", mass="26t")
    assert heavier.max_deflection > curve.max_deflection and "26.00 t differs" in str(heavier.warnings)
    assert np.array_equal(model.predict("50km/h", mass=26e3).force, heavier.force)
    assert model.predict("50km/h", max_crush="spline").document["provenance"]["max_crush_rule"] == "spline"
    for wrong, what in [({"speed": "50"}, "unit"), ({"speed": "50km/h", "mass": "3m"}, "unit"), ({"speed": 14.0, "max_crush": "no"}, "expected one of spline")]:
        with pytest.raises((crumple.Error, ValueError), match=what):
            model.predict(**wrong)
    # The speed of a crush, as by the command.
    crushed = model.predict(crush="620mm", mass="26t")
    document = crumple.run("predict", DEMO / "lead.model", "--crush", "620mm", "--mass", "26t")
    assert crushed.document["found_by_crush"] == document["found_by_crush"] and crushed.speed == document["speed_m_per_s"]
    assert abs(crushed.max_deflection - 0.62) < 1e-9 and crushed.speed == model.predict(crush=0.62, mass=26e3).speed
    for wrong in [{}, {"speed": 10.0, "crush": 0.5}, {"crush": 0.5, "extrapolate": True}, {"crush": [1, 2]}]:
        with pytest.raises(TypeError, match="give a speed|expected one number in m,"):
            model.predict(**wrong)
    with pytest.raises(crumple.Error, match="no speed between those of the runs gives a crush of 90 m"):
        model.predict(crush=90)
    with pytest.raises(crumple.Error, match="has no unit"):
        model.predict(crush="620")
    with pytest.raises(crumple.Error, match="angle"):
        model.predict(14.0, parameters={"angle_deg": 10.0})
    with pytest.raises(TypeError, match="^parameters .*: expected a dict"):
        model.predict(14.0, parameters=[1])
    # The model that was read answers, whatever becomes of its file.
    own = tmp_path / "own2.model"
    shutil.copy(DEMO / "lead.model", own)
    loaded = crumple.Model(own)
    shutil.copy(DEMO / "vehicle.model", own)
    assert np.array_equal(loaded.predict("50km/h").force, curve.force)
    # The text is the program's; how Python says it stands beside it.
    with pytest.raises(crumple.Error, match="unexpected argument '--nodes'") as raised:
        crumple.init(tmp_path, nodes=1)
    assert "nsdm_seeds=3" in raised.value.__notes__[0]
    # As of a pattern that fits nothing; not the working folder.
    with pytest.raises(crumple.Error, match="no run folders"):
        crumple.init([])
    with pytest.raises(ValueError):
        model.predict(-1.0)
    exported = curve.export(tmp_path / "curve.k", units="mm-t-s")
    assert (tmp_path / "curve.k").stat().st_size == exported["bytes"]
    assert curve._repr_svg_().startswith("<svg") and database._repr_svg_().startswith("<svg")
    # Only its own state is given.
    case = database["lead-car-wall"]["36kmh"]
    with pytest.raises(AttributeError, match="force: a case cannot be changed"):
        case.force = None
    with pytest.raises(AttributeError):
        del case.force
    again = pickle.loads(pickle.dumps(case))
    assert again.force.sum() == case.force.sum() and not again.force.flags.writeable and isinstance(case.tags, tuple)
    assert database != crumple.Database(DEMO / "curves.h5") and database == database
    # Tables are shown as such, and documents as their rows.
    group = database["lead-car-wall"]
    section = crumple.read(NODOUT).only()
    for table, shown in [(crumple.read(NODOUT), "x_velocity"), (group, "36kmh"), (group["36kmh"], "closing_speed"), (section, "x_velocity")]:
        assert table._repr_html_().startswith("<div") and f">{shown}</t" in table._repr_html_()
    assert len(group._shown()) == len(group) and len(section._shown().columns) == 12
    run = crumple.simulate(DEMO / "scenario.toml")
    assert ">v_m_per_s[A1]</th>" in run._repr_html_()
    shown = database.validate("lead-car-wall")._repr_html_()
    assert "<p>lead-car-wall rows</p>" in shown and ">acceleration_l1</th>" in shown and ">passes</th>" in shown
    assert crumple.run("db", "diff", DEMO / "curves.h5", DEMO / "curves.h5")._repr_html_() is None
    trained = database.train(tmp_path / "own.model", "lead-car-wall", model="linear")
    assert trained.name == "linear" and trained.predict(50 / 3.6).force.shape == (trained.predict(50 / 3.6).deflection.shape)
    # A copy is the same model when its file is another.
    kept = pickle.dumps(trained)
    with pytest.warns(crumple.Warned) as warned:
        database.train(tmp_path / "own.model", "lead-car-wall", model="nearest").predict(85 / 3.6)
    assert {warning.filename for warning in warned} == {__file__}
    for copied in (pickle.loads(kept), copy.deepcopy(trained), copy.copy(trained)):
        assert copied.name == "linear" and copied.predict(12.0).document == trained.predict(12.0).document


def test_commands_are_functions(tmp_path):
    run = crumple.simulate(DEMO / "scenario.toml")
    assert run["v_m_per_s[A1]"].shape == run["time_s"].shape
    assert run.summary["interfaces"][0]["max_deflection_m"] > 0.5 and run.to_pandas().index.name == "time_s"
    validation = crumple.validate(DEMO / "curves.h5", "lead-car-wall")
    assert validation["groups"][0]["chosen"] == "crush-law"
    bad = tmp_path / "bad.toml"
    bad.write_text("[run]\nduration = 3\n")
    with pytest.raises(crumple.Error, match="has no unit") as raised:
        crumple.simulate(bad)
    error = raised.value
    assert (error.code, error.file, error.line, error.column) == ("toml", str(bad), 2, 12)
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and again.line == 2 and again.document is None
    with pytest.raises(crumple.Error, match="strict") as raised:
        crumple.run("simulate", DEMO / "train-set.toml", "--strict")
    again = pickle.loads(pickle.dumps(raised.value))
    assert again.document == raised.value.document and "summary" in again.document
    assert crumple.run("--version", check=False).startswith("crumple ")
    with pytest.warns(crumple.Warned, match="beyond the end of its curve's data"):
        crumple.simulate(DEMO / "train-set.toml")


def _fitted(seed):
    from crumple.sklearn import RegressionForest

    x = np.linspace(0, 1, 500).reshape(-1, 1)
    return RegressionForest(20, random_state=seed).fit(x, x[:, 0]).predict(x)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own():
    expected = _fitted(1)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert np.array_equal(pool.map_async(_fitted, [1]).get(timeout=60)[0], expected)


def test_the_program_comes_along():
    program = shutil.which("crumple", path=Path(sys.executable).parent)
    said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    assert said == f"crumple {crumple.__version__}\n"
    wrong = subprocess.run([program, "predict", "--json"], capture_output=True, text=True)
    assert wrong.returncode == 2 and json.loads(wrong.stdout)["error"]["code"] == "usage"


def test_other_threads_run_meanwhile():
    count, stop = 0, threading.Event()

    def counting():
        nonlocal count
        while not stop.is_set():
            count += 1
            time.sleep(1e-4)

    thread = threading.Thread(target=counting)
    thread.start()
    for _ in range(5):
        for group in crumple.Database(DEMO / "curves.h5").values():
            list(group.values())
    stop.set()
    thread.join()
    assert count > 3


def test_the_forest_is_an_estimator():
    from sklearn.utils.estimator_checks import check_estimator

    from crumple.sklearn import RegressionForest

    results = check_estimator(RegressionForest(n_estimators=10, random_state=1), on_skip=None, on_fail="raise")
    assert not [r for r in results if r["status"] in ("failed", "xfail")]
    random = np.random.default_rng(0)
    x = random.uniform(size=(300, 2))
    y = np.sin(6 * x[:, 0]) + x[:, 1]
    for frame in (pd.DataFrame(x, columns=["v", "d"]), pl.DataFrame({"v": x[:, 0], "d": x[:, 1]})):
        forest = RegressionForest(random_state=3).fit(frame, y)
        assert list(forest.feature_names_in_) == ["v", "d"]
        assert forest.score(frame, y) > 0.97 and math.isclose(forest.feature_importances_.sum(), 1.0)
        again = pickle.loads(pickle.dumps(forest))
        assert np.array_equal(again.predict(frame), forest.predict(frame))
    x = random.uniform(size=(50, 9))

    def predicted(features):
        return RegressionForest(5, max_features=features, random_state=0).fit(x, x[:, 0]).predict(x)

    for features, same in (("sqrt", 3), ("log2", 3), (0.5, 4), (0.01, 1), (1.0, None)):
        assert np.array_equal(predicted(features), predicted(same)), features
    for features in ("all", 0.0, 1.5):
        with pytest.raises(ValueError, match="expected a number, a share"):
            predicted(features)
    for name in ("n_estimators", "max_depth", "min_samples_leaf", "max_features"):
        with pytest.raises(ValueError, match=f"{name} is -1: expected 1 or more"):
            RegressionForest(**{name: -1}).fit(x, x[:, 0])


def test_cases_are_read_one_by_one(monkeypatch):
    read, seen = crumple._crumple.case, []
    monkeypatch.setattr(crumple._crumple, "case", lambda *names: seen.append(names) or read(*names))
    database = crumple.Database(DEMO / "curves.h5")
    assert list(database["lead-car-wall"])[:2] == ["12kmh", "18kmh"] and seen == []
    for _ in range(2):
        assert database["lead-car-wall"]["36kmh"].mass == 24000.0
    assert [name for _, _, name in seen] == ["36kmh"]
    with pytest.raises(KeyError, match="there is no case '36': expected one of 12kmh, 18kmh"):
        database["lead-car-wall"]["36"]
    assert "48kmh" in database["lead-car-wall"] and len(seen) == 1
    monkeypatch.chdir(DEMO)
    database = crumple.Database("curves.h5")
    monkeypatch.chdir("/")
    assert database["lead-car-wall"]["48kmh"].mass == 24000.0


def test_the_blend_of_curves_is_the_model_linear(tmp_path):
    import pandas as pd
    from sklearn.model_selection import LeaveOneGroupOut, cross_val_score
    from sklearn.utils.estimator_checks import check_estimator

    from crumple.sklearn import CurveRegressor

    results = check_estimator(CurveRegressor(), on_skip=None, on_fail="raise")
    assert not [r for r in results if r["status"] in ("failed", "xfail")]
    database = crumple.Database(DEMO / "curves.h5")
    group = database["lead-car-wall"]
    loading = {case.speed: case.force[: case.deflection.argmax() + 1] for case in group.values()}
    rows = [(case.speed, d) for case in group.values() for d in case.deflection[: case.deflection.argmax() + 1]]
    frame = pd.DataFrame(rows, columns=["v", "d"])
    force = np.concatenate(list(loading.values()))
    blend = CurveRegressor().fit(frame, force)
    assert list(blend.feature_names_in_) == ["v", "d"] and np.abs(blend.predict(frame) - force).max() < 1e-6 * force.max()
    again = pickle.loads(pickle.dumps(blend))
    assert np.array_equal(again.predict(frame), blend.predict(frame))
    for kmh in (20, 42, 66):
        curve = database.train(tmp_path / "linear.model", "lead-car-wall", model="linear").predict(kmh / 3.6)
        # A model's curve begins with no force, and has nodes of its own.
        at = pd.DataFrame({"v": kmh / 3.6, "d": curve.deflection[1:]})
        error = np.abs(blend.predict(at) - curve.force[1:]).sum() / np.abs(curve.force).sum()
        assert error < 1e-3, (kmh, error)
    scores = cross_val_score(CurveRegressor(), frame, force, groups=frame.v, cv=LeaveOneGroupOut())
    assert len(scores) == len(group) and np.median(scores) > 0.8, scores
    # With a second condition, which does not matter, at the conditions of the training.
    angle = frame.assign(angle=frame.v > 10)[["v", "angle", "d"]]
    assert np.allclose(CurveRegressor().fit(angle, force).predict(angle), force)


def test_progress_is_shown_and_ctrl_c_ends_a_command(tmp_path, monkeypatch, request):
    import tqdm.auto

    seen = []

    class Bar:
        n = 0

        def __init__(self, **options):
            seen.append(options)

        def update(self, more):
            self.n += more
            seen.append((self.n, self.total))
            if self.total == 2000000 and self.n > 0:
                signal.raise_signal(signal.SIGINT)

        def set_postfix_str(self, text):
            seen.append(text)

        def close(self):
            seen.append("closed")

    monkeypatch.setattr(tqdm.auto, "tqdm", Bar)
    # What runs in the background begins with Ctrl-C ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    shutil.copytree(DEMO, tmp_path / "demo")
    monkeypatch.chdir(tmp_path / "demo")
    crumple.sweep("scenario.toml", "sweep.csv")
    assert seen[0]["desc"] == "crumple sweep" and (15, 15) in seen and seen[-1] == "closed"
    seen.clear()
    crumple.build("fe/lead-car-wall/study.toml", "own.h5")
    assert any("kmh" in text for text in seen if isinstance(text, str)), seen
    # What an interrupted sweep has written is whole, and it goes on from there.
    varied = '{ what = "speed", train = "A", distribution = "uniform", from = "30km/h", to = "70km/h" }'
    text = Path("scenario.toml").read_text().split("[sweep]")[0]
    Path("long.toml").write_text(f"{text}\n[sweep]\nsamples = 2000000\nvary = [{varied}]\n")
    with pytest.raises(KeyboardInterrupt):
        crumple.sweep("long.toml", "long.csv")
    rows = Path("long.csv.part").read_text()
    assert not Path("long.csv").exists() and rows.endswith("\n") and 2 < rows.count("\n") < 2000000


def test_the_code_of_the_readme_runs(tmp_path, monkeypatch):
    shutil.copytree(DEMO, tmp_path / "demo")
    monkeypatch.chdir(tmp_path / "demo")
    text = (Path(__file__).parent.parent / "README.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) == 5
    names = {}
    for block in blocks:
        exec(block, names)
