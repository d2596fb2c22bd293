//! Radioss and OpenRadioss: `/FUNCT` and `/PROP/TYPE4`, alone or in a starter and an engine file.
//!
//! Layout: Radioss reference guide. TYPE4 takes compression in the third quadrant. Hardening flag 2
//! (uncoupled): after the crush the spring unloads with K1 and has no force in tension, where isotropic
//! hardening (1) would cause tension. The solver takes the smaller of the curve and a line of K1 (OpenRadioss,
//! `redef3.F`), so K1 is at least the steepest rise.

use super::lsdyna::InUnits;
use super::text::{Lines, nine_digits, title};
use super::{ExportCurve, Exported, NUMBER_OF_STATES, Options, run_time_s};
use crate::error::{Error, error};
use crate::unit::UnitSystem;

const TITLE_WIDTH: usize = 100;
const HARDENING: u32 = 2;

pub(crate) fn write(curves: &[ExportCurve], options: &Options) -> Result<Exported, Error> {
    if options.deck && curves.len() != 1 {
        let needs = format!("one curve for a deck of one mass, found {}", curves.len());
        return Err(error!(Export, "{format} takes {needs}", format = "radioss --deck"));
    }
    let stem = curves.first().map_or("curves".into(), ExportCurve::file_stem);
    // It names the run, too.
    let stem: String = stem.chars().take(TITLE_WIDTH - 20).collect();
    let mut lines = Lines::default();
    let mut notes = Vec::new();
    let mut files = Vec::new();
    for (k, curve) in curves.iter().enumerate() {
        let curve = &curve.begun_at_origin()?;
        let units = curve.predicted.provenance.study_units;
        let units = InUnits(options.units.or(units).unwrap_or(UnitSystem::SI));
        let id = options.id + k as u32;
        if options.deck {
            begin(&mut lines, curve, units, &stem);
        }
        describe(&mut lines, curve, units);
        function(&mut lines, curve, units, id);
        property(&mut lines, curve, units, id);
        notes.extend(curve.steepest_notes("Radioss TYPE4", ""));
        if options.deck {
            model(&mut lines, curve, units, id);
            files.push((format!("{stem}_0001.rad"), engine(curve, units, &stem)));
        }
    }
    if options.deck {
        files.insert(0, (format!("{stem}_0000.rad"), lines.into_bytes()));
    } else {
        files.push((format!("{stem}.rad"), lines.into_bytes()));
    }
    Ok(Exported { files, notes, ..Exported::default() })
}

fn begin(lines: &mut Lines, curve: &ExportCurve, units: InUnits, stem: &str) {
    lines.add(format_args!("#RADIOSS STARTER"));
    lines.add(format_args!("/BEGIN"));
    lines.add(format_args!("{stem}"));
    lines.add(format_args!("{:>10}{:>10}", 2022, 0));
    // Of the input and of the solver's own work.
    for _ in 0..2 {
        let [mass, length, time] = unit_names(units.0);
        lines.add(format_args!("{mass:>20}{length:>20}{time:>20}"));
    }
    lines.add(format_args!("/TITLE"));
    lines.add(format_args!("{}", title(&format!("one mass on {}", curve.headline()), TITLE_WIDTH)));
}

/// Mass, length and time by the names that Radioss has for them, else by their size in SI.
fn unit_names(units: UnitSystem) -> [String; 3] {
    let named = |size: f64, names: &[(&str, f64)]| {
        let found = names.iter().find(|(_, unit)| (unit / size - 1.0).abs() < 1e-9);
        found.map_or_else(|| nine_digits(size), |(name, _)| (*name).into())
    };
    [
        named(units.mass_kg, &[("Mg", 1e3), ("kg", 1.0), ("g", 1e-3)]),
        named(units.length_m, &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)]),
        named(units.time_s, &[("s", 1.0), ("ms", 1e-3), ("mus", 1e-6)]),
    ]
}

fn describe(lines: &mut Lines, curve: &ExportCurve, units: InUnits) {
    lines.add(format_args!("# {}", units.stated()));
    for (key, value) in curve.facts() {
        lines.add(format_args!("# {key}: {value}"));
    }
}

fn function(lines: &mut Lines, curve: &ExportCurve, units: InUnits, id: u32) {
    lines.add(format_args!("/FUNCT/{id}"));
    lines.add(format_args!("{}", title(&curve.headline(), TITLE_WIDTH)));
    lines.add(format_args!("#                  X                   Y"));
    let points = curve.deflection_m().iter().zip(curve.force_n()).rev();
    for (i, (d, f)) in points.enumerate() {
        let is_origin = i + 1 == curve.deflection_m().len();
        let force = if is_origin { 0.0 } else { -f };
        lines.add(format_args!("{:>20}{:>20}", units.length(-d), units.force(force)));
    }
    // No force in tension.
    let reach = curve.loading.end_m();
    lines.add(format_args!("{:>20}{:>20}", units.length(0.1 * reach), units.force(0.0)));
}

fn property(lines: &mut Lines, curve: &ExportCurve, units: InUnits, id: u32) {
    let zero = nine_digits(0.0);
    let one = nine_digits(1.0);
    // A spring needs its own mass: a millionth of the body's.
    let mass = 1e-6 * curve.predicted.mass_kg / units.0.mass_kg;
    // With a softer K1 the solver would cut the rises that are steeper, and their energy.
    let stiffness = curve.stiffness_n_per_m().max(curve.loading.max_slope());
    let stiffness = units.stiffness(stiffness);
    lines.add(format_args!("/PROP/TYPE4/{id}"));
    lines.add(format_args!("{}", title(&curve.headline(), TITLE_WIDTH)));
    lines.add(format_args!(
        "#               MASS                               sens_ID    Isflag     Ileng"
    ));
    lines.add(format_args!("{:>20}{:>30}{:>10}{:>10}{:>10}", nine_digits(mass), "", 0, 0, 0));
    lines.add(format_args!(
        "#                 K1                  C1                  A1                  B1                  D1"
    ));
    lines.add(format_args!("{:>20}{zero:>20}{one:>20}{zero:>20}{one:>20}", nine_digits(stiffness)));
    lines.add(format_args!(
        "# fct_ID11        H1  fct_ID21  fct_ID31  fct_ID41                     delta_min1          delta_max1"
    ));
    lines.add(format_args!(
        "{id:>10}{HARDENING:>10}{:>10}{:>10}{:>10}{:>10}{zero:>20}{zero:>20}",
        0, 0, 0, ""
    ));
    lines.add(format_args!(
        "#                 F1                  E1             Ascale1             Hscale1"
    ));
    lines.add(format_args!("{one:>20}{zero:>20}{one:>20}{one:>20}"));
}

/// Nodes, spring, masses, speed and supports. Node 2 at +x moves towards −x.
fn model(lines: &mut Lines, curve: &ExportCurve, units: InUnits, id: u32) {
    let system = units.0;
    let length = 1.2 * curve.loading.end_m() / system.length_m;
    let number = |value: f64| nine_digits(value);
    lines.add(format_args!("/PART/1"));
    lines.add(format_args!("spring"));
    lines.add(format_args!("#     prop       mat    subset"));
    lines.add(format_args!("{id:>10}{:>10}{:>10}", 0, 0));
    lines.add(format_args!("/NODE"));
    lines.add(format_args!("{:>10}{:>20}{:>20}{:>20}", 1, "0.0", "0.0", "0.0"));
    lines.add(format_args!("{:>10}{:>20}{:>20}{:>20}", 2, number(length), "0.0", "0.0"));
    lines.add(format_args!("/SPRING/1"));
    lines.add(format_args!("{:>10}{:>10}{:>10}", 1, 1, 2));
    for node in [1, 2] {
        lines.add(format_args!("/GRNOD/NODE/{node}"));
        lines.add(format_args!("node {node}"));
        lines.add(format_args!("{node:>10}"));
    }
    let masses = [(2, Some(curve.predicted.mass_kg)), (1, curve.other_mass_kg())];
    for (node, mass) in masses {
        let Some(mass) = mass else { continue };
        lines.add(format_args!("/ADMAS/0/{node}"));
        lines.add(format_args!("body {node}"));
        lines.add(format_args!("#               Mass   grnd_ID"));
        lines.add(format_args!("{:>20}{node:>10}", number(mass / system.mass_kg)));
    }
    lines.add(format_args!("/INIVEL/TRA/1"));
    lines.add(format_args!("initial velocity"));
    lines.add(format_args!(
        "#                 Vx                  Vy                  Vz   Gnod_id   Skew_id"
    ));
    let speed = -curve.predicted.speed_m_per_s / system.speed();
    lines.add(format_args!("{:>20}{:>20}{:>20}{:>10}{:>10}", number(speed), "0.0", "0.0", 2, 0));
    let along = usize::from(curve.other_mass_kg().is_none());
    for (node, along) in [(1, along), (2, 0)] {
        lines.add(format_args!("/BCS/{node}"));
        lines.add(format_args!("guided along x"));
        lines.add(format_args!("#  Tra rot   skew_ID  grnod_ID"));
        lines.add(format_args!("   {along}11 111{:>10}{node:>10}", 0));
    }
    for (kind, ids) in [("NODE", &[1, 2][..]), ("SPRING", &[1])] {
        lines.add(format_args!("/TH/{kind}/1"));
        lines.add(format_args!("{}", kind.to_lowercase()));
        lines.add(format_args!("#      var"));
        lines.add(format_args!("DEF"));
        ids.iter().for_each(|id| lines.add(format_args!("{id:>10}")));
    }
    lines.add(format_args!("/END"));
}

fn engine(curve: &ExportCurve, units: InUnits, stem: &str) -> Vec<u8> {
    let end = run_time_s(curve) / units.0.time_s;
    let mut lines = Lines::default();
    lines.add(format_args!("/RUN/{stem}/1"));
    lines.add(format_args!("{end:.6}"));
    lines.add(format_args!("/VERS/2022"));
    lines.add(format_args!("/TFILE/4"));
    lines.add(format_args!("{:.6e}", end / NUMBER_OF_STATES));
    lines.add(format_args!("/PRINT/-1000"));
    lines.into_bytes()
}
