//! Runs of one speed that differ by chance: their mean, their scatter, and what a band makes of it.

use std::collections::BTreeMap;
use std::fs;

use crate::common::{build_fixture, crumple_fails, crumple_ok, json, says, shared};
use crate::models::{all_kinds, case, database_of, died, family, law};
use crumple::assess::{Choice, train, validate};
use crumple::assess::{Purpose, Selection, gaps};
use crumple::curve::{Case, Parameter};
use crumple::database::Database;
use crumple::dataset::TrainingSet;
use crumple::surrogate::Scatter;
use crumple::surrogate::{Model, ModelKind, PredictedCurve, Query, predict};
use serde_json::Value;

const MASS_KG: f64 = 24e3;

/// A run stopped by one force alone, a share above or below 2 MN.
fn flat(name: &str, v: f64, share: f64) -> Case {
    case(name, v, MASS_KG, &|_, _| 2e6 * (1.0 + share))
}

fn scatter_of(cases: &[Case]) -> Option<Scatter> {
    validate(
        "made",
        cases,
        &[ModelKind::nearest(), ModelKind::linear()],
        Selection::Best(Purpose::Vehicle),
    )
    .unwrap()
    .scatter
}

fn near(found: f64, expected: f64) {
    within(found, expected, 1e-9);
}

fn within(found: f64, expected: f64, share: f64) {
    assert!((found / expected - 1.0).abs() < share, "{found} is not {expected}");
}

/// Each of a family's runs and one of the same bytes.
fn twice(cases: &[Case]) -> Vec<Case> {
    let again = |c: &Case| {
        let mut case = c.clone();
        case.id.name.push_str(" again");
        case
    };
    cases.iter().flat_map(|c| [c.clone(), again(c)]).collect()
}

/// Of n runs, deviations from their mean relative to it, by hand: the force is the same at every
/// deflection, so its local level is its mean. That holds but for the last millimetre, where the
/// stronger runs have turned back while their mean continues.
#[test]
fn a_known_scatter_comes_out() {
    let speeds = [8.0, 16.0];
    let mut cases: Vec<Case> = speeds.map(|v| flat(&format!("v{v}"), v, 0.0)).to_vec();
    assert_eq!(scatter_of(&cases), None);
    cases.extend([("a", -0.02), ("b", 0.0), ("c", 0.02)].map(|(n, s)| flat(n, 12.0, s)));
    let three = scatter_of(&cases).unwrap();
    within(three.force_share, 0.02, 5e-3);
    within(three.force_l1, 0.04 / 3.0 * 1.5_f64.sqrt(), 5e-3);
    assert!(three.largest_force_share >= three.force_share);
    // The force moves the body by itself; CFC 60 rounds where it begins and ends.
    let body = three.body.unwrap();
    within(body.force_share, 0.02, 0.15);
    assert!(body.largest_force_share >= body.force_share);
    assert_eq!((three.degrees_of_freedom, three.speeds.len()), (2, 1));
    assert_eq!(three.speeds[0].runs, ["a", "b", "c"]);
    near(three.speeds[0].speed_m_per_s, 12.0);
    // A second speed is pooled by its degrees of freedom.
    cases.extend([("d", -0.01), ("e", 0.01)].map(|(n, s)| flat(n, 20.0, s)));
    let both = scatter_of(&cases).unwrap();
    let (first, second) = (three.force_share, both.speeds[1].force_share);
    within(second, 0.01 * 2.0_f64.sqrt(), 5e-3);
    let pooled = |first: f64, second: f64| ((2.0 * first * first + second * second) / 3.0).sqrt();
    near(both.force_share, pooled(first, second));
    let body_at = |scatter: &Scatter, k: usize| scatter.speeds[k].body.unwrap().force_share;
    let expected = pooled(body_at(&three, 0), body_at(&both, 1));
    near(both.body.unwrap().force_share, expected);
    assert_eq!(both.degrees_of_freedom, 3);
    near(both.velocity_l1, (2.0 * three.velocity_l1 + both.speeds[1].velocity_l1) / 3.0);
}

/// The velocities by another route: sums over the states up to 30 ms after the maximum deflection.
#[test]
fn the_scatter_of_velocities_is_that_of_the_records() {
    let mut cases = [8.0, 16.0].map(|v| flat(&format!("v{v}"), v, 0.0)).to_vec();
    cases.extend([flat("a", 12.0, -0.02), flat("b", 12.0, 0.02)]);
    let (a, b) = (&cases[2], &cases[3]);
    let mean = |of: fn(&Case, usize) -> f64, i: usize| 0.5 * (of(a, i) + of(b, i));
    let states = a.curves.sampled.time_s().len();
    let deflection = |c: &Case, i: usize| c.curves.sampled.deflection_m()[i];
    let speed = |c: &Case, i: usize| c.curves.closing_speed_m_per_s[i];
    let end =
        (0..states).max_by(|&i, &k| mean(deflection, i).total_cmp(&mean(deflection, k))).unwrap();
    let (mut apart, mut whole) = (0.0, 0.0);
    for i in 0..=end + 40 {
        apart += 0.5 * (speed(a, i) - speed(b, i)).abs();
        whole += mean(speed, i).abs();
    }
    near(scatter_of(&cases).unwrap().velocity_l1, apart / whole * 2.0_f64.sqrt());
}

/// A model has one curve per speed, which is the mean of its runs in force, motion and ends.
#[test]
fn a_model_has_the_mean_of_equal_runs() {
    let mut cases = family(&[8.0, 16.0, 20.0]);
    let of = |name: &str, factor: f64| case(name, 12.0, MASS_KG, &|d, u| factor * law(d, u));
    cases.extend([of("b", 1.01), of("a", 0.99), of("c", 1.0)]);
    // Speeds as they are measured.
    cases[3].conditions.speed.m_per_s *= 1.0004;
    let set = TrainingSet::new("made", &cases).unwrap();
    let names: Vec<&str> = set.cases.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["v8", "a (mean of 3)", "v16", "v20"]);
    let (mean, middle) = (&set.cases[1], &cases[5]);
    assert_eq!(mean.runs, ["a", "b", "c"]);
    near(mean.speed_m_per_s, 12.0 * (1.0 + 0.0004 / 3.0));
    within(mean.envelope.end_m(), middle.max_deflection_m(), 1e-3);
    let own = middle.loading().unwrap().envelope;
    for d in [0.02, 0.1, 0.3, 0.4, 0.5] {
        within(mean.envelope.force_at(d), own.force_at(d), 3e-3);
        let work = own.work_to(d) / mean.envelope.work_to(d);
        within(work, 1.0, 2e-3);
    }
    // What is left of the energy, and the mean's own force moved it.
    let speed = mean.motion.closing_speed.force_at(0.3);
    within(0.5 * MASS_KG * (144.0 - speed * speed), own.work_to(0.3), 5e-3);
    let stiffness: f64 =
        cases[3..].iter().map(|c| c.curves.unloading_stiffness_n_per_m.unwrap()).sum::<f64>() / 3.0;
    near(mean.unloading_stiffness_n_per_m.unwrap(), stiffness);
    // The order of the runs changes nothing; any of their bytes changes the hash.
    let model = train("made", &cases, Choice::Kind(ModelKind::linear())).unwrap();
    cases.reverse();
    let other = train("made", &cases, Choice::Kind(ModelKind::linear())).unwrap();
    assert!(model.to_json().unwrap() == other.to_json().unwrap());
    cases[1].provenance.fingerprint += "!";
    let other = train("made", &cases, Choice::Kind(ModelKind::linear())).unwrap();
    assert_ne!(model.training_hash, other.training_hash);
    // Left out are all runs of a speed at once.
    let validation = model.leave_one_out.unwrap();
    let rows: Vec<&str> =
        validation.rows.iter().filter(|r| r.model == "linear").map(|r| r.case.as_str()).collect();
    assert_eq!(rows, names);
}

/// A width of a band that chance alone makes.
fn width(band: &crumple::surrogate::Band, key: &str) -> f64 {
    serde_json::to_value(band).unwrap()["scatter"][key].as_f64().unwrap()
}

/// The squares of both parts add, and that of the scatter is the same at every speed.
#[test]
fn the_scatter_is_the_floor_of_the_band() {
    let mut cases = family(&[6.0, 9.0, 15.0, 18.0]);
    let of = |name: &str, factor: f64| case(name, 12.0, MASS_KG, &|d, u| factor * law(d, u));
    cases.extend([of("a", 0.97), of("b", 1.03), of("c", 1.0)]);
    let model = train("made", &cases, Choice::Kind(ModelKind::linear())).unwrap();
    let validation = model.leave_one_out.as_ref().unwrap();
    let scatter = validation.scatter.as_ref().unwrap();
    for v in [6.0, 7.0, 12.0, 13.0, 18.5] {
        let band = predict(&model, &Query::at(v)).unwrap().provenance.band.unwrap();
        let of_scatter = width(&band, "pointwise_share");
        // t of two degrees of freedom.
        near(of_scatter, 2.92 * scatter.force_share);
        assert!(band.pointwise_share >= of_scatter);
        near(band.pointwise_share, band.interpolation_share().hypot(of_scatter));
        // That of the body force has the scatter of the body force.
        let band = predict(&model, &Query::at(v)).unwrap().provenance.body_band.unwrap();
        near(width(&band, "pointwise_share"), 2.92 * scatter.body.unwrap().force_share);
        near(width(&band, "simultaneous_share"), 2.92 * scatter.body.unwrap().largest_force_share);
    }
    assert_ne!(scatter.body.unwrap().force_share, scatter.force_share);
    // The file keeps it.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.model");
    model.write(&path).unwrap();
    let read = crumple::surrogate::Model::read(&path).unwrap();
    assert_eq!(read.leave_one_out, model.leave_one_out);
}

#[test]
fn runs_of_the_same_bytes_change_no_prediction() {
    let alone = family(&[7.0, 10.0, 13.0, 17.0, 20.0]);
    let doubled = twice(&alone);
    for kind in all_kinds() {
        let [one, two] =
            [&alone, &doubled].map(|cases| train("made", cases, Choice::Kind(kind)).unwrap());
        for v in [7.0, 8.5, 13.0, 21.0] {
            let [one, two] = [&one, &two].map(|model| predict(model, &Query::at(v)).unwrap());
            assert_eq!(one.deflection_m, two.deflection_m, "{} at {v}", kind.name());
            assert_eq!(one.force_n, two.force_n);
            assert_eq!(one.body_force_n, two.body_force_n);
            assert_eq!(one.force_low_n, two.force_low_n);
            assert_eq!(one.body_force_low_n, two.body_force_low_n);
            assert_eq!(one.unloading_stiffness_n_per_m, two.unloading_stiffness_n_per_m);
            assert_eq!((one.rebound, one.warnings), (two.rebound, two.warnings));
        }
        let [one, two] = [one, two].map(|model| model.leave_one_out.unwrap());
        assert_eq!(one.means, two.means);
        // A copy is not a repetition: it says nothing about the scatter.
        assert!(one.scatter.is_none() && two.scatter.is_none());
    }
}

/// Parameters distinguish runs that would else be replicates, and one of each kind is not.
#[test]
fn replicates_agree_in_parameters() {
    let mut cases = twice(&family(&[8.0, 12.0, 16.0]));
    for (i, case) in cases.iter_mut().enumerate() {
        let angle = Parameter::Number(10.0 * (i % 2) as f64);
        case.conditions.parameters = BTreeMap::from([("angle_deg".into(), angle)]);
    }
    assert_eq!(TrainingSet::new("made", &cases).unwrap().cases.len(), 6);
    let mut third = case("third", 8.0, MASS_KG, &|d, u| 1.01 * law(d, u));
    third.conditions.parameters = cases[1].conditions.parameters.clone();
    cases.push(third);
    let set = TrainingSet::new("made", &cases).unwrap();
    let runs: Vec<usize> = set.cases.iter().map(|c| c.runs.len()).collect();
    assert_eq!(runs, [1, 2, 1, 1, 1, 1]);
    // Masses are parameters by themselves.
    let mut heavy = twice(&family(&[8.0, 12.0]));
    heavy[1].conditions.masses.body_kg *= 1.1;
    let set = TrainingSet::new("made", &heavy).unwrap();
    assert_eq!((set.cases.len(), set.features[0].name().as_str()), (3, "mass_kg"));
}

#[test]
fn every_command_takes_replicates() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut cases = family(&[8.0, 16.0, 20.0]);
    let of = |name: &str, factor: f64| case(name, 12.0, MASS_KG, &|d, u| factor * law(d, u));
    cases.extend([of("a", 1.01), of("b", 0.99)]);
    database_of(&here.join("c.h5"), &[("made", cases.clone())]);
    assert!(crumple_ok(here, "db ls c.h5").contains("\nb "));
    assert!(!crumple_ok(here, "db check c.h5").contains("same speed"));
    let printed = crumple_ok(here, "validate c.h5 --next -v");
    let line = "made: scatter of 2 runs at 43.2 km/h: force 1.";
    assert!(printed.contains(line) && printed.contains(": no model can remove this part"));
    // Beside the means, and at the speed itself.
    assert_eq!(printed.matches("\nFE scatter (floor)").count(), 2, "{printed}");
    for force in ["contact", "body"] {
        let parts = format!("of the local {force} force (interpolation ±");
        says(&printed, &parts);
    }
    let report: Value = serde_json::from_str(&crumple_ok(here, "validate c.h5 --json")).unwrap();
    let scatter = &report["groups"][0]["scatter"];
    assert_eq!(scatter["speeds"][0]["runs"], serde_json::json!(["a", "b"]));
    crumple_ok(here, "train c.h5 --group made -o m.model");
    says(&crumple_ok(here, "predict m.model --speed 12m/s"), "scatter between repeated runs ±");
    crumple_ok(here, "export m.model --speed 12m/s -o m.csv");
    let all = ["compare", "c.h5", "--group", "made", "--speed", "12m/s", "--nsdm-seeds", "0"];
    crumple_ok(here, &all);
    crumple_ok(here, "report c.h5 -o r.html");
    assert!(std::fs::read_to_string(here.join("r.html")).unwrap().contains("Repeated runs differ"));
    // Another recipe is not a replicate.
    cases[4].provenance.recipe = r#"{"recipe": {"filter": "CFC60"}}"#.into();
    database_of(&here.join("d.h5"), &[("made", cases)]);
    crumple_fails(here, 1, "validate d.h5");
    says(&crumple_ok(here, "db check d.h5"), "has the same speed as a, but a different recipe");
}

/// Dents 5 % deeper, sheets 1 % thicker, friction 10 % higher: nominally one run.
#[test]
#[ignore = "needs ../shared (the real files)"]
fn perturbed_runs_scatter_little() {
    let mut text = std::fs::read_to_string(shared("fe/lead-car-wall").join("study.toml")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path_of = |group: &str, run: &str| {
        let path = shared(&format!("fe/{group}/{run}"));
        format!("path  = \"{}\"\nname  = \"{run}\"", path.display())
    };
    for run in ["25kmh", "36kmh", "48kmh", "60kmh", "72kmh"] {
        text = text.replace(&format!("path  = \"{run}\""), &path_of("lead-car-wall", run));
    }
    for run in ["48dent", "48thick", "48fric"] {
        let path = path_of("lead-car-wall-perturbed", run);
        text += &format!("\n[[run]]\n{path}\nspeed = \"48km/h\"\nmass  = \"24t\"\n");
    }
    let study = folder.path().join("study.toml");
    std::fs::write(&study, text).unwrap();
    let built = crumple::build::build(&study, &folder.path().join("c.h5"), |_| {}).unwrap();
    let cases = built.database.cases("lead-car-wall");
    assert_eq!(cases.len(), 8);
    let scatter = scatter_of(cases).unwrap();
    assert_eq!(scatter.speeds[0].runs, ["48dent", "48fric", "48kmh", "48thick"]);
    let (force, velocity) = (scatter.force_l1, scatter.velocity_l1);
    assert!(force > 0.003 && force < 0.02 && scatter.force_share < 0.02, "{scatter:?}");
    assert!(velocity > 0.0 && velocity < 0.01, "{scatter:?}");
    // Beside an error of interpolation, of which it is a small part.
    let model = train(
        "lead-car-wall",
        cases,
        Choice::Auto { purpose: Purpose::Vehicle, seed: 0, trees: None },
    )
    .unwrap();
    let band = model.leave_one_out.unwrap().band.unwrap();
    assert!(width(&band, "pointwise_share") < 0.5 * band.interpolation_share(), "{band:?}");
}

/// A repeated run that ended while loading takes nothing away from the whole ones.
#[test]
fn a_repeated_run_that_died_is_left_out() {
    let other =
        |name: &str, share: f64| case(name, 12.0, MASS_KG, &|d, u| (1.0 + share) * law(d, u));
    let whole = [family(&[8.0, 16.0, 20.0]), vec![other("a", 0.01), other("b", -0.01)]].concat();
    let with_dead = [whole.clone(), vec![died(other("c", 0.0), 0.4)]].concat();
    let of = |cases: &[Case]| train("made", cases, Choice::Kind(ModelKind::linear())).unwrap();
    let (expected, found) = (of(&whole), of(&with_dead));
    assert_eq!(found.leave_one_out, expected.leave_one_out);
    let curve = |model: &Model| predict(model, &Query::at(12.0)).unwrap();
    let said = "run \"a (mean of 2)\": c, of the same speed, ended while loading and is left out";
    assert!(curve(&found).warnings.iter().any(|w| w.message == said));
    assert_eq!(curve(&found).force_n, curve(&expected).force_n);
    // If all died, there is nothing else.
    let dead = [family(&[8.0, 16.0, 20.0]), vec![died(other("c", 0.0), 0.4)]].concat();
    assert!(of(&dead).cases.iter().any(|case| case.truncated));
}

/// Runs that ended where they were crushed most show no rebound: the same stiffness is taken of a model and a case, and of what each
/// was written to.
#[test]
fn curves_without_a_rebound_unload_alike_in_every_form() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let whole = Database::read(&build_fixture(here, "lead-car-wall")).unwrap();
    let mut database = Database::default();
    for case in whole.cases("lead-car-wall") {
        database.put(died(case.clone(), 0.99)).unwrap();
    }
    database.write(&here.join("dead.h5")).unwrap();
    crumple_ok(here, "train dead.h5 --model crush-law -o a.model -q");
    crumple_ok(here, "predict a.model --speed 48km/h -o p.json -o p.csv -q");
    crumple_ok(here, "export dead.h5 --case 48kmh -o c.json -q");
    crumple_ok(here, "export dead.h5 --case 48kmh -o c.csv -q");
    let restitution = |source: &str| {
        let scenario = format!(
            "run = {{ duration = \"300ms\" }}\ncurves.nose = {{ {source} }}\nwall = {{}}\ncontact = {{ curve = \"nose\" }}\n\
             train = [{{ name = \"A\", speed = \"48km/h\", vehicles = [{{ name = \"A1\", mass = \"24t\" }}] }}]\n"
        );
        fs::write(here.join("s.toml"), scenario).unwrap();
        let found = json(&crumple_ok(here, "simulate s.toml --json -q"));
        found["summary"]["interfaces"][0]["restitution"].as_f64().unwrap()
    };
    for forms in [
        ["model = \"a.model\"", "file = \"p.json\"", "file = \"p.csv\""],
        [
            "database = \"dead.h5\", case = \"lead-car-wall/48kmh\"",
            "file = \"c.json\"",
            "file = \"c.csv\"",
        ],
    ] {
        let found = forms.map(restitution);
        assert!(found.iter().all(|r| (r / found[0] - 1.0).abs() < 1e-4), "{forms:?}: {found:?}");
    }
}

/// A run that ended before a slower one stood narrows no interval: not that of a band, of `nearest`, or of the next run. Its peak so far
/// is not that of its speed.
#[test]
fn a_run_that_died_shows_no_more_than_a_slower_one() {
    let without = family(&[6.0, 8.0, 12.0, 20.0, 22.0]);
    let dead = |share| died(case("dead", 16.0, MASS_KG, &law), share);
    let with = |share| [without.clone(), vec![dead(share)]].concat();
    let model = |cases: &[Case], kind| train("made", cases, Choice::Kind(kind)).unwrap();
    let at = |model: &Model, v| predict(model, &Query::at(v)).unwrap();
    for kind in [ModelKind::nearest(), ModelKind::rate()] {
        let [none, early, late] = [without.clone(), with(0.15), with(0.9)].map(|c| model(&c, kind));
        let gap = |model: &Model| at(model, 15.0).provenance.band.map(|band| band.span_m_per_s);
        let near = |model: &Model| at(model, 15.0).provenance.nearest_training_speed_m_per_s;
        assert_eq!((near(&none), near(&early), near(&late)), (12.0, 12.0, 16.0));
        if kind == ModelKind::nearest() {
            assert_eq!(at(&early, 15.0).force_n, at(&none, 15.0).force_n);
            let said = |curve: &PredictedCurve| {
                curve.warnings.iter().any(|w| w.message.contains("m of the nearest run: the force"))
            };
            // Of 12 m/s the curve ends before a faster body stands.
            assert!(said(&at(&none, 15.0)) && !said(&at(&none, 11.0)));
        } else {
            assert_eq!(gap(&none), gap(&early));
            assert!(gap(&late) < gap(&none), "{:?}", gap(&late));
        }
        let codes = |curve: PredictedCurve| curve.warnings.into_iter().map(|w| w.code.name());
        assert!(codes(at(&early, 16.0)).all(|code| code != "peak_force"));
    }
    let next = |cases: &[Case]| {
        let of = model(cases, ModelKind::rate()).leave_one_out.unwrap();
        gaps(&TrainingSet::new("made", cases).unwrap(), &of).remove(0).between_m_per_s
    };
    assert_eq!(next(&with(0.15)), next(&without));
}
