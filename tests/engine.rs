//! The engine of fixed steps: against the independent reference on random chains, its orders,
//! dampers and resistance against closed forms, and what a run says of itself.

use crate::common::{says, within_tolerance};
use crumple::curve::Envelope;
use crumple::multibody::{
    Body, Chain, Damping, EnvelopeEnd, ForceLaw, Interface, Method, Record, Resistance, Run,
    RunSettings, STANDARD_GRAVITY_M_PER_S2, Unloading, UnloadingShape, simulate,
};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

type Stream = Xoshiro256PlusPlus;

const OUTPUT_S: f64 = 0.75e-3;
const TONNES: f64 = 1e3;
const MEGA: f64 = 1e6;

/// What may occur in a random chain.
#[derive(Clone, Copy)]
struct Kind {
    /// Curves that begin above 0, where bodies meet with some speed. Bodies that are pressed
    /// together from rest do not move on such a curve until the force is exceeded; the law
    /// has no force between 0 and its first for that, so that there every method is of the
    /// first order at best.
    above: bool,
    tension: bool,
    shapes: bool,
    /// Curves that begin above 0 also with memory, and wherever bodies touch.
    everywhere: bool,
}

/// Kinks everywhere, rises of up to 1 GN/m, stretches without force.
fn envelope(random: &mut Stream, from_above: bool) -> Envelope {
    let mut deflection = vec![0.0];
    let mut force = vec![if from_above { random.gen_range(0.1e6..2e6) } else { 0.0 }];
    for _ in 1..random.gen_range(2..12) {
        let step = match random.gen_range(0..4) {
            0 => random.gen_range(0.004..0.02),
            _ => random.gen_range(0.02..0.2),
        };
        deflection.push(deflection[deflection.len() - 1] + step);
        let zero = random.gen_bool(0.15);
        force.push(if zero { 0.0 } else { random.gen_range(0.2e6..4e6) });
    }
    Envelope::new(deflection, force).unwrap()
}

/// A branch that falls unevenly, not always.
fn shape(random: &mut Stream) -> UnloadingShape {
    let points = random.gen_range(3..8);
    let (mut deflection, mut force) = (vec![0.5], vec![1e6]);
    for j in 1..points {
        let left = 1e6 * (1.0 - j as f64 / (points - 1) as f64);
        deflection.push(0.5 - 0.01 * (j as f64 + random.gen_range(-0.3..0.3)));
        force.push(if j == points - 1 { -1e3 } else { left * random.gen_range(0.5..1.3) });
    }
    UnloadingShape::of_branch(&deflection, &force).unwrap()
}

fn law(random: &mut Stream, kind: Kind, meets: bool) -> ForceLaw {
    let from_above = kind.above && (meets || kind.everywhere) && random.gen_bool(0.5);
    let envelope = envelope(random, from_above);
    let end = if random.gen_bool(0.5) { EnvelopeEnd::Hold } else { EnvelopeEnd::Slope };
    if from_above && !kind.everywhere || random.gen_bool(0.35) {
        return ForceLaw::new(envelope, Unloading::Elastic, end);
    }
    let unloading = Unloading::Memory { stiffness_n_per_m: random.gen_range(5e6..200e6) };
    if kind.shapes && random.gen_bool(0.5) {
        ForceLaw::shaped(envelope, unloading, shape(random), end)
    } else {
        ForceLaw::new(envelope, unloading, end)
    }
}

/// 1 to 16 bodies of 1 to 80 t: a train against another or a wall, or all at random speeds.
fn random_chain(random: &mut Stream, kind: Kind) -> Chain {
    let bodies = random.gen_range(1..=16_usize);
    let wall = bodies == 1 || random.gen_bool(0.4);
    let nose = if wall { bodies - 1 } else { random.gen_range(0..bodies - 1) };
    let trains = random.gen_bool(0.7);
    let made: Vec<Body> = (0..bodies)
        .map(|i| {
            let mass = random.gen_range(1.0_f64.ln()..80.0_f64.ln()).exp() * TONNES;
            let speed = match trains {
                true if i <= nose => 12.0,
                true => 0.0,
                false => random.gen_range(-10.0..10.0),
            };
            Body::new(format!("B{i}"), mass, speed)
        })
        .collect();
    let mut interface = |k: usize| {
        let gap = if random.gen_bool(0.5) { 0.0 } else { random.gen_range(0.0..0.08) };
        let meets = k == nose || gap > 0.0 || !trains;
        let interface = Interface::new(format!("I{k}"), law(random, kind, meets), gap);
        if kind.tension && random.gen_bool(0.5) {
            let slack = if random.gen_bool(0.5) { 0.0 } else { random.gen_range(0.0..0.03) };
            return interface.with_tension(law(random, kind, slack > 0.0), slack);
        }
        interface
    };
    let interfaces = (0..bodies - usize::from(!wall)).map(&mut interface).collect();
    Chain::new(made, interfaces).unwrap()
}

fn settings() -> RunSettings {
    RunSettings::new(0.15, OUTPUT_S)
}

/// Ledger within its tolerances, which every run must keep.
fn run(chain: &Chain, settings: &RunSettings) -> Run {
    let run = simulate(chain, settings).unwrap();
    let ledger = &run.ledger;
    assert!(ledger.max_energy_error < 1e-3, "energy {:e}", ledger.max_energy_error);
    assert!(ledger.max_momentum_error < 1e-10, "momentum {:e}", ledger.max_momentum_error);
    run
}

/// Largest difference of any body's speed at any output, in m/s.
fn difference(a: &Run, b: &Run) -> f64 {
    assert_eq!(a.time_s.len(), b.time_s.len());
    let mut largest = 0.0_f64;
    for (a, b) in a.bodies.iter().zip(&b.bodies) {
        for (a, b) in a.v_m_per_s.iter().zip(&b.v_m_per_s) {
            largest = largest.max((a - b).abs());
        }
    }
    largest
}

#[derive(Clone, Copy)]
struct Error {
    step_s: f64,
    /// In m/s.
    speed: f64,
}

/// Step used in s and error against the reference in m/s, of random chains of a kind: at the
/// default step and at a part of it.
fn errors(kind: Kind, chains: u64, method: Method, part: f64) -> (Vec<Error>, Vec<Error>) {
    let of = |seed: u64| {
        let chain = random_chain(&mut Stream::seed_from_u64(seed), kind);
        let reference = run(&chain, &settings().with_method(Method::Reference));
        // Its only measure of itself: a lost turn or kink shows here first.
        assert!(reference.ledger.max_energy_error < 1e-8, "{seed}: {:?}", reference.ledger);
        let whole = settings().with_method(method);
        let with = |settings: &RunSettings| {
            let run = run(&chain, settings);
            Error { step_s: run.step_s, speed: difference(&run, &reference) }
        };
        (with(&whole), with(&whole.with_step(part * method.default_step_s())))
    };
    (0..chains).map(of).unzip()
}

/// Median, what 9 of 10 keep to, and the largest. The same on every machine; the limits of the tests are
/// about 1.5 times what is found.
fn spread(errors: &[Error]) -> [f64; 3] {
    let mut sorted: Vec<f64> = errors.iter().map(|e| e.speed).collect();
    sorted.sort_by(f64::total_cmp);
    [sorted[sorted.len() / 2], sorted[sorted.len() * 9 / 10], sorted[sorted.len() - 1]]
}

/// `limits` may stop before the largest error.
fn assert_within(what: &str, errors: &[Error], limits: &[f64]) {
    let found = spread(errors);
    println!("{what}: median, 9 of 10, all within {found:?} m/s");
    for (found, limit) in found.into_iter().zip(limits.iter().copied()) {
        assert!(found < limit, "{what}: {found:e} m/s, expected less than {limit:e}");
    }
}

/// Mean order over the chains whose error is above the reference's own. Stiff chains are run
/// with less than the default step.
fn order(long: &[Error], short: &[Error]) -> f64 {
    let pairs: Vec<f64> = long
        .iter()
        .zip(short)
        .filter(|(long, short)| short.speed > 1e-9 && long.step_s > 1.5 * short.step_s)
        .map(|(long, short)| (long.speed / short.speed).ln() / (long.step_s / short.step_s).ln())
        .collect();
    assert!(pairs.len() > 20, "{} pairs", pairs.len());
    pairs.iter().sum::<f64>() / pairs.len() as f64
}

const PLAIN: Kind = Kind { above: false, tension: false, shapes: false, everywhere: false };
const COUPLED: Kind = Kind { above: false, tension: true, shapes: true, everywhere: false };
const ABOVE: Kind = Kind { above: true, tension: true, shapes: true, everywhere: false };
const EVERYWHERE: Kind = Kind { everywhere: true, ..ABOVE };

/// Most chains keep to 1e-4 m/s at the default step. A contact that is touched or missed by a
/// hair makes some far more sensitive, for any method, so what must hold for each of them is
/// stated at the short step, where only a wrong branch, not the step, could be left.
#[test]
fn verlet_moves_random_chains_as_the_reference_does() {
    for (name, kind) in [("plain", PLAIN), ("coupled", COUPLED)] {
        let (long, short) = errors(kind, 60, Method::Verlet, 0.25);
        assert_within(name, &long, &[2.5e-5, 1.6e-4, 3.5e-4]);
        assert_within(name, &short, &[1.5e-6, 1e-5, 2.2e-5]);
        let order = order(&long, &short);
        println!("order {order:.2}");
        // A kink costs a chance part of a step, which scatters the single chain's order.
        assert!((order - 2.0).abs() < 0.1, "{name}: order {order}");
    }
}

/// The default step is 37.5 times Verlet's. Kinks are taken along the step's parabola, turns
/// only nearly, so that the order is almost that of the smooth motion.
#[test]
fn the_fourth_order_moves_random_chains_as_the_reference_does() {
    for (name, kind) in [("plain", PLAIN), ("coupled", COUPLED)] {
        let (long, short) = errors(kind, 60, Method::FourthOrder, 0.125);
        assert_within(name, &long, &[1.5e-5, 2e-4, 5.5e-4]);
        assert_within(name, &short, &[5.5e-8, 7.5e-7, 2.7e-6]);
        let order = order(&long, &short);
        println!("order {order:.2}");
        assert!(order > 3.3, "{name}: order {order}");
    }
}

/// Where curves begin above 0, bodies bounce. A bounce in less than a step is not resolved, so the largest
/// error of 60 chains is that of one bounce and proves nothing at the default step (0.01 m/s, and
/// 0.4 m/s with the fourth order); at short steps it does.
#[test]
fn curves_that_begin_above_zero_are_followed() {
    let (long, short) = errors(ABOVE, 60, Method::Verlet, 0.25);
    assert_within("Verlet", &long, &[2e-5, 2.4e-4]);
    assert_within("Verlet, short", &short, &[1.2e-6, 1.2e-5, 1.2e-3]);
    let (long, short) = errors(ABOVE, 60, Method::FourthOrder, 0.0625);
    assert_within("fourth order", &long, &[6.5e-4, 1.1e-2]);
    assert_within("fourth order, short", &short, &[6.5e-6, 1.1e-4, 1.4e-2]);
}

/// Bodies that are pressed together behind a curve that begins above 0 turn within nanometres, on
/// branches of any steepness. No method converges there, but none may win energy.
#[test]
fn no_chain_wins_energy() {
    for seed in 0..200 {
        let chain = random_chain(&mut Stream::seed_from_u64(seed), EVERYWHERE);
        for (method, step_s) in [
            (Method::Verlet, 1e-5),
            (Method::FourthOrder, 3.5e-4),
            (Method::FourthOrder, 4e-5),
            (Method::FourthOrder, 1e-5),
        ] {
            run(&chain, &settings().with_method(method).with_step(step_s));
        }
    }
}

/// Neighbours that press equally, on curves that hold one force, move by nothing but rounding from
/// step to step, and over next to no way a work tells no force.
#[test]
fn chains_that_press_equally_win_no_energy() {
    let mut random = Stream::seed_from_u64(5);
    for k in 0..100 {
        let bodies = random.gen_range(2..25_usize);
        let wall = random.gen_bool(0.5);
        let most_n = if random.gen_bool(0.5) { 1e6 } else { 1.5e6 };
        let rise_m = random.gen_range(0.005..0.05);
        let curve = Envelope::new(vec![0.0, rise_m, 1.0], vec![0.0, 1e6, most_n]).unwrap();
        let unloading = if random.gen_bool(0.3) { Unloading::Elastic } else { memory() };
        let law = || ForceLaw::new(curve.clone(), unloading, EnvelopeEnd::Hold);
        let gap_m = [0.0, 0.02, 0.05][random.gen_range(0..3)];
        let couples = random.gen_bool(0.4);
        let moves = |i: usize| if wall || i < bodies / 2 { 8.0 } else { 0.0 };
        let row = (0..bodies).map(|i| Body::new(format!("A{i}"), 20.0 * TONNES, moves(i)));
        let interfaces = (1..bodies + usize::from(wall)).map(|i| {
            let interface = Interface::new(format!("I{i}"), law(), gap_m);
            if couples && i < bodies { interface.with_tension(law(), 0.0) } else { interface }
        });
        let chain = Chain::new(row.collect(), interfaces.collect()).unwrap();
        for (method, step_s) in [
            (Method::Verlet, 1e-5),
            (Method::Verlet, 5e-5),
            (Method::Verlet, 1.5e-4),
            (Method::FourthOrder, 3.5e-4),
        ] {
            let settings = RunSettings::new(2.0, 3e-3).with_method(method).with_step(step_s);
            let error = simulate(&chain, &settings).unwrap().ledger.max_energy_error;
            assert!(error < 1e-5, "chain {k}, {method:?}, {step_s} s: energy {error:e}");
        }
    }
}

/// A 24 t body at 40/3 m/s against a wall.
fn against_wall(interface: Interface) -> Chain {
    Chain::new(vec![Body::new("car", 24.0 * TONNES, 40.0 / 3.0)], vec![interface]).unwrap()
}

fn linear(stiffness: f64) -> ForceLaw {
    let envelope = Envelope::new(vec![0.0, 10.0], vec![0.0, 10.0 * stiffness]).unwrap();
    ForceLaw::new(envelope, Unloading::Elastic, EnvelopeEnd::Hold)
}

/// `x'' + 2ζω x' + ω² x = 0` while pressed: `v = v₀ e^{−ζωt} (cos ω_d t − ζω/ω_d sin ω_d t)`.
#[test]
pub fn a_damped_spring_follows_its_closed_form() {
    let (mass, stiffness, v0) = (24.0 * TONNES, 40.0 * MEGA, 40.0_f64 / 3.0);
    let omega = (stiffness / mass).sqrt();
    let zeta = 0.2;
    let damping = Damping::constant(2.0 * zeta * omega * mass).unwrap();
    let chain = against_wall(Interface::new("I", linear(stiffness), 0.0).with_damping(damping));
    let damped = omega * (1.0 - zeta * zeta).sqrt();
    let exact = |t: f64| {
        let wave = (damped * t).cos() - zeta * omega / damped * (damped * t).sin();
        v0 * (-zeta * omega * t).exp() * wave
    };
    let error = |step_s: f64| {
        let run = run(&chain, &settings().with_step(step_s));
        // Up to 45 ms the spring and the damper together push.
        let pressed = (0..60).map(|row| run.bodies[0].v_m_per_s[row] - exact(run.time_s[row]));
        assert!(run.interfaces[0].force_n[..60].iter().skip(1).all(|f| *f > 0.0));
        pressed.fold(0.0_f64, |worst, e| worst.max(e.abs()))
    };
    let (long, short) = (error(2e-5), error(1e-5));
    let order = (long / short).log2();
    // With the speed of the middle of the step for the damper the scheme stays symmetric.
    within_tolerance(order - 2.0, 0.1);
    within_tolerance(short, 1e-5);
    let reference = run(&chain, &settings().with_method(Method::Reference));
    let differs = |row: usize| reference.bodies[0].v_m_per_s[row] - exact(reference.time_s[row]);
    let worst = (0..60).map(|row| differs(row).abs()).fold(0.0, f64::max);
    within_tolerance(worst, 1e-9);
}

/// Damped energy is in the ledger, by both methods the same.
#[test]
fn an_unloading_stiffness_is_above_zero() {
    for stiffness_n_per_m in [0.0, -1.0, f64::NAN] {
        let unloading = Unloading::Memory { stiffness_n_per_m };
        let envelope = Envelope::new(vec![0.0, 0.1], vec![0.0, 1e6]).unwrap();
        let law = ForceLaw::new(envelope, unloading, EnvelopeEnd::Hold);
        let body = Body::new("A1", 20.0 * TONNES, 10.0);
        let error = Chain::new(vec![body], vec![Interface::new("A1|wall", law, 0.0)]).unwrap_err();
        let expected = format!("the unloading stiffness of A1|wall is {stiffness_n_per_m} N/m");
        assert!(error.to_string().starts_with(&expected), "{error}");
    }
}

#[test]
fn what_dampers_take_is_in_the_ledger() {
    let damping = Damping::new(vec![0.0, 2.0, 20.0], vec![4e5, 2e5, 1e5]).unwrap();
    let bodies: Vec<Body> =
        (0..5).map(|i| Body::new(format!("B{i}"), 20.0 * TONNES, 12.0)).collect();
    let interface = |k: usize| {
        let gap = if k == 4 { 0.0 } else { 0.013 };
        let interface = Interface::new(format!("I{k}"), linear(20.0 * MEGA), gap);
        interface.with_damping(damping.clone())
    };
    let chain = Chain::new(bodies, (0..5).map(interface).collect()).unwrap();
    let ours = run(&chain, &settings());
    let reference = run(&chain, &settings().with_method(Method::Reference));
    let (damped, of_all) = (ours.ledger.damped_j, ours.ledger.initial_kinetic_j);
    assert!(damped > 0.1 * of_all, "{damped} J of {of_all} J");
    let share = (damped - reference.ledger.damped_j).abs() / of_all;
    assert!(share < 1e-6, "{share:e}");
    let (long, short) = (
        difference(&run(&chain, &settings().with_step(4e-5)), &reference),
        difference(&ours, &reference),
    );
    println!("{long:e} {short:e}");
    // A damper sets in where a gap closes within a step: half a step of its force would be
    // 4e5 N s/m · 2 m/s · 5 µs / 20 t = 2e-4 m/s, and of the first order.
    assert!(short < 2e-6, "{short:e} m/s");
    let order = (long / short).ln() / 4.0_f64.ln();
    assert!(order > 1.7, "order {order}: {long:e}, {short:e} m/s");
}

/// Where a damper stops the swing of a light body the steps are up to three times as long, and nowhere else: a body by
/// itself would lose more than the ledger may.
#[test]
fn damped_contacts_of_light_bodies_take_longer_steps() {
    let (light_kg, plates_n_per_m) = (40.0_f64, 5e9);
    let plates = |ratio: f64| {
        let damping = Damping::constant(ratio * 2.0 * (light_kg * plates_n_per_m).sqrt()).unwrap();
        Interface::new("plates", linear(plates_n_per_m), 0.0).with_damping(damping)
    };
    let light = || Body::new("end", light_kg, 10.0);
    let alone = |ratio: f64| Chain::new(vec![light()], vec![plates(ratio)]).unwrap();
    let crush = || Interface::new("crush", linear(20.0 * MEGA), 0.0);
    let before_car = |ratio: f64| {
        let car = Body::new("car", 20.0 * TONNES, 10.0);
        Chain::new(vec![car, light()], vec![crush(), plates(ratio)]).unwrap()
    };
    let usual_s = 0.03 * (light_kg / plates_n_per_m).sqrt();
    let into_car = |car_kg: f64| {
        let car = Body::new("car", car_kg, 0.0);
        Chain::new(vec![light(), car], vec![plates(0.25)]).unwrap()
    };
    for (chain, is_longer) in [
        (into_car(20.0 * TONNES), false),
        (alone(0.25), false),
        (alone(0.19), false),
        (before_car(0.25), true),
        (before_car(0.19), false),
    ] {
        let run = run(&chain, &settings());
        assert_eq!(run.step_s > 2.0 * usual_s, is_longer, "{} s", run.step_s);
        assert!(run.step_s <= usual_s * if is_longer { 3.0 } else { 1.0 }, "{} s", run.step_s);
    }
}

/// Dampers of couplings set in and let go where their slack or gap ends.
#[test]
fn dampers_of_couplings_are_of_the_second_order() {
    let damping = Damping::constant(1.5e5).unwrap();
    let bodies: Vec<Body> = (0..4)
        .map(|i| Body::new(format!("B{i}"), 20.0 * TONNES, if i < 2 { 4.0 } else { 0.0 }))
        .collect();
    let interface = |k: usize| {
        let interface = Interface::new(format!("I{k}"), linear(20.0 * MEGA), 0.007);
        let slack = if k == 1 { 0.0 } else { 0.004 };
        interface.with_tension(linear(10.0 * MEGA), slack).with_damping(damping.clone())
    };
    let chain = Chain::new(bodies, (0..3).map(interface).collect()).unwrap();
    let settings = RunSettings::new(0.6, OUTPUT_S);
    let reference = run(&chain, &settings.with_method(Method::Reference));
    let error = |step_s: f64| difference(&run(&chain, &settings.with_step(step_s)), &reference);
    let (long, short) = (error(8e-5), error(1e-5));
    println!("{long:e} {short:e}");
    let order = (long / short).ln() / 8.0_f64.ln();
    assert!(order > 1.7, "order {order}: {long:e}, {short:e} m/s");
}

/// `v = v₀ − μ g t` far above the speed over which the sign is smoothed.
#[test]
pub fn a_braked_body_slows_down_evenly() {
    let resistance = Resistance { braking: 0.15, ..Resistance::default() };
    let body = Body { resistance, ..Body::new("car", 20.0 * TONNES, 15.0) };
    let chain = Chain::new(vec![body], Vec::new()).unwrap();
    let settings = RunSettings::new(1.5, OUTPUT_S);
    for method in [Method::Verlet, Method::Reference] {
        let run = run(&chain, &settings.with_method(method));
        let rate = 0.15 * STANDARD_GRAVITY_M_PER_S2;
        for (t, v) in run.time_s.iter().zip(&run.bodies[0].v_m_per_s) {
            // Rounding of 150 000 steps.
            within_tolerance(v - (15.0 - rate * t), 1e-10);
        }
        let ledger = run.ledger;
        let taken = ledger.initial_kinetic_j - ledger.kinetic_j;
        assert!((ledger.resisted_j - taken).abs() < 1e-6 * taken, "{ledger:?}");
        assert_eq!((ledger.stored_j, ledger.damped_j), (0.0, 0.0));
    }
}

/// All terms of the resistance, in a train that collides: one ledger.
#[test]
fn a_braked_train_balances() {
    let resistance = Resistance {
        constant_m_per_s2: 0.02,
        linear_per_s: 1e-3,
        quadratic_per_m: 1e-4,
        braking: 0.15,
    };
    let mut random = Stream::seed_from_u64(7);
    let body = |i: usize| Body {
        resistance,
        ..Body::new(format!("B{i}"), 20.0 * TONNES, if i < 4 { 12.0 } else { 0.0 })
    };
    let interface = |k: usize| Interface::new(format!("I{k}"), law(&mut random, PLAIN, true), 0.0);
    let chain = Chain::new((0..8).map(body).collect(), (0..7).map(interface).collect()).unwrap();
    let ours = run(&chain, &settings());
    let reference = run(&chain, &settings().with_method(Method::Reference));
    assert!(ours.ledger.resisted_j > 0.0);
    let share = (ours.ledger.resisted_j - reference.ledger.resisted_j).abs();
    assert!(share < 1e-6 * ours.ledger.initial_kinetic_j, "{share} J");
    // As any chain with kinks.
    assert!(difference(&ours, &reference) < 2e-4, "{:e}", difference(&ours, &reference));
}

#[test]
fn the_fourth_order_refuses_what_depends_on_speeds() {
    let fourth = settings().with_method(Method::FourthOrder);
    let damping = Damping::constant(1e5).unwrap();
    let damped = against_wall(Interface::new("nose|wall", linear(MEGA), 0.0).with_damping(damping));
    assert_eq!(
        simulate(&damped, &fourth).unwrap_err().to_string(),
        "the damper of interface nose|wall depends on the speed, which the fourth-order method does not support: use method = \"verlet\""
    );
    let resistance = Resistance { linear_per_s: 0.01, ..Resistance::default() };
    let body = Body { resistance, ..Body::new("car", 20.0 * TONNES, 15.0) };
    let braked = Chain::new(vec![body], Vec::new()).unwrap();
    let error = simulate(&braked, &fourth).unwrap_err();
    assert!(error.to_string().starts_with("running or braking resistance depends"), "{error}");
}

fn constant(force_n: f64) -> Envelope {
    Envelope::new(vec![0.0, 10.0], vec![force_n, force_n]).unwrap()
}

fn memory() -> Unloading {
    Unloading::Memory { stiffness_n_per_m: 80.0 * MEGA }
}

/// `d = μ v_r²/2F`, `t = μ v_r/F`, `e² = (F²/2k_u)/(μ v_r²/2)` with 24 t each, 10 m/s and 2 MN.
#[test]
fn the_summary_says_what_happened() {
    let law = ForceLaw::new(constant(2.0 * MEGA), memory(), EnvelopeEnd::Hold);
    let bodies = [("A", 10.0), ("B", 0.0)].map(|(name, v)| Body::new(name, 24.0 * TONNES, v));
    let chain = Chain::new(bodies.to_vec(), vec![Interface::new("A|B", law, 0.2)]).unwrap();
    let e = (2.0 * MEGA) / (80.0 * MEGA * 12.0 * TONNES).sqrt() / 10.0;
    // The unloading line takes a quarter of its period.
    let ends = 0.06 + std::f64::consts::FRAC_PI_2 * (12.0 * TONNES / (80.0 * MEGA)).sqrt();
    for method in [Method::Verlet, Method::FourthOrder] {
        let run = run(&chain, &RunSettings::new(0.2, OUTPUT_S).with_method(method));
        let seen = &run.interfaces[0];
        let close = |value: f64, exact: f64, what: &str| {
            // The opening lies within a step that the events cut by straight lines.
            let error = (value / exact - 1.0).abs();
            assert!(error < 1e-5, "{method:?}, {what}: {value} against {exact}");
        };
        close(seen.max_deflection_m, 0.3, "deflection");
        close(seen.max_deflection_time_s, 0.06, "its time");
        close(seen.common_velocity_time_s.unwrap(), 0.06, "common velocity");
        close(seen.peak_force_n, 2.0 * MEGA, "peak force");
        close(seen.restitution.unwrap(), e, "restitution");
        let (a, b) = (&run.bodies[0], &run.bodies[1]);
        close(a.final_v_m_per_s, 5.0 - 5.0 * e, "speed of A");
        close(b.final_v_m_per_s, 5.0 + 5.0 * e, "speed of B");
        close(a.mean_deceleration_m_per_s2, (5.0 + 5.0 * e) / ends, "mean deceleration");
        close(b.mean_deceleration_m_per_s2, -(5.0 + 5.0 * e) / ends, "mean acceleration");
        // All of it happens within 120 ms of the start.
        let moving = a.moving_mean_deceleration_m_per_s2.unwrap();
        close(moving, (5.0 + 5.0 * e) / 0.12, "moving mean");
        assert_eq!(run.warnings, [""; 0]);
    }
    let short = run(&chain, &RunSettings::new(0.11, OUTPUT_S));
    assert_eq!(short.bodies[0].moving_mean_deceleration_m_per_s2, None);
    // Windows begin or end at outputs, whatever their interval.
    let odd = run(&chain, &RunSettings::new(0.2, 0.7e-3));
    let moving = odd.bodies[0].moving_mean_deceleration_m_per_s2.unwrap();
    assert!((moving / ((5.0 + 5.0 * e) / 0.12) - 1.0).abs() < 1e-5, "{moving}");
}

/// A summary alone is that of the run with histories, bit by bit; it is audited less often.
#[test]
fn a_summary_alone_is_the_same() {
    for seed in 0..12 {
        let chain = random_chain(&mut Stream::seed_from_u64(seed), COUPLED);
        for method in [Method::Verlet, Method::FourthOrder, Method::Reference] {
            let settings = settings().with_method(method);
            let mut whole = run(&chain, &settings);
            let summary = run(&chain, &RunSettings { record: Record::Summary, ..settings });
            assert!(whole.time_s.len() == 201 && summary.time_s.is_empty());
            whole.time_s.clear();
            for body in &mut whole.bodies {
                for values in [&mut body.x_m, &mut body.v_m_per_s, &mut body.a_m_per_s2] {
                    assert_eq!(values.len(), 201);
                    values.clear();
                }
            }
            for i in &mut whole.interfaces {
                for values in [
                    &mut i.deflection_m,
                    &mut i.force_n,
                    &mut i.largest_deflection_m,
                    &mut i.stored_j,
                    &mut i.dissipated_j,
                ] {
                    assert_eq!(values.len(), 201);
                    values.clear();
                }
                // The reference method does not know it of each interface.
                if method == Method::Reference {
                    assert!(i.damped_so_far_j.is_empty() && i.damped_j.is_none());
                } else {
                    assert_eq!(i.damped_so_far_j.len(), 201);
                    assert_eq!(i.damped_so_far_j.last().copied(), i.damped_j);
                }
                i.damped_so_far_j.clear();
            }
            let (most, least) = (whole.ledger, summary.ledger);
            assert!(least.max_energy_error <= most.max_energy_error);
            assert!(least.max_momentum_error <= most.max_momentum_error);
            whole.ledger.max_energy_error = least.max_energy_error;
            whole.ledger.max_momentum_error = least.max_momentum_error;
            assert_eq!(whole, summary, "{seed}, {method:?}");
        }
    }
}

#[test]
fn warnings_and_errors_name_the_interface() {
    let table = || Envelope::new(vec![0.0, 0.2], vec![0.0, MEGA]).unwrap();
    let with = |end| {
        let law = ForceLaw::new(table(), Unloading::Elastic, end);
        against_wall(Interface::new("nose|wall", law, 0.0))
    };
    let long = settings().with_step(OUTPUT_S);
    let run = run(&with(EnvelopeEnd::Hold), &long);
    let deflection_m = run.interfaces[0].max_deflection_m;
    assert!(deflection_m > 0.2);
    let beyond = format!(
        "interface nose|wall is crushed {deflection_m:.4} m, beyond the end of its curve's data at 0.2000 m: the force there is an assumption"
    );
    assert_eq!(run.warnings.len(), 2, "{:?}", run.warnings);
    assert_eq!(run.warnings[0], beyond);
    assert!(
        run.warnings[1].starts_with("the run ends at 0.15 s while the contact still loads car:")
    );
    let stiff = against_wall(Interface::new("buffer", linear(1e4 * MEGA), 0.0));
    let run = simulate(&stiff, &long).unwrap();
    let (asked_s, used_s) = (OUTPUT_S, run.step_s);
    let shortened = format!(
        "the step of {asked_s:.3e} s is too long for interface buffer: {used_s:.3e} s was used"
    );
    assert_eq!(run.warnings, [shortened]);
    assert!(used_s <= 0.03 * (24.0 * TONNES / (1e4 * MEGA)).sqrt());
    for method in [Method::Verlet, Method::FourthOrder, Method::Reference] {
        let settings = settings().with_method(method);
        let error = simulate(&with(EnvelopeEnd::Error), &settings).unwrap_err().to_string();
        let words: Vec<&str> = error.split(' ').collect();
        assert_eq!(words[..4], ["interface", "nose|wall", "is", "crushed"], "{error}");
        says(&error, "s, beyond the end of its curve's data (0.2000 m)");
        let (deflection_m, time_s): (f64, f64) =
            (words[4].parse().unwrap(), words[7].parse().unwrap());
        // 0.2 m at 13.3 m/s, a little braked: after 15 ms; said within a step.
        assert!((0.2..0.212).contains(&deflection_m), "{method:?}: {deflection_m}");
        assert!((0.015..0.0165).contains(&time_s), "{method:?}: {time_s}");
    }
}

#[test]
fn bodies_that_never_meet_run_freely() {
    let bodies: Vec<Body> = [(-3.0, 10.0), (2.0, 20.0), (7.0, 5.0)]
        .map(|(v, mass)| Body::new(format!("B{v}"), mass * TONNES, v))
        .to_vec();
    let interfaces =
        [0.0, 0.3].map(|gap| Interface::new(format!("I{gap}"), linear(MEGA), gap)).to_vec();
    let chain = Chain::new(bodies, interfaces).unwrap();
    for method in [Method::Verlet, Method::FourthOrder, Method::Reference] {
        let run = run(&chain, &settings().with_method(method));
        for (body, v) in run.bodies.iter().zip([-3.0, 2.0, 7.0]) {
            assert!(body.v_m_per_s.iter().all(|now| *now == v));
            assert!(body.a_m_per_s2.iter().all(|a| *a == 0.0));
            for (x, t) in body.x_m.iter().zip(&run.time_s) {
                assert!((x - v * t).abs() < 1e-12, "{x} m at {t} s");
            }
            assert_eq!(body.mean_deceleration_m_per_s2, 0.0);
        }
        for seen in &run.interfaces {
            assert!(seen.force_n.iter().all(|f| *f == 0.0));
            assert_eq!((seen.peak_force_n, seen.max_deflection_m), (0.0, 0.0));
            assert_eq!((seen.restitution, seen.common_velocity_time_s), (None, None));
        }
        assert_eq!(run.ledger.max_energy_error, 0.0);
    }
}

fn points(shape: &[(f64, f64)]) -> UnloadingShape {
    let (deflection, force): (Vec<f64>, Vec<f64>) = shape.iter().copied().unzip();
    UnloadingShape::of_branch(&deflection, &force).unwrap()
}

/// The branch returns the energy of the line, `F²/2k_u`, whatever its shape: the rebound of
/// case 4 in another way.
#[test]
fn a_shaped_branch_gives_back_what_is_stored() {
    let e = (2.0 * MEGA) / (80.0 * MEGA * 24.0 * TONNES).sqrt() / (40.0 / 3.0);
    let hollow = points(&[(0.5, 1e6), (0.49, 4e5), (0.47, 1e5), (0.44, 3e4), (0.40, 0.0)]);
    let bulge = points(&[(0.5, 1e6), (0.49, 1.1e6), (0.47, 0.8e6), (0.46, -1e5)]);
    for (name, shape) in [("line", UnloadingShape::line()), ("hollow", hollow), ("bulge", bulge)] {
        let law = ForceLaw::shaped(constant(2.0 * MEGA), memory(), shape, EnvelopeEnd::Hold);
        let chain = against_wall(Interface::new("I", law, 0.0));
        for method in [Method::Verlet, Method::FourthOrder] {
            let run = run(&chain, &RunSettings::new(0.3, OUTPUT_S).with_method(method));
            let found = run.interfaces[0].restitution.unwrap();
            assert!((found / e - 1.0).abs() < 1e-6, "{name}, {method:?}: {found} against {e}");
            let ledger = run.ledger;
            assert_eq!(ledger.stored_j, 0.0);
            let back = ledger.initial_kinetic_j - ledger.dissipated_j;
            assert!((ledger.kinetic_j / back - 1.0).abs() < 2e-6, "{name}: {ledger:?}");
        }
    }
}

#[test]
fn a_straight_branch_of_many_points_is_the_line() {
    let straight = points(&[(0.5, 8e5), (0.45, 6e5), (0.41, 4.4e5), (0.36, 2.4e5), (0.2, -4e5)]);
    for seed in 0..8 {
        let mut random = Stream::seed_from_u64(seed);
        let envelope = envelope(&mut random, false);
        let with = |shape| {
            let law = ForceLaw::shaped(envelope.clone(), memory(), shape, EnvelopeEnd::Hold);
            run(&against_wall(Interface::new("I", law, 0.0)), &settings())
        };
        let (line, many) = (with(UnloadingShape::line()), with(straight.clone()));
        // Shares of the branch are rounded in another way.
        assert!(difference(&line, &many) < 1e-9, "{:e} m/s", difference(&line, &many));
    }
}

/// The same crash of a body that weighs 1/100 and 1/10 000: its mean is the same, but for when it begins.
#[test]
fn mean_decelerations_are_those_of_any_mass() {
    let mean = |factor: f64| {
        let unloading = Unloading::Memory { stiffness_n_per_m: 80.0 * MEGA * factor };
        let law = ForceLaw::new(constant(4e5 * factor), unloading, EnvelopeEnd::Hold);
        let body = Body::new("A", 1270.0 * factor, 10.0);
        let chain = Chain::new(vec![body], vec![Interface::new("A|wall", law, 0.0)]).unwrap();
        run(&chain, &settings()).bodies[0].mean_deceleration_m_per_s2
    };
    let whole = mean(1.0);
    assert!(whole > 100.0, "{whole}");
    for factor in [1e-2, 1e-4] {
        assert!((mean(factor) / whole - 1.0).abs() < 0.02, "{} against {whole}", mean(factor));
    }
}

/// A contact ends where its force does, whatever happens then: a curve that falls to zero, an
/// elastic curve that goes back over a stretch without force, a damper that opens before its
/// spring, neighbours that press with the same force.
#[test]
fn mean_decelerations_end_with_the_force() {
    let curve = |d: &[f64], f: &[f64]| Envelope::new(d.to_vec(), f.to_vec()).unwrap();
    let body = |name: &str, v: f64| Body::new(name, 20.0 * TONNES, v);
    let wall = |speed: f64, interface: Interface| {
        Chain::new(vec![body("A", speed)], vec![interface]).unwrap()
    };
    let law = |envelope, unloading, end| ForceLaw::new(envelope, unloading, end);
    let elastic = |envelope| law(envelope, Unloading::Elastic, EnvelopeEnd::Slope);
    let falls = curve(&[0.0, 0.1, 0.2, 0.3, 5.0], &[0.0, 1e6, 1e6, 0.0, 0.0]);
    let late = curve(&[0.0, 0.1, 1.0], &[0.0, 0.0, 9e6]);
    let spring = curve(&[0.0, 1.0], &[0.0, 5e6]);
    let damper = Damping::constant(4e5).unwrap();
    let fall = Interface::new("A|wall", law(falls, memory(), EnvelopeEnd::Hold), 0.0);
    let damped = Interface::new("A|wall", elastic(spring), 0.0).with_damping(damper);
    let plateau = || curve(&[0.0, 0.02, 1.0], &[0.0, 1e6, 1.5e6]);
    let row: Vec<Body> = (0..20).map(|i| body(&format!("A{i}"), 8.0)).collect();
    let between = (0..20)
        .map(|i| Interface::new(format!("I{i}"), law(plateau(), memory(), EnvelopeEnd::Hold), 0.05))
        .collect();
    let chains = [
        wall(10.0, fall),
        wall(5.0, Interface::new("A|wall", elastic(late), 0.0)),
        wall(5.0, damped),
        Chain::new(row, between).unwrap(),
    ];
    for (k, chain) in chains.iter().enumerate() {
        let fine = run(chain, &RunSettings::new(2.0, 5e-5).with_step(5e-5));
        for method in [Method::Verlet, Method::FourthOrder, Method::Reference] {
            if method == Method::FourthOrder && chain.has_rates() {
                continue;
            }
            for duration_s in [2.0, 3.0] {
                let coarse = run(chain, &RunSettings::new(duration_s, 5e-3).with_method(method));
                for (i, body) in chain.bodies().iter().enumerate() {
                    let (exact, length_s) = mean_of_histories(&fine, i, body.mass_kg).unwrap();
                    assert!(length_s < 1.9, "chain {k}: body {i} over {length_s} s");
                    let found = coarse.bodies[i].mean_deceleration_m_per_s2;
                    let error = (found / exact - 1.0).abs();
                    // Between equal neighbours the force dies away without an end.
                    let limit = if k == 3 { 0.04 } else { 0.01 };
                    assert!(
                        error < limit,
                        "chain {k}, {method:?}: {found} for {exact} of body {i}"
                    );
                }
            }
        }
    }
}

/// A contact counts from where its force begins, whatever announces it: a curve that begins
/// without force, a coupling, or brakes that act already.
#[test]
fn mean_decelerations_begin_with_the_force() {
    let tonnes = 24.0 * TONNES;
    let late = || Envelope::new(vec![0.0, 0.1, 0.1 + 1e-9, 9.0], vec![0.0, 0.0, 2e6, 2e6]).unwrap();
    let law = |curve| ForceLaw::new(curve, memory(), EnvelopeEnd::Hold);
    let bodies = |speeds: [f64; 2]| {
        ["A", "B"].iter().zip(speeds).map(|(name, v)| Body::new(*name, tonnes, v)).collect()
    };
    let (a, closing) = (2e6 / tonnes, 10.0);
    // As long as the force acts: to the common velocity and a quarter of the unloading's period.
    let e = 2e6 / (80e6 * 0.5 * tonnes).sqrt() / closing;
    let ends = 0.5 * closing / a + std::f64::consts::FRAC_PI_2 * (0.5 * tonnes / 80e6).sqrt();
    let mean = (0.5 * closing) * (1.0 + e) / ends;
    let late_push =
        |bodies| Chain::new(bodies, vec![Interface::new("A|B", law(late()), 0.2)]).unwrap();
    let mut braked: Vec<Body> = bodies([10.0, 0.0]);
    braked[0].resistance.braking = 0.1;
    let coupled = Interface::new("A|B", law(constant(1e6)), 1.0).with_tension(law(late()), 0.0);
    let chains = [
        (late_push(bodies([10.0, 0.0])), mean, 1e-4),
        (Chain::new(bodies([0.0, 10.0]), vec![coupled]).unwrap(), -mean, 1e-2),
        // Brakes of 0.1 g add to the 83 m/s² while A moves.
        (late_push(braked), mean + 0.1 * STANDARD_GRAVITY_M_PER_S2, 1e-2),
    ];
    for (chain, exact, tolerance) in &chains {
        for method in [Method::Verlet, Method::FourthOrder, Method::Reference] {
            if method == Method::FourthOrder && chain.has_rates() {
                continue;
            }
            let found = run(chain, &RunSettings::new(0.2, OUTPUT_S).with_method(method)).bodies[0]
                .mean_deceleration_m_per_s2;
            let tolerance = if method == Method::Reference { 1e-2 } else { *tolerance };
            let error = (found / exact - 1.0).abs();
            assert!(error < tolerance, "{method:?}: {found} against {exact}");
        }
    }
}

/// Mean deceleration by its definition from fine histories: over the first stretch of time in
/// which the net force has one sign and exceeds 1 kN, but for at most 0.3 ms, beside a push of less than 1 ms for as long, and
/// changes the speed by 0.5 % of the range of the speeds, 5 % in less than 1 ms; and how long that is, in s. None where
/// that depends on whether something lasts a quarter of a millisecond more.
fn mean_of_histories(run: &Run, body: usize, mass_kg: f64) -> Option<(f64, f64)> {
    let [one, other] = [0.75e-3, 1.25e-3].map(|s| mean_without(run, body, mass_kg, s));
    (one == other).then_some(one)
}

/// The same, with interruptions that are shorter than that.
fn mean_without(run: &Run, body: usize, mass_kg: f64, brief_s: f64) -> (f64, f64) {
    let (a, v, times) = (&run.bodies[body].a_m_per_s2, &run.bodies[body].v_m_per_s, &run.time_s);
    let exceeds = |t: usize, sign: f64| a[t] * sign * mass_kg > 1e3;
    let (mut from, mut stretches) = (0, Vec::new());
    while let Some(first) = (from..a.len()).find(|&t| exceeds(t, a[t].signum())) {
        let sign = a[first].signum();
        let end = (first..a.len()).find(|&t| !exceeds(t, sign)).unwrap_or(a.len() - 1);
        if end > first {
            stretches.push((sign, first.saturating_sub(1), end, first.saturating_sub(1)));
        }
        from = end.max(first + 1);
    }
    let is_brief = |from: usize, to: usize| times[to].max(times[from]) - times[from] < brief_s;
    // Sign, begin, end, and begin of the last of its pushes.
    let joins = |s: &[(f64, usize, usize, usize)]| {
        let (first, last) = (s[0], s[s.len() - 1]);
        let rattles = is_brief(first.3, first.2) || is_brief(last.1, last.2);
        let follow = |from: usize, to: usize| {
            rattles && is_brief(from, to) || s.len() == 2 && times[to] - times[from] <= 0.3e-3
        };
        first.0 == last.0
            && s.windows(2).all(|pair| follow(pair[0].2, pair[1].1))
            && (s.len() == 2 || is_brief(s[1].1, s[1].2))
    };
    while let Some((k, n)) = (0..stretches.len()).find_map(|k| {
        let of = |n: &usize| stretches.get(k..k + n).is_some_and(joins);
        [2, 3].into_iter().find(of).map(|n| (k, n))
    }) {
        (stretches[k].2, stretches[k].3) = (stretches[k + n - 1].2, stretches[k + n - 1].3);
        stretches.drain(k + 1..k + n);
    }
    let ends = stretches.iter().flat_map(|s| [v[s.1], v[s.2]]);
    let (low, high) =
        ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (v.min(low), v.max(high)));
    let counts = |(_, begin, end, _): &&(f64, usize, usize, usize)| {
        let share = if is_brief(*begin, *end) { 0.05 } else { 0.005 };
        (v[*begin] - v[*end]).abs() >= share * (high - low)
    };
    let Some(&(_, begin, end, _)) = stretches.iter().find(counts) else {
        return (0.0, f64::INFINITY);
    };
    let length_s = times[end] - times[begin];
    ((v[begin] - v[end]) / length_s, length_s)
}

/// The summary has them whatever the interval between the outputs.
#[test]
fn mean_decelerations_do_not_depend_on_the_outputs() {
    let mut random = Stream::seed_from_u64(11);
    let kind = Kind { above: false, tension: true, shapes: false, everywhere: false };
    let (mut errors, mut open) = (Vec::new(), 0);
    for _ in 0..40 {
        let chain = random_chain(&mut random, kind);
        let settings = RunSettings::new(0.24, 2e-5).with_method(Method::FourthOrder);
        let fine = run(&chain, &settings);
        for (method, output_s) in [
            (Method::Verlet, OUTPUT_S),
            (Method::FourthOrder, OUTPUT_S),
            (Method::FourthOrder, 6e-3),
            (Method::Reference, OUTPUT_S),
        ] {
            let coarse = run(&chain, &RunSettings::new(0.24, output_s).with_method(method));
            for (i, body) in chain.bodies().iter().enumerate() {
                let Some((exact, length_s)) = mean_of_histories(&fine, i, body.mass_kg) else {
                    open += 1;
                    continue;
                };
                let found = coarse.bodies[i].mean_deceleration_m_per_s2;
                let error = (found - exact).abs() / exact.abs().max(0.1);
                // Ends fall between two looks.
                let limit = 1e-2 + 0.4e-3 / length_s;
                assert!(
                    error < limit,
                    "{method:?}, {output_s} s: {found} for {exact} over {length_s} s"
                );
                errors.push(error);
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    assert!(open < errors.len() / 20, "{open} of {}", errors.len());
    let at = |share: f64| errors[(errors.len() as f64 * share) as usize];
    println!("mean decelerations, median, 9 of 10, 49 of 50: {:?}", [0.5, 0.9, 0.98].map(at));
    assert!(at(0.5) < 1e-3 && at(0.9) < 5e-3 && at(0.98) < 2e-2);
}
