//! Draws the speeds of three vehicles in a train crash: FE's run of the whole train, and the
//! multi-body run with the curves of the best models, as SVG on standard output.
//!
//!     cargo run --example train_set > examples/train_set.svg

use std::error::Error;
use std::fs;
use std::path::Path;

use crumple::assess::ComparisonSettings;
use crumple::assess::train::compare_train;
use crumple::build::build;
use crumple::scenario;

/// Left, top, width and height of the plot area, in pixels.
const AREA: [f64; 4] = [60.0, 20.0, 700.0, 320.0];
/// What the area spans.
const END_S: f64 = 0.135;
const LOW_M_PER_S: f64 = -1.0;
const HIGH_M_PER_S: f64 = 5.5;
const COLOURS: [&str; 3] = ["#084594", "#d94801", "#238b45"];
/// Methods that are drawn, with their dashes.
const METHODS: [(&str, &str); 3] =
    [("fdrm", "2 3"), ("best_train", "8 4"), ("best_local", "12 3 2 3")];

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir()?;
    for group in ["lead-car-wall", "vehicle-pair"] {
        let study = root.join("fixtures/fe").join(group).join("study.toml");
        build(&study, &folder.path().join("curves.h5"), |_| {})?;
    }
    let fe = folder.path().join("fe/train-set/36kmh");
    fs::create_dir_all(&fe)?;
    fs::copy(root.join("fixtures/train-set/36kmh/nodout"), fe.join("nodout"))?;
    let path = folder.path().join("train-set.toml");
    fs::copy(root.join("examples/trains/train-set.toml"), &path)?;
    let settings = ComparisonSettings { nsdm_seeds: 0, ..ComparisonSettings::default() };
    let scenario = scenario::read(&path)?;
    let comparison = compare_train(&path, &scenario, &settings)?;

    let [left, top, width, height] = AREA;
    println!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 780 400" font-family="sans-serif" font-size="13">"#
    );
    println!(r#"<rect width="780" height="400" fill="white"/>"#);
    for speed in -1..=5 {
        let y = top + height * share(f64::from(speed));
        println!(r##"<path d="M{left} {y:.1}H{}" stroke="#ddd"/>"##, left + width);
        println!(r#"<text x="{}" y="{:.1}" text-anchor="end">{speed}</text>"#, left - 8.0, y + 4.0);
    }
    for tick in 0..=4 {
        let x = left + width * 0.03 * f64::from(tick) / END_S;
        let y = top + height + 18.0;
        println!(r#"<text x="{x:.1}" y="{y}" text-anchor="middle">{}</text>"#, 30 * tick);
    }
    println!(r#"<text x="410" y="385" text-anchor="middle">time [ms]</text>"#);
    println!(
        r#"<text x="16" y="180" transform="rotate(-90 16 180)" text-anchor="middle">speed [m/s]</text>"#
    );
    for (k, (vehicle, speeds)) in comparison.fe.iter().enumerate() {
        line(&comparison.time_s, speeds, COLOURS[k], 2.5, "none");
        for (method, dashes) in METHODS {
            for row in comparison.rows.iter().filter(|row| row.method == method) {
                line(&comparison.time_s, &row.velocities[vehicle], COLOURS[k], 1.3, dashes);
            }
        }
        println!(r#"<text x="90" y="{}" fill="{}">{vehicle}</text>"#, 250 + 18 * k, COLOURS[k]);
    }
    legend(0, "none", "FE");
    for (k, (method, dashes)) in METHODS.into_iter().enumerate() {
        legend(k + 1, dashes, method);
    }
    println!("</svg>");
    Ok(())
}

/// Place of a speed from the top of the area, 0 to 1.
fn share(m_per_s: f64) -> f64 {
    ((HIGH_M_PER_S - m_per_s) / (HIGH_M_PER_S - LOW_M_PER_S)).clamp(0.0, 1.0)
}

fn line(time_s: &[f64], speeds: &[f64], colour: &str, thickness: f64, dashes: &str) {
    let [left, top, width, height] = AREA;
    let points: Vec<String> = time_s
        .iter()
        .zip(speeds)
        .map(|(t, v)| format!("{:.1},{:.1}", left + width * t / END_S, top + height * share(*v)))
        .collect();
    println!(
        r#"<polyline fill="none" stroke="{colour}" stroke-width="{thickness}" stroke-dasharray="{dashes}" points="{}"/>"#,
        points.join(" ")
    );
}

fn legend(row: usize, dashes: &str, text: &str) {
    let y = 250 + 20 * row;
    println!(
        r##"<path d="M130 {y}h44" stroke="#333" stroke-width="2" stroke-dasharray="{dashes}"/>"##
    );
    println!(r#"<text x="182" y="{}">{text}</text>"#, y + 5);
}
