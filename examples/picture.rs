//! Draws the picture of the README: the FE curves of the bundled runs, and the predicted
//! curve with its band at a speed between them, as SVG on standard output.
//!
//!     cargo run --example picture > examples/picture.svg

use std::error::Error;
use std::path::Path;

use crumple::assess::validate::{Choice, train};
use crumple::build::build;
use crumple::dataset::TrainingSet;
use crumple::surrogate::{Query, predict};
use crumple::unit::km_per_h;

const GROUP: &str = "lead-car-wall";
const SPEED_M_PER_S: f64 = 50.0 / 3.6;
/// Left, top, width and height of the plot area, in pixels.
const AREA: [f64; 4] = [60.0, 20.0, 700.0, 320.0];
/// What the area spans.
const END_M: f64 = 2.2;
const END_MN: f64 = 5.0;
const COLOURS: [&str; 7] =
    ["#c6dbef", "#9ecae1", "#6baed6", "#4292c6", "#2171b5", "#08519c", "#08306b"];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/fe").join(GROUP);
    let report = build(&study.join("study.toml"), &folder.path().join("curves.h5"), |_| {})?;
    let cases = report.database.cases(GROUP);
    let set = TrainingSet::new(GROUP, cases)?;
    let model = train(GROUP, cases, Choice::Auto { seed: 0, trees: None })?;
    let curve = predict(&model, &Query::at(SPEED_M_PER_S))?;

    let [left, top, width, height] = AREA;
    let (right, bottom) = (left + width, top + height);
    println!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 780 400" font-family="sans-serif" font-size="13">"#
    );
    println!(r#"<rect width="780" height="400" fill="white"/>"#);
    for tick in 0..=5 {
        let y = bottom - height * f64::from(tick) / END_MN;
        println!(r##"<path d="M{left} {y:.1}H{right}" stroke="#ddd"/>"##);
        println!(r#"<text x="{}" y="{:.1}" text-anchor="end">{tick}</text>"#, left - 8.0, y + 4.0);
    }
    for tick in 0..=4 {
        let d = 0.5 * f64::from(tick);
        let x = left + width * d / END_M;
        println!(r#"<text x="{x:.1}" y="{}" text-anchor="middle">{d}</text>"#, bottom + 18.0);
    }
    println!(r#"<text x="410" y="385" text-anchor="middle">deflection [m]</text>"#);
    println!(
        r#"<text x="16" y="180" transform="rotate(-90 16 180)" text-anchor="middle">force [MN]</text>"#
    );
    if let (Some(low), Some(high)) = (&curve.force_low_n, &curve.force_high_n) {
        let there = curve.deflection_m.iter().zip(high);
        let back = curve.deflection_m.iter().zip(low).rev();
        let outline: Vec<String> = there.chain(back).map(|(&d, &f)| point(d, f)).collect();
        println!(r##"<path d="M{}Z" fill="#d94801" fill-opacity="0.15"/>"##, outline.join("L"));
    }
    for (k, case) in set.cases.iter().enumerate() {
        let envelope = &case.envelope;
        line(envelope.deflection_m(), envelope.force_n(), COLOURS[k % COLOURS.len()], 1.5);
        legend(k, COLOURS[k % COLOURS.len()], &format!("FE at {}", km_per_h(case.speed_m_per_s)));
    }
    line(&curve.deflection_m, &curve.force_n, "#d94801", 2.5);
    legend(set.cases.len(), "#d94801", &format!("{} at {}", curve.model, km_per_h(SPEED_M_PER_S)));
    println!("</svg>");
    Ok(())
}

/// Place of a point of a curve in the picture.
fn point(deflection_m: f64, force_n: f64) -> String {
    let [left, top, width, height] = AREA;
    let x = left + width * deflection_m / END_M;
    let y = top + height * (1.0 - force_n / 1e6 / END_MN).max(0.0);
    format!("{x:.1},{y:.1}")
}

fn line(deflection_m: &[f64], force_n: &[f64], colour: &str, thickness: f64) {
    let points: Vec<String> =
        deflection_m.iter().zip(force_n).map(|(&d, &f)| point(d, f)).collect();
    println!(
        r#"<polyline fill="none" stroke="{colour}" stroke-width="{thickness}" points="{}"/>"#,
        points.join(" ")
    );
}

fn legend(row: usize, colour: &str, text: &str) {
    let y = 36 + 20 * row;
    println!(r#"<path d="M610 {y}h24" stroke="{colour}" stroke-width="3"/>"#);
    println!(r#"<text x="642" y="{}">{text}</text>"#, y + 5);
}
