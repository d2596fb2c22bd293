//! The immutable model: bodies in a row and the interfaces between them.

use super::interface::ForceLaw;

/// One mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    pub name: String,
    pub mass_kg: f64,
    /// Initial speed, positive in the direction in which the first train moves.
    pub speed_m_per_s: f64,
}

/// The interface in front of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    /// `A1|A2`, `A1|wall`.
    pub name: String,
    pub law: ForceLaw,
    /// Free distance before contact, in m.
    pub gap_m: f64,
}

/// Bodies from back to front (increasing x), each with the interface to the next one.
///
/// Invariant: masses above 0; as many interfaces as bodies if the row ends at a rigid
/// wall, one less otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    bodies: Vec<Body>,
    interfaces: Vec<Interface>,
}

/// Why bodies and interfaces are no chain.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChainError {
    #[error("there are no bodies")]
    NoBodies,
    #[error("{bodies} bodies need {} interfaces, or {bodies} with a wall in front, found {interfaces}", bodies - 1)]
    Interfaces { bodies: usize, interfaces: usize },
    #[error("the mass of {name} is {mass_kg} kg: expected more than 0")]
    Mass { name: String, mass_kg: f64 },
    #[error("the speed of {name} is {speed_m_per_s} m/s: expected a finite number")]
    Speed { name: String, speed_m_per_s: f64 },
    #[error("the gap of {name} is {gap_m} m: expected 0 or more")]
    Gap { name: String, gap_m: f64 },
}

impl Chain {
    /// Checks the invariant once.
    ///
    /// # Errors
    /// [`ChainError`] names the body or interface that breaks it.
    pub fn new(bodies: Vec<Body>, interfaces: Vec<Interface>) -> Result<Self, ChainError> {
        if bodies.is_empty() {
            return Err(ChainError::NoBodies);
        }
        if interfaces.len() != bodies.len() && interfaces.len() + 1 != bodies.len() {
            let (bodies, interfaces) = (bodies.len(), interfaces.len());
            return Err(ChainError::Interfaces { bodies, interfaces });
        }
        Self { bodies, interfaces }.checked()
    }

    /// Gives the bodies other masses and speeds (kg, m/s) and the interfaces other gaps (m), in
    /// the order of the chain; the force laws stay.
    ///
    /// # Errors
    /// [`ChainError`] names the body or interface whose value breaks the invariant; the chain is
    /// then not to be run.
    pub fn adjust(&mut self, motions: &[(f64, f64)], gaps_m: &[f64]) -> Result<(), ChainError> {
        for (body, (mass_kg, speed_m_per_s)) in self.bodies.iter_mut().zip(motions) {
            (body.mass_kg, body.speed_m_per_s) = (*mass_kg, *speed_m_per_s);
        }
        for (interface, gap_m) in self.interfaces.iter_mut().zip(gaps_m) {
            interface.gap_m = *gap_m;
        }
        self.check()
    }

    fn checked(self) -> Result<Self, ChainError> {
        self.check().map(|()| self)
    }

    fn check(&self) -> Result<(), ChainError> {
        for body in &self.bodies {
            let Body { mass_kg, speed_m_per_s, .. } = *body;
            let name = || body.name.clone();
            if !(mass_kg > 0.0 && mass_kg.is_finite()) {
                return Err(ChainError::Mass { name: name(), mass_kg });
            }
            if !speed_m_per_s.is_finite() {
                return Err(ChainError::Speed { name: name(), speed_m_per_s });
            }
        }
        for interface in &self.interfaces {
            if !(interface.gap_m >= 0.0 && interface.gap_m.is_finite()) {
                let (name, gap_m) = (interface.name.clone(), interface.gap_m);
                return Err(ChainError::Gap { name, gap_m });
            }
        }
        Ok(())
    }

    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    pub fn interfaces(&self) -> &[Interface] {
        &self.interfaces
    }

    /// Longest time step, `0.03 sqrt(m_min / k_max)` in s; infinite for interfaces without
    /// stiffness.
    ///
    /// Verlet's energy swings by about `(ω h)²/8` with `ω² ≤ 4 k_max/m_min`, so this keeps
    /// the ledger within its 1e-3; the usual `0.1` would not.
    pub fn longest_step_s(&self) -> f64 {
        let lightest = self.bodies.iter().map(|b| b.mass_kg).fold(f64::INFINITY, f64::min);
        let stiffest =
            self.interfaces.iter().map(|i| i.law.max_stiffness_n_per_m()).fold(0.0, f64::max);
        0.03 * (lightest / stiffest).sqrt()
    }
}
