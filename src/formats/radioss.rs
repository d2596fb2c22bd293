//! Radioss and OpenRadioss: `/FUNCT` and `/PROP/TYPE4`, alone or in a starter and an engine file.
//!
//! Layout: Radioss reference guide. TYPE4 takes compression in the third quadrant. Hardening flag 2
//! (uncoupled): after the crush the spring unloads with K1 and has no force in tension, where isotropic
//! hardening (1) would cause tension. The solver takes the smaller of the curve and a line of K1 (OpenRadioss,
//! `redef3.F`), so K1 is at least the steepest rise.

use super::lsdyna::InUnits;
use super::text::{line, nine_digits, title};
use super::{ExportCurve, Exported, NUMBER_OF_STATES, Options, run_time_s};
use crate::error::Error;
use crate::unit::UnitSystem;

const TITLE_WIDTH: usize = 100;
const HARDENING: u32 = 2;

pub(crate) fn write(curves: &[ExportCurve], options: &Options) -> Result<Exported, Error> {
    let stem = curves.first().map_or("curves".into(), ExportCurve::file_stem);
    let mut lines = String::new();
    let mut notes = Vec::new();
    let mut files = Vec::new();
    for (k, curve) in curves.iter().enumerate() {
        let curve = &curve.begun_at_origin(false, &mut notes)?;
        let units = InUnits::of(curve, options);
        let id = options.id + k as u32;
        if options.deck {
            begin(&mut lines, curve, units, &stem);
        }
        line!(lines, "# {}", units.stated());
        for (key, value) in curve.facts_by_elongation() {
            line!(lines, "# {key}: {value}");
        }
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

fn begin(lines: &mut String, curve: &ExportCurve, units: InUnits, stem: &str) {
    line!(lines, "#RADIOSS STARTER\n/BEGIN\n{stem}\n      2022         0");
    // Of the input and of the solver's own work.
    for _ in 0..2 {
        let [mass, length, time] = unit_names(units.0);
        line!(lines, "{mass:>20}{length:>20}{time:>20}");
    }
    line!(
        lines,
        "/TITLE\n{}",
        title(&format!("{} on {}", curve.bodies(), curve.headline()), TITLE_WIDTH)
    );
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

fn function(lines: &mut String, curve: &ExportCurve, units: InUnits, id: u32) {
    line!(lines, "/FUNCT/{id}\n{}", title(&curve.headline(), TITLE_WIDTH));
    line!(lines, "#                  X                   Y");
    let points = curve.deflection_m().iter().zip(curve.force_n()).rev();
    for (i, (d, f)) in points.enumerate() {
        let is_origin = i + 1 == curve.deflection_m().len();
        let force = if is_origin { 0.0 } else { -f };
        line!(lines, "{:>20}{:>20}", units.length(-d), units.force(force));
    }
    // No force in tension.
    let reach = curve.loading.end_m();
    line!(lines, "{:>20}{:>20}", units.length(0.1 * reach), units.force(0.0));
}

fn property(lines: &mut String, curve: &ExportCurve, units: InUnits, id: u32) {
    let [zero, one] = [0.0, 1.0].map(nine_digits);
    // A spring needs its own mass: a millionth of the body's.
    let mass = nine_digits(1e-6 * curve.predicted.mass_kg / units.0.mass_kg);
    // With a softer K1 the solver would cut the rises that are steeper, and their energy. Its starter compares with the
    // points as they are written, to the last digit.
    let written = |text: String| text.parse::<f64>().unwrap_or(f64::NAN);
    let own = written(nine_digits(units.stiffness(curve.stiffness_n_per_m())));
    let points = curve.deflection_m().iter().zip(curve.force_n());
    let points: Vec<(f64, f64)> =
        points.map(|(d, f)| (written(units.length(*d)), written(units.force(*f)))).collect();
    let slopes = points.windows(2).map(|w| (w[1].1 - w[0].1) / (w[1].0 - w[0].0));
    let steepest = slopes.fold(0.0, f64::max);
    let stiffness = nine_digits(if steepest > own { steepest * (1.0 + 1e-8) } else { own });
    line!(lines, "/PROP/TYPE4/{id}\n{}", title(&curve.headline(), TITLE_WIDTH));
    line!(lines, "#               MASS                               sens_ID    Isflag     Ileng");
    line!(lines, "{mass:>20}{:>30}         0         0         0", "");
    line!(
        lines,
        "#                 K1                  C1                  A1                  B1                  D1"
    );
    line!(lines, "{stiffness:>20}{zero:>20}{one:>20}{zero:>20}{one:>20}");
    line!(
        lines,
        "# fct_ID11        H1  fct_ID21  fct_ID31  fct_ID41                     delta_min1          delta_max1"
    );
    line!(
        lines,
        "{id:>10}{HARDENING:>10}         0         0         0          {zero:>20}{zero:>20}"
    );
    line!(
        lines,
        "#                 F1                  E1             Ascale1             Hscale1"
    );
    line!(lines, "{one:>20}{zero:>20}{one:>20}{one:>20}");
}

/// Nodes, spring, masses, speed and supports. Node 2 at +x moves towards −x.
fn model(lines: &mut String, curve: &ExportCurve, units: InUnits, id: u32) {
    let system = units.0;
    let length = 1.2 * curve.loading.end_m() / system.length_m;
    line!(lines, "/PART/1\nspring\n#     prop       mat    subset\n{id:>10}         0         0");
    line!(lines, "/NODE");
    for (node, x) in [(1, "0.0".into()), (2, nine_digits(length))] {
        line!(lines, "{node:>10}{x:>20}                 0.0                 0.0");
    }
    line!(lines, "/SPRING/1\n         1         1         2");
    for node in [1, 2] {
        line!(lines, "/GRNOD/NODE/{node}\nnode {node}\n{node:>10}");
    }
    let masses = [(2, Some(curve.predicted.mass_kg)), (1, curve.other_mass_kg())];
    for (node, mass) in masses {
        let Some(mass) = mass else { continue };
        line!(lines, "/ADMAS/0/{node}\nbody {node}\n#               Mass   grnd_ID");
        line!(lines, "{:>20}{node:>10}", nine_digits(mass / system.mass_kg));
    }
    line!(lines, "/INIVEL/TRA/1\ninitial velocity");
    line!(
        lines,
        "#                 Vx                  Vy                  Vz   Gnod_id   Skew_id"
    );
    let speed = nine_digits(-curve.predicted.speed_m_per_s / system.speed());
    line!(lines, "{speed:>20}                 0.0                 0.0         2         0");
    let along = usize::from(curve.other_mass_kg().is_none());
    for (node, along) in [(1, along), (2, 0)] {
        line!(lines, "/BCS/{node}\nguided along x\n#  Tra rot   skew_ID  grnod_ID");
        line!(lines, "   {along}11 111         0{node:>10}");
    }
    // Numbers of such groups are unique across types.
    line!(lines, "/TH/NODE/1\nnode\n#      var\nDEF\n         1\n         2");
    line!(lines, "/TH/SPRING/2\nspring\n#      var\nDEF\n         1\n/END");
}

fn engine(curve: &ExportCurve, units: InUnits, stem: &str) -> Vec<u8> {
    let end = run_time_s(curve) / units.0.time_s;
    let interval = end / NUMBER_OF_STATES;
    let written_by = &curve.predicted.provenance.written_by;
    format!("# written_by: {written_by}\n/RUN/{stem}/1\n{end:.6}\n/VERS/2022\n/TFILE/4\n{interval:.6e}\n/PRINT/-1000\n")
        .into_bytes()
}
