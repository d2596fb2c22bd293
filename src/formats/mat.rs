//! MAT v4: matrices for MATLAB, Octave, scipy and Modelica's tables; SI.
//!
//! Layout of a matrix (MATLAB, MAT-File Format, chapter 2): five little-endian 32-bit integers (0 for
//! little-endian doubles, rows, columns, 0 for no imaginary part, length of the name with its NUL), the
//! name, the doubles column by column.

use super::{ExportCurve, Exported, TargetUnloading};
use crate::error::Error;

pub(crate) fn write(curves: &[ExportCurve]) -> Result<Exported, Error> {
    let mut bytes = Vec::new();
    let mut notes = Vec::new();
    for (k, curve) in curves.iter().enumerate() {
        let curve = &curve.begun_at_origin(true, &mut notes)?;
        // The first curve has the plain names, which the others number.
        let named = |name: &str| if k == 0 { name.into() } else { format!("{name}_{}", k + 1) };
        let reach = curve.loading.end_m();
        // A guard point: tools that extrapolate continue without force before the contact.
        let guarded = |force_n: &[f64]| -> Vec<(f64, f64)> {
            let points = curve.deflection_m().iter().copied().zip(force_n.iter().copied());
            std::iter::once((-0.01 * reach, 0.0)).chain(points).collect()
        };
        let (end_m, end_n) = (curve.max_crush_m(), curve.end_n());
        let k_u = curve.line_stiffness_n_per_m();
        let open_m = end_m - end_n / k_u;
        matrix(&mut bytes, &named("fd_load"), &columns(&guarded(curve.force_n())));
        matrix(&mut bytes, &named("fd_unload"), &columns(&[(open_m, 0.0), (end_m, end_n)]));
        if let Some((low_n, high_n)) = &curve.band {
            matrix(&mut bytes, &named("fd_low"), &columns(&guarded(low_n)));
            matrix(&mut bytes, &named("fd_high"), &columns(&guarded(high_n)));
        }
        for (name, value) in [
            ("k_u", k_u),
            ("max_deflection_m", end_m),
            ("speed_m_per_s", curve.predicted.speed_m_per_s),
            ("mass_kg", curve.predicted.mass_kg),
        ] {
            matrix(&mut bytes, &named(name), &[vec![value]]);
        }
        text(&mut bytes, &named("facts"), curve);
        notes.push(curve.restitution_note("a table without memory", TargetUnloading::Elastic));
    }
    Ok(Exported::of_all(curves, "mat", bytes, notes))
}

fn columns(rows: &[(f64, f64)]) -> Vec<Vec<f64>> {
    vec![rows.iter().map(|r| r.0).collect(), rows.iter().map(|r| r.1).collect()]
}

/// Header of a matrix: `kind` is 0 for numbers and 1 for text.
fn head(bytes: &mut Vec<u8>, kind: i32, name: &str, rows: usize, columns: usize) {
    let name = [name.as_bytes(), &[0]].concat();
    for field in [kind, rows as i32, columns as i32, 0, name.len() as i32] {
        bytes.extend(field.to_le_bytes());
    }
    bytes.extend(name);
}

fn matrix(bytes: &mut Vec<u8>, name: &str, columns: &[Vec<f64>]) {
    head(bytes, 0, name, columns[0].len(), columns.len());
    bytes.extend(columns.iter().flatten().flat_map(|value| value.to_le_bytes()));
}

/// One line per fact, as rows of characters; each character is a double.
fn text(bytes: &mut Vec<u8>, name: &str, curve: &ExportCurve) {
    let facts = curve.facts().into_iter().chain(curve.line_facts());
    let lines: Vec<Vec<char>> =
        facts.map(|(key, value)| format!("{key}: {value}").chars().collect()).collect();
    let width = lines.iter().map(Vec::len).max().unwrap_or(0);
    head(bytes, 1, name, lines.len(), width);
    for column in 0..width {
        for line in &lines {
            let c = line.get(column).filter(|c| c.is_ascii()).map_or(' ', |c| *c);
            bytes.extend(f64::from(c as u32).to_le_bytes());
        }
    }
}
