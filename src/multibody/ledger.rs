//! Ledger: where the initial kinetic energy and the momentum are.

use serde::Serialize;

use super::train::Chain;

/// Energies in J and the worst imbalances over a run.
///
/// `KE + ΣU + ΣD = KE₀`, with stored and dissipated energy exact from the envelopes'
/// tables. The trapezoidal work of the forces would balance for any step and so check
/// nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Ledger {
    #[serde(rename = "initial_kinetic_J")]
    pub initial_kinetic_j: f64,
    #[serde(rename = "kinetic_J")]
    pub kinetic_j: f64,
    #[serde(rename = "stored_J")]
    pub stored_j: f64,
    #[serde(rename = "dissipated_J")]
    pub dissipated_j: f64,
    /// Largest imbalance of energy at any output, as a share of the initial kinetic energy.
    pub max_energy_error: f64,
    /// Largest imbalance of momentum at any output, as a share of `Σ m|v₀|`.
    pub max_momentum_error: f64,
}

/// Imbalance of energy over which a warning is due.
pub const ENERGY_TOLERANCE: f64 = 1e-3;
/// Imbalance of momentum over which a warning is due.
pub const MOMENTUM_TOLERANCE: f64 = 1e-10;

/// The running account of a simulation.
pub(super) struct Account {
    ledger: Ledger,
    initial_momentum: f64,
    momentum_scale: f64,
}

impl Account {
    pub fn open(chain: &Chain) -> Self {
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

    /// Audits one state. `wall_impulse` is what the wall has taken so far, in N s.
    pub fn audit(
        &mut self,
        chain: &Chain,
        speed_m_per_s: &[f64],
        deflection_m: &[f64],
        largest_m: &[f64],
        wall_impulse: f64,
    ) {
        let ledger = &mut self.ledger;
        let masses = || chain.bodies().iter().map(|b| b.mass_kg).zip(speed_m_per_s);
        ledger.kinetic_j = masses().map(|(m, v)| 0.5 * m * v * v).sum();
        (ledger.stored_j, ledger.dissipated_j) = (0.0, 0.0);
        for ((interface, &d), &largest) in
            chain.interfaces().iter().zip(deflection_m).zip(largest_m)
        {
            let (stored, dissipated) = interface.law.energies_j(d, largest);
            ledger.stored_j += stored;
            ledger.dissipated_j += dissipated;
        }
        let energy = ledger.kinetic_j + ledger.stored_j + ledger.dissipated_j;
        let momentum: f64 = masses().map(|(m, v)| m * v).sum();
        let share = |difference: f64, scale: f64| {
            if difference == 0.0 { 0.0 } else { difference.abs() / scale }
        };
        let energy_error = share(energy - ledger.initial_kinetic_j, ledger.initial_kinetic_j);
        let momentum_error =
            share(momentum + wall_impulse - self.initial_momentum, self.momentum_scale);
        ledger.max_energy_error = ledger.max_energy_error.max(energy_error);
        ledger.max_momentum_error = ledger.max_momentum_error.max(momentum_error);
    }

    pub fn close(self) -> Ledger {
        self.ledger
    }
}
