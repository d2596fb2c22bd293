//! Curves in the terminal.

use std::io::{self, Write};

use textplots::{Chart, Plot, Shape};

/// Draws force (N, shown in MN) over deflection (m).
pub fn curve(out: &mut dyn Write, deflection_m: &[f64], force_n: &[f64]) -> io::Result<()> {
    let points: Vec<(f32, f32)> =
        deflection_m.iter().zip(force_n).map(|(&d, &f)| (d as f32, (f / 1e6) as f32)).collect();
    let end = points.iter().map(|p| p.0).fold(f32::MIN_POSITIVE, f32::max);
    let mut chart = Chart::new(140, 50, 0.0, end);
    let lines = Shape::Lines(&points);
    let chart = chart.lineplot(&lines);
    chart.axis();
    chart.figures();
    write!(out, "{chart}")
}
