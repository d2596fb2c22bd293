//! LS-DYNA: `*DEFINE_CURVE_TITLE` (loading, unloading) with a spring material that uses them, alone or in a runnable deck.
//!
//! Layouts and rules: LS-DYNA Keyword User's Manual, volumes I (`*DEFINE_CURVE`) and II (`*MAT_S06`, `*MAT_S08`, `*MAT_121`).

use super::text::{line, nine_digits, title};
use super::{ExportCurve, Exported, NUMBER_OF_STATES, Options, TargetUnloading, run_time_s};
use crate::error::Error;
use crate::unit::UnitSystem;

const TITLE_WIDTH: usize = 80;
/// Maximum number of points to which LS-DYNA resamples a curve.
const MOST_RESAMPLED: usize = 20_000;

/// Intervals of the even points for the smallest one of an uneven curve.
const FINER: f64 = 20.0;

/// Spring materials of LS-DYNA.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Material {
    /// `*MAT_SPRING_INELASTIC`: compression only; unloads with the larger of KU and the steepest
    /// rise.
    #[default]
    S08,
    /// `*MAT_GENERAL_NONLINEAR_1DOF_DISCRETE_BEAM`: unloads with its own stiffness.
    Mat121,
    /// `*MAT_SPRING_GENERAL_NONLINEAR`: unloads along a curve.
    S06,
}

/// Factors from SI to the units of the file.
#[derive(Clone, Copy)]
pub(super) struct InUnits(pub UnitSystem);

impl InUnits {
    /// Those that were asked for, else those of the runs.
    pub(super) fn of(curve: &ExportCurve, options: &Options) -> Self {
        let of_runs = curve.predicted.provenance.study_units;
        Self(options.units.or(of_runs).unwrap_or(UnitSystem::SI))
    }

    pub(super) fn length(self, m: f64) -> String {
        nine_digits(m / self.0.length_m)
    }

    pub(super) fn force(self, n: f64) -> String {
        nine_digits(n / self.0.force())
    }

    pub(super) fn stiffness(self, n_per_m: f64) -> f64 {
        n_per_m * self.0.length_m / self.0.force()
    }

    /// The lines that state the units, for a header.
    pub(super) fn stated(self) -> String {
        format!(
            "units of the points: {} (length {} m, force {} N)",
            self.0,
            nine_digits(self.0.length_m),
            nine_digits(self.0.force())
        )
    }
}

pub(crate) fn write(curves: &[ExportCurve], options: &Options) -> Result<Exported, Error> {
    let mut lines = String::new();
    let mut notes = Vec::new();
    line!(lines, "*KEYWORD");
    for (k, curve) in curves.iter().enumerate() {
        let curve = &curve.begun_at_origin(false, &mut notes)?;
        let units = InUnits::of(curve, options);
        // Of the loading branch and of the material; that of the unloading is one more.
        let id = options.id + 2 * k as u32;
        describe(&mut lines, curve, units, options.material);
        match options.material {
            Material::S08 => inelastic(&mut lines, curve, units, id),
            Material::Mat121 => discrete_beam(&mut lines, curve, units, id),
            Material::S06 => general(&mut lines, curve, units, id),
        }
        notes.extend(note(curve, options.material));
        notes.extend(resampling_note(curve));
        if options.deck {
            write_deck(&mut lines, curve, units, options.material, id);
        }
    }
    line!(lines, "*END");
    Ok(Exported::of_all(curves, "k", lines.into_bytes(), notes))
}

/// The material's restitution compared with ours.
fn note(curve: &ExportCurve, material: Material) -> Vec<String> {
    let own = TargetUnloading::Line(curve.line_stiffness_n_per_m());
    match material {
        Material::S08 => {
            let other = "--material mat121 unloads with its own stiffness";
            curve.steepest_notes("LS-DYNA's S08", other)
        }
        Material::Mat121 => vec![curve.restitution_note("LS-DYNA's MAT_121", own)],
        Material::S06 => vec![curve.restitution_note("LS-DYNA's S06", own)],
    }
}

/// Loss by resampling an unevenly spaced curve in LS-DYNA.
fn resampling_note(curve: &ExportCurve) -> Option<String> {
    let points = points(curve);
    let step_m = curve.loading.end_m() / (MOST_RESAMPLED - 1) as f64;
    (resampling(&points) == MOST_RESAMPLED && smallest_interval(&points) < step_m).then(|| {
        format!(
            "{}: its points are unevenly spaced, so LCINT is {MOST_RESAMPLED}, the largest used: LS-DYNA resamples the curve every {:.3} mm and smooths what is finer",
            curve.headline(),
            step_m * 1e3
        )
    })
}

fn describe(lines: &mut String, curve: &ExportCurve, units: InUnits, material: Material) {
    line!(lines, "$ {}", units.stated());
    // These unload along a line whatever the curve's slopes are.
    let (stiffness_n_per_m, facts, line) = match material {
        Material::S08 => (curve.stiffness_n_per_m(), curve.facts(), Vec::new()),
        Material::Mat121 | Material::S06 => {
            (curve.line_stiffness_n_per_m(), curve.facts_by_elongation(), curve.line_facts())
        }
    };
    line!(
        lines,
        "$ unloading stiffness in these units: {}",
        nine_digits(units.stiffness(stiffness_n_per_m))
    );
    for (key, value) in facts.into_iter().chain(line) {
        line!(lines, "$ {key}: {value}");
    }
}

/// S08 takes the first quadrant and works in compression only (CTF 1).
fn inelastic(lines: &mut String, curve: &ExportCurve, units: InUnits, id: u32) {
    let points = points(curve);
    let text = curve.headline();
    define_curve(lines, (id, &text), &points, units, resampling(&points));
    let ku = ten_columns(units.stiffness(curve.stiffness_n_per_m()));
    let text = title(&text, TITLE_WIDTH);
    line!(lines, "*MAT_SPRING_INELASTIC_TITLE\n{text}");
    line!(lines, "$#     mid      lcfd        ku       ctf");
    line!(lines, "{id:>10}{id:>10}{ku:>10}       1.0");
}

/// MAT_121 takes compression in the third quadrant, unloads with K until the unloading curve,
/// which has no force, and continues without force.
fn discrete_beam(lines: &mut String, curve: &ExportCurve, units: InUnits, id: u32) {
    let points = third_quadrant(&points(curve));
    let text = curve.headline();
    define_curve(lines, (id, &text), &points, units, resampling(&points));
    let reach = points[0].0;
    let nothing = [(reach, 0.0), (0.0, 0.0), (-0.1 * reach, 0.0)];
    define_curve(lines, (id + 1, &format!("{text} unloaded")), &nothing, units, 0);
    // A discrete beam needs its own mass: with VOL 1, a millionth of the body's.
    let density = ten_columns(1e-6 * curve.predicted.mass_kg / units.0.mass_kg);
    let k = ten_columns(units.stiffness(curve.line_stiffness_n_per_m()));
    let (text, unloading) = (title(&text, TITLE_WIDTH), id + 1);
    line!(lines, "*MAT_GENERAL_NONLINEAR_1DOF_DISCRETE_BEAM_TITLE\n{text}");
    line!(lines, "$#     mid        ro         k   unldopt    offset     dampf");
    line!(lines, "{id:>10}{density:>10}{k:>10}       2.0       0.0       0.0");
    line!(lines, "$#   lcidt    lcidtu    lcidtd    lcidte");
    line!(lines, "{id:>10}{unloading:>10}         0         0");
    line!(lines, "$#  utfail    ucfail        iu\n       0.0       0.0       0.0");
}

/// S06 takes compression in the third quadrant. BETA 0: falling forces are followed.
fn general(lines: &mut String, curve: &ExportCurve, units: InUnits, id: u32) {
    let points = third_quadrant(&points(curve));
    let text = curve.headline();
    define_curve(lines, (id, &text), &points, units, resampling(&points));
    let highest = curve.loading.peak_force_n();
    let length = highest / curve.line_stiffness_n_per_m();
    // Of the 100 points to which it is resampled, one lies at the origin.
    let unloading = [(-length, -highest), (0.0, 0.0), (0.5 * length, 0.0)];
    define_curve(lines, (id + 1, &format!("{text} unloading")), &unloading, units, 0);
    let (text, unloading) = (title(&text, TITLE_WIDTH), id + 1);
    line!(lines, "*MAT_SPRING_GENERAL_NONLINEAR_TITLE\n{text}");
    line!(lines, "$#     mid      lcdl      lcdu      beta       tyi       cyi");
    line!(lines, "{id:>10}{id:>10}{unloading:>10}       0.0       0.0       0.0");
}

/// Deflection in m and force in N of each point. They begin at the origin, otherwise LS-DYNA extrapolates the
/// first slope into tension.
fn points(curve: &ExportCurve) -> Vec<(f64, f64)> {
    let force = std::iter::once(0.0).chain(curve.force_n().iter().copied().skip(1));
    curve.deflection_m().iter().copied().zip(force).collect()
}

/// The same in tension's signs, rising, with a point beyond the origin that holds the force at 0. It lies a multiple of the smallest
/// interval away, so that an even curve keeps its points when it is resampled.
fn third_quadrant(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let reach = points[points.len() - 1].0;
    let smallest = smallest_interval(points);
    let pulled = [((0.1 * reach / smallest).ceil() * smallest, 0.0)];
    points.iter().rev().map(|&(d, f)| (-d, -f)).chain(pulled).collect()
}

fn define_curve(
    lines: &mut String,
    (id, text): (u32, &str),
    points: &[(f64, f64)],
    units: InUnits,
    resampling: usize,
) {
    line!(lines, "*DEFINE_CURVE_TITLE\n{}", title(text, TITLE_WIDTH));
    line!(
        lines,
        "$#    lcid      sidr       sfa       sfo      offa      offo    dattyp     lcint"
    );
    line!(
        lines,
        "{id:>10}         0       1.0       1.0       0.0       0.0         0{resampling:>10}"
    );
    line!(lines, "$#                a1                  o1");
    for &(d, f) in points {
        line!(lines, "{:>20}{:>20}", units.length(d), units.force(f));
    }
}

/// Points to which LS-DYNA resamples a curve evenly, 100 by default: a curve with more would
/// lose its peaks. The number that the smallest interval requires keeps every point of an even curve; an uneven one gets
/// [`FINER`] times as many, so that little is cut off beside its points.
fn resampling(points: &[(f64, f64)]) -> usize {
    let (first, smallest) = (points[0].0, smallest_interval(points));
    let reach = points[points.len() - 1].0 - first;
    let is_on_grid = |p: &(f64, f64)| {
        let at = (p.0 - first) / smallest;
        (at - at.round()).abs() < 1e-3
    };
    let finer = if points.iter().all(is_on_grid) { 1.0 } else { FINER };
    let intervals = (finer * reach / smallest - 1e-6).ceil();
    if intervals < 100.0 { 0 } else { (intervals as usize + 1).min(MOST_RESAMPLED) }
}

fn smallest_interval(points: &[(f64, f64)]) -> f64 {
    points.windows(2).map(|w| w[1].0 - w[0].0).fold(f64::INFINITY, f64::min)
}

/// A number in a field of ten columns, with as many digits as fit.
fn ten_columns(value: f64) -> String {
    let text = (0..9).rev().map(|digits| format!("{value:.digits$e}")).find(|t| t.len() <= 9);
    text.unwrap_or_else(|| format!("{value:e}"))
}

/// Everything besides curves and material. The moving body is node 2 at +x and moves towards −x.
pub(crate) fn write_deck(
    lines: &mut String,
    curve: &ExportCurve,
    units: InUnits,
    material: Material,
    material_id: u32,
) {
    let system = units.0;
    // Free length: more than any crush, so that the nodes never pass each other.
    let length = 1.2 * curve.loading.end_m() / system.length_m;
    let end = run_time_s(curve) / system.time_s;
    let text = curve.headline();
    line!(lines, "*TITLE\n{}", title(&format!("{} on {text}", curve.bodies()), TITLE_WIDTH));
    line!(lines, "*CONTROL_TERMINATION\n$#  endtim\n{:>10}", fixed(end));
    line!(lines, "*CONTROL_TIMESTEP\n$#  dtinit    tssfac\n       0.0       0.1");
    // LS-DYNA writes a beam's force to elout, for the elements that are named.
    let (forces, element) = match material {
        Material::S08 | Material::S06 => ("DEFORC", DISCRETE_ELEMENT),
        Material::Mat121 => ("ELOUT", BEAM_ELEMENT),
    };
    for file in ["NODOUT", forces, "GLSTAT"] {
        line!(lines, "*DATABASE_{file}\n{:>10.3e}", end / NUMBER_OF_STATES);
    }
    line!(lines, "*DATABASE_HISTORY_NODE\n         1         2\n*NODE");
    for (node, x) in [(1, "0.0".into()), (2, nine_digits(length))] {
        line!(lines, "{node:>8}{x:>16}             0.0             0.0");
    }
    line!(lines, "*PART\n{}", title(&text, TITLE_WIDTH));
    line!(lines, "$#     pid     secid       mid\n         1         1{material_id:>10}");
    *lines += element;
    masses(lines, curve, units);
    supports(lines, curve, units);
}

/// Section and element of S06 and S08.
const DISCRETE_ELEMENT: &str = "\
*SECTION_DISCRETE
$#   secid       dro        kd        v0        cl        fd
         1         0       0.0       0.0       0.0       0.0
$#     cdl       tdl
       0.0       0.0
*ELEMENT_DISCRETE
$#   eid     pid      n1      n2     vid               s
       1       1       1       2       0             1.0
";

/// Output, section and element of MAT_121: ELFORM 6 is a discrete beam, SCOOR 2 keeps its axis along the nodes.
const BEAM_ELEMENT: &str = "\
*DATABASE_HISTORY_BEAM
         1
*SECTION_BEAM
$#   secid    elform      shrf   qr/irid       cst     scoor
         1         6       1.0         2         0       2.0
$#     vol      iner       cid        ca    offset
       1.0    1.0e-6         0       0.0       0.0
*ELEMENT_BEAM
$#   eid     pid      n1      n2      n3
       1       1       1       2       0
";

fn masses(lines: &mut String, curve: &ExportCurve, units: InUnits) {
    line!(lines, "*ELEMENT_MASS\n$#   eid     nid            mass");
    let masses = [(2, 2, Some(curve.predicted.mass_kg)), (3, 1, curve.other_mass_kg())];
    for (element, node, mass) in masses {
        let Some(mass) = mass else { continue };
        line!(lines, "{element:>8}{node:>8}{:>16}", nine_digits(mass / units.0.mass_kg));
    }
}

/// Speed of the moving body, and the constraints that guide both.
fn supports(lines: &mut String, curve: &ExportCurve, units: InUnits) {
    let speed = fixed(-curve.predicted.speed_m_per_s / units.0.speed());
    line!(lines, "*INITIAL_VELOCITY_NODE\n$#     nid        vx        vy        vz");
    line!(lines, "         2{speed:>10}       0.0       0.0");
    line!(lines, "*BOUNDARY_SPC_NODE");
    line!(
        lines,
        "$#     nid       cid      dofx      dofy      dofz     dofrx     dofry     dofrz"
    );
    let free = usize::from(curve.other_mass_kg().is_none());
    for (node, along) in [(1, free), (2, 0)] {
        line!(
            lines,
            "{node:>10}         0{along:>10}         1         1         1         1         1"
        );
    }
}

/// A number in ten columns, with decimals or an exponent, whichever is nearer to it; it may touch the field before it.
fn fixed(value: f64) -> String {
    let forms = |digits| [format!("{value:.digits$}"), format!("{value:.digits$e}")];
    let off = |text: &String| text.parse::<f64>().map_or(f64::INFINITY, |v| (v - value).abs());
    let fitting = (0..9).rev().flat_map(forms).filter(|text| text.len() <= 10);
    fitting.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or_else(|| format!("{value:e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_curve_keeps_its_points_when_it_is_resampled() {
        let even: Vec<(f64, f64)> = (0..=400).map(|i| (f64::from(i) * 0.003, 1.0)).collect();
        assert_eq!(resampling(&even), 401);
        assert_eq!(resampling(&even[..50]), 0);
        let points = third_quadrant(&even);
        let step = (points[points.len() - 1].0 - points[0].0) / (resampling(&points) - 1) as f64;
        assert!((step / 0.003 - 1.0).abs() < 1e-12, "{step}");
        let mut uneven = even;
        uneven.insert(1, (1e-9, 1.0));
        assert_eq!(resampling(&uneven), MOST_RESAMPLED);
    }

    #[test]
    fn numbers_fit_their_field() {
        for (value, expected) in [
            (-13.888_888_888, "-13.888889"),
            (-8.333_333_333e-7, "-8.3333e-7"),
            (8.0, "8.00000000"),
            (1.234_567_891e12, "1.23457e12"),
        ] {
            assert_eq!(fixed(value), expected);
        }
        for value in [194_123.456_789, 1.0, 1e-12, 1e300, 7.0 / 3.0] {
            let text = ten_columns(value);
            assert!(text.len() < 10, "{text}");
            assert!((text.parse::<f64>().unwrap() / value - 1.0).abs() < 1e-2, "{text}");
        }
    }
}
