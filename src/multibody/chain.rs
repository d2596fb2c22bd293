//! The immutable model: bodies in a row and the interfaces between them, with forces that follow speeds: dampers, the rate effect of crush zones, stopped mass.

use std::sync::Arc;

use serde::Deserialize;

use super::law::ForceLaw;
use crate::curve::Envelope;
use crate::error::{Error, KeyPath, error};
use crate::piecewise;

/// One mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its name in messages and outputs.
    pub name: String,
    /// Mass in kg, above 0.
    pub mass_kg: f64,
    /// Initial speed in m/s, positive in the direction in which the first train moves.
    pub speed_m_per_s: f64,
    /// Running and braking resistance; none by default.
    pub resistance: Resistance,
}

impl Body {
    /// A body that runs without resistance.
    pub fn new(name: impl Into<String>, mass_kg: f64, speed_m_per_s: f64) -> Self {
        Self { name: name.into(), mass_kg, speed_m_per_s, resistance: Resistance::default() }
    }
}

/// Resistance against a body's motion over the track,
/// `R = m (A + B|v| + C v² + μ g) sgn(v)`, with `sgn` smoothed to `tanh(v / 0.05 m/s)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Resistance {
    /// `A` of the running resistance (Davis' equation per mass), in m/s².
    pub constant_m_per_s2: f64,
    /// `B`, in 1/s.
    pub linear_per_s: f64,
    /// `C`, in 1/m.
    pub quadratic_per_m: f64,
    /// Coefficient of friction `μ` of the brakes, over the whole weight.
    pub braking: f64,
}

/// Standard gravity in m/s² (CGPM 1901).
pub const STANDARD_GRAVITY_M_PER_S2: f64 = 9.80665;
/// Speed over which the sign of the velocity is smoothed, in m/s.
const SMOOTH_M_PER_S: f64 = 0.05;

impl Resistance {
    /// Whether the body runs without resistance.
    pub(super) fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// A term that is below 0 or not finite.
    pub(crate) fn wrong_term(&self) -> Option<f64> {
        let terms = [self.constant_m_per_s2, self.linear_per_s, self.quadratic_per_m, self.braking];
        terms.into_iter().find(|term| !(*term >= 0.0 && term.is_finite()))
    }

    /// Force against the motion of `mass_kg` at `v_m_per_s`, with its sign, in N.
    pub(crate) fn force_n(&self, mass_kg: f64, v_m_per_s: f64) -> f64 {
        let v = v_m_per_s.abs();
        let rate = self.constant_m_per_s2
            + self.linear_per_s * v
            + self.quadratic_per_m * v * v
            + self.braking * STANDARD_GRAVITY_M_PER_S2;
        mass_kg * rate * libm::tanh(v_m_per_s / SMOOTH_M_PER_S)
    }
}

/// The interface in front of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    /// `A1|A2`, `A1|wall`.
    pub name: String,
    /// Under compression.
    pub law: Arc<ForceLaw>,
    /// Free distance before contact, in m.
    pub gap_m: f64,
    /// Under tension, where the bodies are coupled.
    pub(crate) tension: Option<Tension>,
    /// Parallel to the law, while it is in contact.
    pub damping: Option<Damping>,
    /// Factor on the law's force that follows speeds.
    pub rate: Option<RateFactor>,
    /// Mass that one side takes from the other while the interface is crushed.
    pub stopping: Option<Stopping>,
}

/// A law on the extension beyond the initial distance of the bodies.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tension {
    pub law: Arc<ForceLaw>,
    /// Extension before the coupling pulls, in m.
    pub slack_m: f64,
}

impl Interface {
    /// An interface that only pushes.
    pub fn new(name: impl Into<String>, law: impl Into<Arc<ForceLaw>>, gap_m: f64) -> Self {
        let law = law.into();
        let (tension, damping, rate, stopping) = (None, None, None, None);
        Self { name: name.into(), law, gap_m, tension, damping, rate, stopping }
    }

    /// The same with a law that also pulls.
    pub fn with_tension(self, law: impl Into<Arc<ForceLaw>>, slack_m: f64) -> Self {
        Self { tension: Some(Tension { law: law.into(), slack_m }), ..self }
    }

    /// The same with a force that follows speeds.
    pub fn with_rate(self, rate: RateFactor) -> Self {
        Self { rate: Some(rate), ..self }
    }

    /// The same as a crush zone that stops mass.
    pub fn with_stopping(self, stopping: Stopping) -> Self {
        Self { stopping: Some(stopping), ..self }
    }

    /// The same with a damper.
    pub fn with_damping(self, damping: Damping) -> Self {
        Self { damping: Some(damping), ..self }
    }

    /// Largest stiffness of all that acts here, in N/m.
    fn max_stiffness_n_per_m(&self) -> f64 {
        let pulls = self.tension.as_ref().map_or(0.0, |t| t.law.max_stiffness_n_per_m());
        self.law.max_stiffness_n_per_m().max(pulls)
    }
}

/// The step follows the swing of springs, whose energy error stays. A swing dies within a few periods from this share of
/// critical damping on, and a body up to this share of all mass and of all kinetic energy has hardly any of the energy: where both
/// hold, as between plates, the step may be so many times longer. In examples/trains/split-ends.toml, with `step` set to a tenth
/// of what it takes, crushes move by 0.002 % of the largest (0.0005 % from a third on), and the ledger is off by 8e-6.
const STOPPING_RATIO: f64 = 0.2;
const LIGHT_SHARE: f64 = 0.01;
const STOPPED_SWING: f64 = 3.0;

/// Bodies from back to front (increasing x), each with the interface to the next one.
///
/// Invariant: masses above 0; as many interfaces as bodies if the row ends at a rigid
/// wall, one less otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    bodies: Vec<Body>,
    interfaces: Vec<Interface>,
}

impl Chain {
    /// Checks the invariant once.
    ///
    /// # Errors
    /// It names the body or interface that breaks it.
    pub fn new(bodies: Vec<Body>, interfaces: Vec<Interface>) -> Result<Self, Error> {
        if bodies.is_empty() {
            return Err(error!(Other at "train", "there are no bodies"));
        }
        if interfaces.len() != bodies.len() && interfaces.len() + 1 != bodies.len() {
            let (bodies, interfaces) = (bodies.len(), interfaces.len());
            return Err(error!(
                Other at "train",
                "{bodies} bodies need {} interfaces, or {bodies} with a wall in front, found {interfaces}",
                bodies - 1
            ));
        }
        let chain = Self { bodies, interfaces };
        chain.check()?;
        Ok(chain)
    }

    /// Gives the bodies other masses and speeds (kg, m/s) and the interfaces other gaps and
    /// slacks (m), in the order of the chain; the force laws stay.
    pub(crate) fn adjust(
        &mut self,
        motions: &[(f64, f64)],
        gaps_m: &[f64],
        slacks_m: &[f64],
    ) -> Result<(), Error> {
        for (body, (mass_kg, speed_m_per_s)) in self.bodies.iter_mut().zip(motions) {
            (body.mass_kg, body.speed_m_per_s) = (*mass_kg, *speed_m_per_s);
        }
        for ((interface, gap_m), slack_m) in self.interfaces.iter_mut().zip(gaps_m).zip(slacks_m) {
            interface.gap_m = *gap_m;
            if let Some(tension) = &mut interface.tension {
                tension.slack_m = *slack_m;
            }
        }
        self.check()
    }

    fn check(&self) -> Result<(), Error> {
        for (i, body) in self.bodies.iter().enumerate() {
            let Body { name, mass_kg, speed_m_per_s, resistance } = body;
            let key = |key| KeyPath::of("bodies").item(i).key(key);
            if !(*mass_kg > 0.0 && mass_kg.is_finite()) {
                return Err(error!(
                    Other,
                    "the mass of {name} is {mass_kg} kg: expected more than 0"
                )
                .at(key("mass")));
            }
            if !speed_m_per_s.is_finite() {
                return Err(error!(
                    Other at "train",
                    "the speed of {name} is {speed_m_per_s} m/s: expected a finite number"
                ));
            }
            if let Some(value) = resistance.wrong_term() {
                return Err(error!(
                    Other,
                    "the resistance of {name} has the term {value}: expected 0 or more"
                )
                .at(key("resistance")));
            }
        }
        for (k, interface) in self.interfaces.iter().enumerate() {
            let name = &interface.name;
            if let Some(fault) = self.crush_fault(interface) {
                let key = KeyPath::of("interfaces").item(k);
                return Err(error!(Other, "{name} has {fault}").at(key));
            }
            let laws = [Some(&interface.law), interface.tension.as_ref().map(|t| &t.law)];
            for memory in laws.into_iter().flatten().filter_map(|law| law.memory.as_ref()) {
                let stiffness = memory.stiffness_n_per_m;
                if !(stiffness > 0.0 && stiffness.is_finite()) {
                    return Err(error!(
                        Other,
                        "the unloading stiffness of {name} is {stiffness} N/m: expected more than 0"
                    ));
                }
            }
            let slack = interface.tension.as_ref().map_or(0.0, |t| t.slack_m);
            for (what, length_m) in [("gap", interface.gap_m), ("slack", slack)] {
                if !(length_m >= 0.0 && length_m.is_finite()) {
                    return Err(error!(
                        Other at "contact.gap",
                        "the {what} of {name} is {length_m} m: expected 0 or more"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Error in the rate or the crush zone of an interface.
    fn crush_fault(&self, interface: &Interface) -> Option<&'static str> {
        let bodies = self.bodies.len();
        if let Some(rate) = &interface.rate {
            let values = [rate.sensitivity_sqrt_s_per_m, rate.share];
            if !values.iter().all(|value| *value >= 0.0 && value.is_finite()) {
                return Some("a rate whose sensitivity or share is not 0 or more");
            }
            if rate.behind >= bodies || rate.ahead.is_some_and(|ahead| ahead >= bodies) {
                return Some("a rate that follows a body that does not exist");
            }
            if interface.tension.is_some() {
                return Some("a rate and a coupling: a rate applies to compression only");
            }
        }
        let stopping = interface.stopping.as_ref()?;
        let (Some(body), Some(zone)) =
            (self.bodies.get(stopping.body), self.bodies.get(stopping.zone))
        else {
            return Some("a crush zone that does not exist");
        };
        let is_sound = stopping.is_sound(body.mass_kg + zone.mass_kg);
        (!is_sound).then_some(
            "a stopped mass that falls with the deflection, or is not less than its vehicle's: expected that of a vehicle not much heavier than this one",
        )
    }

    /// From back to front.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The one in front of each body, in the bodies' order.
    pub fn interfaces(&self) -> &[Interface] {
        &self.interfaces
    }

    /// Whether the row ends at a rigid wall.
    pub(crate) fn has_wall(&self) -> bool {
        self.interfaces.len() == self.bodies.len()
    }

    /// Whether forces depend on speeds: dampers, crush zones, resistance.
    pub fn has_rates(&self) -> bool {
        let depends =
            |i: &Interface| i.damping.is_some() || i.rate.is_some() || i.stopping.is_some();
        self.interfaces.iter().any(depends) || self.has_resistance()
    }

    /// Whether the track brakes any body.
    pub(super) fn has_resistance(&self) -> bool {
        self.bodies.iter().any(|b| !b.resistance.is_none())
    }

    /// Shortest `sqrt(m/k)` of all interfaces in s, with the lighter of the two bodies and the
    /// stiffest part of the law (a damper counts as `m/c`; one that stops the swing of a light body
    /// counts three times), and the interface's index; infinite for interfaces without stiffness.
    pub(super) fn shortest_time_s(&self) -> (f64, usize) {
        let mass = |i: usize| self.bodies.get(i).map_or(f64::INFINITY, |b| b.mass_kg);
        let moves = |b: &Body| b.mass_kg * b.speed_m_per_s * b.speed_m_per_s;
        let all_kg: f64 = self.bodies.iter().map(|b| b.mass_kg).sum();
        let all_move: f64 = self.bodies.iter().map(moves).sum();
        let is_light =
            |b: &Body| b.mass_kg <= LIGHT_SHARE * all_kg && moves(b) <= LIGHT_SHARE * all_move;
        let mut shortest = (f64::INFINITY, 0);
        for (k, interface) in self.interfaces.iter().enumerate() {
            let lighter = mass(k).min(mass(k + 1));
            let spring = (lighter / interface.max_stiffness_n_per_m()).sqrt();
            let damper =
                interface.damping.as_ref().map_or(f64::INFINITY, |d| lighter / d.largest());
            let stops_swing = interface.damping.as_ref().is_some_and(|d| {
                let critical = 2.0 * (lighter * interface.max_stiffness_n_per_m()).sqrt();
                let of = k..self.bodies.len().min(k + 2);
                let lighter = self.bodies[of].iter().min_by(|a, b| a.mass_kg.total_cmp(&b.mass_kg));
                lighter.is_some_and(is_light) && d.smallest() >= STOPPING_RATIO * critical
            });
            let time = spring.min(damper) * if stops_swing { STOPPED_SWING } else { 1.0 };
            if time < shortest.0 {
                shortest = (time, k);
            }
        }
        shortest
    }

    /// Time of free motion in s until the first gap or slack closes, and the times of each
    /// interface's; 0 if none closes.
    pub(super) fn flights(&self) -> (f64, Vec<(f64, f64)>) {
        let flight =
            |gap_m: f64, closing: f64| if closing > 0.0 { gap_m / closing } else { f64::INFINITY };
        let speed = |i: usize| self.bodies.get(i).map_or(0.0, |b| b.speed_m_per_s);
        let flights: Vec<(f64, f64)> = self
            .interfaces
            .iter()
            .enumerate()
            .map(|(k, interface)| {
                let closing = speed(k) - speed(k + 1);
                let slack = interface.tension.as_ref().map_or(f64::INFINITY, |t| t.slack_m);
                (flight(interface.gap_m, closing), flight(slack, -closing))
            })
            .collect();
        let shortest = flights.iter().map(|(a, b)| a.min(*b)).fold(f64::INFINITY, f64::min);
        (if shortest.is_finite() { shortest } else { 0.0 }, flights)
    }

    /// Positions of the bodies at the first contact, in m.
    pub(super) fn first_contact(&self) -> Vec<f64> {
        let (flight_s, _) = self.flights();
        self.bodies.iter().map(|b| b.speed_m_per_s * flight_s).collect()
    }
}

/// A damper's coefficient over the magnitude of its speed, piecewise linear, held beyond its
/// ends.
///
/// Invariant: at least one point; speeds at least 0 and strictly increasing; coefficients
/// finite and at least 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Damping {
    speed_m_per_s: Vec<f64>,
    coefficient_n_s_per_m: Vec<f64>,
}

impl Damping {
    /// # Errors
    /// It names the first point that breaks the invariant, counted from 1.
    pub fn new(speed_m_per_s: Vec<f64>, coefficient_n_s_per_m: Vec<f64>) -> Result<Self, Error> {
        let (speeds, coefficients) = (speed_m_per_s.len(), coefficient_n_s_per_m.len());
        if speeds != coefficients || speeds == 0 {
            return Err(error!(
                Other,
                "a damper needs as many coefficients as speeds, at least one: found {speeds} and {coefficients}"
            ));
        }
        let mut before = -f64::MIN_POSITIVE;
        for (i, (&v, &c)) in speed_m_per_s.iter().zip(&coefficient_n_s_per_m).enumerate() {
            if !(v > before && v >= 0.0 && v.is_finite() && c >= 0.0 && c.is_finite()) {
                return Err(error!(
                    Other,
                    "point {} of the damper is ({v} m/s, {c} N s/m): expected speeds that increase from 0 or more and coefficients of 0 or more",
                    i + 1
                ));
            }
            before = v;
        }
        Ok(Self { speed_m_per_s, coefficient_n_s_per_m })
    }

    /// The same coefficient in N s/m at all speeds.
    ///
    /// # Errors
    /// For a coefficient below 0.
    pub fn constant(coefficient_n_s_per_m: f64) -> Result<Self, Error> {
        Self::new(vec![0.0], vec![coefficient_n_s_per_m])
    }

    /// Coefficient in N s/m at a speed of either sign.
    pub(crate) fn at(&self, speed_m_per_s: f64) -> f64 {
        let (v, c) = (&self.speed_m_per_s, &self.coefficient_n_s_per_m);
        let speed = speed_m_per_s.abs();
        let last = v.len() - 1;
        if speed >= v[last] {
            c[last]
        } else if speed >= v[0] {
            piecewise::by_product(v, c, piecewise::segment(v, speed), speed)
        } else {
            c[0]
        }
    }

    /// Its coefficient if it has one, for all speeds.
    pub(super) fn constant_n_s_per_m(&self) -> Option<f64> {
        <[f64; 1]>::try_from(&*self.coefficient_n_s_per_m).ok().map(|[c]| c)
    }

    fn largest(&self) -> f64 {
        self.coefficient_n_s_per_m.iter().copied().fold(0.0, f64::max)
    }

    fn smallest(&self) -> f64 {
        self.coefficient_n_s_per_m.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// A factor `1 + β √u` on the force of an interface, with `u` the share `share` of the speed at
/// which the body `behind` closes on the body `ahead`.
///
/// The two need not be the interface's own sides: both ends of neighbouring vehicles follow the
/// closing speed of the vehicles. If each followed its own rate, an end that slows down would
/// weaken at once and take all further crush.
#[derive(Clone, Debug, PartialEq)]
pub struct RateFactor {
    /// β in (s/m)^½, 0 at least.
    pub sensitivity_sqrt_s_per_m: f64,
    /// Of the closing speed, above 0: ½ where a curve counts the speed of one vehicle only.
    pub share: f64,
    /// Index of a body of the chain.
    pub behind: usize,
    /// The same; `None` for the wall.
    pub ahead: Option<usize>,
}

impl RateFactor {
    /// At a closing speed of the two bodies in m/s; 1 while they separate.
    pub(super) fn at(&self, closing_m_per_s: f64) -> f64 {
        Self::of(self.sensitivity_sqrt_s_per_m, self.share * closing_m_per_s)
    }

    /// At the speed in m/s that counts.
    #[inline(always)]
    pub(super) fn of(sensitivity_sqrt_s_per_m: f64, m_per_s: f64) -> f64 {
        let m_per_s = if m_per_s > 0.0 { m_per_s } else { 0.0 };
        1.0 + sensitivity_sqrt_s_per_m * m_per_s.sqrt()
    }

    /// Closing speed in m/s of its two bodies, whose speeds `speed_m_per_s` gives.
    pub(super) fn closing_m_per_s(&self, speed_m_per_s: impl Fn(usize) -> f64) -> f64 {
        speed_m_per_s(self.behind) - self.ahead.map_or(0.0, speed_m_per_s)
    }
}

/// A crush zone that stops part of its body's mass while it is crushed: one side of an interface
/// takes mass from the other, `m(δ) = max(m₀, m_s(δ))` at the maximum deflection δ so far, with
/// `m₀` its mass at first.
#[derive(Clone, Debug, PartialEq)]
pub struct Stopping {
    /// Index of the body that loses mass.
    pub body: usize,
    /// Index of the body that takes it.
    pub zone: usize,
    /// Stopped mass in kg over the deflection in m of the interface, never falling: an envelope
    /// by its shape, not a force. Held beyond its end.
    pub stopped_kg: Arc<Envelope>,
}

impl Stopping {
    /// Mass of the zone in kg once its maximum deflection was `largest_m`; `least_kg` at first.
    pub(super) fn zone_kg(&self, largest_m: f64, least_kg: f64) -> f64 {
        self.stopped_kg.force_at(largest_m.max(0.0)).max(least_kg)
    }

    /// Mass that is stopped per deflection, in kg/m.
    pub(super) fn rate_kg_per_m(&self, deflection_m: f64, least_kg: f64) -> f64 {
        let (d, m) = (self.stopped_kg.deflection_m(), self.stopped_kg.force_n());
        if deflection_m >= self.stopped_kg.end_m() || self.zone_kg(deflection_m, 0.0) < least_kg {
            return 0.0;
        }
        let i = piecewise::segment(d, deflection_m);
        (m[i + 1] - m[i]) / (d[i + 1] - d[i])
    }

    /// Whether the mass never falls and stays between 0 and `most_kg`.
    pub(super) fn is_sound(&self, most_kg: f64) -> bool {
        let m = self.stopped_kg.force_n();
        m[0] >= 0.0 && m.windows(2).all(|w| w[0] <= w[1]) && m[m.len() - 1] < most_kg
    }
}
