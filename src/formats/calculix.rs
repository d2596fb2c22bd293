//! CalculiX and Abaqus: `*SPRING, NONLINEAR`, elastic, alone or in an input of one mass on the spring.
//!
//! CalculiX 2.20 accepts at most 200 rows and is silently wrong with more, so the curve is thinned to that at equal energy.

use super::lsdyna::InUnits;
use super::text::{line, nine_digits};
use super::{ExportCurve, Exported, NUMBER_OF_STATES, Options, TargetUnloading, run_time_s};
use crate::error::Error;
use crate::unit::UnitSystem;

/// Rows that CalculiX accepts, one of them for tension.
const MOST_ROWS: usize = 200;
/// Time steps of the deck per state.
const STEPS: f64 = 10.0;

pub(crate) fn write(curves: &[ExportCurve], options: &Options) -> Result<Exported, Error> {
    let units = InUnits(options.units.unwrap_or(UnitSystem::SI));
    let mut lines = String::new();
    let mut notes = Vec::new();
    for (k, curve) in curves.iter().enumerate() {
        let curve = &curve.begun_at_origin(true, &mut notes)?;
        let id = options.id + k as u32;
        let takes = format!(" (CalculiX takes {MOST_ROWS} rows)");
        let few = curve.of_at_most(MOST_ROWS - 1, &takes, &mut notes)?;
        notes.push(curve.restitution_note("CalculiX", TargetUnloading::Elastic));
        line!(lines, "** {}", units.stated());
        for (key, value) in few.facts_by_elongation() {
            line!(lines, "** {key}: {}", ascii(&value));
        }
        if options.deck {
            nodes(&mut lines, curve, units, id);
        }
        // The empty data line is that of an orientation, which SPRINGA does not have.
        line!(lines, "*SPRING, ELSET=IF{id}, NONLINEAR\n");
        let rows = few.deflection_m().iter().zip(few.force_n()).skip(1).rev();
        for (d, f) in rows {
            line!(lines, "{}, {}", units.force(-f), units.length(-d));
        }
        let zero = nine_digits(0.0);
        line!(lines, "{zero}, {zero}");
        line!(lines, "{zero}, {}", units.length(0.1 * curve.loading.end_m()));
        if options.deck {
            step(&mut lines, curve, units);
        }
    }
    Ok(Exported::of_all(curves, "inp", lines.into_bytes(), notes))
}

fn ascii(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' }).collect()
}

/// The body is node 2 at +x and moves towards −x; node 1 is fixed, or the other body.
fn nodes(lines: &mut String, curve: &ExportCurve, units: InUnits, id: u32) {
    // Longer than any crush: otherwise CalculiX reverses the spring.
    let length = units.length(1.2 * curve.loading.end_m());
    line!(lines, "*NODE, NSET=NALL\n1, 0.0, 0.0, 0.0\n2, {length}, 0.0, 0.0");
    line!(lines, "*ELEMENT, TYPE=SPRINGA, ELSET=IF{id}\n1, 1, 2");
    let masses = [(2, 2, 2, Some(curve.predicted.mass_kg)), (1, 3, 1, curve.other_mass_kg())];
    for (body, element, node, mass) in masses {
        let Some(mass) = mass else { continue };
        let mass = nine_digits(mass / units.0.mass_kg);
        line!(lines, "*ELEMENT, TYPE=MASS, ELSET=BODY{body}\n{element}, {node}");
        line!(lines, "*MASS, ELSET=BODY{body}\n{mass}");
    }
    let first = if curve.other_mass_kg().is_some() { 2 } else { 1 };
    line!(lines, "*BOUNDARY\n1, {first}, 3\n2, 2, 3");
    let speed = nine_digits(-curve.predicted.speed_m_per_s / units.0.speed());
    line!(lines, "*INITIAL CONDITIONS, TYPE=VELOCITY\n2, 1, {speed}");
}

fn step(lines: &mut String, curve: &ExportCurve, units: InUnits) {
    let end = run_time_s(curve) / units.0.time_s;
    let increments = (NUMBER_OF_STATES * STEPS) as usize;
    let [step, end] = [end / NUMBER_OF_STATES / STEPS, end].map(nine_digits);
    line!(lines, "*STEP, NLGEOM, INC={}", 10 * increments);
    line!(lines, "*DYNAMIC, DIRECT, ALPHA=0.0\n{step}, {end}");
    line!(lines, "*NODE PRINT, NSET=NALL, FREQUENCY={}\nU, V\n*END STEP", STEPS as usize);
}
