//! Ledger: the balance of the initial kinetic energy and the momentum.

use serde::Serialize;

use super::chain::Chain;

/// Energies in J and the worst imbalances over a run.
///
/// `KE + ΣU + ΣD + W = KE₀`, with stored and dissipated energy of the interfaces exact from
/// their tables, and `W` what dampers and resistance took, by the trapezoidal rule over the
/// steps. The trapezoidal work of the interfaces' forces would balance for any step and so
/// check nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Ledger {
    /// At the first contact.
    #[serde(rename = "initial_kinetic_J")]
    pub initial_kinetic_j: f64,
    /// At the end, as all that follow.
    #[serde(rename = "kinetic_J")]
    pub kinetic_j: f64,
    /// In all interfaces.
    #[serde(rename = "stored_J")]
    pub stored_j: f64,
    /// In all interfaces.
    #[serde(rename = "dissipated_J")]
    pub dissipated_j: f64,
    /// By dampers, by the share of forces that follows speeds, and where mass is stopped.
    #[serde(rename = "damped_J")]
    pub damped_j: f64,
    /// By running and braking resistance.
    #[serde(rename = "resisted_J")]
    pub resisted_j: f64,
    /// Largest imbalance of energy at any output, as a share of the initial kinetic energy.
    pub max_energy_error: f64,
    /// Largest imbalance of momentum at any output, as a share of `Σ m|v₀|`.
    pub max_momentum_error: f64,
}

impl Ledger {
    /// What is out of tolerance.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.max_energy_error > ENERGY_TOLERANCE {
            warnings.push(format!(
                "energy is off by {:.2e} of the initial kinetic energy (tolerance {ENERGY_TOLERANCE:e}): shorten the step",
                self.max_energy_error
            ));
        }
        if self.max_momentum_error > MOMENTUM_TOLERANCE {
            warnings.push(format!(
                "momentum is off by {:.2e} (tolerance {MOMENTUM_TOLERANCE:e}): shorten the step",
                self.max_momentum_error
            ));
        }
        warnings
    }
}

/// Imbalance of energy over which a warning is due.
const ENERGY_TOLERANCE: f64 = 1e-3;
/// Imbalance of momentum over which a warning is due.
const MOMENTUM_TOLERANCE: f64 = 1e-10;

/// What is where at an output: energies in J, momentum and impulse in N s.
pub(super) struct Balance {
    pub kinetic_j: f64,
    /// Stored and dissipated by all interfaces.
    pub interfaces_j: f64,
    pub damped_j: f64,
    pub resisted_j: f64,
    pub momentum: f64,
    /// What wall and track have taken so far.
    pub impulse: f64,
}

/// The running account of a simulation.
pub(super) struct Account {
    ledger: Ledger,
    initial_momentum: f64,
    momentum_scale: f64,
}

impl Account {
    pub(crate) fn open(chain: &Chain) -> Self {
        let bodies = chain.bodies();
        let kinetic = |b: &super::Body| 0.5 * b.mass_kg * b.speed_m_per_s * b.speed_m_per_s;
        let ledger =
            Ledger { initial_kinetic_j: bodies.iter().map(kinetic).sum(), ..Ledger::default() };
        Self {
            ledger,
            initial_momentum: bodies.iter().map(|b| b.mass_kg * b.speed_m_per_s).sum(),
            momentum_scale: bodies.iter().map(|b| b.mass_kg * b.speed_m_per_s.abs()).sum(),
        }
    }

    /// Audits an output.
    pub(crate) fn audit(&mut self, now: &Balance) {
        let ledger = &mut self.ledger;
        (ledger.kinetic_j, ledger.damped_j, ledger.resisted_j) =
            (now.kinetic_j, now.damped_j, now.resisted_j);
        let energy = now.kinetic_j + now.interfaces_j + now.damped_j + now.resisted_j;
        let share = |difference: f64, scale: f64| {
            if difference == 0.0 {
                0.0
            } else {
                Some(difference.abs() / scale).filter(|e| !e.is_nan()).unwrap_or(f64::INFINITY)
            }
        };
        let energy_error = share(energy - ledger.initial_kinetic_j, ledger.initial_kinetic_j);
        let momentum_error =
            share(now.momentum + now.impulse - self.initial_momentum, self.momentum_scale);
        ledger.max_energy_error = ledger.max_energy_error.max(energy_error);
        ledger.max_momentum_error = ledger.max_momentum_error.max(momentum_error);
    }

    /// Stored and dissipated are those of the last output.
    pub(crate) fn close(self, stored_j: f64, dissipated_j: f64) -> Ledger {
        Ledger { stored_j, dissipated_j, ..self.ledger }
    }
}
