//! Times of fitting the nonlinear spring-damper to a bundled run, and of one motion of it.
//!
//!     cargo bench --bench nsdm

use std::path::Path;
use std::sync::OnceLock;

use crumple::nsdm::{FitSettings, Start, Target, fit, fit_seeds};
use crumple::signal::derivative;
use divan::{Bencher, black_box};

const GROUP: &str = "lead-car-wall";
const CASE: &str = "48kmh";

fn main() {
    divan::main();
}

/// Mass, speed, times and velocity of a whole run of 400 states.
fn motion() -> &'static (f64, f64, Vec<f64>, Vec<f64>) {
    static MOTION: OnceLock<(f64, f64, Vec<f64>, Vec<f64>)> = OnceLock::new();
    MOTION.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let study =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe/lead-car-wall/study.toml");
        let report = crumple::build::build(&study, &folder.path().join("curves.h5"), |_| {})
            .expect("the bundled runs make a database");
        let mut cases = report.database.cases(GROUP).iter();
        let case = cases.find(|case| case.id.name == CASE).expect("a case of that name");
        let time_s = case.curves.sampled.time_s().to_vec();
        let velocity = case.curves.closing_speed_m_per_s.clone();
        (case.conditions.masses.effective_kg(), case.conditions.speed.m_per_s, time_s, velocity)
    })
}

/// The first `states` of the run.
fn target(states: usize) -> Target {
    let (mass_kg, speed_m_per_s, time_s, velocity) = motion();
    let (time_s, velocity) = (time_s[..states].to_vec(), velocity[..states].to_vec());
    let acceleration = derivative(&time_s, &velocity);
    Target::new(*mass_kg, *speed_m_per_s, time_s, velocity, acceleration).expect("a target")
}

/// 210 states reach to 30 ms behind the largest deflection.
#[divan::bench(args = [210, 400], sample_count = 5)]
fn fit_one_seed(bencher: Bencher, states: usize) {
    let target = target(states);
    bencher.bench(|| fit(black_box(&target), &FitSettings::default(), 1));
}

#[divan::bench(sample_count = 5)]
fn fit_one_seed_from_least_squares(bencher: Bencher) {
    let target = target(210);
    let settings = FitSettings { start: Start::LeastSquares, ..FitSettings::default() };
    bencher.bench(|| fit(black_box(&target), &settings, 1));
}

#[divan::bench(sample_count = 3)]
fn fit_three_seeds(bencher: Bencher) {
    let target = target(210);
    bencher.bench(|| fit_seeds(black_box(&target), &FitSettings::default(), &[1, 2, 3]));
}

#[divan::bench]
fn one_motion_of_400_states(bencher: Bencher) {
    let (mass_kg, speed_m_per_s, time_s, _) = motion();
    let settings =
        FitSettings { generations: 10, simplex_evaluations: 0, ..FitSettings::default() };
    let law = fit(&target(210), &settings, 1).expect("a fit").model;
    bencher.bench(|| black_box(&law).run(*mass_kg, *speed_m_per_s, time_s));
}
