//! Contact and plausibility: where a curve begins, and which runs no crash can be.

use std::fs;
use std::path::Path;

use crate::common::{build_fixture, crumple_fails, crumple_in, crumple_ok, entries, fixture, says};
use crumple::curve::{Extracted, Measured, MeasuredForce, Setup, Stated, StatedContact, extract};
use crumple::curve::{Masses, Quality};
use crumple::curve::{Recipe, RecordedMotion};
use crumple::history::{EntityId, History};
use crumple::solver::{self, Selection};
use crumple::unit::{SpeedKind, UnitSystem};

const INTERVAL_S: f64 = 0.75e-3;

/// One run of lead-car-wall in the solver's units, to be changed.
struct Run {
    speed_m_per_s: f64,
    /// That the study says.
    units: &'static str,
    mass_kg: f64,
    displacement: History,
    velocity: History,
    acceleration: History,
    force: History,
}

impl Run {
    fn read(km_per_h: u32) -> Self {
        let folder = fixture(&format!("fe/lead-car-wall/{km_per_h}kmh"));
        let nodout = solver::read(&folder.join("nodout"), None, &Selection::all()).unwrap();
        let rwforc = solver::read(&folder.join("rwforc"), None, &Selection::all()).unwrap();
        let node = |component| nodout.history(Some(EntityId::new(900_001)), component).unwrap();
        Self {
            speed_m_per_s: f64::from(km_per_h) / 3.6,
            units: "mm-t-s",
            mass_kg: 24e3,
            displacement: node("x_displacement").clone(),
            velocity: node("x_velocity").clone(),
            acceleration: node("x_acceleration").clone(),
            force: rwforc.history(Some(EntityId::new(1)), "normal_force").unwrap().clone(),
        }
    }

    /// The same with `states` of free flight in front.
    fn after_flight(mut self, states: usize) -> Self {
        let v = self.velocity.values[0];
        let flight_s = states as f64 * INTERVAL_S;
        let before = |k: usize| k as f64 * INTERVAL_S;
        let time: Vec<f64> = (0..states)
            .map(before)
            .chain(self.displacement.time.iter().map(|t| t + flight_s))
            .collect();
        let prepend = |history: &mut History, value: &dyn Fn(f64) -> f64| {
            let values = (0..states).map(|k| value(before(k) - flight_s));
            history.values = values.chain(history.values.iter().copied()).collect();
            history.time = time.clone().into();
        };
        prepend(&mut self.displacement, &|t| v * t);
        prepend(&mut self.velocity, &|_| v);
        prepend(&mut self.acceleration, &|_| 0.0);
        prepend(&mut self.force, &|_| 0.0);
        self
    }

    /// Every `n`-th state, so that the last of the flight, just before contact, is one of them.
    fn thinned(mut self, n: usize, first: usize) -> Self {
        for history in
            [&mut self.displacement, &mut self.velocity, &mut self.acceleration, &mut self.force]
        {
            let keep = |i: &usize| *i >= first && (*i - first).is_multiple_of(n);
            let kept = (0..history.values.len()).filter(keep);
            (history.time, history.values) = (
                kept.clone().map(|i| history.time[i]).collect::<Vec<_>>().into(),
                kept.map(|i| history.values[i]).collect(),
            );
        }
        self
    }

    /// The same run as a solver would have written it in other units.
    fn written_in(mut self, units: &str) -> Self {
        let from = UnitSystem::parse("mm-t-s").unwrap();
        let to = UnitSystem::parse(units).unwrap();
        let scale = |history: &mut History, factor: f64| {
            history.time = history.time.iter().map(|t| t * from.time_s / to.time_s).collect();
            history.values.iter_mut().for_each(|v| *v *= factor);
        };
        scale(&mut self.displacement, from.length_m / to.length_m);
        scale(&mut self.velocity, from.speed() / to.speed());
        scale(&mut self.acceleration, from.acceleration() / to.acceleration());
        scale(&mut self.force, from.force() / to.force());
        self
    }

    fn extract_with(&self, recipe: &str, stated: Stated) -> Result<Extracted, crumple::Error> {
        let recipe: Recipe = toml::from_str(recipe).unwrap();
        let is_body = recipe.force_is_body();
        let measured = Measured {
            units: UnitSystem::parse(self.units).unwrap(),
            displacement: &self.displacement,
            minus_displacement: None,
            velocity: Some(&self.velocity),
            minus_velocity: None,
            force: if is_body {
                MeasuredForce::Body(&self.acceleration, RecordedMotion::Acceleration)
            } else {
                MeasuredForce::Contact(&self.force)
            },
            contact: recipe.contact.as_ref().map(|_| &self.force),
        };
        let setup = Setup {
            filter: recipe.filter,
            sampling: recipe.sampling,
            kind: SpeedKind::Wall,
            half_model: false,
            masses: Masses { body_kg: self.mass_kg, other_kg: None },
            manifest_speed_m_per_s: Some(self.speed_m_per_s),
            deck_speed: None,
            contact_threshold: recipe.contact_threshold.unwrap_or(0.005),
            of_impulse: false,
            stated,
            others: &Vec::new,
        };
        extract(&measured, &setup)
    }

    fn extract(&self) -> Extracted {
        self.extract_with(CONTACT_RECIPE, Stated::default()).unwrap()
    }
}

const CONTACT_RECIPE: &str = r#"
    deflection = { file = "nodout", node = 900001, component = "x_displacement" }
    force = { file = "rwforc", id = 1, component = "normal_force" }
    filter = "none"
"#;

fn crush(extracted: &Extracted) -> f64 {
    extracted.curves.original.deflection_m().iter().copied().fold(0.0, f64::max)
}

/// What no manifest and no file can hold, a program can give.
#[test]
fn impossible_arguments_are_refused() {
    let refused = |change: &dyn Fn(&mut Run), recipe: &str, expected: &str| {
        let mut run = Run::read(48);
        change(&mut run);
        let error = run.extract_with(recipe, Stated::default()).unwrap_err().to_string();
        says(&error, expected);
    };
    for mass_kg in [0.0, -24e3, f64::NAN, f64::INFINITY] {
        let expected = format!("the mass is {mass_kg}: expected a finite number above 0");
        refused(&|run| run.mass_kg = mass_kg, CONTACT_RECIPE, &expected);
    }
    let cut = |run: &mut Run| run.velocity.values.truncate(50);
    refused(&cut, CONTACT_RECIPE, "x_velocity[900001] has 50 values for 400 times");
}

#[test]
fn a_noisy_state_before_the_impact_does_not_move_the_contact() {
    for speed in [25, 36, 48, 60, 72] {
        let clean = Run::read(speed).after_flight(80);
        let expected = clean.extract();
        for early in [1, 15, 33, 66] {
            let mut noisy = Run::read(speed).after_flight(80);
            noisy.force.values[80 - early] = 5e4;
            let found = noisy.extract();
            if early as f64 * INTERVAL_S < 0.010 {
                // Too near to be distinguished from a bouncing nose plate: taken, or said.
                continue;
            }
            assert_eq!(
                found.curves.contact_time_s, expected.curves.contact_time_s,
                "{speed}, {early} early"
            );
            assert_eq!(crush(&found), crush(&expected));
            let said = found
                .quality
                .warnings
                .iter()
                .any(|w| w.starts_with("contact: ignored the force of"));
            assert!(said, "{:?}", found.quality.warnings);
        }
    }
}

#[test]
fn the_crush_counts_from_the_crossing_and_not_from_the_next_state() {
    for speed in [25, 36, 48, 60, 72] {
        let whole = crush(&Run::read(speed).extract());
        // The last state of free flight is 1 µs before the first touch.
        for every in [1, 7, 27] {
            let run = Run::read(speed).after_flight(81);
            let shifted = |mut run: Run| {
                // The first state of FE's record is the touch itself: its force is zero there.
                run.force.values[81] = 0.0;
                run
            };
            let found = shifted(run).thinned(every, 81 % every).extract();
            // From the next state on it would be off by 0.8, 5.6 and 22 %.
            let most = [(1, 0.001), (7, 0.01), (27, 0.02)].into_iter().find(|m| m.0 == every);
            let error = crush(&found) / whole - 1.0;
            assert!(
                error.abs() < most.unwrap().1,
                "{speed} km/h, each {every}: crush is {error:+.4} off"
            );
            let said = found
                .quality
                .warnings
                .iter()
                .any(|w| w.contains("% of the crush: set contact_time"));
            let step = f64::from(every as u32) * INTERVAL_S * f64::from(speed) / 3.6;
            assert_eq!(said, step > 0.01 * crush(&found), "{:?}", found.quality.warnings);
        }
    }
}

#[test]
fn body_forces_find_the_contact_by_the_contact_force_or_say_that_they_cannot() {
    let body = r#"
        deflection = { file = "nodout", node = 900001, component = "x_displacement" }
        force = { file = "nodout", node = 900001, component = "x_acceleration", times = "mass" }
        filter = "none"
    "#;
    let with_contact =
        format!("{body}\ncontact = {{ file = \"rwforc\", id = 1, component = \"normal_force\" }}");
    for speed in [25, 36, 48, 60, 72] {
        let run = Run::read(speed).after_flight(40);
        let contact = run.extract();
        let measured = run.extract_with(&with_contact, Stated::default()).unwrap();
        assert_eq!(measured.curves.contact_time_s, contact.curves.contact_time_s);
        let alone = run.extract_with(body, Stated::default()).unwrap();
        let said =
            alone.quality.warnings.iter().any(|w| w.contains("where the body starts to slow down"));
        assert!(said, "{:?}", alone.quality.warnings);
    }
}

#[test]
fn a_long_weak_beginning_is_said() {
    for (force_n, states) in [(3e4, 60), (2.5e4, 20), (3e4, 80)] {
        let mut run = Run::read(48).after_flight(80);
        run.force.values[80 - states..80].fill(force_n);
        let found = run.extract();
        let said = found
            .quality
            .warnings
            .iter()
            .any(|w| w.contains("contribute less than 0.3 % of the impulse"));
        assert!(said, "{force_n} N over {states} states: {:?}", found.quality.warnings);
    }
    for speed in [12, 18, 25, 36, 48, 60, 72] {
        assert_eq!(Run::read(speed).extract().quality.warnings, [""; 0], "{speed} km/h");
    }
}

#[test]
fn a_run_that_ends_while_loading_is_held_against_what_it_stopped() {
    let folder = tempfile::tempdir().unwrap();
    study(folder.path(), "truncate = \"60ms\"");
    let output = crumple_in(folder.path(), "build study.toml -o c.h5");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    says(&said, "truncated: the maximum deflection is at the last state");
    assert!(!said.contains("energy:") && !said.contains("short:"), "{said}");
}

/// A record of fewer states than the recipe's: a warning while the contact lasts, a note when it is over.
#[test]
fn a_short_record_is_warned_of_while_the_contact_lasts() {
    // At 12 km/h the force dips to nothing in the 13th state, long before the largest.
    for (speed, states, warns) in [(72, 165, true), (72, 300, false), (12, 13, true)] {
        let mut run = Run::read(speed);
        for of in [&mut run.displacement, &mut run.velocity, &mut run.acceleration, &mut run.force]
        {
            of.time = of.time[..states].into();
            of.values.truncate(states);
        }
        let stated = Stated { accept_energy: true, ..Stated::default() };
        let quality = run.extract_with(CONTACT_RECIPE, stated).unwrap().quality;
        let is_said = |all: &[String]| all.iter().any(|w| w.starts_with("short: the record holds"));
        let said = (is_said(&quality.warnings), is_said(&quality.notes));
        assert_eq!(said, (warns, !warns), "{speed} km/h, {states} states");
    }
}

#[test]
fn a_wrong_state_does_not_turn_the_force() {
    let mut run = Run::read(36).after_flight(40);
    let expected = run.extract();
    run.force.values[5] = -2e7;
    assert_eq!(crush(&run.extract()), crush(&expected));
}

/// A study of the bundled run at 36 km/h with lines added to its entry and to [study].
fn study(folder: &Path, entry: &str) -> std::path::PathBuf {
    study_of(folder, "36kmh", &format!("speed = \"36km/h\"\nmass = \"24t\"\n{entry}"), "mm-t-s")
}

fn study_of(folder: &Path, run: &str, entry: &str, units: &str) -> std::path::PathBuf {
    let path = folder.join("study.toml");
    let run = fixture(&format!("fe/lead-car-wall/{run}"));
    let text = format!(
        "[study]\nname = \"s\"\nunits = \"{units}\"\ngroup = \"g\"\nkind = \"wall\"\n[recipe]\n{CONTACT_RECIPE}\n[[run]]\npath = '{}'\nname = \"r\"\n{entry}\n",
        run.display()
    );
    fs::write(&path, text).unwrap();
    path
}

/// The case of a study as `db show --json` prints it.
fn built(folder: &Path, entry: &str) -> serde_json::Value {
    study(folder, entry);
    crumple_ok(folder, "build study.toml -o c.h5");
    let shown = crumple_ok(folder, "db show c.h5 --group g --case r --json");
    serde_json::from_str(&shown).unwrap()
}

/// The state at a stated contact belongs to the curve: a right time leaves nothing out.
#[test]
fn a_stated_contact_at_a_state_is_exact() {
    let run = Run::read(36);
    let (whole, later) = (run.extract(), Run::read(36).after_flight(4));
    for contact in [StatedContact::Time { s: 4.0 * INTERVAL_S }, StatedContact::Gap { m: 0.03 }] {
        let stated = Stated { contact: Some(contact), ..Stated::default() };
        let found = later.extract_with(CONTACT_RECIPE, stated).unwrap();
        let warned = &found.quality.warnings;
        assert!(!warned.iter().any(|w| w.contains("the curve leaves it out")), "{warned:?}");
        assert!((crush(&found) / crush(&whole) - 1.0).abs() < 1e-6, "{contact:?}");
    }
    // A state late, what came before is missing.
    let contact = Some(StatedContact::Time { s: 6.0 * INTERVAL_S });
    let found = later.extract_with(CONTACT_RECIPE, Stated { contact, ..Stated::default() });
    let warned = found.unwrap().quality.warnings;
    assert!(warned.iter().any(|w| w.contains("the curve leaves it out")), "{warned:?}");
}

#[test]
fn a_run_states_contact_gap_offset_end_and_sign() {
    let folder = tempfile::tempdir().unwrap();
    let crush = |entry: &str| {
        built(folder.path(), entry)["groups"]["g"][0]["max_deflection_m"].as_f64().unwrap()
    };
    let whole = crush("");
    let near = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-4, "{found} m is not {expected} m");
    };
    // 36 km/h is 10 m/s: 3 ms are 30 mm, before the body has slowed down by much.
    near(crush("gap = \"30mm\""), whole - 0.030);
    near(crush("offset = \"30mm\""), whole + 0.030);
    near(crush("offset = \"-30mm\""), whole - 0.030);
    assert!((crush("contact_time = \"3ms\"") - (whole - 0.030)).abs() < 0.001);
    assert!(crush("truncate = \"40ms\"\naccept_energy = true") < 0.75 * whole);
    near(crush("sign = 1"), whole);

    let fails = |entry: &str| {
        study(folder.path(), entry);
        crumple_fails(folder.path(), 1, "build study.toml -o d.h5")
    };
    let error = fails("contact_time = \"3s\"");
    says(&error, "contact_time = 3000 ms lies outside the record, which runs from 0 ms to 299.");
    let error = fails("gap = \"3m\"");
    says(&error, "gap = 3000 mm is never closed: the bodies approach each other by at most 56");
    says(&fails("offset = \"-3m\""), "offset = -3000 mm is never made up for");
    says(&fails("sign = -1"), "the force is never positive");
    says(&fails("sign = 2"), "sign = 2: expected 1 or -1");
    let error = fails("gap = \"3mm\"\ncontact_time = \"1ms\"");
    says(&error, "contact_time and gap both say when contact begins");
    says(
        &fails("truncate = \"0ms\""),
        "the record up to truncate holds 1 state: at least 2 are needed",
    );
}

#[test]
fn impossible_runs_are_refused_with_their_likely_cause() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |run: &str, entry: &str, units: &str, cause: &str| {
        study_of(folder.path(), run, entry, units);
        let error = crumple_fails(folder.path(), 1, "build study.toml -o d.h5");
        assert!(error.contains(cause), "{run}, {entry}, {units}: {cause} is not in\n{error}");
        says(&error, "accept_energy = true");
        assert!(!folder.path().join("d.h5").exists());
    };
    for run in ["25kmh", "36kmh", "48kmh", "60kmh", "72kmh"] {
        let speed = run.replace("kmh", "km/h");
        let with = |mass: &str| format!("speed = \"{speed}\"\nmass = \"{mass}\"");
        let without = |mass: &str| format!("mass = \"{mass}\"");
        let units = "likely the units: read as \"mm-t-s\" it would fit";
        refused(run, &with("24t"), "SI", units);
        refused(run, &without("24t"), "SI", units);
        refused(run, &with("24t"), "mm-kg-ms", units);
        refused(run, &without("24t"), "mm-kg-ms", units);
        // At a thousandth of the times a filter leaves nothing of the force.
        let study = fs::read_to_string(study_of(folder.path(), run, &with("24t"), "mm-kg-ms"));
        let filtered = study.unwrap().replace("filter = \"none\"", "filter = \"CFC60\"");
        says(&filtered, "CFC60");
        fs::write(folder.path().join("study.toml"), filtered).unwrap();
        says(&crumple_fails(folder.path(), 1, "build study.toml -o d.h5"), units);
        let mass = "likely the mass (impulse and speeds give 2";
        refused(run, &with("12t"), "mm-t-s", mass);
        refused(run, &without("48t"), "mm-t-s", mass);
        if run == "60kmh" {
            let other = "speed = \"25km/h\"\nmass = \"24t\"";
            refused(run, other, "mm-t-s", "likely the speed: the record's is 60 km/h");
        }
    }
    // A run may be taken as it is, and says so.
    study_of(folder.path(), "36kmh", "mass = \"12t\"\naccept_energy = true", "mm-t-s");
    let output = crumple_in(folder.path(), "build study.toml -o d.h5");
    assert!(output.status.success());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    says(&said, "accept_energy: the curve absorbs 2.041 times");
}

#[test]
fn the_units_that_would_fit_are_named() {
    for written in ["mm-t-s", "mm-kg-ms", "SI"] {
        for read in ["mm-t-s", "mm-kg-ms", "SI"] {
            let run = Run { units: read, ..Run::read(48).written_in(written) };
            let result = run.extract_with(CONTACT_RECIPE, Stated::default());
            if written == read {
                assert!((crush(&result.unwrap()) - 0.8749).abs() < 1e-4);
                continue;
            }
            let error = result.unwrap_err().to_string();
            let hints = [
                format!("likely the units: read as \"{written}\" it would fit"),
                "likely the units: the solver files have others".into(),
                "check id, component, sign and units".into(),
            ];
            let hinted = hints.iter().any(|hint| error.contains(hint));
            assert!(hinted, "{written} read as {read}: {error}");
        }
    }
}

#[test]
fn the_recorded_speed_outranks_the_decks() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    fs::create_dir(&run).unwrap();
    for name in ["nodout", "rwforc"] {
        fs::copy(fixture("fe/lead-car-wall/60kmh").join(name), run.join(name)).unwrap();
    }
    // The deck of the run at 25 km/h, copied and forgotten.
    let deck = "*KEYWORD\n*INITIAL_VELOCITY\n         0         0         0\n -6944.444       0.0       0.0\n*END\n";
    fs::write(run.join("main.k"), deck).unwrap();
    let text = format!(
        "[study]\nname = \"s\"\nunits = \"mm-t-s\"\ngroup = \"g\"\nkind = \"wall\"\n[recipe]\n{CONTACT_RECIPE}\n[[run]]\npath = \"run\"\nmass = \"24t\"\n"
    );
    fs::write(folder.path().join("study.toml"), &text).unwrap();
    let output = crumple_in(folder.path(), "build study.toml -o c.h5");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    says(&said, "speed: the deck main.k, line 2 states 25 km/h; the record's 60 km/h is used");
    says(&crumple_ok(folder.path(), "db ls c.h5"), "60 km/h (wall)");
}

/// Changes the values of a history by their times.
fn each(history: &mut History, value: impl Fn(f64, f64) -> f64) {
    for (t, v) in history.time.iter().zip(&mut history.values) {
        *v = value(*t, *v);
    }
}

/// Each kind of damage that leaves a plausible curve, and what is reported of it.
#[test]
fn histories_that_contradict_each_other_are_said() {
    type Damage = fn(&mut Run);
    fn clock(run: &mut Run, at: fn(f64) -> f64) {
        run.force.time = run.force.time.iter().map(|&t| at(t)).collect();
    }
    #[rustfmt::skip]
    let damages: [(&str, Damage, &str); 15] = [
        ("a state of the force that is wrong", |run| run.force.values[30] *= 4.0, "force: the peak of "),
        ("force 10 ms early", |run| clock(run, |t| t - 0.010), "times: the force starts at -10 ms"),
        ("force 5 ms early", |run| clock(run, |t| t - 0.005), "times: the force starts at -5 ms"),
        ("force 3 ms late", |run| clock(run, |t| t + 0.003), "the first 9.9 to 40.0 mm of the crush (1.2 to 4.6 %) are missing; the bodies slow down over the first"),
        ("force stretched", |run| clock(run, |t| 1.1 * t), "impulse: from"),
        ("displacement 0.95", |run| each(&mut run.displacement, |_, d| 0.95 * d), "displacement: from"),
        ("displacement glitch", |run| run.displacement.values[60] += 300.0, "displacement: from 45.002 ms on it deviates from the integral of the velocity by up to 34.3 %"),
        ("velocity 1.05", |run| each(&mut run.velocity, |t, v| if t > 0.05 { 1.05 * v } else { v }), "displacement: from"),
        ("force on a body in flight", |run| each(&mut run.force, |t, f| if (0.15..0.195).contains(&t) { 5e6 } else { f }), "after the contact, its impulse is 225.035 kN·s, but the momentum changes by -1.467 kN·s"),
        (
            "force long after the contact",
            |run| {
                each(&mut run.force, |t, f| {
                    if t > 0.2 && t < 0.22 {
                        1e6
                    } else if t > 0.17 {
                        0.0
                    } else {
                        f
                    }
                })
            },
            "after the contact, its impulse is 20.250",
        ),
        (
            "first states missing",
            |run| {
                for history in [&mut run.displacement, &mut run.velocity, &mut run.force] {
                    history.time = history.time.iter().copied().skip(3).collect();
                    history.values.drain(..3);
                }
            },
            "contact: the record starts at 2.254 ms, in contact: the first 30.1 mm of the crush (3.4 %) are missing",
        ),
        (
            "a clock that begins elsewhere",
            |run| {
                for history in [&mut run.displacement, &mut run.velocity, &mut run.force] {
                    history.time = history.time.iter().map(|t| t + 0.02).collect();
                }
            },
            "(up to 23.4 %) are missing; the body still has the run's speed, so none are if the clock does not begin at the impact",
        ),
        (
            "output each 6 ms",
            |run| {
                for history in [&mut run.displacement, &mut run.velocity, &mut run.force] {
                    history.time = history.time.iter().copied().step_by(8).collect();
                    history.values = history.values.iter().copied().step_by(8).collect();
                }
            },
            "sampling: the record has 21 states up to the maximum crush",
        ),
        (
            "the motion each 7.5 ms",
            |run| {
                for history in [&mut run.displacement, &mut run.velocity] {
                    history.time = history.time.iter().copied().step_by(10).collect();
                    history.values = history.values.iter().copied().step_by(10).collect();
                }
            },
            "sampling: the motion has 17 states up to the maximum crush, one every 7.500 ms, and the force 170",
        ),
        (
            "a fall",
            |run| {
                *run = Run::read(48).after_flight(80);
                let (start, g) = (80.0 * INTERVAL_S, 30_000.0);
                each(&mut run.velocity, |t, v| v + g * (start - t).max(0.0));
                each(&mut run.displacement, |t, d| d - 0.5 * g * (start - t).max(0.0).powi(2));
            },
            "free flight: before contact the speed changes by 30.",
        ),
    ];
    for (name, damage, expected) in damages {
        let mut run = Run::read(48);
        damage(&mut run);
        let warnings = run.extract().quality.warnings;
        assert!(warnings.iter().any(|w| w.contains(expected)), "{name}: {warnings:?}");
    }
    for speed in [12, 18, 25, 36, 48, 60, 72] {
        assert_eq!(Run::read(speed).extract().quality.warnings, [""; 0], "{speed} km/h");
    }
}

#[test]
fn a_record_that_is_not_one_impact_is_refused() {
    let refused = |run: &Run, recipe: &str, stated: Stated| {
        run.extract_with(recipe, stated).unwrap_err().to_string()
    };
    let mut pushed = Run::read(48);
    let v = pushed.velocity.values[0];
    each(&mut pushed.velocity, |_, _| v);
    each(&mut pushed.displacement, |t, _| v * t);
    each(&mut pushed.force, |_, _| 2e6);
    let accepted = Stated { accept_energy: true, ..Stated::default() };
    for stated in [Stated::default(), accepted] {
        let said = refused(&pushed, CONTACT_RECIPE, stated);
        assert!(
            said.starts_with("the motion is prescribed: the body keeps its 13.3333 m/s"),
            "{said}"
        );
    }
    // A hit before the one that counts has taken a quarter of the speed.
    let mut second = Run::read(48).after_flight(80);
    let (v, hit_s) = (second.velocity.values[0], 20.0 * INTERVAL_S);
    each(&mut second.velocity, |t, u| if t < hit_s { v / 0.75 } else { u });
    each(&mut second.displacement, |t, d| {
        if t < hit_s { d + v * (1.0 / 0.75 - 1.0) * (t - hit_s) } else { d }
    });
    each(&mut second.force, |t, f| if (t - hit_s).abs() < 2.5 * INTERVAL_S { 3e6 } else { f });
    second.speed_m_per_s /= 0.75;
    let said = refused(&second, CONTACT_RECIPE, Stated::default());
    says(
        &said,
        "likely a force before the contact that was found, which the curve leaves out: contact_time in the run takes it in",
    );
    let mut other = Run::read(48);
    each(&mut other.velocity, |_, v| 0.3 * v);
    let said = refused(&other, CONTACT_RECIPE, Stated::default());
    assert!(said.contains("displacement: from") && said.contains("wrong node"), "{said}");
    let taken = other.extract_with(CONTACT_RECIPE, accepted).unwrap().quality.warnings;
    assert!(taken.iter().any(|w| w.starts_with("accept_energy: displacement: from")), "{taken:?}");
    let window = format!("{CONTACT_RECIPE}\nsampling = {{ states = 100, interval_ms = 0.75 }}");
    let said = refused(&Run::read(48), &window, Stated::default());
    says(&said, "ends 74.25 ms after contact, before the maximum crush at 126.");
    says(&said, "raise states to 171 or more");
    let until = Stated { truncate_s: Some(0.07), ..Stated::default() };
    Run::read(48).extract_with(&window, until).unwrap();
    let coarse = format!("{CONTACT_RECIPE}\nsampling = {{ states = 50, interval_ms = 6.0 }}");
    let said = Run::read(48).extract_with(&coarse, Stated::default()).unwrap().quality.warnings;
    assert!(
        said.iter().any(|w| w
            .starts_with("sampling: the common times, one every 6.000 ms, change the curve by")),
        "{said:?}"
    );
}

/// Mass times acceleration is in balance with every mass: the contact force knows better.
#[test]
fn the_mass_of_a_body_force_is_held_against_the_contact() {
    let recipe = r#"
        deflection = { file = "nodout", node = 900001, component = "x_displacement" }
        force = { file = "nodout", node = 900001, component = "x_acceleration", times = "mass" }
        contact = { file = "rwforc", id = 1, component = "normal_force" }
        filter = "none"
    "#;
    let of =
        |mass_kg: f64| Run { mass_kg, ..Run::read(48) }.extract_with(recipe, Stated::default());
    let said = of(12e3).unwrap_err().to_string();
    says(&said, "2.000 times the momentum lost by 12.00 t; it would fit 24.00");
    assert_eq!(of(24e3).unwrap().quality.warnings, [""; 0]);
    for (mass_kg, or) in
        [(20e3, "the mass of the run is wrong"), (40e3, "other forces act besides this contact")]
    {
        let said = of(mass_kg).unwrap().quality.warnings;
        assert!(said.iter().any(|w| w.starts_with("mass: ") && w.contains(or)), "{said:?}");
    }
}

/// A light specimen is not another structure: forces and mass of a millionth give a millionth.
#[test]
fn the_contact_is_relative_to_the_peak() {
    let whole = Run::read(36).after_flight(20).extract();
    let mut light = Run::read(36).after_flight(20);
    light.mass_kg *= 1e-6;
    each(&mut light.force, |_, f| 1e-6 * f);
    let light = light.extract();
    assert_eq!(light.curves.original.deflection_m(), whole.curves.original.deflection_m());
    assert_eq!(light.curves.contact_time_s, whole.curves.contact_time_s);
    for (a, b) in light.curves.original.force_n().iter().zip(whole.curves.original.force_n()) {
        assert!((a * 1e6 - b).abs() <= 1e-12 * b.abs(), "{a} for {b}");
    }
    assert_eq!(light.quality.warnings, whole.quality.warnings);
    let late = format!("{CONTACT_RECIPE}\ncontact_threshold = 0.5");
    let late = Run::read(36).after_flight(20).extract_with(&late, Stated::default()).unwrap();
    assert!(crush(&late) < crush(&whole), "{} and {}", crush(&late), crush(&whole));
}

/// A run that ended before its body stood has more impulse than the body has lost momentum, by the crush zone that is stopped already.
#[test]
fn a_sound_run_that_ended_early_is_not_accused() {
    let cut = |mass: f64| {
        let mut run = Run::read(72);
        run.mass_kg *= mass;
        let stated = Stated { truncate_s: Some(0.055), ..Stated::default() };
        run.extract_with(CONTACT_RECIPE, stated).unwrap().quality
    };
    let sound = cut(1.0);
    let accused = |quality: &Quality| {
        quality.warnings.iter().any(|w| w.starts_with("energy:") || w.starts_with("impulse:"))
    };
    assert!(!accused(&sound), "{:?}", sound.warnings);
    let note = "of the momentum that the body has lost: it stops the crush zone before the body";
    assert!(sound.notes.iter().any(|n| n.contains(note)), "{:?}", sound.notes);
    assert!(accused(&cut(1.3)) && accused(&cut(0.8)));
}

/// The group knows more of a run than the run itself: a force of 0.95, a run of another design, and
/// copies that would count as repetitions.
#[test]
fn what_the_group_shows_of_a_run_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let source = fixture("fe/lead-car-wall");
    let run = |name: &str| folder.path().join(name);
    for name in entries(&source).iter().filter(|name| source.join(name).is_dir()) {
        fs::create_dir_all(run(name)).unwrap();
        for file in ["nodout", "rwforc"] {
            fs::copy(source.join(name).join(file), run(name).join(file)).unwrap();
        }
    }
    let study = run("study.toml");
    fs::copy(source.join("study.toml"), &study).unwrap();
    let build = |expected: &[&str]| {
        let (study, path) = (study.to_str().unwrap(), folder.path().join("c.h5"));
        let output = crumple_in(folder.path(), &["build", study, "-o", path.to_str().unwrap()]);
        let said = String::from_utf8_lossy(&output.stderr).to_string();
        let warnings: Vec<&str> = said.lines().filter(|l| l.starts_with("warning: ")).collect();
        assert_eq!(warnings.len(), expected.len(), "{said}");
        for expected in expected {
            assert!(warnings.iter().any(|w| w.contains(expected)), "{expected} is not in {said}");
        }
        let checked = crumple_in(folder.path(), "db check c.h5");
        let found = String::from_utf8_lossy(&checked.stdout).to_string();
        assert!(expected.iter().all(|e| found.contains(e)), "{found}");
    };
    build(&[]);
    // A force that begins with the record and is 8 ms early lacks its beginning; only the other runs show it.
    for name in ["48kmh", "60kmh", "72kmh"] {
        let force = run(name).join("rwforc");
        let whole = fs::read_to_string(&force).unwrap();
        let lines: Vec<&str> = whole.lines().collect();
        let first = lines.iter().position(|line| line.starts_with(" 0.00000E+00")).unwrap();
        let early = (0..lines.len()).map(|k| match k < first {
            true => format!("{}\n", lines[k]),
            false => {
                format!("{}{}\n", &lines[k][..12], &lines[(k + 11).min(lines.len() - 1)][12..])
            }
        });
        fs::write(&force, early.collect::<String>()).unwrap();
        let output = crumple_in(folder.path(), "build study.toml -o early.h5 --overwrite");
        let said = String::from_utf8_lossy(&output.stderr).to_string();
        let early = format!("{name}: the impulse of its force runs ahead of the momentum");
        let found = said.lines().filter(|line| line.contains("runs ahead of the momentum"));
        assert!(said.contains(&early) && found.count() == 1, "{said}");
        fs::write(&force, whole).unwrap();
    }
    let force = run("48kmh/rwforc");
    let whole = fs::read_to_string(&force).unwrap();
    let scaled = whole.lines().map(|line| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        match fields.get(2).and_then(|f| f.parse::<f64>().ok()) {
            Some(f) if fields.len() == 6 && f != 0.0 => {
                let written = format!("{:.6E}", 0.95 * f);
                let (digits, power) = written.split_once('E').unwrap();
                let power: i32 = power.parse().unwrap();
                line.replacen(fields[2], &format!("{digits}E{power:+03}"), 1)
            }
            _ => line.into(),
        }
    });
    fs::write(&force, scaled.map(|l| l + "\n").collect::<String>()).unwrap();
    build(&["48kmh: W/E is 0.978", "48kmh: impulse over momentum is 0.9"]);
    for name in ["nodout", "rwforc"] {
        let other = fixture("fe/lead-car-b-wall/48kmh").join(name);
        fs::copy(other, run("48kmh").join(name)).unwrap();
    }
    build(&[
        "48kmh: the title of its files is \"second lead car design to rigid wall 48 km/h\"",
        "60kmh: over the 1.084 m that both are crushed, its mean force is 1.36 times that of 48kmh",
    ]);
    for name in ["nodout", "rwforc"] {
        let own = fixture("fe/lead-car-wall/48kmh").join(name);
        fs::copy(own, run("48kmh").join(name)).unwrap();
        fs::create_dir_all(run("copy")).unwrap();
        fs::copy(run("48kmh").join(name), run("copy").join(name)).unwrap();
    }
    let text = fs::read_to_string(&study).unwrap();
    fs::write(&study, text + "\n[[run]]\npath = 'copy'\nspeed = '48km/h'\nmass = '24t'\n").unwrap();
    build(&["copy: is a copy of 48kmh: the same values at every state"]);
    let said = crumple_ok(folder.path(), "validate c.h5");
    assert!(!said.contains("scatter"), "{said}");
}

/// The plates of both groups stand apart by the same at every speed, and fly freely until they touch; states are up to 5 mm apart.
#[test]
fn impulses_show_where_plates_touch() {
    let folder = tempfile::tempdir().unwrap();
    for (group, fastest_km_per_h, apart_mm) in
        [("vehicle-ends", 25.0, 6.2), ("vehicle-pair", 12.0, 1.1)]
    {
        let database = build_fixture(folder.path(), group);
        let database = crumple::database::Database::read(&database).unwrap();
        let runs = database.cases(group).iter();
        let slow = runs.filter(|case| case.conditions.speed.m_per_s * 3.6 < fastest_km_per_h + 0.1);
        let found: Vec<f64> = slow
            .map(|case| 1e3 * case.conditions.speed.m_per_s * case.curves.contact_time_s)
            .collect();
        assert!(found.len() >= 3, "{found:?}");
        assert!(found.iter().all(|mm| (mm - apart_mm).abs() < 0.15), "{group}: {found:?}");
    }
}
