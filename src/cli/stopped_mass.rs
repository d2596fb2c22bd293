//! What is said of the mass that a crush zone stops.

use crate::curve::StoppedMass;
use crate::unit::SpeedKind;

/// How much, over which deflection, and how well the runs agree.
pub(super) fn said(stopped: &StoppedMass, kind: SpeedKind) -> String {
    let (end_m, all_kg) = stopped.in_all();
    let of = match kind {
        SpeedKind::Wall => "",
        SpeedKind::Closing => " of the reduced mass, half of what one of two equal ends has,",
    };
    format!(
        "crush law: the crush zone stops {all_kg:.0} kg{of} over {end_m:.3} m; the runs' momentum says so within {:.0} kg (root mean square)",
        stopped.residual_kg
    )
}
