//! The motion of one mass on spring and damper, by Runge–Kutta steps.
//!
//! Nearly all the time of a fit is spent on motions. A Runge–Kutta step is as long as the reference's interval; only one that
//! crosses a node of either law is repeated in eight parts, because between nodes the laws are smooth and one step is exact
//! to far more digits than a fit. A test compares random laws with steps 64 times shorter.

use super::check_times;
use super::law::Nsdm;
use crate::error::{Error, error};

/// Longest step, in s: the output interval of the reference method.
const STEP_S: f64 = 0.75e-3;
/// Longest step times the rate of the motion, which is at most 0.09 in a fit.
const STEP_TIMES_RATE: f64 = 0.15;
/// A step that passes a node of either law is taken again in this many parts.
///
/// The laws are smooth between their nodes, where one step is exact to far more digits than
/// a fit; nearly all of the error is that of the kinks.
const PARTS: u32 = 8;
/// A gap between two times longer than this many steps is a mistyped time.
const MAX_STEPS: f64 = 1e7;

/// A motion at given times: displacement, speed and acceleration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Displacement in m.
    pub x_m: Vec<f64>,
    /// Speed in m/s.
    pub v_m_per_s: Vec<f64>,
    /// Acceleration in m/s².
    pub a_m_per_s2: Vec<f64>,
}

impl Nsdm {
    /// The motion of `mass_kg` (above 0) that begins at x = 0 with `speed_m_per_s` (above 0)
    /// at time 0, at `time_s` (seconds from 0 on, strictly increasing).
    ///
    /// Any mass and speed may be given, also others than those of the fit; the damper then
    /// keeps its axis, which ends at the fitted speed, and its last value is held beyond.
    ///
    /// # Errors
    /// For times out of order, a mass or speed that is not above 0, and a motion that is not finite.
    pub fn run(&self, mass_kg: f64, speed_m_per_s: f64, time_s: &[f64]) -> Result<Motion, Error> {
        check_times(time_s)?;
        super::check_mass_and_speed(mass_kg, speed_m_per_s)?;
        let mut motion = Motion::default();
        let laws = Laws::new(
            mass_kg,
            [self.stiffness.nodes(), self.damping.nodes()],
            [self.stiffness.values(), self.damping.values()],
        );
        // A light mass on a stiff law moves faster than those of a fit.
        let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max) / mass_kg;
        let rate_per_s = most(self.damping.values()).max(most(self.stiffness.values()).sqrt());
        let longest_s = STEP_S.min(STEP_TIMES_RATE / rate_per_s);
        let last_s = time_s.last().copied().unwrap_or_default();
        if longest_s < STEP_S && last_s / longest_s > MAX_STEPS {
            return Err(error!(
                Comparison,
                "{mass_kg} kg is too light for this spring or damper: it needs more than {MAX_STEPS:e} steps"
            ));
        }
        laws.integrate(speed_m_per_s, &Steps::over(time_s, longest_s)?, |x, v, a| {
            motion.x_m.push(x);
            motion.v_m_per_s.push(v);
            motion.a_m_per_s2.push(a);
        });
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        if !(finite(&motion.x_m) && finite(&motion.v_m_per_s) && finite(&motion.a_m_per_s2)) {
            return Err(error!(
                Comparison,
                "the motion of {mass_kg} kg is not finite: it is too light for this spring or damper"
            ));
        }
        Ok(motion)
    }
}

/// Number and length of the steps before each time.
pub(super) struct Steps(Vec<(u32, f64)>);

impl Steps {
    /// Equal steps between two times, none longer than [`STEP_S`].
    pub(crate) fn new(time_s: &[f64]) -> Result<Self, Error> {
        Self::over(time_s, STEP_S)
    }

    fn over(time_s: &[f64], longest_s: f64) -> Result<Self, Error> {
        let before = std::iter::once(&0.0).chain(time_s);
        let steps = time_s.iter().zip(before).map(|(time_s, before_s)| {
            let interval_s = time_s - before_s;
            // Rounding of the times must not double the number of steps.
            let steps = (interval_s / longest_s * (1.0 - 1e-9)).ceil();
            if steps > MAX_STEPS {
                return Err(error!(Comparison, "no sample for {interval_s} s before {time_s} s, too long to follow: expected times in seconds", time_s = *time_s));
            }
            Ok((steps as u32, if steps > 0.0 { interval_s / steps } else { 0.0 }))
        });
        Ok(Self(steps.collect::<Result<_, _>>()?))
    }
}

/// `offset + slope·u` up to `end`.
struct Segment {
    end: f64,
    offset: f64,
    slope: f64,
}

/// A piecewise linear function, divided by the mass; its last segment holds to infinity.
struct Table(Vec<Segment>);

impl Table {
    fn new(nodes: &[f64], values: &[f64], per_mass: f64) -> Self {
        let last = nodes.len() - 1;
        let mut segments = Vec::with_capacity(nodes.len());
        for i in 0..last {
            let slope = (values[i + 1] - values[i]) / (nodes[i + 1] - nodes[i]) * per_mass;
            let offset = values[i] * per_mass - slope * nodes[i];
            segments.push(Segment { end: nodes[i + 1], offset, slope });
        }
        let offset = values[last] * per_mass;
        segments.push(Segment { end: f64::INFINITY, offset, slope: 0.0 });
        Self(segments)
    }

    /// Value at `u ≥ 0`. Neighbouring calls ask for neighbouring values, so the search continues
    /// from the segment of the last one.
    #[inline(always)]
    fn at(&self, u: f64, segment: &mut usize) -> f64 {
        while u > self.0[*segment].end {
            *segment += 1;
        }
        while *segment > 0 && u <= self.0[*segment - 1].end {
            *segment -= 1;
        }
        let Segment { offset, slope, .. } = self.0[*segment];
        offset + slope * u
    }
}

/// Spring and damper of a unit mass.
pub(super) struct Laws {
    spring: Table,
    damper: Table,
}

impl Laws {
    /// Nodes and values of the stiffness and of the damping, as [`super::PiecewiseLinear`]
    /// has them.
    pub(crate) fn new(mass_kg: f64, nodes: [&[f64]; 2], values: [&[f64]; 2]) -> Self {
        let per_mass = 1.0 / mass_kg;
        Self {
            spring: Table::new(nodes[0], values[0], per_mass),
            damper: Table::new(nodes[1], values[1], per_mass),
        }
    }

    /// Integrates by the classical Runge–Kutta method of order 4 (Kutta 1901) from x = 0;
    /// `visit` gets x, x', x'' at the time behind each group of steps.
    ///
    /// Nothing is checked on the way: a motion that diverges is visited with infinities and
    /// NaN.
    pub(crate) fn integrate(
        &self,
        speed_m_per_s: f64,
        steps: &Steps,
        mut visit: impl FnMut(f64, f64, f64),
    ) {
        let mut at = Segments::default();
        let mut state = State { x: 0.0, v: speed_m_per_s, a: 0.0 };
        state.a = self.acceleration(state.x, state.v, &mut at);
        for &(count, h) in &steps.0 {
            for _ in 0..count {
                let before = at;
                let next = self.step(state, h, &mut at);
                state = if at == before { next } else { self.parts(state, h, &mut at) };
            }
            visit(state.x, state.v, state.a);
        }
    }

    /// A step that passes a node, in [`PARTS`].
    #[inline(never)]
    fn parts(&self, mut state: State, h: f64, at: &mut Segments) -> State {
        for _ in 0..PARTS {
            state = self.step(state, h / f64::from(PARTS), at);
        }
        state
    }

    #[inline(always)]
    fn step(&self, State { x, v, a }: State, h: f64, at: &mut Segments) -> State {
        let half = 0.5 * h;
        let v2 = v + half * a;
        let a2 = self.acceleration(x + half * v, v2, at);
        let v3 = v + half * a2;
        let a3 = self.acceleration(x + half * v2, v3, at);
        let v4 = v + h * a3;
        let a4 = self.acceleration(x + h * v3, v4, at);
        let x = x + h / 6.0 * (v + 2.0 * (v2 + v3) + v4);
        let v = v + h / 6.0 * (a + 2.0 * (a2 + a3) + a4);
        State { x, v, a: self.acceleration(x, v, at) }
    }

    #[inline(always)]
    fn acceleration(&self, x: f64, v: f64, at: &mut Segments) -> f64 {
        let k = self.spring.at(x.abs(), &mut at.spring);
        let c = self.damper.at(v.abs(), &mut at.damper);
        -(k * x + c * v)
    }
}

/// Segments of the last values looked up.
#[derive(Clone, Copy, Default, PartialEq)]
struct Segments {
    spring: usize,
    damper: usize,
}

#[derive(Clone, Copy)]
struct State {
    x: f64,
    v: f64,
    a: f64,
}

#[cfg(test)]
mod tests {
    use super::super::PiecewiseLinear;
    use super::super::genetic::{Genes, Scales};
    use super::*;
    use crate::signal::l1_ratio;
    use crate::stream::Stream;

    fn constant(stiffness: f64, damping: f64) -> Nsdm {
        let flat = |value| PiecewiseLinear::new(vec![0.0, 1.0], vec![value; 2]).unwrap();
        Nsdm { stiffness: flat(stiffness), damping: flat(damping) }
    }

    fn times(count: usize) -> Vec<f64> {
        (0..count).map(|i| 0.75e-3 * i as f64).collect()
    }

    /// `x = v₀/ω_d e^{−ζt} sin ω_d t`, with `ζ = c/2m` and `ω_d² = k/m − ζ²`.
    #[test]
    fn damped_oscillation_follows_its_closed_form() {
        let (m, k, c, v0) = (24e3, 40e6, 2e5, 40.0 / 3.0);
        let time_s = times(400);
        let motion = constant(k, c).run(m, v0, &time_s).unwrap();
        let zeta = c / (2.0 * m);
        let omega = (k / m - zeta * zeta).sqrt();
        for (i, t) in time_s.iter().enumerate() {
            let (sin, cos) = libm::sincos(omega * t);
            let decay = libm::exp(-zeta * t);
            let x = v0 / omega * decay * sin;
            let v = v0 * decay * (cos - zeta / omega * sin);
            assert!((motion.x_m[i] - x).abs() < 1e-7, "x at {t}: {} {x}", motion.x_m[i]);
            assert!(
                (motion.v_m_per_s[i] - v).abs() < 1e-6,
                "v at {t}: {} {v}",
                motion.v_m_per_s[i]
            );
            let a = -(k * x + c * v) / m;
            assert!((motion.a_m_per_s2[i] - a).abs() < 1e-3, "a at {t}");
        }
    }

    /// Laws as the fit may meet them, with kinks and narrow segments: the step's error stays
    /// far below the percents of velocity and acceleration that a fit leaves.
    #[test]
    fn step_is_fine_enough_for_any_law_of_the_fit() {
        let scales = Scales { displacement_m: 1.0, speed_m_per_s: 40.0 / 3.0 };
        let time_s = times(250);
        let (plain, tight) =
            (Steps::new(&time_s).unwrap(), Steps::over(&time_s, STEP_S / 64.0).unwrap());
        let (mut worst_v, mut worst_a) = (0.0_f64, 0.0_f64);
        for number in 0..200 {
            let mut stream = Stream::new(5, number);
            let genes: Genes = std::array::from_fn(|_| stream.unit());
            let laws = scales.laws(&genes, 24e3);
            let record = |steps: &Steps| {
                let (mut v, mut a) = (vec![], vec![]);
                laws.integrate(scales.speed_m_per_s, steps, |_, speed, rate| {
                    v.push(speed);
                    a.push(rate);
                });
                (v, a)
            };
            let ((v, a), (tight_v, tight_a)) = (record(&plain), record(&tight));
            worst_v = worst_v.max(l1_ratio(&tight_v, &v));
            worst_a = worst_a.max(l1_ratio(&tight_a, &a));
        }
        assert!(worst_v < 3e-4 && worst_a < 2e-3, "v {worst_v:e}, a {worst_a:e}");
    }

    #[test]
    fn times_need_not_be_even_or_begin_at_zero() {
        let law = constant(40e6, 1e5);
        let even = law.run(24e3, 10.0, &times(21)).unwrap();
        let some = law.run(24e3, 10.0, &[0.75e-3, 2.25e-3, 0.015]).unwrap();
        for (i, row) in [(0, 1), (1, 3), (2, 20)] {
            assert!((some.x_m[i] - even.x_m[row]).abs() < 1e-9);
        }
    }

    #[test]
    fn a_light_mass_is_followed_in_short_steps() {
        // It stops within a step of 0.75 ms: x = v₀ m/c, as the damper alone has it.
        let (law, times) = (constant(1e4, 5e5), times(100));
        let motion = law.run(1.0, 10.0, &times).unwrap();
        assert!((motion.x_m[1] / (10.0 / 5e5) - 1.0).abs() < 1e-3, "{}", motion.x_m[1]);
        let error = law.run(1e-6, 10.0, &times).unwrap_err().to_string();
        assert!(error.starts_with("0.000001 kg is too light for this spring or damper"), "{error}");
    }
}
