//! Curves in the terminal, drawn with Braille characters of 2 by 4 dots.

use crate::unit::Shown;
use std::io::{self, Write};

use super::terminal;

/// Characters across, at most, and down.
const SIZE: (usize, usize) = (70, 13);
/// Fewer characters show no curve.
const LEAST: usize = 20;
/// Bits of a Braille character's dots, by row and column.
const DOTS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// Draws force in N over deflection in m, which increases; the force axis includes 0.
pub(super) fn curve(out: &mut dyn Write, deflection_m: &[f64], force_n: &[f64]) -> io::Result<()> {
    let end_m = deflection_m.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let low = force_n.iter().copied().fold(0.0, f64::min);
    let high = force_n.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let labels = [high, low].map(|force| format!(" {}", Shown::force(high.max(-low)).text(force)));
    let beside = labels.iter().map(String::len).max().unwrap_or(0);
    let room = terminal::width().map_or(SIZE.0, |width| width.saturating_sub(beside));
    let across = room.clamp(LEAST, SIZE.0);
    let (width, height) = (2 * across, 4 * SIZE.1);
    // Row of dots from the top.
    let row = |force: f64| ((high - force) / (high - low) * (height - 1) as f64).round() as usize;
    let column = |d: f64| (d / end_m * (width - 1) as f64).round().max(0.0) as usize;
    let mut cells = vec![vec![0_u32; across]; SIZE.1];
    let mut dot = |x: usize, y: usize| cells[y / 4][x / 2] |= DOTS[y % 4][x % 2];
    let points: Vec<(usize, usize)> =
        deflection_m.iter().zip(force_n).map(|(&d, &f)| (column(d), row(f))).collect();
    for pair in points.windows(2) {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        let steps = x0.abs_diff(x1).max(y0.abs_diff(y1)).max(1);
        let between = |a: usize, b: usize, k: usize| {
            (a as f64 + (b as f64 - a as f64) * k as f64 / steps as f64).round() as usize
        };
        (0..=steps).for_each(|k| dot(between(x0, x1, k), between(y0, y1, k)));
    }
    for (i, line) in cells.iter().enumerate() {
        let label = match i {
            0 => labels[0].as_str(),
            i if i + 1 == SIZE.1 => &labels[1],
            _ => "",
        };
        let braille = line.iter().filter_map(|&bits| char::from_u32(0x2800 + bits));
        writeln!(out, "{}{label}", braille.collect::<String>())?;
    }
    writeln!(out, "0 m{:>1$}", format!("{end_m:.3} m"), across - 3)
}
