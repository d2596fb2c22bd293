//! The law of the nonlinear spring-damper: two piecewise linear functions; and the spread of fits
//! with several seeds: whether their parameters are meaningful.

use serde::{Deserialize, Serialize};

use super::Fit;
use crate::curve::Envelope;
use crate::error::{Error, error};
use crate::piecewise;

/// Largest difference between [`Nsdm::envelope`] and the spring, as a share of its peak.
const ENVELOPE_ERROR: f64 = 1e-4;

/// A continuous, piecewise linear function of a magnitude; its last value is held beyond.
///
/// Invariant: as many values as nodes, at least two; nodes finite and strictly increasing
/// from 0; values finite and not below 0.
#[derive(Clone, Debug, PartialEq)]
pub struct PiecewiseLinear {
    nodes: Vec<f64>,
    values: Vec<f64>,
}

impl PiecewiseLinear {
    /// Checks the invariant once.
    ///
    /// # Errors
    /// It names the first node that breaks it, counted from 1.
    pub fn new(nodes: Vec<f64>, values: Vec<f64>) -> Result<Self, Error> {
        if nodes.len() != values.len() || nodes.len() < 2 {
            return Err(error!(
                Comparison,
                "a law needs a value at each of at least 2 nodes, found {nodes} nodes and {values} values",
                nodes = nodes.len(),
                values = values.len()
            ));
        }
        for (i, (&at, &value)) in nodes.iter().zip(&values).enumerate() {
            let ordered = if i == 0 { at == 0.0 } else { at > nodes[i - 1] };
            if !(ordered && at.is_finite() && value >= 0.0 && value.is_finite()) {
                return Err(error!(
                    Comparison,
                    "node {node} of a law is ({at}, {value}): expected nodes that increase from 0 and values of 0 or more, all finite",
                    node = i + 1
                ));
            }
        }
        Ok(Self { nodes, values })
    }

    /// Magnitudes at the nodes.
    pub(crate) fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Values at the nodes.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Value at `|u|`; the last value beyond the last node.
    pub(crate) fn at(&self, u: f64) -> f64 {
        let u = u.abs();
        if u >= self.end() {
            return self.values[self.values.len() - 1];
        }
        // Nodes begin at 0, so one lies at or before any magnitude; a NaN takes the first segment.
        piecewise::by_share(&self.nodes, &self.values, piecewise::segment(&self.nodes, u), u)
    }

    /// Where the last value begins to hold.
    pub fn end(&self) -> f64 {
        self.nodes[self.nodes.len() - 1]
    }
}

/// Spring and damper of one mass: `m x'' + c(|x'|) x' + k(|x|) x = 0`.
///
/// `k` multiplies `x`: it is a secant stiffness. The stiffness ends at the largest
/// displacement of the motion that the law was fitted to, the damping at its impact speed;
/// beyond either, the last value is held, also when the law is applied at a higher speed.
///
/// As JSON: `deflection_m`, `stiffness_N_per_m`, `speed_m_per_s`, `damping_N_s_per_m`;
/// reading checks the invariants of both functions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Columns", into = "Columns")]
pub struct Nsdm {
    /// `k` in N/m over `|x|` in m.
    pub stiffness: PiecewiseLinear,
    /// `c` in N s/m over `|x'|` in m/s.
    pub damping: PiecewiseLinear,
}

/// The law as in a file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Columns {
    deflection_m: Vec<f64>,
    #[serde(rename = "stiffness_N_per_m")]
    stiffness_n_per_m: Vec<f64>,
    speed_m_per_s: Vec<f64>,
    #[serde(rename = "damping_N_s_per_m")]
    damping_n_s_per_m: Vec<f64>,
}

impl TryFrom<Columns> for Nsdm {
    type Error = Error;

    fn try_from(columns: Columns) -> Result<Self, Error> {
        Ok(Self {
            stiffness: PiecewiseLinear::new(columns.deflection_m, columns.stiffness_n_per_m)?,
            damping: PiecewiseLinear::new(columns.speed_m_per_s, columns.damping_n_s_per_m)?,
        })
    }
}

impl From<Nsdm> for Columns {
    fn from(law: Nsdm) -> Self {
        Self {
            deflection_m: law.stiffness.nodes,
            stiffness_n_per_m: law.stiffness.values,
            speed_m_per_s: law.damping.nodes,
            damping_n_s_per_m: law.damping.values,
        }
    }
}

impl Nsdm {
    /// The law with the same motion of a mass so many times as heavy, in a time that runs so many times faster.
    pub(super) fn scaled(mut self, mass: f64, rate: f64) -> Self {
        let times = |values: &mut [f64], by: f64| values.iter_mut().for_each(|value| *value *= by);
        times(&mut self.stiffness.values, mass * rate * rate);
        times(&mut self.damping.values, mass * rate);
        times(&mut self.damping.nodes, rate);
        self
    }

    /// `k(|x|) x` in N, at `x` in m.
    pub(crate) fn spring_force_n(&self, x_m: f64) -> f64 {
        self.stiffness.at(x_m) * x_m
    }

    /// The spring alone as an envelope, within 1e-4 of its peak force.
    ///
    /// Between two nodes the force is a parabola, so each segment is cut as finely as its
    /// curvature requires. The table goes to twice the last node: there the force is a straight
    /// line through the origin, which an interface continues by `EnvelopeEnd::Slope`.
    ///
    /// # Errors
    /// For stiffnesses whose force is beyond a double.
    pub fn envelope(&self) -> Result<Envelope, Error> {
        let nodes = self.stiffness.nodes();
        let segments: Vec<Parabola> = (1..nodes.len()).map(|i| self.parabola(i)).collect();
        let peak = segments.iter().map(Parabola::peak_n).fold(0.0, f64::max);
        let (mut deflection_m, mut force_n) = (vec![0.0], vec![0.0]);
        for segment in &segments {
            // A chord over δ leaves a parabola of curvature 2b by at most bδ²/4.
            let length_m = segment.to_m - segment.from_m;
            let pieces = length_m * (segment.b.abs() / (4.0 * ENVELOPE_ERROR * peak)).sqrt();
            // At most 100, because no force is below 0: bδ²/4 over the whole segment is then no
            // more than the peak. Without any force the root is that of 0/0, which `max` drops.
            let pieces = pieces.ceil().max(1.0) as usize;
            for j in 1..=pieces {
                let share = j as f64 / pieces as f64;
                let d = if j == pieces { segment.to_m } else { segment.from_m + share * length_m };
                deflection_m.push(d);
                force_n.push(self.spring_force_n(d));
            }
        }
        let end_m = 2.0 * self.stiffness.end();
        deflection_m.push(end_m);
        force_n.push(self.spring_force_n(end_m));
        Envelope::new(deflection_m, force_n)
    }

    /// The spring force between node `i − 1` and node `i`.
    fn parabola(&self, i: usize) -> Parabola {
        let (x, k) = (self.stiffness.nodes(), self.stiffness.values());
        let b = (k[i] - k[i - 1]) / (x[i] - x[i - 1]);
        Parabola { from_m: x[i - 1], to_m: x[i], a: k[i - 1] - b * x[i - 1], b }
    }
}

/// `F = a x + b x²` between two deflections.
struct Parabola {
    from_m: f64,
    to_m: f64,
    a: f64,
    b: f64,
}

impl Parabola {
    /// Largest force, which may lie between the nodes.
    fn peak_n(&self) -> f64 {
        let force = |x: f64| (self.a + self.b * x) * x;
        let top = (-0.5 * self.a / self.b).clamp(self.from_m, self.to_m);
        // A straight segment has no top: 0/0 is dropped by `max`.
        force(self.from_m).max(force(self.to_m)).max(force(top))
    }
}

/// Minimum number of fits that show a spread.
const FEWEST: usize = 3;
/// Places along an axis at which laws are compared.
const PLACES: usize = 200;

/// Smallest, largest and mean value over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Range {
    pub min: f64,
    pub max: f64,
    pub mean: f64,
}

impl Range {
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count() as f64;
        Self {
            min: values.clone().fold(f64::INFINITY, f64::min),
            max: values.clone().fold(f64::NEG_INFINITY, f64::max),
            mean: values.sum::<f64>() / count,
        }
    }

    /// `(max − min) / mean`; 0 where all are zero.
    fn relative(self) -> f64 {
        if self.max == self.min { 0.0 } else { (self.max - self.min) / self.mean }
    }
}

/// How far laws lie apart along their axis, as `(max − min) / mean` over the seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct LawSpread {
    pub largest: f64,
    /// Where that is, in m or m/s.
    pub largest_at: f64,
    pub mean: f64,
}

impl LawSpread {
    fn of(laws: &[&PiecewiseLinear]) -> Self {
        let end = laws.iter().map(|law| law.end()).fold(0.0, f64::max);
        let mut spread = Self { largest: 0.0, largest_at: 0.0, mean: 0.0 };
        for place in 0..=PLACES {
            let at = end * place as f64 / PLACES as f64;
            let here = Range::of(laws.iter().map(|law| law.at(at))).relative();
            if here > spread.largest {
                (spread.largest, spread.largest_at) = (here, at);
            }
            spread.mean += here / (PLACES + 1) as f64;
        }
        spread
    }
}

/// Spread of errors and of parameters over the seeds.
///
/// Equal errors with different laws mean that the parameters are not unique: spring
/// and damper can replace each other, and what the law does at another speed is chance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Identifiability {
    pub(crate) seeds: usize,
    /// In m²/s⁴.
    pub(crate) objective: Range,
    /// `Σ|p − r|/Σ|r|` at the fitted speed.
    pub(crate) velocity_l1: Range,
    pub(crate) acceleration_l1: Range,
    pub(crate) stiffness: LawSpread,
    pub(crate) damping: LawSpread,
}

impl Identifiability {
    /// Of at least three fits of one target.
    ///
    /// # Errors
    /// For fewer.
    pub fn of(fits: &[Fit]) -> Result<Self, Error> {
        if fits.len() < FEWEST {
            return Err(error!(
                Comparison,
                "{seeds} fits show no spread: at least {FEWEST} seeds are needed",
                seeds = fits.len()
            ));
        }
        let stiffness: Vec<_> = fits.iter().map(|fit| &fit.model.stiffness).collect();
        let damping: Vec<_> = fits.iter().map(|fit| &fit.model.damping).collect();
        Ok(Self {
            seeds: fits.len(),
            objective: Range::of(fits.iter().map(|fit| fit.objective)),
            velocity_l1: Range::of(fits.iter().map(|fit| fit.velocity_l1)),
            acceleration_l1: Range::of(fits.iter().map(|fit| fit.acceleration_l1)),
            stiffness: LawSpread::of(&stiffness),
            damping: LawSpread::of(&damping),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nsdm::Nsdm;

    pub(crate) fn law() -> Nsdm {
        Nsdm {
            stiffness: PiecewiseLinear::new(vec![0.0, 0.1, 0.5, 1.0], vec![9e7, 1e7, 2e6, 3e6])
                .unwrap(),
            damping: PiecewiseLinear::new(vec![0.0, 5.0, 13.0], vec![0.0, 2e4, 1e5]).unwrap(),
        }
    }

    #[test]
    fn values_between_nodes_and_beyond() {
        let law = law();
        assert_eq!(law.spring_force_n(0.05), 5e7 * 0.05);
        assert_eq!(law.spring_force_n(-0.05), -5e7 * 0.05);
        assert_eq!(law.spring_force_n(2.0), 6e6);
        assert_eq!(law.damping.at(-9.0), 6e4);
        assert_eq!(law.damping.at(20.0), 1e5);
    }

    #[test]
    fn wrong_nodes_are_named() {
        let refused = |nodes: &[f64], values: &[f64]| {
            PiecewiseLinear::new(nodes.to_vec(), values.to_vec()).unwrap_err().to_string()
        };
        let expected = "expected nodes that increase from 0 and values of 0 or more, all finite";
        for (nodes, values, named) in [
            (&[0.0, 1.0, 1.0][..], &[1.0, 1.0, 2.0][..], "node 3 of a law is (1, 2)"),
            (&[0.5, 1.0], &[1.0; 2], "node 1 of a law is (0.5, 1)"),
            (&[0.0, 1.0], &[1.0, -1.0], "node 2 of a law is (1, -1)"),
        ] {
            assert_eq!(refused(nodes, values), format!("{named}: {expected}"));
        }
        assert_eq!(
            refused(&[0.0, 1.0], &[1.0]),
            "a law needs a value at each of at least 2 nodes, found 2 nodes and 1 values"
        );
        assert!(PiecewiseLinear::new(vec![0.0, f64::INFINITY], vec![1.0; 2]).is_err());
        assert!(PiecewiseLinear::new(vec![0.0, 1.0], vec![f64::NAN, 1.0]).is_err());
    }

    #[test]
    fn survives_json_and_refuses_a_damaged_one() {
        let text = serde_json::to_string(&law()).unwrap();
        assert_eq!(serde_json::from_str::<Nsdm>(&text).unwrap(), law());
        let damaged = text.replace("[0.0,5.0,13.0]", "[0.0,15.0,13.0]");
        assert_ne!(damaged, text);
        let error = serde_json::from_str::<Nsdm>(&damaged).unwrap_err().to_string();
        assert!(error.starts_with("node 3 of a law is (13, 100000)"), "{error}");
    }

    #[test]
    fn envelope_is_the_spring() {
        let law = law();
        let envelope = law.envelope().unwrap();
        // The peak up to the last node is the force there.
        let peak = 3e6;
        let mut worst = 0.0_f64;
        for i in 0..=20_000 {
            let x = 1e-4 * f64::from(i);
            worst = worst.max((envelope.force_at(x) - law.spring_force_n(x)).abs());
        }
        assert!(worst <= 1e-4 * peak, "{worst} N");
        assert!(worst > 0.5e-4 * peak, "no finer than asked for: {worst} N");
        assert_eq!(envelope.end_m(), 2.0);
        assert!(envelope.deflection_m().len() < 500, "{}", envelope.deflection_m().len());
    }

    /// Two nodes far apart in stiffness: the peak lies inside the first segment.
    #[test]
    fn envelope_of_a_steep_fall() {
        let stiffness = PiecewiseLinear::new(vec![0.0, 0.2, 1.0], vec![1e8, 1e5, 1e5]).unwrap();
        let law = Nsdm { stiffness, ..law() };
        let envelope = law.envelope().unwrap();
        let peak = law.spring_force_n(0.1001);
        for i in 0..=20_000 {
            let x = 5e-5 * f64::from(i);
            let off = (envelope.force_at(x) - law.spring_force_n(x)).abs();
            assert!(off <= 1e-4 * peak, "{off} N at {x} m");
        }
    }

    fn fit(seed: u64, stiffness: f64, damping: [f64; 2], velocity_l1: f64) -> Fit {
        let law = |values: [f64; 2]| PiecewiseLinear::new(vec![0.0, 2.0], values.to_vec()).unwrap();
        Fit {
            model: Nsdm { stiffness: law([stiffness; 2]), damping: law(damping) },
            seed,
            objective: 1.0,
            velocity_l1,
            acceleration_l1: 0.1,
            evaluations: 0,
            generations: 0,
            history: vec![],
        }
    }

    #[test]
    fn spreads_by_hand() {
        let fits = [
            fit(0, 1e6, [0.0, 1e5], 0.01),
            fit(1, 2e6, [0.0, 2e5], 0.02),
            fit(2, 3e6, [0.0, 3e5], 0.06),
        ];
        let found = Identifiability::of(&fits).unwrap();
        assert_eq!((found.velocity_l1.min, found.velocity_l1.max), (0.01, 0.06));
        assert!((found.velocity_l1.mean - 0.03).abs() < 1e-15);
        assert_eq!(
            found.stiffness,
            LawSpread { largest: 1.0, largest_at: 0.0, mean: found.stiffness.mean }
        );
        assert!((found.stiffness.mean - 1.0).abs() < 1e-12);
        // All are zero at rest, and lie apart alike everywhere else.
        assert!((found.damping.largest - 1.0).abs() < 1e-12);
        assert!((found.damping.mean - 200.0 / 201.0).abs() < 1e-12);
        let error = Identifiability::of(&fits[..2]).unwrap_err().to_string();
        assert_eq!(error, "2 fits show no spread: at least 3 seeds are needed");
    }
}
