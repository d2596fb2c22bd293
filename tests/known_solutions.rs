//! Multi-body runs against solutions on paper, to the digits given there, by every method.

use crate::common::{says, within_tolerance};
use crumple::curve::Envelope;
use crumple::multibody::{
    Body, Chain, EnvelopeEnd, ForceLaw, Interface, Method, Run, RunSettings,
    STANDARD_GRAVITY_M_PER_S2, Unloading, simulate,
};

const TONNES: f64 = 1e3;
const MEGA: f64 = 1e6;

fn constant(force_n: f64) -> Envelope {
    Envelope::new(vec![0.0, 10.0], vec![force_n, force_n]).unwrap()
}

fn linear(stiffness: f64) -> Envelope {
    Envelope::new(vec![0.0, 10.0], vec![0.0, 10.0 * stiffness]).unwrap()
}

/// Bodies (mass, speed) from back to front, `laws` between them or to a wall.
fn chain(bodies: &[(f64, f64)], laws: &[ForceLaw]) -> Chain {
    let body =
        |(i, &(mass_kg, speed)): (usize, &(f64, f64))| Body::new(format!("B{i}"), mass_kg, speed);
    let interface =
        |(i, law): (usize, &ForceLaw)| Interface::new(format!("I{i}"), law.clone(), 0.0);
    Chain::new(
        bodies.iter().enumerate().map(body).collect(),
        laws.iter().enumerate().map(interface).collect(),
    )
    .unwrap()
}

fn elastic(envelope: Envelope) -> ForceLaw {
    ForceLaw::new(envelope, Unloading::Elastic, EnvelopeEnd::Hold)
}

fn memory(envelope: Envelope, stiffness_n_per_m: f64) -> ForceLaw {
    ForceLaw::new(envelope, Unloading::Memory { stiffness_n_per_m }, EnvelopeEnd::Hold)
}

fn run(chain: &Chain, duration_s: f64, method: Method) -> Run {
    run_with(chain, &RunSettings::new(duration_s, 0.75e-3).with_method(method))
}

fn run_with(chain: &Chain, settings: &RunSettings) -> Run {
    let run = simulate(chain, settings).unwrap();
    assert!(run.ledger.max_energy_error < 1e-3, "energy {:e}", run.ledger.max_energy_error);
    assert!(run.ledger.max_momentum_error < 1e-10, "momentum {:e}", run.ledger.max_momentum_error);
    run
}

/// Equal to as many digits as `printed` has behind its point.
fn digits(value: f64, printed: &str) {
    let decimals = printed.split('.').nth(1).map_or(0, str::len);
    assert_eq!(format!("{value:.decimals$}"), printed);
    // Half a unit of the last digit, and the rounding of the difference.
    let half = 0.5 * 10_f64.powi(-(decimals as i32));
    within_tolerance(value - printed.parse::<f64>().unwrap(), half * (1.0 + 1e-6));
}

/// Those that see the extremes between outputs; the reference is compared at the outputs.
const STEPPING: [Method; 2] = [Method::Verlet, Method::FourthOrder];
const ALL: [Method; 3] = [Method::Verlet, Method::FourthOrder, Method::Reference];
/// Verlet at a quarter of its default step, where its error would show in the last digit.
fn finer(settings: RunSettings) -> RunSettings {
    let share = if settings.method == Method::Verlet { 0.25 } else { 1.0 };
    settings.with_step(share * settings.method.default_step_s())
}

/// The reference keeps to 1e-12 of the largest speed in each of its steps.
const REFERENCE: f64 = 1e-9;

/// `d = m v²/2F`, `t = m v/F`.
#[test]
pub fn case_1_constant_force_against_a_wall() {
    let wall = chain(&[(24.0 * TONNES, 40.0 / 3.0)], &[elastic(constant(2.0 * MEGA))]);
    for method in STEPPING {
        let run = run(&wall, 0.3, method);
        let contact = &run.interfaces[0];
        digits(contact.max_deflection_m, "1.0666667");
        digits(contact.max_deflection_time_s, "0.16");
        let mean = run.bodies[0].mean_deceleration_m_per_s2;
        digits(mean / STANDARD_GRAVITY_M_PER_S2, "8.4976");
    }
    let run = run(&wall, 0.3, Method::Reference);
    for (t, v) in run.time_s.iter().zip(&run.bodies[0].v_m_per_s) {
        let exact = 40.0 / 3.0 - 2.0 * MEGA / (24.0 * TONNES) * t;
        within_tolerance(v - exact, REFERENCE);
    }
}

/// `d = v sqrt(m/k)`, `t = (π/2) sqrt(m/k)`, `F = v sqrt(m k)`.
#[test]
pub fn case_2_linear_spring_against_a_wall() {
    let wall = chain(&[(24.0 * TONNES, 40.0 / 3.0)], &[elastic(linear(40.0 * MEGA))]);
    for method in STEPPING {
        let run = run(&wall, 0.3, method);
        let contact = &run.interfaces[0];
        digits(contact.max_deflection_m, "0.3265986");
        digits(contact.max_deflection_time_s, "0.03847649");
        // 13.0639453: Verlet's own period is longer by (ωh)²/24, and its force larger by 2e-8.
        let printed = if method == Method::Verlet { "13.06395" } else { "13.063945" };
        digits(contact.peak_force_n / MEGA, printed);
        digits(contact.restitution.unwrap(), "1.000000");
    }
    let run = run(&wall, 0.07, Method::Reference);
    let omega = (40.0 * MEGA / (24.0 * TONNES)).sqrt();
    for (t, d) in run.time_s.iter().zip(&run.interfaces[0].deflection_m) {
        let exact = 40.0 / 3.0 / omega * (omega * t).sin();
        within_tolerance(d - exact, REFERENCE);
    }
}

/// 24 t each, 10 m/s, 2 MN, and 80 MN/m on the way back.
fn pair() -> Chain {
    chain(
        &[(24.0 * TONNES, 10.0), (24.0 * TONNES, 0.0)],
        &[memory(constant(2.0 * MEGA), 80.0 * MEGA)],
    )
}

/// `d = μ v_r²/2F`, common velocity `m_1 v_r/(m_1 + m_2)`.
#[test]
pub fn case_3_two_bodies_with_constant_force() {
    for method in ALL {
        let run = run(&pair(), 0.06, method);
        digits(run.interfaces[0].max_deflection_m, "0.3");
        digits(run.interfaces[0].max_deflection_time_s, "0.06");
        let last = run.time_s.len() - 1;
        for body in &run.bodies {
            within_tolerance(body.v_m_per_s[last] - 5.0, 1e-9);
        }
    }
}

/// `e² = (F²/2k_u)/(μ v_r²/2)`.
#[test]
pub fn case_4_unloading_gives_the_restitution() {
    for method in ALL {
        let settings = finer(RunSettings::new(0.15, 0.75e-3).with_method(method));
        let run = run_with(&pair(), &settings);
        let last = run.time_s.len() - 1;
        digits(run.bodies[0].v_m_per_s[last], "3.9793793");
        digits(run.bodies[1].v_m_per_s[last], "6.0206207");
        if method != Method::Reference {
            digits(run.interfaces[0].restitution.unwrap(), "0.2041241");
        }
    }
    let run = run(&pair(), 0.15, Method::Verlet);
    let e = 2.0 * MEGA / (80.0 * MEGA * 12.0 * TONNES).sqrt() / 10.0;
    let error = run.bodies[0].final_v_m_per_s - (5.0 - 5.0 * e);
    within_tolerance(error, 1e-7);
}

/// Springs that push and pull, against their modes:
/// `v_i(t) = Σ_j q_j cos(ω_j t) φ_j(i)`, `φ_j(i) = cos(jπ(i − 1/2)/N)`,
/// `ω_j = 2 sqrt(k/m) sin(jπ/2N)`.
#[test]
pub fn case_5_free_chain_of_two_way_springs() {
    let (n, mass, stiffness) = (8, 24.0 * TONNES, 50.0 * MEGA);
    let start = |i: usize| if i < n / 2 { 10.0 } else { 0.0 };
    let pi = std::f64::consts::PI;
    let shape = |j: usize, i: usize| (j as f64 * pi * (i as f64 + 0.5) / n as f64).cos();
    let velocity = |i: usize, t: f64| -> f64 {
        (0..n)
            .map(|j| {
                let norm = if j == 0 { n as f64 } else { n as f64 / 2.0 };
                let share: f64 = (0..n).map(|k| start(k) * shape(j, k)).sum::<f64>() / norm;
                let omega =
                    2.0 * (stiffness / mass).sqrt() * (j as f64 * pi / (2 * n) as f64).sin();
                share * (omega * t).cos() * shape(j, i)
            })
            .sum()
    };
    let printed = [
        "3.470766", "3.027898", "6.053866", "4.390974", "5.609026", "3.946134", "6.972102",
        "6.529234",
    ];
    for (i, printed) in printed.into_iter().enumerate() {
        digits(velocity(i, 0.1), printed);
    }
    let bodies: Vec<Body> = (0..n).map(|i| Body::new(format!("B{i}"), mass, start(i))).collect();
    let spring = |k| {
        let law = elastic(linear(stiffness));
        Interface::new(format!("I{k}"), law.clone(), 0.0).with_tension(law, 0.0)
    };
    let chain = Chain::new(bodies, (0..n - 1).map(spring).collect()).unwrap();
    for method in ALL {
        // On beyond 0.1 s, up to which all springs push.
        let settings = RunSettings::new(0.3, 1e-3).with_method(method);
        let settings = finer(settings);
        // 2e-7 m/s over 0.3 s are below the fourth order's default step.
        let settings = settings.with_step(settings.step_s.min(1.5e-4));
        let run = run_with(&chain, &settings);
        digits(run.time_s[100], "0.1");
        for (i, (body, printed)) in run.bodies.iter().zip(printed).enumerate() {
            digits(body.v_m_per_s[100], printed);
            for (&v, &t) in body.v_m_per_s.iter().zip(&run.time_s) {
                let error = v - velocity(i, t);
                within_tolerance(error, 2e-7);
            }
        }
        let pulls = run.interfaces.iter().all(|i| i.force_n.iter().any(|f| *f < -MEGA));
        assert!(pulls, "every spring pulls at some time");
    }
    // Verlet's frequencies are off by (ωh)²/24 ≤ 3.5e-8, which 0.1 s makes 3e-7 rad of 10 m/s.
    let run = run_with(&chain, &RunSettings::new(0.1, 1e-3));
    for (i, body) in run.bodies.iter().enumerate() {
        let error = body.final_v_m_per_s - velocity(i, 0.1);
        within_tolerance(error, 1e-6);
    }
}

/// A gap shifts x, not the time: t = 0 is the first contact, and the ledger closes from
/// there although the constant force begins at full height.
#[test]
fn a_gap_is_closed_before_time_begins() {
    let settings = RunSettings::new(0.1, 0.75e-3);
    let with_gap = |gap_m: f64| {
        let interface = Interface::new("I0", memory(constant(2.0 * MEGA), 80.0 * MEGA), gap_m);
        let bodies =
            [("A", 10.0), ("B", 0.0)].map(|(name, speed)| Body::new(name, 24.0 * TONNES, speed));
        simulate(&Chain::new(bodies.to_vec(), vec![interface]).unwrap(), &settings).unwrap()
    };
    let (touching, apart) = (with_gap(0.0), with_gap(0.5));
    for (a, b) in touching.interfaces[0].force_n.iter().zip(&apart.interfaces[0].force_n) {
        assert!((a - b).abs() < 1.0, "{a} N against {b} N");
    }
    assert!((apart.bodies[0].x_m[0] - 0.5).abs() < 1e-12);
    assert_eq!(apart.interfaces[0].deflection_m[0], 0.0);
    assert!(apart.ledger.max_energy_error < 1e-3, "{:e}", apart.ledger.max_energy_error);
    digits(apart.interfaces[0].max_deflection_m, "0.300");
}

/// An interface only pushes: forces below zero in a curve do not pull.
#[test]
fn a_curve_never_pulls() {
    let wavy = Envelope::new(vec![0.0, 0.1, 0.2, 1.0], vec![0.0, MEGA, -MEGA, MEGA]).unwrap();
    let run = run(&chain(&[(24.0 * TONNES, 5.0)], &[memory(wavy, MEGA)]), 0.3, Method::Verlet);
    assert!(run.interfaces[0].force_n.iter().all(|&f| f >= 0.0));
}

/// A curve with peaks, for the cases without closed form.
fn bumpy() -> Envelope {
    let d = vec![0.0, 0.02, 0.05, 0.1, 0.2, 0.6, 1.2];
    let f = vec![0.0, 1.2e6, 0.7e6, 3.1e6, 1.9e6, 1.6e6, 2.4e6];
    Envelope::new(d, f).unwrap()
}

/// Same force, deflection doubled, at `v_r = 2 v_w`.
#[test]
pub fn case_6_wall_curve_and_doubled_pair_curve_move_alike() {
    let doubled = Envelope::new(
        bumpy().deflection_m().iter().map(|d| 2.0 * d).collect(),
        bumpy().force_n().to_vec(),
    )
    .unwrap();
    let wall = chain(&[(24.0 * TONNES, 8.0)], &[memory(bumpy(), 100.0 * MEGA)]);
    let pair =
        chain(&[(24.0 * TONNES, 8.0), (24.0 * TONNES, -8.0)], &[memory(doubled, 50.0 * MEGA)]);
    for method in ALL {
        let (wall, pair) = (run(&wall, 0.3, method), run(&pair, 0.3, method));
        for (a, b) in wall.bodies[0].v_m_per_s.iter().zip(&pair.bodies[0].v_m_per_s) {
            within_tolerance(a - b, 1e-9);
        }
    }
}

#[test]
pub fn case_7_mass_and_force_scale_together() {
    let scaled = |factor: f64, method: Method| {
        let force = bumpy().force_n().iter().map(|f| factor * f).collect();
        let envelope = Envelope::new(bumpy().deflection_m().to_vec(), force).unwrap();
        let law = memory(envelope, factor * 100.0 * MEGA);
        run(&chain(&[(factor * 24.0 * TONNES, 10.0)], &[law]), 0.3, method)
    };
    for method in ALL {
        let (one, eight) = (scaled(1.0, method), scaled(8.0, method));
        let three = scaled(3.0, method);
        if method != Method::Reference {
            // The reference chooses its steps by a momentum that scales too.
            assert_eq!(one.bodies, eight.bodies, "{method:?}: a power of two changes no bit");
        }
        for (a, b) in one.bodies[0].v_m_per_s.iter().zip(&three.bodies[0].v_m_per_s) {
            within_tolerance(a - b, REFERENCE);
        }
    }
}

/// Halving the step divides the error on a spring by 4, or by 16.
#[test]
pub fn orders_of_convergence_are_two_and_four() {
    let amplitude = 40.0 / 3.0 * (24.0 * TONNES / (40.0 * MEGA)).sqrt();
    let omega = (40.0 * MEGA / (24.0 * TONNES)).sqrt();
    let wall = chain(&[(24.0 * TONNES, 40.0 / 3.0)], &[elastic(linear(40.0 * MEGA))]);
    let error = |method, step_s| {
        let settings = RunSettings::new(0.06, 1.5e-3).with_method(method).with_step(step_s);
        let run = simulate(&wall, &settings).unwrap();
        assert_eq!(run.step_s, step_s);
        // At a fixed time on the way in, free of the search for the top.
        let row = run.time_s.len() / 2;
        run.interfaces[0].deflection_m[row] - amplitude * (omega * run.time_s[row]).sin()
    };
    let order = |method, step_s| -> f64 {
        let ratio: f64 = error(method, step_s) / error(method, step_s / 2.0);
        ratio.log2()
    };
    let two = order(Method::Verlet, 1.5e-3 / 8.0);
    within_tolerance(two - 2.0, 0.05);
    // Coarse, so that rounding stays far below the error.
    let four = order(Method::FourthOrder, 1.5e-3);
    within_tolerance(four - 4.0, 0.05);
}

#[test]
fn the_step_keeps_to_its_rule() {
    let stiff = chain(&[(1.0 * TONNES, 5.0)], &[elastic(linear(1e10))]);
    for (method, share) in [(Method::Verlet, 0.03), (Method::FourthOrder, 0.1)] {
        let settings = RunSettings::new(0.01, 0.75e-3).with_method(method).with_step(1e-3);
        assert!(run_with(&stiff, &settings).step_s <= share * (1e3_f64 / 1e10).sqrt());
    }
}

#[test]
fn a_curve_that_ends_is_an_error_with_the_interface_named() {
    let short = Envelope::new(vec![0.0, 0.2], vec![0.0, 1.0 * MEGA]).unwrap();
    let law = ForceLaw::new(short, Unloading::Elastic, EnvelopeEnd::Error);
    let settings = RunSettings::new(0.3, 0.75e-3);
    let error = simulate(&chain(&[(24.0 * TONNES, 10.0)], &[law]), &settings).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with("interface I0 is crushed 0.200"), "{message}");
    says(&message, "give a longer curve (a model: train it with faster runs), or end = \"hold\"");
}

#[test]
fn a_mistyped_duration_does_not_run_for_days() {
    let wall = chain(&[(24.0 * TONNES, 10.0)], &[elastic(linear(MEGA))]);
    let settings = RunSettings::new(1e9, 0.75e-3);
    let error = simulate(&wall, &settings).unwrap_err().to_string();
    says(&error, "shorten the duration or lengthen the output interval");
    let masses = vec![(24.0 * TONNES, 10.0); 200_000];
    let laws: Vec<_> = masses.iter().map(|_| elastic(linear(MEGA))).collect();
    let error = simulate(&chain(&masses, &laws), &RunSettings::new(0.4, 0.75e-3)).unwrap_err();
    assert!(error.to_string().contains("of 200000 bodies at 533 outputs"), "{error}");
}
