//! Numbers as the page writes them.

use crate::unit::Shown;
use std::path::Path;

/// The last part of a path.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name()
        .map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// `4.5 %`.
pub(super) fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:.1} %", 100.0 * share) } else { "–".into() }
}

/// `−4.5 %`, `+4.5 %`.
pub(super) fn signed_percent(share: f64) -> String {
    format!("{:+.1} %", 100.0 * share).replace('-', "−")
}

/// `3.214 MN`.
pub(super) fn force(force_n: f64) -> String {
    Shown::force(force_n).text(force_n)
}

/// `2.31 MJ`, `25.1 kJ`.
pub(super) fn energy(energy_j: f64) -> String {
    Shown::energy(energy_j).text(energy_j)
}

/// `1.087 m`.
pub(super) fn metres(length_m: f64) -> String {
    format!("{length_m:.3} m")
}

/// `24.00 t`.
pub(super) fn mass(mass_kg: f64) -> String {
    Shown::mass(mass_kg).text(mass_kg)
}
