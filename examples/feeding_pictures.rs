//! Draws the pictures of docs/feeding: what becomes of a curve in each target, as SVG files.
//!
//!     cargo run --example feeding_pictures docs/feeding
//!
//! Two curves of the bundled lead car are drawn: the one predicted for 50 km/h, and that of the run at
//! 48 km/h, whose first flank is steeper than its unloading. Points of targets are those of the files
//! that `crumple export` writes.

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use crumple::assess::validate::{Choice, train};
use crumple::build::build;
use crumple::curve::{Case, Envelope, ForceKind};
use crumple::formats::{ExportCurve, ExportInput, Options, Tail, by_name};
use crumple::multibody::{EnvelopeEnd, ForceLaw, Unloading};
use crumple::surrogate::predict::predict_beyond;
use crumple::surrogate::{Model, PredictedCurve, Query};

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
    let model = train(GROUP, cases, Choice::Auto { seed: 0, trees: None })?;
    let (curve, beyond) = predict_beyond(&model, &Query::at(PREDICTED_M_PER_S))?;
    let predicted = ExportInput { curve, beyond: None };
    let along_faster_runs = ExportInput { beyond: Some(beyond), ..predicted.clone() };
    let is_recorded = |case: &&Case| (case.speed.m_per_s - RECORDED_M_PER_S).abs() < 0.01;
    let case = cases.iter().find(is_recorded).ok_or("no run at 48 km/h")?;
    let recorded = ExportInput { curve: PredictedCurve::of_case(case)?, beyond: None };
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
fn overview(predicted: &ExportInput, recorded: &ExportInput) -> Anything<String> {
    let body = ready(predicted, ForceKind::Body)?;
    let contact = ready(predicted, ForceKind::Contact)?;
    let one = ready(recorded, ForceKind::Body)?;
    let mut left = Panel::whole("predicted for 50 km/h");
    left.line(0, points(&contact.loading));
    left.line(1, points(&body.loading));
    left.mark("maximal crush", body.max_crush_m());
    let mut right = Panel::around_end(&one, "run at 48 km/h: ways back");
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
    Ok(svg(&legend, &[left, right]))
}

/// MAT_121 and S06 unload with the curve's own stiffness, S08 with the steepest rise.
fn lsdyna(recorded: &ExportInput) -> Anything<String> {
    let curve = ready(recorded, ForceKind::Body)?;
    let own = on_line(&curve, curve.stiffness_n_per_m());
    let steepest = on_line(&curve, curve.loading.max_slope().max(curve.stiffness_n_per_m()));
    let mut left = Panel::whole("run at 48 km/h, body force");
    let mut right = Panel::around_end(&curve, "at the maximal crush");
    for panel in [&mut left, &mut right] {
        panel.line(0, both_ways(&curve));
        panel.line(1, own.clone());
        panel.line(2, steepest.clone());
    }
    left.line(0, points(&curve.loading));
    Ok(svg(&[(0, "crumple"), (1, "MAT_121 and S06"), (2, "S08")], &[left, right]))
}

/// K1 is at least the steepest rise, so the way back is steeper than ours where a flank is.
fn radioss(recorded: &ExportInput) -> Anything<String> {
    let curve = ready(recorded, ForceKind::Body)?;
    let k1 = curve.stiffness_n_per_m().max(curve.loading.max_slope());
    let mut left = Panel::whole("run at 48 km/h, body force");
    left.line(0, both_ways(&curve));
    left.line(1, [loading(&curve), on_line(&curve, k1)].concat());
    let mut right = Panel::around_end(&curve, "its end");
    right.line(0, both_ways(&curve));
    right.line(1, [loading(&curve), on_line(&curve, k1)].concat());
    Ok(svg(&[(0, "crumple"), (1, "Radioss TYPE4, H = 2, unloading with K1")], &[left, right]))
}

/// 200 rows, elastic.
fn calculix(predicted: &ExportInput) -> Anything<String> {
    let rows = rows(&exported(predicted, "calculix", "inp")?, "*SPRING", "*STEP");
    let rows: Points = rows.iter().rev().map(|&(f, d)| (-d, -f)).collect();
    elastic(predicted, "CalculiX, Abaqus", rows)
}

/// Elastic, with guard points.
fn adams(predicted: &ExportInput) -> Anything<String> {
    let rows = rows(&exported(predicted, "adams", "spr")?, "{ disp", "[");
    let rows = rows.iter().map(|&(d, f)| (1e-3 * d, f)).collect();
    elastic(predicted, "Adams, MotionView", rows)
}

/// A target that goes back on the loading branch, with its points at the maximal crush.
fn elastic(input: &ExportInput, name: &str, rows: Points) -> Anything<String> {
    let curve = ready(input, ForceKind::Body)?;
    let mut left = Panel::whole("predicted for 50 km/h, body force");
    left.line(0, points(&curve.loading));
    left.line(1, rows.clone());
    let mut right = Panel::around_end(&curve, "its end; points as in the file");
    right.line(0, both_ways(&curve));
    right.line(1, rows.clone());
    right.dots(1, rows);
    let back = format!("{name}: back along the loading branch");
    Ok(svg(&[(0, "crumple"), (1, &back)], &[left, right]))
}

/// The law itself, and what inputs that are held over a step make of it.
fn fmi(predicted: &ExportInput) -> Anything<String> {
    let curve = ready(predicted, ForceKind::Body)?;
    let law = curve.law();
    let late = held(&law, curve.predicted.mass_kg, RECORDED_M_PER_S, 1e-3);
    let exact = held(&law, curve.predicted.mass_kg, RECORDED_M_PER_S, 1e-5);
    let mut left = Panel::whole("24 t at 48 km/h; curve predicted for 50 km/h");
    left.line(0, points(&curve.loading));
    left.line(1, exact.clone());
    left.line(2, late.clone());
    let reach = largest(&exact);
    let x = [reach - 0.06, reach + 0.04];
    let mut right = Panel::around(x, [0.0, 4.0], 0.02, 1.0, "where the mass turns round");
    right.line(1, exact);
    right.line(2, late);
    let legend = [(0, "the law"), (1, "model exchange"), (2, "co-simulation, input held for 1 ms")];
    Ok(svg(&legend, &[left, right]))
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
fn modelica(predicted: &ExportInput) -> Anything<String> {
    let curve = ready(predicted, ForceKind::Body)?;
    let package = exported(predicted, "modelica", "mo")?;
    let table = Envelope::new(array(&package, "d"), array(&package, "f"))?;
    let unloading = Unloading::Memory { stiffness_n_per_m: curve.stiffness_n_per_m() };
    let law = ForceLaw::new(table.clone(), unloading, EnvelopeEnd::Slope);
    let spring = [points(&table), back(&law, curve.max_crush_m())].concat();
    let combi = rows(&exported(predicted, "modelica", "txt")?, "double fd_load", "double");
    let mut left = Panel::whole("predicted for 50 km/h, body force");
    left.line(0, points(&curve.loading));
    left.line(2, combi.clone());
    let mut right = Panel::around_end(&curve, "at the maximal crush");
    right.line(0, both_ways(&curve));
    right.line(1, spring);
    right.line(2, combi);
    let legend = [(0, "crumple"), (1, "package"), (2, "CombiTable: back along the loading branch")];
    Ok(svg(&legend, &[left, right]))
}

/// `fd_load` in a lookup block, and the points of `fd_unload`.
fn matlab(predicted: &ExportInput) -> Anything<String> {
    let curve = ready(predicted, ForceKind::Body)?;
    let unloading = on_line(&curve, curve.stiffness_n_per_m());
    let mut left = Panel::whole("predicted for 50 km/h, body force");
    left.line(0, both_ways(&curve));
    left.line(1, points(&curve.loading));
    let mut right = Panel::around_end(&curve, "at the maximal crush");
    right.line(0, both_ways(&curve));
    right.line(1, points(&curve.loading));
    right.line(2, unloading.clone());
    right.dots(2, unloading);
    let legend =
        [(0, "crumple"), (1, "1-D Lookup of fd_load: back on it"), (2, "fd_unload, slope k_u")];
    Ok(svg(&legend, &[left, right]))
}

/// The record, beside the straight unloading of a curve's exports.
fn iso_mme(case: &Case, recorded: &ExportInput) -> Anything<String> {
    let curve = ready(recorded, case.force_kind)?;
    let d = case.sampled.deflection_m().iter().copied();
    let record: Points = d.zip(case.sampled.force_n().iter().copied()).collect();
    let mut left = Panel::whole("run at 48 km/h, contact force");
    left.line(0, both_ways(&curve));
    left.line(1, record.clone());
    let mut right = Panel::around_end(&curve, "its end; samples as in the file");
    right.line(0, both_ways(&curve));
    right.line(1, record.clone());
    right.dots(1, record);
    Ok(svg(&[(0, "curve exports"), (1, "ISO-MME: the whole record")], &[left, right]))
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
    let mut panel =
        Panel::wide("body force; the circles are the maximal crushes, behind them the tails");
    let mut legend = Vec::new();
    let names = speeds.map(|kmh| format!("{kmh} km/h"));
    for (k, kmh) in speeds.iter().enumerate() {
        let numbers = |line: &str| line.split(',').filter_map(|n| n.parse().ok()).collect();
        let rows = table.lines().map(numbers).filter(|row: &Vec<f64>| row.len() == 3);
        let of_speed = rows.filter(|row| (row[0] * 3.6 - kmh).abs() < 0.01);
        let row: Points = of_speed.map(|row| (row[1], row[2])).collect();
        let (curve, _) = predict_beyond(model, &Query::at(kmh / 3.6))?;
        let curve = curve.of_force(ForceKind::Body)?;
        let end = curve.max_deflection_m;
        let end_n = curve.force_n[curve.force_n.len() - 1];
        panel.line(k, row);
        panel.dots(k, vec![(end, end_n)]);
        legend.push((k, names[k].as_str()));
    }
    Ok(svg(&legend, &[panel]))
}

/// The points of the CSV file as they stand, and as tools with elongation positive take them.
fn other_tools(predicted: &ExportInput) -> Anything<String> {
    let rows = rows(&exported(predicted, "csv", "csv")?, "d_m", "#");
    let end = rows[rows.len() - 1].0;
    let mut left = Panel::whole("compression positive, as in the file");
    left.line(0, rows.clone());
    let x = [-1.5, 0.15];
    let mut right = Panel::around(x, [-6.0, 0.5], 0.5, 1.0, "elongation positive: (−d, −F)");
    let turned: Points = rows.iter().rev().map(|&(d, f)| (-d, -f)).collect();
    right.line(1, turned);
    right.line(2, vec![(0.0, 0.0), (0.1 * end, 0.0)]);
    right.dots(2, vec![(0.05 * end, 0.0), (0.1 * end, 0.0)]);
    Ok(svg(&[(0, "CSV"), (1, "turned"), (2, "guard points without force")], &[left, right]))
}

// Curves.

/// The curve as the multi-body targets get it.
fn ready(input: &ExportInput, force: ForceKind) -> Anything<ExportCurve> {
    Ok(ExportCurve::new(input, force, Tail::Bottom, false)?)
}

fn points(curve: &Envelope) -> Points {
    curve.deflection_m().iter().copied().zip(curve.force_n().iter().copied()).collect()
}

/// To the maximal crush.
fn loading(curve: &ExportCurve) -> Points {
    points(&curve.loading)[..=curve.end].to_vec()
}

/// From a largest deflection until there is no force.
fn back(law: &ForceLaw, largest_m: f64) -> Points {
    let way = (0..=200).map(|i| largest_m - 0.1 * f64::from(i) / 200.0);
    way.map(|d| (d, law.force_n(d, largest_m))).collect()
}

/// Loading to the maximal crush and unloading from it, in crumple's own runs.
fn both_ways(curve: &ExportCurve) -> Points {
    [loading(curve), back(&curve.law(), curve.max_crush_m())].concat()
}

/// From the maximal crush along a straight line.
fn on_line(curve: &ExportCurve, n_per_m: f64) -> Points {
    let (end_m, end_n) = (curve.max_crush_m(), curve.end_n());
    vec![(end_m, end_n), (end_m - end_n / n_per_m, 0.0)]
}

fn largest(points: &Points) -> f64 {
    points.iter().map(|p| p.0).fold(0.0, f64::max)
}

/// The file that `crumple export` writes of the body's force.
fn exported(input: &ExportInput, format: &str, extension: &str) -> Anything<String> {
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

/// Colour, thickness and dashes of the series: the first lies below the others, so it is broad.
const LOOKS: [(&str, f64, &str); 5] = [
    ("#9ecae1", 5.0, "none"),
    ("#d94801", 2.0, "9 5"),
    ("#238b45", 2.0, "2 3"),
    ("#6a51a3", 2.0, "10 3 2 3"),
    ("#08306b", 1.5, "none"),
];
const WIDTH: f64 = 780.0;
const HEIGHT: f64 = 330.0;
const TOP: f64 = 52.0;
const BOTTOM: f64 = 278.0;

/// Axes with what is drawn between them; deflections in m and forces in MN.
struct Panel {
    title: String,
    left: f64,
    right: f64,
    x: [f64; 2],
    y: [f64; 2],
    ticks: [f64; 2],
    content: String,
}

impl Panel {
    fn new(place: [f64; 2], x: [f64; 2], y: [f64; 2], ticks: [f64; 2], title: &str) -> Self {
        let [left, right] = place;
        Self { title: title.into(), left, right, x, y, ticks, content: String::new() }
    }

    /// On the left, a whole curve.
    fn whole(title: &str) -> Self {
        Self::new([56.0, 420.0], [0.0, 1.5], [0.0, 6.0], [0.5, 1.0], title)
    }

    /// Over the whole width.
    fn wide(title: &str) -> Self {
        Self::new([56.0, 760.0], [0.0, 1.6], [0.0, 5.0], [0.2, 1.0], title)
    }

    /// On the right, a part.
    fn around(x: [f64; 2], y: [f64; 2], tick_m: f64, tick_mn: f64, title: &str) -> Self {
        Self::new([486.0, 760.0], x, y, [tick_m, tick_mn], title)
    }

    /// On the right, where the curve unloads.
    fn around_end(curve: &ExportCurve, title: &str) -> Self {
        let end = curve.max_crush_m();
        let top = (1.25e-6 * curve.end_n()).ceil();
        Self::around([end - 0.06, end + 0.02], [0.0, top], 0.02, 1.0, title)
    }

    fn place(&self, (d, f): (f64, f64)) -> (f64, f64) {
        let share = |v: f64, [low, high]: [f64; 2]| (v - low) / (high - low);
        let x = self.left + (self.right - self.left) * share(d, self.x);
        (x, BOTTOM - (BOTTOM - TOP) * share(1e-6 * f, self.y))
    }

    fn line(&mut self, look: usize, points: Points) {
        let (colour, thickness, dashes) = LOOKS[look];
        // With the points beside those that are seen.
        let is_seen = |p: &(f64, f64)| (self.x[0]..=self.x[1]).contains(&p.0);
        let is_near = |i: usize| points[i.saturating_sub(1)..].iter().take(3).any(is_seen);
        let placed: Points =
            (0..points.len()).filter(|&i| is_near(i)).map(|i| self.place(points[i])).collect();
        let text: Vec<String> =
            thinned(&placed).iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(
            self.content,
            r#"<polyline fill="none" stroke="{colour}" stroke-width="{thickness}" stroke-dasharray="{dashes}" points="{}"/>"#,
            text.join(" ")
        );
    }

    fn dots(&mut self, look: usize, points: Points) {
        for point in points.iter().filter(|p| (self.x[0]..=self.x[1]).contains(&p.0)) {
            let ((x, y), colour) = (self.place(*point), LOOKS[look].0);
            let _ = writeln!(
                self.content,
                r#"<circle cx="{x:.1}" cy="{y:.1}" r="3" fill="white" stroke="{colour}"/>"#
            );
        }
    }

    /// A line upright at a deflection.
    fn mark(&mut self, text: &str, deflection_m: f64) {
        let (x, _) = self.place((deflection_m, 0.0));
        let _ = writeln!(self.content, r##"<path d="M{x:.1} {TOP}V{BOTTOM}" stroke="#888"/>"##);
        let _ = writeln!(
            self.content,
            r#"<text x="{:.1}" y="{}" text-anchor="end">{text}</text>"#,
            x - 6.0,
            TOP + 16.0
        );
    }

    fn draw(&self, number: usize, out: &mut String) {
        let Self { title, left, right, .. } = self;
        let middle = 0.5 * (left + right);
        let _ = writeln!(out, r#"<text x="{left}" y="{}" fill="black">{title}</text>"#, TOP - 8.0);
        let ticks = |range: [f64; 2], tick: f64| {
            let (first, last) = ((range[0] / tick).ceil() as i32, (range[1] / tick).floor() as i32);
            (first..=last).map(move |k| f64::from(k) * tick)
        };
        let number_of = |value: f64, tick: f64| {
            let digits = usize::from(tick < 1.0) + usize::from(tick < 0.1);
            format!("{value:.digits$}")
        };
        for value in ticks(self.y, self.ticks[1]) {
            let (_, y) = self.place((0.0, 1e6 * value));
            let _ = writeln!(out, r##"<path d="M{left} {y:.1}H{right}" stroke="#ddd"/>"##);
            let _ = writeln!(
                out,
                r#"<text x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
                left - 7.0,
                y + 4.0,
                number_of(value, 1.0)
            );
        }
        for value in ticks(self.x, self.ticks[0]) {
            let (x, _) = self.place((value, 0.0));
            let _ = writeln!(
                out,
                r##"<path d="M{x:.1} {BOTTOM}v4" stroke="#666"/><text x="{x:.1}" y="{}" text-anchor="middle">{}</text>"##,
                BOTTOM + 18.0,
                number_of(value, self.ticks[0])
            );
        }
        let _ = writeln!(
            out,
            r#"<text x="{middle}" y="{}" text-anchor="middle">deflection [m]</text>"#,
            BOTTOM + 38.0
        );
        let (x, y) = (left - 36.0, 0.5 * (TOP + BOTTOM));
        let _ = writeln!(
            out,
            r#"<text x="{x}" y="{y}" transform="rotate(-90 {x} {y})" text-anchor="middle">force [MN]</text>"#
        );
        let (wide, high) = (right - left, BOTTOM - TOP);
        let _ = writeln!(
            out,
            r#"<clipPath id="p{number}"><rect x="{left}" y="{TOP}" width="{wide}" height="{high}"/></clipPath>"#
        );
        let _ = writeln!(out, "<g clip-path=\"url(#p{number})\">\n{}</g>", self.content);
    }
}

/// Fewer points through which the line looks the same: within 0.3 pixels (Douglas and Peucker).
fn thinned(points: &Points) -> Points {
    let n = points.len();
    if n < 3 {
        return points.clone();
    }
    let (a, b) = (points[0], points[n - 1]);
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length = dx.hypot(dy);
    let off = |p: &(f64, f64)| match length > 1e-9 {
        true => ((p.0 - a.0) * dy - (p.1 - a.1) * dx).abs() / length,
        false => (p.0 - a.0).hypot(p.1 - a.1),
    };
    let (mut worst, mut at) = (0.0, 0);
    for (i, point) in points.iter().enumerate().take(n - 1).skip(1) {
        if off(point) > worst {
            (worst, at) = (off(point), i);
        }
    }
    if worst < 0.3 {
        return vec![a, b];
    }
    let mut kept = thinned(&points[..=at].to_vec());
    kept.pop();
    kept.extend(thinned(&points[at..].to_vec()));
    kept
}

fn svg(legend: &[(usize, &str)], panels: &[Panel]) -> String {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
    );
    let mut x = 56.0;
    for (look, text) in legend {
        let (colour, thickness, dashes) = LOOKS[*look];
        let _ = writeln!(
            out,
            r#"<path d="M{x} 18h36" stroke="{colour}" stroke-width="{thickness}" stroke-dasharray="{dashes}"/><text x="{}" y="22">{text}</text>"#,
            x + 42.0
        );
        x += 62.0 + 7.2 * text.chars().count() as f64;
    }
    for (number, panel) in panels.iter().enumerate() {
        panel.draw(number, &mut out);
    }
    out + "</svg>\n"
}
