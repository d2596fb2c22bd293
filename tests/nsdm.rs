//! The nonlinear spring-damper: laws found again, FE's motion, seeds and threads, wrong input.

use crate::common::root;
use crumple::curve::Case;
use crumple::multibody::{
    Body, Chain, EnvelopeEnd, ForceLaw, Interface, RunSettings, Unloading, simulate,
};
use crumple::nsdm::{
    DAMPING_N_S_PER_M, Fit, FitSettings, Identifiability, Nsdm, PiecewiseLinear, STIFFNESS_N_PER_M,
    Start, Target, fit, fit_seeds,
};
use crumple::signal::{derivative, l1_ratio};

const MASS_KG: f64 = 24e3;
const SPEED_M_PER_S: f64 = 40.0 / 3.0;

fn times(count: usize) -> Vec<f64> {
    (0..count).map(|i| 0.75e-3 * i as f64).collect()
}

/// A law of an impact: a stiff beginning, a long crush zone, some damping.
fn known() -> Nsdm {
    Nsdm {
        stiffness: PiecewiseLinear::new(
            vec![0.0, 0.08, 0.3, 0.7, 1.2],
            vec![3e7, 1.2e7, 4e6, 2.5e6, 3e6],
        )
        .unwrap(),
        damping: PiecewiseLinear::new(vec![0.0, 4.0, SPEED_M_PER_S], vec![1e5, 6e4, 2e4]).unwrap(),
    }
}

fn target_of(law: &Nsdm) -> Target {
    let time_s = times(200);
    let motion = law.run(MASS_KG, SPEED_M_PER_S, &time_s).unwrap();
    Target::new(MASS_KG, SPEED_M_PER_S, time_s, motion.v_m_per_s, motion.a_m_per_s2).unwrap()
}

/// The bounds are those of rail vehicles; others that move alike are fitted as one of them, just outside as well.
#[test]
fn light_and_slow_masses_are_fitted_as_usual_ones() {
    let (law, settings) = (known(), short());
    let usual = target_of(&law);
    let heavy = fit(&usual, &settings, 7).unwrap();
    let largest_m = usual.displacement_m().iter().copied().fold(0.0, f64::max);
    let slow = 6.25 / (SPEED_M_PER_S / largest_m);
    let time_s = times(200);
    let of = law.run(MASS_KG, SPEED_M_PER_S, &time_s).unwrap();
    let times = |values: &[f64], by: f64| values.iter().map(|value| value * by).collect::<Vec<_>>();
    for (mass, rate) in [(1e-4, 10.0), (7.5 / 24.0, slow), (76.0 / 24.0, slow), (1.0, 100.0)] {
        let other = Target::new(
            MASS_KG * mass,
            SPEED_M_PER_S * rate,
            times(&time_s, 1.0 / rate),
            times(&of.v_m_per_s, rate),
            times(&of.a_m_per_s2, rate * rate),
        );
        let fitted = fit(&other.unwrap(), &settings, 7).unwrap();
        let errors = (fitted.velocity_l1, heavy.velocity_l1);
        assert!(errors.0 < 1.5 * errors.1 + 0.01, "{mass} {rate}: {errors:?}");
    }
}

fn short() -> FitSettings {
    FitSettings {
        population: 40,
        generations: 40,
        simplex_evaluations: 1_000,
        ..FitSettings::default()
    }
}

fn cases() -> Vec<Case> {
    let folder = tempfile::tempdir().unwrap();
    let study = root().join("fixtures/fe/lead-car-wall/study.toml");
    let report = crumple::build::build(&study, &folder.path().join("curves.h5"), |_| {}).unwrap();
    report.database.cases("lead-car-wall").to_vec()
}

/// FE's body from contact to 30 ms after the maximum deflection.
fn window(case: &Case) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let end_s = case.curves.original.time_s()[case.loading_end()] + 0.030;
    let states = case.curves.sampled.time_s().iter().take_while(|&&t| t <= end_s).count();
    let time_s = case.curves.sampled.time_s()[..states].to_vec();
    let velocity = case.curves.closing_speed_m_per_s[..states].to_vec();
    let acceleration = derivative(&time_s, &velocity);
    (time_s, velocity, acceleration)
}

fn target_at(cases: &[Case], name: &str) -> Target {
    let case = cases.iter().find(|case| case.id.name == name).unwrap();
    let (time_s, velocity, acceleration) = window(case);
    let mass_kg = case.conditions.masses.effective_kg();
    Target::new(mass_kg, case.conditions.speed.m_per_s, time_s, velocity, acceleration).unwrap()
}

#[test]
fn a_known_law_is_repeated() {
    let target = target_of(&known());
    let found = fit(&target, &FitSettings::default(), 1).unwrap();
    assert!(found.velocity_l1 < 0.002, "{}", found.velocity_l1);
    assert!(found.acceleration_l1 < 0.01, "{}", found.acceleration_l1);
    assert!(found.objective < 1e-3 * found.history[0], "{}", found.objective);
    assert_eq!(found.history.len(), 401);
    // What is reported is the law that is returned.
    let motion = found.model.run(MASS_KG, SPEED_M_PER_S, &times(200)).unwrap();
    let known = known().run(MASS_KG, SPEED_M_PER_S, &times(200)).unwrap();
    assert_eq!(found.velocity_l1, l1_ratio(&known.v_m_per_s, &motion.v_m_per_s));
    let squares = motion.a_m_per_s2.iter().zip(&known.a_m_per_s2).map(|(a, r)| (a - r).powi(2));
    assert!((found.objective / squares.sum::<f64>() - 1.0).abs() < 1e-6);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let target = target_of(&known());
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let settings = FitSettings { start: Start::LeastSquares, ..short() };
        pool.install(|| fit_seeds(&target, &settings, &[7, 8]).unwrap())
    };
    let (one, two, three) = (with(1), with(2), with(3));
    assert_eq!(one, two);
    assert_eq!(one, three);
    assert_ne!(one[0].model, one[1].model, "another seed searches elsewhere");
    assert_ne!(one[0].history, one[1].history);
}

#[test]
fn least_squares_begin_better_and_end_no_worse() {
    let target = target_at(&cases(), "48kmh");
    let with = |start| {
        let settings = FitSettings { start, simplex_evaluations: 0, ..short() };
        fit_seeds(&target, &settings, &[1, 2, 3]).unwrap()
    };
    for (least, random) in with(Start::LeastSquares).iter().zip(&with(Start::Random)) {
        assert!(least.history[0] < 0.5 * random.history[0], "seed {}", least.seed);
        assert!(least.objective <= random.objective, "seed {}", least.seed);
    }
}

#[test]
fn the_simplex_search_improves_what_the_generations_leave() {
    let target = target_of(&known());
    let with = |simplex_evaluations| {
        fit(&target, &FitSettings { simplex_evaluations, ..short() }, 1).unwrap()
    };
    let (without, little, much) = (with(0), with(100), with(4_000));
    assert_eq!(without.objective, without.history[40]);
    assert_eq!(without.history, much.history);
    assert!(much.objective < 0.8 * without.objective && little.objective <= without.objective);
    assert_eq!(without.evaluations, 40 + 40 * 38);
    assert!(little.evaluations <= without.evaluations + 100);
}

#[test]
fn weight_on_the_velocity_improves_it() {
    let target = target_at(&cases(), "48kmh");
    let with = |velocity_weight_per_s2| {
        let settings = FitSettings { velocity_weight_per_s2, ..short() };
        let fits = fit_seeds(&target, &settings, &[1, 2, 3]).unwrap();
        fits.iter().map(|fit| fit.velocity_l1).sum::<f64>()
    };
    let (without, weighted) = (with(0.0), with(1e4));
    assert!(weighted < 0.8 * without, "{weighted} {without}");
}

/// The errors of one law at every speed of the group.
fn errors_over_speeds(fit: &Fit, cases: &[Case]) -> Vec<(f64, f64, f64)> {
    let errors = |case: &Case| {
        let (time_s, velocity, acceleration) = window(case);
        let speed = case.conditions.speed.m_per_s;
        let motion = fit.model.run(case.conditions.masses.effective_kg(), speed, &time_s).unwrap();
        let velocity_l1 = l1_ratio(&velocity, &motion.v_m_per_s);
        (3.6 * speed, velocity_l1, l1_ratio(&acceleration, &motion.a_m_per_s2))
    };
    cases.iter().map(errors).collect()
}

#[test]
fn fe_motion_is_fitted_at_its_own_speed_and_missed_at_others() {
    let cases = cases();
    let target = target_at(&cases, "48kmh");
    let settings = FitSettings {
        population: 60,
        generations: 80,
        simplex_evaluations: 3_000,
        start: Start::LeastSquares,
        ..FitSettings::default()
    };
    let fits = fit_seeds(&target, &settings, &[1, 2, 3]).unwrap();
    for fit in &fits {
        assert!(fit.velocity_l1 < 0.05, "{}", fit.velocity_l1);
        assert!(fit.acceleration_l1 < 0.15, "{}", fit.acceleration_l1);
        let rows = errors_over_speeds(fit, &cases);
        eprintln!(
            "seed {}: speed in km/h, error of velocity, of acceleration: {rows:.3?}",
            fit.seed
        );
        for (speed, velocity_l1, acceleration_l1) in rows {
            if (speed - 48.0).abs() < 0.1 {
                assert_eq!((velocity_l1, acceleration_l1), (fit.velocity_l1, fit.acceleration_l1));
            } else {
                assert!(velocity_l1 > 2.0 * fit.velocity_l1, "at {speed} km/h: {velocity_l1}");
            }
        }
        assert!(
            fit.model
                .stiffness
                .values()
                .iter()
                .all(|k| { (STIFFNESS_N_PER_M[0]..=STIFFNESS_N_PER_M[1]).contains(k) })
        );
        assert!(
            fit.model
                .damping
                .values()
                .iter()
                .all(|c| { (DAMPING_N_S_PER_M[0]..=DAMPING_N_S_PER_M[1]).contains(c) })
        );
        assert_eq!(fit.model.stiffness.values().len(), 11);
        assert_eq!(fit.model.damping.values().len(), 6);
        assert_eq!(fit.model.damping.end(), cases[4].conditions.speed.m_per_s);
        let largest = target.displacement_m().iter().copied().fold(0.0, f64::max);
        assert_eq!(fit.model.stiffness.end(), largest);
    }
    let spread = serde_json::to_value(Identifiability::of(&fits).unwrap()).unwrap();
    let largest = spread["stiffness"]["largest"].as_f64().unwrap();
    assert!(largest > 0.3, "parameters of equally good fits differ: {spread}");
}

/// Two routes: the spring alone by this module, and as an envelope in a multi-body chain.
#[test]
fn a_spring_moves_alike_in_a_chain() {
    let no_damper = PiecewiseLinear::new(vec![0.0, 1.0], vec![0.0; 2]).unwrap();
    // The law ends before the crush does.
    let stiffness = PiecewiseLinear::new(vec![0.0, 0.1, 0.4], vec![3e7, 1e7, 4e6]).unwrap();
    let law = Nsdm { stiffness, damping: no_damper };
    let law_in_chain =
        ForceLaw::new(law.envelope().unwrap(), Unloading::Elastic, EnvelopeEnd::Slope);
    let body = Body::new("car", MASS_KG, SPEED_M_PER_S);
    let interface = Interface::new("car|wall", law_in_chain, 0.0);
    let settings = RunSettings::new(0.11251, 0.75e-3);
    let run = simulate(&Chain::new(vec![body], vec![interface]).unwrap(), &settings).unwrap();
    let motion = law.run(MASS_KG, SPEED_M_PER_S, &run.time_s).unwrap();
    assert!(motion.x_m.iter().any(|&x| x > 0.9), "beyond twice the last node");
    for (a, b) in motion.v_m_per_s.iter().zip(&run.bodies[0].v_m_per_s) {
        assert!((a - b).abs() < 2e-3, "{a} m/s against {b} m/s");
    }
}

#[test]
fn wrong_input_is_named() {
    // Times, velocities and accelerations, spoiled.
    let refused = |edit: &dyn Fn(&mut [Vec<f64>; 3])| {
        let mut columns = [times(4), vec![1.0; 4], vec![0.0; 4]];
        edit(&mut columns);
        let [time_s, velocity, acceleration] = columns;
        Target::new(1.0, 1.0, time_s, velocity, acceleration).unwrap_err().to_string()
    };
    assert_eq!(
        refused(&|columns| columns.iter_mut().for_each(|column| column.truncate(2))),
        "a motion needs at least 3 samples, found 2"
    );
    assert_eq!(
        refused(&|columns| columns[1].truncate(3)),
        "columns differ in length: 4 times, 3 velocities, 4 accelerations"
    );
    assert_eq!(
        refused(&|columns| columns[2][2] = f64::NAN),
        "the acceleration of sample 3 is NaN: expected a finite number"
    );
    assert_eq!(
        refused(&|columns| columns[0][3] = f64::INFINITY),
        "the time of sample 4 is inf: expected a finite number"
    );
    assert_eq!(
        refused(&|columns| columns[0][2] = columns[0][1]),
        "time does not increase at sample 3: 0.00075 s follows 0.00075 s"
    );
    assert_eq!(
        refused(&|columns| columns[0][0] = -1.0),
        "the first time is -1 s: times count from contact, so expected 0 or more"
    );
    assert_eq!(
        refused(&|columns| columns[1].fill(-1.0)),
        "the reference never moves forwards: is the velocity positive at contact?"
    );
    let of = |mass_kg, speed_m_per_s| {
        let columns = (times(3), vec![1.0; 3], vec![0.0; 3]);
        Target::new(mass_kg, speed_m_per_s, columns.0, columns.1, columns.2)
            .map_err(|e| e.to_string())
    };
    assert!(of(1.0, 1.0).is_ok());
    assert_eq!(of(0.0, 1.0).unwrap_err(), "the mass in kg is 0: expected a finite number above 0");
    assert_eq!(
        of(1.0, f64::NAN).unwrap_err(),
        "the speed in m/s is NaN: expected a finite number above 0"
    );
    assert!(known().run(MASS_KG, -1.0, &times(3)).is_err());
    assert!(known().run(MASS_KG, 1.0, &[0.0, 2.0, 1.0]).is_err());
    let error = known().run(MASS_KG, 1.0, &[0.0, 1e9]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "no sample for 1000000000 s before 1000000000 s, too long to follow: expected times in seconds"
    );
}

#[test]
fn wrong_settings_are_named() {
    let target = target_of(&known());
    let refused = |settings| fit(&target, &settings, 0).unwrap_err().to_string();
    assert_eq!(
        refused(FitSettings { population: 3, ..short() }),
        "the population is 3: expected 4 to 1000000"
    );
    assert_eq!(
        refused(FitSettings { velocity_weight_per_s2: -1.0, ..short() }),
        "the weight of the velocity is -1 1/s²: expected a finite number of 0 or more"
    );
    let smallest = FitSettings { population: 4, generations: 0, simplex_evaluations: 0, ..short() };
    assert_eq!(fit(&target, &smallest, 0).unwrap().evaluations, 4);
}
