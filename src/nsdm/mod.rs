//! NSDM: a nonlinear spring and damper, fitted to a recorded motion.
//!
//! The reference method of the literature on train crashes, besides prescribed curves: one mass with
//! `m x'' + c(|x'|) x' + k(|x|) x = 0`, `x(0) = 0`, `x'(0) = v₀`. `k` is continuous and
//! piecewise linear with 10 segments up to the reference's maximum displacement, `c` with 5
//! segments up to its impact speed. The 30 node values and positions are found by a genetic
//! algorithm followed by a simplex search; see [`fit`]. The motion at another speed
//! is [`Nsdm::run`]; since spring and damper can replace each other, fit with several seeds
//! and check their [`Identifiability`].
//!
//! ```
//! use crumple::nsdm::{FitSettings, Target, fit};
//!
//! // A mass of 24 t that bounces off a spring of 40 MN/m.
//! let omega = (40e6_f64 / 24e3).sqrt();
//! let time_s: Vec<f64> = (0..80).map(|i| 0.75e-3 * f64::from(i)).collect();
//! let velocity = time_s.iter().map(|t| 10.0 * (omega * t).cos()).collect();
//! let acceleration = time_s.iter().map(|t| -10.0 * omega * (omega * t).sin()).collect();
//!
//! let target = Target::new(24e3, 10.0, time_s, velocity, acceleration)?;
//! let settings = FitSettings { population: 30, generations: 20, ..FitSettings::default() };
//! let fit = fit(&target, &settings, 1)?;
//! assert!(fit.velocity_l1 < 0.05);
//! # Ok::<(), crumple::Error>(())
//! ```

mod genetic;
mod law;
mod motion;
mod simplex;

use serde::Serialize;

use crate::error::{Error, error};
use crate::parallel;
use crate::signal::l1_ratio;
use crate::stream::Stream;
use genetic::{Genes, Scales};
pub use law::{Identifiability, Nsdm, PiecewiseLinear};
pub use motion::Motion;
use motion::Steps;

/// Bounds of the stiffness at its nodes, in N/m, for rail vehicles; searched evenly in the logarithm. A mass below 7.6 or above 76 t is
/// fitted as one of 24 t, and a speed over crush below 6.3 or above 63 1/s as one of 20 1/s, and the law is scaled back.
pub const STIFFNESS_N_PER_M: [f64; 2] = [1e5, 1e8];
/// Bounds of the damping at its nodes, in N s/m, for the same.
pub const DAMPING_N_S_PER_M: [f64; 2] = [0.0, 5e5];
/// Mass, and speed over crush, that the bounds are meant for: the lead car's.
const USUAL_MASS_KG: f64 = 24e3;
const USUAL_RATE_PER_S: f64 = 20.0;
/// Objective of a law that diverges: larger than any other, and comparable.
const PENALTY: f64 = f64::MAX;
/// One in this many of the first population begins at least squares, if requested.
const LEAST_SQUARES_SHARE: usize = 4;
/// More would be a mistyped number.
const MAX_POPULATION: usize = 1_000_000;
const FEWEST_SAMPLES: usize = 3;

/// What a law is fitted to: the motion of one mass from contact on.
///
/// Invariant: at least 3 samples, columns of one length, all finite; time strictly increasing
/// from 0 or later; mass and speed above 0; the mass moves forwards at least once.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    mass_kg: f64,
    speed_m_per_s: f64,
    time_s: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    displacement_m: Vec<f64>,
    largest_m: f64,
}

impl Target {
    /// `mass_kg` and `speed_m_per_s` above 0; `time_s` from contact on; `velocity` in m/s,
    /// positive on the way in, and `acceleration` in m/s² at these times.
    ///
    /// The displacement is the integral of the velocity by the trapezoidal rule; before a first
    /// time later than 0 the mass moves with the impact speed.
    ///
    /// # Errors
    /// It names the first sample that breaks the invariant, counted from 1.
    pub fn new(
        mass_kg: f64,
        speed_m_per_s: f64,
        time_s: Vec<f64>,
        velocity: Vec<f64>,
        acceleration: Vec<f64>,
    ) -> Result<Self, Error> {
        let samples = time_s.len();
        if velocity.len() != samples || acceleration.len() != samples {
            let (velocity, acceleration) = (velocity.len(), acceleration.len());
            return Err(error!(
                Comparison,
                "columns differ in length: {samples} times, {velocity} velocities, {acceleration} accelerations"
            ));
        }
        if samples < FEWEST_SAMPLES {
            return Err(error!(
                Comparison,
                "a motion needs at least {FEWEST_SAMPLES} samples, found {samples}"
            ));
        }
        check_mass_and_speed(mass_kg, speed_m_per_s)?;
        check_finite("velocity", &velocity)?;
        check_finite("acceleration", &acceleration)?;
        check_times(&time_s)?;
        let mut displacement_m = vec![time_s[0] * speed_m_per_s];
        for i in 1..samples {
            let step = 0.5 * (velocity[i - 1] + velocity[i]) * (time_s[i] - time_s[i - 1]);
            displacement_m.push(displacement_m[i - 1] + step);
        }
        let largest_m = displacement_m.iter().copied().fold(0.0, f64::max);
        if !(largest_m > 0.0 && largest_m.is_finite()) {
            return Err(error!(
                Comparison,
                "the reference never moves forwards: is the velocity positive at contact?"
            ));
        }
        Ok(Self {
            mass_kg,
            speed_m_per_s,
            time_s,
            velocity,
            acceleration,
            displacement_m,
            largest_m,
        })
    }

    /// The same motion of a mass that is so many times lighter, in a time that runs so many times slower.
    fn scaled(&self, mass: f64, rate: f64) -> Self {
        let over = |values: &[f64], by: f64| values.iter().map(|value| value / by).collect();
        Self {
            mass_kg: self.mass_kg / mass,
            speed_m_per_s: self.speed_m_per_s / rate,
            time_s: self.time_s.iter().map(|t| t * rate).collect(),
            velocity: over(&self.velocity, rate),
            acceleration: over(&self.acceleration, rate * rate),
            ..self.clone()
        }
    }

    /// Displacement at each time, in m.
    pub fn displacement_m(&self) -> &[f64] {
        &self.displacement_m
    }

    fn scales(&self) -> Scales {
        Scales { displacement_m: self.largest_m, speed_m_per_s: self.speed_m_per_s }
    }

    /// `Σ (a − a_ref)² + w Σ (v − v_ref)²` of a law; [`PENALTY`] if that is not finite.
    fn objective(&self, genes: &Genes, steps: &Steps, weight_per_s2: f64) -> f64 {
        let laws = self.scales().laws(genes, self.mass_kg);
        let mut reference = self.acceleration.iter().zip(&self.velocity);
        let (mut acceleration, mut velocity) = (0.0, 0.0);
        laws.integrate(self.speed_m_per_s, steps, |_, v, a| {
            if let Some((a_ref, v_ref)) = reference.next() {
                acceleration += (a - a_ref) * (a - a_ref);
                velocity += (v - v_ref) * (v - v_ref);
            }
        });
        let sum = acceleration + weight_per_s2 * velocity;
        if sum.is_finite() { sum } else { PENALTY }
    }
}

/// Where the search begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// Drawn evenly, as in the reference method.
    #[default]
    Random,
    /// A quarter of the first population takes the node values that fit the accelerations best
    /// along the reference's own motion, on the nodes drawn; the first one on even nodes.
    LeastSquares,
}

/// How long and for what to search; the default is the reference method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSettings {
    /// Individuals of a generation, at least 4.
    pub population: usize,
    /// Generations of the genetic algorithm; 0 leaves the first population.
    pub generations: usize,
    /// Most evaluations of the simplex search from the best individual; 0 leaves it out.
    pub simplex_evaluations: usize,
    /// Weight of the squared differences of velocity, in 1/s²; 0 fits accelerations alone.
    pub velocity_weight_per_s2: f64,
    /// Where the search begins.
    pub start: Start,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self {
            population: 120,
            generations: 400,
            simplex_evaluations: 10_000,
            velocity_weight_per_s2: 0.0,
            start: Start::Random,
        }
    }
}

/// A fitted law and how it was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The law.
    pub model: Nsdm,
    /// Seed of its search.
    pub seed: u64,
    /// `Σ (a − a_ref)² + w Σ (v − v_ref)²`, in m²/s⁴.
    pub objective: f64,
    /// `Σ|p − r|/Σ|r|` of the velocity against the target.
    pub velocity_l1: f64,
    /// The same for the acceleration, the law's own at each time, not filtered.
    pub acceleration_l1: f64,
    /// Motions computed.
    pub evaluations: usize,
    /// Generations of the genetic algorithm.
    pub generations: usize,
    /// Best objective of the first population and after each generation.
    pub history: Vec<f64>,
}

/// Fits a law to the target.
///
/// The genetic algorithm (tournaments of 3, simulated binary crossover with probability 0.9 and
/// η = 15, polynomial mutation with probability 1/30 and η = 20, 2 elites) is followed by
/// Nelder–Mead with adaptive coefficients. Runs on all threads of rayon's pool; the same seed
/// gives the same bits for any number of them.
///
/// # Errors
/// For settings out of range, or if no law found has a finite motion.
pub fn fit(target: &Target, settings: &FitSettings, seed: u64) -> Result<Fit, Error> {
    let FitSettings { population, generations, velocity_weight_per_s2: weight_per_s2, .. } =
        *settings;
    if !(2 * genetic::ELITES..=MAX_POPULATION).contains(&population) {
        return Err(error!(
            Comparison,
            "the population is {population}: expected 4 to {MAX_POPULATION}"
        ));
    }
    if u32::try_from(generations).is_err() {
        return Err(error!(Comparison, "{generations} generations: expected fewer than 2^32"));
    }
    if !(weight_per_s2 >= 0.0 && weight_per_s2.is_finite()) {
        return Err(error!(
            Comparison,
            "the weight of the velocity is {weight_per_s2} 1/s²: expected a finite number of 0 or more"
        ));
    }
    let is_usual = |ratio: f64| (0.1_f64.sqrt()..=10_f64.sqrt()).contains(&ratio);
    let scale = |ratio: f64| if is_usual(ratio) { 1.0 } else { ratio };
    let mass = scale(target.mass_kg / USUAL_MASS_KG);
    let rate = scale(target.speed_m_per_s / target.largest_m / USUAL_RATE_PER_S);
    let (asked, target) = (target, &target.scaled(mass, rate));
    let weight_per_s2 = weight_per_s2 / (rate * rate);
    let steps = Steps::new(&target.time_s)?;
    let objective = |genes: &Genes| target.objective(genes, &steps, weight_per_s2);
    let start = first_individuals(target, settings, seed);
    let evolved = genetic::minimise(objective, &start, population, generations, seed);
    let (best, used) = simplex::polish(objective, evolved.best, settings.simplex_evaluations);
    if best.objective == PENALTY {
        return Err(error!(
            Comparison,
            "the motion of {mass_kg} kg is not finite: it is too light for this spring or damper",
            mass_kg = asked.mass_kg
        ));
    }
    let model = target.scales().law(&best.genes)?.scaled(mass, rate);
    let motion = model.run(asked.mass_kg, asked.speed_m_per_s, &asked.time_s)?;
    let in_m2_per_s4 = |of: f64| (of * (rate * rate * rate * rate)).min(PENALTY);
    Ok(Fit {
        model,
        seed,
        objective: in_m2_per_s4(best.objective),
        velocity_l1: l1_ratio(&asked.velocity, &motion.v_m_per_s),
        acceleration_l1: l1_ratio(&asked.acceleration, &motion.a_m_per_s2),
        evaluations: evolved.evaluations + used,
        generations,
        history: evolved.history.into_iter().map(in_m2_per_s4).collect(),
    })
}

/// Fits with several seeds, in their order; see [`Identifiability::of`] for their spread.
///
/// # Errors
/// As [`fit`].
pub fn fit_seeds(
    target: &Target,
    settings: &FitSettings,
    seeds: &[u64],
) -> Result<Vec<Fit>, Error> {
    parallel::map(seeds, |&seed| fit(target, settings, seed)).into_iter().collect()
}

/// Individuals at least squares, if the settings ask for them.
fn first_individuals(target: &Target, settings: &FitSettings, seed: u64) -> Vec<Genes> {
    let count = match settings.start {
        Start::Random => 0,
        Start::LeastSquares => settings.population.div_ceil(LEAST_SQUARES_SHARE),
    };
    let individual = |i: usize| {
        // A number that no individual of the search has.
        let mut stream = Stream::new(seed, u64::MAX - i as u64);
        let mut genes: Genes = std::array::from_fn(|_| if i == 0 { 0.5 } else { stream.unit() });
        simplex::least_squares(&mut genes, target);
        genes
    };
    parallel::map(0..count, individual)
}

fn check_mass_and_speed(mass_kg: f64, speed_m_per_s: f64) -> Result<(), Error> {
    for (what, value) in [("mass in kg", mass_kg), ("speed in m/s", speed_m_per_s)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(error!(
                Comparison,
                "the {what} is {value}: expected a finite number above 0"
            ));
        }
    }
    Ok(())
}

fn check_finite(column: &'static str, values: &[f64]) -> Result<(), Error> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(i) => Err(error!(
            Comparison,
            "the {column} of sample {sample} is {value}: expected a finite number",
            sample = i + 1,
            value = values[i]
        )),
        None => Ok(()),
    }
}

/// Finite, strictly increasing, not before contact.
fn check_times(time_s: &[f64]) -> Result<(), Error> {
    check_finite("time", time_s)?;
    if let Some(&time_s) = time_s.first().filter(|&&time_s| time_s < 0.0) {
        return Err(error!(
            Comparison,
            "the first time is {time_s} s: times count from contact, so expected 0 or more"
        ));
    }
    match time_s.windows(2).position(|w| w[1] <= w[0]) {
        Some(i) => Err(error!(
            Comparison,
            "time does not increase at sample {sample}: {time_s} s follows {before_s} s",
            before_s = time_s[i],
            sample = i + 2,
            time_s = time_s[i + 1]
        )),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(mass_kg: f64) -> Target {
        let time_s: Vec<f64> = (0..100).map(|i| 0.75e-3 * f64::from(i)).collect();
        let velocity: Vec<f64> = time_s.iter().map(|t| 10.0 * (20.0 * t).cos()).collect();
        let acceleration = time_s.iter().map(|t| -200.0 * (20.0 * t).sin()).collect();
        Target::new(mass_kg, 10.0, time_s, velocity, acceleration).unwrap()
    }

    /// A mass so light that some or all laws are too stiff for the steps.
    #[test]
    fn laws_that_diverge_are_penalised() {
        let (light, stiff) = (target(10.0), [1.0; genetic::VARIABLES]);
        let steps = Steps::new(&light.time_s).unwrap();
        assert_eq!(light.objective(&stiff, &steps, 1.0), PENALTY);
        let settings = FitSettings {
            population: 20,
            generations: 5,
            simplex_evaluations: 200,
            ..FitSettings::default()
        };
        // A fit takes bounds that go with the mass.
        for mass_kg in [10.0, 1e-3] {
            let found = fit(&target(mass_kg), &settings, 1).unwrap();
            assert!(found.objective < PENALTY && found.history.iter().all(|h| !h.is_nan()));
        }
    }

    #[test]
    fn objective_by_hand() {
        // At rest in the law's eyes: one sample after no time, so a = −c v/m.
        let target =
            Target::new(2.0, 3.0, vec![0.0, 1e-9, 2e-9], vec![3.0, 3.0, 1.0], vec![0.0; 3])
                .unwrap();
        let mut genes = [0.0; genetic::VARIABLES];
        // All damping at a millionth of its range: 0.5 N s/m.
        genes[20..26].fill(1e-6);
        let steps = Steps::new(&target.time_s).unwrap();
        let expected = 3.0 * 0.75 * 0.75 + 10.0 * 4.0;
        let found = target.objective(&genes, &steps, 10.0);
        assert!((found / expected - 1.0).abs() < 1e-3, "{found}, on paper {expected}");
    }
}
