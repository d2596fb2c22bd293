//! Energy audit: work of the loading branch against the kinetic energy it stopped.

use super::loading::loading_end;
use super::{Curve, EnergyAudit, Masses};
use crate::unit::Speed;

/// `W = ∫F dd` up to the largest deflection by the trapezoidal rule over the samples,
/// and `E`, the kinetic energy of the impact.
pub fn audit(curve: &Curve, masses: Masses, speed: Speed) -> EnergyAudit {
    let (d, f) = (curve.deflection_m(), curve.force_n());
    let work_j =
        (1..=loading_end(curve)).map(|i| 0.5 * (f[i] + f[i - 1]) * (d[i] - d[i - 1])).sum();
    EnergyAudit { work_j, kinetic_j: masses.kinetic_energy_j(speed) }
}
