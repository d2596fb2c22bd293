//! Multi-body runs against solutions on paper, to the digits given there.

use crumple::curve::Envelope;
use crumple::multibody::{
    Body, Chain, EnvelopeEnd, ForceLaw, Interface, Run, RunSettings, SimulationError, Unloading,
    simulate,
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

fn run(chain: &Chain, duration_s: f64, step_s: f64) -> Run {
    let settings = RunSettings::new(duration_s, 0.75e-3).with_step(step_s);
    let run = simulate(chain, &settings).unwrap();
    assert!(run.ledger.max_energy_error < 1e-3, "energy {:e}", run.ledger.max_energy_error);
    assert!(run.ledger.max_momentum_error < 1e-10, "momentum {:e}", run.ledger.max_momentum_error);
    run
}

/// Equal to as many digits as `printed` has behind its point.
fn digits(value: f64, printed: &str) {
    let decimals = printed.split('.').nth(1).map_or(0, str::len);
    assert_eq!(format!("{value:.decimals$}"), printed);
}

const STEP_S: f64 = crumple::multibody::integrator::DEFAULT_STEP_S;

/// `d = m v²/2F`, `t = m v/F`.
#[test]
fn case_1_constant_force_against_a_wall() {
    let wall = chain(&[(24.0 * TONNES, 40.0 / 3.0)], &[elastic(constant(2.0 * MEGA))]);
    let run = run(&wall, 0.3, STEP_S);
    let contact = &run.interfaces[0];
    digits(contact.max_deflection_m, "1.0666667");
    digits(contact.max_deflection_time_s, "0.16");
    digits(run.bodies[0].mean_deceleration_m_per_s2 / 9.80665, "8.4976");
}

/// `d = v sqrt(m/k)`, `t = (π/2) sqrt(m/k)`, `F = v sqrt(m k)`.
#[test]
fn case_2_linear_spring_against_a_wall() {
    let wall = chain(&[(24.0 * TONNES, 40.0 / 3.0)], &[elastic(linear(40.0 * MEGA))]);
    let run = run(&wall, 0.3, STEP_S);
    let contact = &run.interfaces[0];
    digits(contact.max_deflection_m, "0.3265986");
    digits(contact.max_deflection_time_s, "0.03847649");
    digits(contact.peak_force_n / MEGA, "13.063946");
    digits(contact.restitution.unwrap(), "1.000000");
}

/// `d = μ v_r²/2F`, common velocity `m_1 v_r/(m_1 + m_2)`.
#[test]
fn case_3_two_bodies_with_constant_force() {
    let pair = chain(
        &[(24.0 * TONNES, 10.0), (24.0 * TONNES, 0.0)],
        &[memory(constant(2.0 * MEGA), 80.0 * MEGA)],
    );
    let run = run(&pair, 0.06, STEP_S);
    digits(run.interfaces[0].max_deflection_m, "0.3");
    digits(run.interfaces[0].max_deflection_time_s, "0.06");
    digits(run.bodies[0].v_m_per_s[run.time_s.len() - 1], "5.000");
}

/// `e² = (F²/2k_u)/(μ v_r²/2)`.
#[test]
fn case_4_unloading_gives_the_restitution() {
    let pair = chain(
        &[(24.0 * TONNES, 10.0), (24.0 * TONNES, 0.0)],
        &[memory(constant(2.0 * MEGA), 80.0 * MEGA)],
    );
    // The switch from loading to unloading costs O(h): seven digits need a short step.
    let run = run(&pair, 0.15, 1e-7);
    let last = run.time_s.len() - 1;
    digits(run.interfaces[0].restitution.unwrap(), "0.2041241");
    digits(run.bodies[0].v_m_per_s[last], "3.9793793");
    digits(run.bodies[1].v_m_per_s[last], "6.0206207");
}

/// A spring that also pulls is not an interface of ours, so the free chain is checked while
/// all interfaces still push, against its closed form.
#[test]
fn chain_of_springs_follows_its_modes_while_it_is_pressed() {
    let (n, mass, stiffness) = (8, 24.0 * TONNES, 50.0 * MEGA);
    let start = |i: usize| if i < n / 2 { 10.0 } else { 0.0 };
    let bodies: Vec<(f64, f64)> = (0..n).map(|i| (mass, start(i))).collect();
    let laws: Vec<ForceLaw> = (0..n - 1).map(|_| elastic(linear(stiffness))).collect();
    let run = run(&chain(&bodies, &laws), 0.06, 1e-6);
    // v_i(t) = Σ_j q_j cos(ω_j t) φ_j(i), φ_j(i) = cos(jπ(i − 1/2)/N), ω_j = 2 sqrt(k/m) sin(jπ/2N).
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
    // The closed form's own check values, at 0.1 s.
    digits(velocity(0, 0.1), "3.470766");
    digits(velocity(7, 0.1), "6.529234");
    // Up to where the first interface would pull.
    let pulls = |row: usize| run.interfaces.iter().any(|i| i.deflection_m[row] < 0.0);
    let pressed = (0..run.time_s.len()).take_while(|&row| !pulls(row)).count();
    assert!(run.time_s[pressed - 1] > 0.03, "pressed until {} s", run.time_s[pressed - 1]);
    for row in 0..pressed {
        for i in 0..n {
            let (ours, exact) = (run.bodies[i].v_m_per_s[row], velocity(i, run.time_s[row]));
            assert!((ours - exact).abs() < 1e-6, "body {i}: {ours} against {exact}");
        }
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
    let run = run(&chain(&[(24.0 * TONNES, 5.0)], &[memory(wavy, 0.0)]), 0.3, STEP_S);
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
fn case_6_wall_curve_and_doubled_pair_curve_move_alike() {
    let doubled = Envelope::new(
        bumpy().deflection_m().iter().map(|d| 2.0 * d).collect(),
        bumpy().force_n().to_vec(),
    )
    .unwrap();
    let wall = chain(&[(24.0 * TONNES, 8.0)], &[memory(bumpy(), 100.0 * MEGA)]);
    let pair =
        chain(&[(24.0 * TONNES, 8.0), (24.0 * TONNES, -8.0)], &[memory(doubled, 50.0 * MEGA)]);
    let (wall, pair) = (run(&wall, 0.3, STEP_S), run(&pair, 0.3, STEP_S));
    for (a, b) in wall.bodies[0].v_m_per_s.iter().zip(&pair.bodies[0].v_m_per_s) {
        assert!((a - b).abs() < 1e-9, "{a} against {b}");
    }
}

#[test]
fn case_7_mass_and_force_scale_together() {
    let scaled = |factor: f64| {
        let force = bumpy().force_n().iter().map(|f| factor * f).collect();
        let envelope = Envelope::new(bumpy().deflection_m().to_vec(), force).unwrap();
        let law = memory(envelope, factor * 100.0 * MEGA);
        run(&chain(&[(factor * 24.0 * TONNES, 10.0)], &[law]), 0.3, STEP_S)
    };
    let (one, eight, three) = (scaled(1.0), scaled(8.0), scaled(3.0));
    assert_eq!(one.bodies, eight.bodies, "a power of two changes no bit");
    for (a, b) in one.bodies[0].v_m_per_s.iter().zip(&three.bodies[0].v_m_per_s) {
        assert!((a - b).abs() < 1e-10, "{a} against {b}");
    }
}

/// Halving the step quarters the error of the crush on a spring.
#[test]
fn order_of_convergence_is_two() {
    let exact = 40.0 / 3.0 * (24.0 * TONNES / (40.0 * MEGA)).sqrt();
    let error = |step_s| {
        let wall = chain(&[(24.0 * TONNES, 40.0 / 3.0)], &[elastic(linear(40.0 * MEGA))]);
        let settings = RunSettings::new(0.06, 0.75e-3).with_step(step_s);
        let run = simulate(&wall, &settings).unwrap();
        // At a fixed time on the way in, free of the search for the top.
        let row = run.time_s.len() / 2;
        let omega = (40.0 * MEGA / (24.0 * TONNES)).sqrt();
        run.interfaces[0].deflection_m[row] - exact * (omega * run.time_s[row]).sin()
    };
    let order = (error(0.75e-3 / 4.0) / error(0.75e-3 / 8.0)).log2();
    assert!((order - 2.0).abs() < 0.05, "order {order}");
}

#[test]
fn the_step_keeps_to_its_rule() {
    let stiff = chain(&[(1.0 * TONNES, 5.0)], &[elastic(linear(1e10))]);
    let run = run(&stiff, 0.01, 1e-3);
    assert!(run.step_s <= 0.03 * (1e3_f64 / 1e10).sqrt());
}

#[test]
fn a_curve_that_ends_is_an_error_with_the_interface_named() {
    let short = Envelope::new(vec![0.0, 0.2], vec![0.0, 1.0 * MEGA]).unwrap();
    let law = ForceLaw::new(short, Unloading::Elastic, EnvelopeEnd::Error);
    let settings = RunSettings::new(0.3, 0.75e-3);
    let error = simulate(&chain(&[(24.0 * TONNES, 10.0)], &[law]), &settings).unwrap_err();
    let message = error.to_string();
    assert!(message.starts_with("interface I0 is crushed 0.200"), "{message}");
    assert!(message.contains("give a longer curve, or end = \"hold\""), "{message}");
}

#[test]
fn a_mistyped_duration_does_not_run_for_days() {
    let wall = chain(&[(24.0 * TONNES, 10.0)], &[elastic(linear(MEGA))]);
    let settings = RunSettings::new(1e9, 0.75e-3);
    assert!(matches!(simulate(&wall, &settings), Err(SimulationError::TooLong { .. })));
}
