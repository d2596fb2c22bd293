//! Numbers as the page writes them.

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
pub(super) fn mega_newton(force_n: f64) -> String {
    format!("{:.3} MN", force_n / 1e6)
}

/// `2.31 MJ`, `25.1 kJ`.
pub(super) fn energy(energy_j: f64) -> String {
    match energy_j.abs() {
        e if e >= 1e6 => format!("{:.3} MJ", energy_j / 1e6),
        _ => format!("{:.1} kJ", energy_j / 1e3),
    }
}

/// `1.087 m`.
pub(super) fn metres(length_m: f64) -> String {
    format!("{length_m:.3} m")
}

/// `24.00 t`.
pub(super) fn tonnes(mass_kg: f64) -> String {
    format!("{:.2} t", mass_kg / 1e3)
}
