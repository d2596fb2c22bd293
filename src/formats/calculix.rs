//! CalculiX and Abaqus: `*SPRING, NONLINEAR`, elastic, alone or in an input of one mass on the spring.
//!
//! CalculiX 2.20 accepts at most 200 rows and is silently wrong with more, so the curve is thinned to that at equal energy.

use super::lsdyna::InUnits;
use super::text::{Lines, nine_digits};
use super::thin::thinned;
use super::{ExportCurve, Exported, NUMBER_OF_STATES, Options, TargetUnloading, run_time_s};
use crate::error::{Error, error};
use crate::unit::UnitSystem;

/// Rows that CalculiX accepts, one of them for tension.
const MOST_ROWS: usize = 200;
/// Time steps of the deck per state.
const STEPS: f64 = 10.0;

pub(crate) fn write(curves: &[ExportCurve], options: &Options) -> Result<Exported, Error> {
    if options.deck && curves.len() != 1 {
        let needs = format!("one curve for a deck of one mass, found {}", curves.len());
        return Err(error!(Export, "{format} takes {needs}", format = "calculix --deck"));
    }
    let units = InUnits(options.units.unwrap_or(UnitSystem::SI));
    let mut lines = Lines::default();
    let mut notes = Vec::new();
    for (k, curve) in curves.iter().enumerate() {
        let curve = &curve.begun_at_origin()?;
        let id = options.id + k as u32;
        let given = curve.deflection_m().len();
        let loading = thinned(&curve.loading, MOST_ROWS - 1, curve.end)?;
        if loading.deflection_m().len() < given {
            notes.push(format!(
                "{}: {} of {given} points are kept (CalculiX takes {MOST_ROWS} rows), with the same energy up to the maximum crush",
                curve.headline(),
                loading.deflection_m().len()
            ));
        }
        notes.push(curve.restitution_note("CalculiX", TargetUnloading::Elastic));
        lines.add(format_args!("** {}", units.stated()));
        for (key, value) in curve.facts() {
            lines.add(format_args!("** {key}: {}", ascii(&value)));
        }
        lines.add(format_args!(
            "** elongation is positive: a crush stands as (-force, -deflection)"
        ));
        if options.deck {
            nodes(&mut lines, curve, units, id);
        }
        lines.add(format_args!("*SPRING, ELSET=IF{id}, NONLINEAR"));
        // The data line of an orientation, which SPRINGA does not have.
        lines.add(format_args!(""));
        let rows = loading.deflection_m().iter().zip(loading.force_n()).skip(1).rev();
        for (d, f) in rows {
            lines.add(format_args!("{}, {}", units.force(-f), units.length(-d)));
        }
        let zero = nine_digits(0.0);
        lines.add(format_args!("{zero}, {zero}"));
        lines.add(format_args!("{zero}, {}", units.length(0.1 * curve.loading.end_m())));
        if options.deck {
            step(&mut lines, curve, units);
        }
    }
    let stem = curves.first().map_or("curves".into(), ExportCurve::file_stem);
    Ok(Exported {
        files: vec![(format!("{stem}.inp"), lines.into_bytes())],
        notes,
        ..Exported::default()
    })
}

fn ascii(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' }).collect()
}

/// The body is node 2 at +x and moves towards −x; node 1 is fixed, or the other body.
fn nodes(lines: &mut Lines, curve: &ExportCurve, units: InUnits, id: u32) {
    let mass = |kg: f64| nine_digits(kg / units.0.mass_kg);
    lines.add(format_args!("*NODE, NSET=NALL"));
    lines.add(format_args!("1, 0.0, 0.0, 0.0"));
    // Longer than any crush: otherwise CalculiX reverses the spring.
    lines.add(format_args!("2, {}, 0.0, 0.0", units.length(1.2 * curve.loading.end_m())));
    lines.add(format_args!("*ELEMENT, TYPE=SPRINGA, ELSET=IF{id}"));
    lines.add(format_args!("1, 1, 2"));
    lines.add(format_args!("*ELEMENT, TYPE=MASS, ELSET=BODY2"));
    lines.add(format_args!("2, 2"));
    lines.add(format_args!("*MASS, ELSET=BODY2"));
    lines.add(format_args!("{}", mass(curve.predicted.mass_kg)));
    if let Some(other) = curve.other_mass_kg() {
        lines.add(format_args!("*ELEMENT, TYPE=MASS, ELSET=BODY1"));
        lines.add(format_args!("3, 1"));
        lines.add(format_args!("*MASS, ELSET=BODY1"));
        lines.add(format_args!("{}", mass(other)));
    }
    lines.add(format_args!("*BOUNDARY"));
    lines.add(format_args!("1, {}, 3", if curve.other_mass_kg().is_some() { 2 } else { 1 }));
    lines.add(format_args!("2, 2, 3"));
    lines.add(format_args!("*INITIAL CONDITIONS, TYPE=VELOCITY"));
    let speed = curve.predicted.speed_m_per_s / units.0.speed();
    lines.add(format_args!("2, 1, {}", nine_digits(-speed)));
}

fn step(lines: &mut Lines, curve: &ExportCurve, units: InUnits) {
    let end = run_time_s(curve) / units.0.time_s;
    let increments = (NUMBER_OF_STATES * STEPS) as usize;
    lines.add(format_args!("*STEP, NLGEOM, INC={}", 10 * increments));
    lines.add(format_args!("*DYNAMIC, DIRECT, ALPHA=0.0"));
    lines.add(format_args!(
        "{}, {}",
        nine_digits(end / NUMBER_OF_STATES / STEPS),
        nine_digits(end)
    ));
    lines.add(format_args!("*NODE PRINT, NSET=NALL, FREQUENCY={}", STEPS as usize));
    lines.add(format_args!("U, V"));
    lines.add(format_args!("*END STEP"));
}
