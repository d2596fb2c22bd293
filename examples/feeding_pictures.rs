//! Draws the pictures of docs/feeding: what becomes of a curve in each target, as SVG files.
//!
//!     cargo run --example feeding_pictures docs/feeding
//!
//! Two curves of the bundled lead car are drawn: the one predicted for 50 km/h, and that of the run at
//! 48 km/h, whose first rise is steeper than its unloading. Points of targets are those of the files
//! that `crumple export` writes.

use std::error::Error;
use std::fs;
use std::path::Path;

use crumple::assess::Purpose;
use crumple::assess::{Choice, train};
use crumple::build::build;
use crumple::curve::{Case, Envelope, ForceKind, Tail};
use crumple::formats::{ExportCurve, Options, by_name};
use crumple::multibody::{EnvelopeEnd, ForceLaw, Unloading};
use crumple::plot::{Axis, Chart, Mark, Panel, Series, Shown};
use crumple::surrogate::{Model, PredictedCurve, Query, predict};

type Points = Vec<(f64, f64)>;
type Anything<T> = Result<T, Box<dyn Error>>;

const GROUP: &str = "lead-car-wall";
const PREDICTED_M_PER_S: f64 = 50.0 / 3.6;
const RECORDED_M_PER_S: f64 = 48.0 / 3.6;

fn main() -> Anything<()> {
    let to = std::env::args().nth(1).unwrap_or_else(|| "docs/feeding".into());
    let folder = tempfile::tempdir()?;
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe").join(GROUP);
    let report = build(&study.join("study.toml"), &folder.path().join("curves.h5"), |_| {})?;
    let cases = report.database.cases(GROUP);
    let model =
        train(GROUP, cases, Choice::Auto { purpose: Purpose::Vehicle, seed: 0, trees: None })?;
    let along_faster_runs = predict(&model, &Query::at(PREDICTED_M_PER_S))?;
    let predicted = PredictedCurve { beyond: None, ..along_faster_runs.clone() };
    let is_recorded =
        |case: &&Case| (case.conditions.speed.m_per_s - RECORDED_M_PER_S).abs() < 0.01;
    let case = cases.iter().find(is_recorded).ok_or("no run at 48 km/h")?;
    let recorded = PredictedCurve::of_case(case)?;
    for (name, picture) in [
        ("overview", overview(&along_faster_runs, &recorded)?),
        ("lsdyna", lsdyna(&recorded)?),
        ("radioss", radioss(&recorded)?),
        ("calculix", calculix(&predicted)?),
        ("adams", adams(&predicted)?),
        ("fmi", fmi(&predicted)?),
        ("modelica", modelica(&predicted)?),
        ("matlab", matlab(&predicted)?),
        ("iso-mme", iso_mme(case, &recorded)?),
        ("two-variables", two_variables(&model)?),
        ("other-tools", other_tools(&predicted)?),
    ] {
        fs::write(Path::new(&to).join(format!("{name}.svg")), picture)?;
    }
    Ok(())
}

/// Both forces with their tails; and the three ways in which targets unload.
fn overview(predicted: &PredictedCurve, recorded: &PredictedCurve) -> Anything<String> {
    let body = ready(predicted, ForceKind::Body)?;
    let contact = ready(predicted, ForceKind::Contact)?;
    let one = ready(recorded, ForceKind::Body)?;
    let mut left = Sheet::whole("predicted for 50 km/h");
    left.line(0, points(&contact.loading));
    left.line(1, points(&body.loading));
    left.mark("maximum crush", body.max_crush_m());
    let mut right = Sheet::around_end(&one, "run at 48 km/h: ways back");
    right.line(2, on_line(&one, one.stiffness_n_per_m()));
    right.line(3, on_line(&one, one.loading.max_slope()));
    right.line(4, loading(&one));
    let legend = [
        (0, "contact force"),
        (1, "body force"),
        (2, "own stiffness"),
        (3, "steepest rise"),
        (4, "elastic"),
    ];
    Ok(svg(&legend, vec![left, right]))
}

/// MAT_121 and S06 unload with the curve's own stiffness, S08 with the steepest rise.
fn lsdyna(recorded: &PredictedCurve) -> Anything<String> {
    let curve = ready(recorded, ForceKind::Body)?;
    let own = on_line(&curve, curve.stiffness_n_per_m());
    let steepest = on_line(&curve, curve.loading.max_slope().max(curve.stiffness_n_per_m()));
    let mut left = Sheet::whole("run at 48 km/h, body force");
    let mut right = Sheet::around_end(&curve, "at the maximum crush");
    for panel in [&mut left, &mut right] {
        panel.line(0, both_ways(&curve));
        panel.line(1, own.clone());
        panel.line(2, steepest.clone());
    }
    left.line(0, points(&curve.loading));
    Ok(svg(&[(0, "crumple"), (1, "MAT_121 and S06"), (2, "S08")], vec![left, right]))
}

/// K1 is at least the steepest rise, so the way back is steeper than ours where a rise is.
fn radioss(recorded: &PredictedCurve) -> Anything<String> {
    let curve = ready(recorded, ForceKind::Body)?;
    let k1 = curve.stiffness_n_per_m().max(curve.loading.max_slope());
    let mut left = Sheet::whole("run at 48 km/h, body force");
    left.line(0, both_ways(&curve));
    left.line(1, [loading(&curve), on_line(&curve, k1)].concat());
    let mut right = Sheet::around_end(&curve, "its end");
    right.line(0, both_ways(&curve));
    right.line(1, [loading(&curve), on_line(&curve, k1)].concat());
    Ok(svg(&[(0, "crumple"), (1, "Radioss TYPE4, H = 2, unloading with K1")], vec![left, right]))
}

/// 200 rows, elastic.
fn calculix(predicted: &PredictedCurve) -> Anything<String> {
    let rows = rows(&exported(predicted, "calculix", "inp")?, "*SPRING", "*STEP");
    let rows: Points = rows.iter().rev().map(|&(f, d)| (-d, -f)).collect();
    elastic(predicted, "CalculiX, Abaqus", rows)
}

/// Elastic, with guard points.
fn adams(predicted: &PredictedCurve) -> Anything<String> {
    let rows = rows(&exported(predicted, "adams", "spr")?, "{ disp", "[");
    let rows = rows.iter().map(|&(d, f)| (1e-3 * d, f)).collect();
    elastic(predicted, "Adams, MotionView", rows)
}

/// A target that goes back on the loading branch, with its points at the maximum crush.
fn elastic(input: &PredictedCurve, name: &str, rows: Points) -> Anything<String> {
    let curve = ready(input, ForceKind::Body)?;
    let mut left = Sheet::whole("predicted for 50 km/h, body force");
    left.line(0, points(&curve.loading));
    left.line(1, rows.clone());
    let mut right = Sheet::around_end(&curve, "its end; points as in the file");
    right.line(0, both_ways(&curve));
    right.line(1, rows.clone());
    right.dots(1, rows);
    let back = format!("{name}: back along the loading branch");
    Ok(svg(&[(0, "crumple"), (1, &back)], vec![left, right]))
}

/// The law itself, and what inputs that are held over a step make of it.
fn fmi(predicted: &PredictedCurve) -> Anything<String> {
    let curve = ready(predicted, ForceKind::Body)?;
    let law = curve.law();
    let late = held(&law, curve.predicted.mass_kg, RECORDED_M_PER_S, 1e-3);
    let exact = held(&law, curve.predicted.mass_kg, RECORDED_M_PER_S, 1e-5);
    let mut left = Sheet::whole("24 t at 48 km/h");
    left.line(0, points(&curve.loading));
    left.line(1, exact.clone());
    left.line(2, late.clone());
    let reach = largest(&exact);
    let x = [reach - 0.06, reach + 0.04];
    let mut right = Sheet::around(x, [0.0, 4.0], "where the mass turns round");
    right.line(1, exact);
    right.line(2, late);
    let legend = [(0, "the law"), (1, "model exchange"), (2, "co-simulation, input held for 1 ms")];
    Ok(svg(&legend, vec![left, right]))
}

/// Force on a mass and where it is, while the spring gets its place at the step's begin and the mass
/// the force that is there then.
fn held(law: &ForceLaw, mass_kg: f64, speed_m_per_s: f64, step_s: f64) -> Points {
    let (mut x, mut v, mut largest, mut force) = (0.0_f64, speed_m_per_s, 0.0_f64, 0.0);
    let mut seen = vec![(x, force)];
    while v > 0.0 || force > 0.0 {
        largest = largest.max(x);
        let new = law.force_n(x, largest);
        x += step_s * v - 0.5 * step_s * step_s * force / mass_kg;
        v -= step_s * force / mass_kg;
        force = new;
        seen.push((x, force));
    }
    seen
}

/// The package has the memory, a table has none.
fn modelica(predicted: &PredictedCurve) -> Anything<String> {
    let curve = ready(predicted, ForceKind::Body)?;
    let package = exported(predicted, "modelica", "mo")?;
    let table = Envelope::new(array(&package, "d"), array(&package, "f"))?;
    let unloading = Unloading::Memory { stiffness_n_per_m: curve.stiffness_n_per_m() };
    let law = ForceLaw::new(table.clone(), unloading, EnvelopeEnd::Slope);
    let spring = [points(&table), back(&law, curve.max_crush_m())].concat();
    let combi = rows(&exported(predicted, "modelica", "txt")?, "double fd_load", "double");
    let mut left = Sheet::whole("predicted for 50 km/h, body force");
    left.line(0, points(&curve.loading));
    left.line(2, combi.clone());
    let mut right = Sheet::around_end(&curve, "at the maximum crush");
    right.line(0, both_ways(&curve));
    right.line(1, spring);
    right.line(2, combi);
    let legend = [(0, "crumple"), (1, "package"), (2, "CombiTable: back along the loading branch")];
    Ok(svg(&legend, vec![left, right]))
}

/// `fd_load` in a lookup block, and the points of `fd_unload`.
fn matlab(predicted: &PredictedCurve) -> Anything<String> {
    let curve = ready(predicted, ForceKind::Body)?;
    let unloading = on_line(&curve, curve.stiffness_n_per_m());
    let mut left = Sheet::whole("predicted for 50 km/h, body force");
    left.line(0, both_ways(&curve));
    left.line(1, points(&curve.loading));
    let mut right = Sheet::around_end(&curve, "at the maximum crush");
    right.line(0, both_ways(&curve));
    right.line(1, points(&curve.loading));
    right.line(2, unloading.clone());
    right.dots(2, unloading);
    let legend =
        [(0, "crumple"), (1, "1-D Lookup of fd_load: back on it"), (2, "fd_unload, slope k_u")];
    Ok(svg(&legend, vec![left, right]))
}

/// The record, beside the straight unloading of a curve's exports.
fn iso_mme(case: &Case, recorded: &PredictedCurve) -> Anything<String> {
    let curve = ready(recorded, case.curves.force_kind)?;
    let d = case.curves.sampled.deflection_m().iter().copied();
    let record: Points = d.zip(case.curves.sampled.force_n().iter().copied()).collect();
    let mut left = Sheet::whole("run at 48 km/h, contact force");
    left.line(0, both_ways(&curve));
    left.line(1, record.clone());
    let mut right = Sheet::around_end(&curve, "its end; samples as in the file");
    right.line(0, both_ways(&curve));
    right.line(1, record.clone());
    right.dots(1, record);
    Ok(svg(&[(0, "curve exports"), (1, "ISO-MME: the whole record")], vec![left, right]))
}

/// Rows of the table at some speeds, held beyond their own crush.
fn two_variables(model: &Model) -> Anything<String> {
    let speeds = [25.0, 36.0, 50.0, 60.0];
    let options = Options {
        extension: Some("csv".into()),
        speeds_m_per_s: speeds.map(|kmh| kmh / 3.6).to_vec(),
        ..Options::default()
    };
    let table = text(by_name("table")?.export_model(model, &options)?)?;
    let mut panel = Sheet::wide("body force; behind the maximum crush, which is marked, the tail");
    let mut legend = Vec::new();
    let names = speeds.map(|kmh| format!("{kmh} km/h"));
    for (k, kmh) in speeds.iter().enumerate() {
        let numbers = |line: &str| line.split(',').filter_map(|n| n.parse().ok()).collect();
        let rows = table.lines().map(numbers).filter(|row: &Vec<f64>| row.len() >= 3);
        let of_speed = rows.filter(|row| (row[0] * 3.6 - kmh).abs() < 0.01);
        let row: Points = of_speed.map(|row| (row[1], row[2])).collect();
        let curve = predict(model, &Query::at(kmh / 3.6))?;
        let curve = curve.of_force(ForceKind::Body)?;
        let end = curve.max_deflection_m;
        let end_n = curve.force_n[curve.force_n.len() - 1];
        panel.line(k, row);
        panel.dots(k, vec![(end, end_n)]);
        legend.push((k, names[k].as_str()));
    }
    Ok(svg(&legend, vec![panel]))
}

/// The points of the CSV file as they stand, and as tools with elongation positive take them.
fn other_tools(predicted: &PredictedCurve) -> Anything<String> {
    let csv = exported(predicted, "csv", "csv")?;
    // Deflection and force, without the edges of the band.
    let pair = |line: &str| line.split(',').take(2).collect::<Vec<_>>().join(",");
    let pairs: Vec<String> = csv.lines().map(pair).collect();
    let rows = rows(&pairs.join("\n"), "d_m", "#");
    let end = rows[rows.len() - 1].0;
    let mut left = Sheet::whole("compression positive, as in the file");
    left.line(0, rows.clone());
    let x = [-1.5, 0.15];
    let mut right = Sheet::around(x, [-6.0, 0.5], "elongation positive: (−d, −F)");
    let turned: Points = rows.iter().rev().map(|&(d, f)| (-d, -f)).collect();
    right.line(1, turned);
    right.line(2, vec![(0.0, 0.0), (0.1 * end, 0.0)]);
    right.dots(2, vec![(0.05 * end, 0.0), (0.1 * end, 0.0)]);
    Ok(svg(&[(0, "CSV"), (1, "turned"), (2, "guard points without force")], vec![left, right]))
}

// Curves.

/// The curve as the multi-body targets get it.
fn ready(input: &PredictedCurve, force: ForceKind) -> Anything<ExportCurve> {
    Ok(ExportCurve::new(input, force, Tail::Bottom, false)?)
}

fn points(curve: &Envelope) -> Points {
    curve.deflection_m().iter().copied().zip(curve.force_n().iter().copied()).collect()
}

/// To the maximum crush.
fn loading(curve: &ExportCurve) -> Points {
    points(&curve.loading)[..=curve.end].to_vec()
}

/// From a maximum deflection until there is no force.
fn back(law: &ForceLaw, largest_m: f64) -> Points {
    let way = (0..=200).map(|i| largest_m - 0.1 * f64::from(i) / 200.0);
    way.map(|d| (d, law.force_n(d, largest_m))).collect()
}

/// Loading to the maximum crush and unloading from it, in crumple's own runs.
fn both_ways(curve: &ExportCurve) -> Points {
    [loading(curve), back(&curve.law(), curve.max_crush_m())].concat()
}

/// From the maximum crush along a straight line.
fn on_line(curve: &ExportCurve, n_per_m: f64) -> Points {
    let (end_m, end_n) = (curve.max_crush_m(), curve.end_n());
    vec![(end_m, end_n), (end_m - end_n / n_per_m, 0.0)]
}

fn largest(points: &Points) -> f64 {
    points.iter().map(|p| p.0).fold(0.0, f64::max)
}

/// The file that `crumple export` writes of the body force.
fn exported(input: &PredictedCurve, format: &str, extension: &str) -> Anything<String> {
    let options = Options { extension: Some(extension.into()), ..Options::default() };
    text(by_name(format)?.export(std::slice::from_ref(input), &options)?)
}

fn text(exported: crumple::formats::Exported) -> Anything<String> {
    let (_, bytes) = exported.files.into_iter().next().ok_or("no file")?;
    Ok(String::from_utf8(bytes)?)
}

/// The pairs of numbers between two lines that begin so.
fn rows(text: &str, start: &str, stop: &str) -> Points {
    let lines = text.lines().skip_while(|l| !l.starts_with(start)).skip(1);
    let pair = |line: &str| {
        let numbers: Vec<f64> =
            line.split([',', ' ']).filter_map(|n| n.trim().parse().ok()).collect();
        (numbers.len() == 2).then(|| (numbers[0], numbers[1]))
    };
    lines.take_while(|l| !l.starts_with(stop)).filter_map(pair).collect()
}

/// The numbers of a Modelica array.
fn array(text: &str, name: &str) -> Vec<f64> {
    let behind = text.split(&format!("Real {name}[")).nth(1).unwrap_or_default();
    let inside = behind.split(['{', '}']).nth(1).unwrap_or_default();
    inside.split(',').filter_map(|n| n.trim().parse().ok()).collect()
}

// Drawing.

/// Axes with what is drawn between them; deflections in m and forces in N.
struct Sheet(Panel);

impl Sheet {
    fn around(x: [f64; 2], y_mn: [f64; 2], title: &str) -> Self {
        let deflection = Axis::new("deflection", "m", 1.0).over(x[0], x[1]);
        let force = Axis::new("force", "MN", 1e-6).over(1e6 * y_mn[0], 1e6 * y_mn[1]);
        Self(Panel { title: title.into(), ..Panel::new(deflection, force) })
    }

    /// A whole curve.
    fn whole(title: &str) -> Self {
        Self::around([0.0, 1.5], [0.0, 6.0], title)
    }

    /// A curve over the whole width.
    fn wide(title: &str) -> Self {
        Self::around([0.0, 1.6], [0.0, 5.0], title)
    }

    /// Where a curve unloads.
    fn around_end(curve: &ExportCurve, title: &str) -> Self {
        let end = curve.max_crush_m();
        Self::around([end - 0.06, end + 0.02], [0.0, (1.25e-6 * curve.end_n()).ceil()], title)
    }

    /// The first look lies below the others, so it is broad.
    fn line(&mut self, look: usize, points: Points) {
        let (x, y) = points.into_iter().unzip();
        let series = Series::line("", look, x, y);
        let is_broad = look == 0;
        self.0.series.push(if is_broad { series.shown(Shown::Emphasis) } else { series });
    }

    fn dots(&mut self, look: usize, points: Points) {
        let (x, y) = points.into_iter().unzip();
        self.0.series.push(Series::line("", look, x, y).shown(Shown::Points));
    }

    /// A line upright at a deflection.
    fn mark(&mut self, text: &str, deflection_m: f64) {
        self.0.marks.push(Mark { name: text.into(), x: deflection_m });
    }
}

/// The sheets side by side; lines of a look have its name in the legend.
fn svg(legend: &[(usize, &str)], sheets: Vec<Sheet>) -> String {
    let mut panels: Vec<Panel> = sheets.into_iter().map(|sheet| sheet.0).collect();
    for series in panels.iter_mut().flat_map(|panel| &mut panel.series) {
        if let (Some((_, name)), Shown::Line | Shown::Emphasis) =
            (legend.iter().find(|(look, _)| *look == series.look), series.shown)
        {
            series.name = (*name).into();
        }
    }
    Chart { height: 226.0, ..Chart::row("", panels) }.drawing().svg()
}
