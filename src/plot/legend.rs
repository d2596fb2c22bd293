//! The legend below the axes: one entry for each name and look, in columns.

use super::chart::{Chart, Shown};
use super::drawing::{Paint, Shape, Shows, Stroke, Text};
use super::{font, look};

/// Width of the sample beside a name, in pixels.
const SAMPLE: f64 = 34.0;
const GAP: f64 = 7.0;
const COLUMN_GAP: f64 = 20.0;
const ROW: f64 = 19.0;
pub(super) const SIZE: f64 = 13.0;
pub(super) const BAND: f64 = 0.22;

#[derive(PartialEq)]
struct Entry<'a> {
    name: &'a str,
    look: usize,
    /// `None` for a band.
    shown: Option<Shown>,
}

fn entries(chart: &Chart) -> Vec<Entry<'_>> {
    let mut entries: Vec<Entry> = Vec::new();
    for panel in &chart.panels {
        let series = panel.series.iter().map(|s| Entry {
            name: &s.name,
            look: s.look,
            shown: Some(s.shown),
        });
        let bands = panel.bands.iter().map(|b| Entry { name: &b.name, look: b.look, shown: None });
        for entry in series.chain(bands) {
            if !entry.name.is_empty() && !entries.contains(&entry) {
                entries.push(entry);
            }
        }
    }
    entries
}

/// The legend's shapes from a height downwards, and the height where it ends.
pub(super) fn draw(chart: &Chart, left: f64, top: f64) -> (Vec<Shape>, f64) {
    let entries = entries(chart);
    let room = chart.width - left - super::layout::MARGIN;
    let most = (room - SAMPLE - GAP).max(1.0);
    let names: Vec<String> = entries.iter().map(|e| font::fitted(e.name, SIZE, most)).collect();
    let (rows, lefts) = columns(&names, room);
    let mut shapes = Vec::new();
    for (k, (entry, name)) in entries.iter().zip(names).enumerate() {
        let (x, y) = (left + lefts[k / rows], top + ROW * ((k % rows) as f64 + 0.5));
        shapes.extend(sample(entry, x, y));
        shapes.push(Shape::Text(Text {
            text: name,
            x: x + SAMPLE + GAP,
            y: y + 0.35 * SIZE,
            size: SIZE,
            is_upright: false,
            paint: Paint::Ink,
            shows: Some(Shows::Legend),
        }));
    }
    (shapes, top + ROW * rows as f64)
}

/// How many rows the names need, and where the columns begin: as many columns as the room takes.
fn columns(names: &[String], room: f64) -> (usize, Vec<f64>) {
    let width = |name: &String| SAMPLE + GAP + font::width(name, SIZE) + COLUMN_GAP;
    for rows in 1..=names.len() {
        let mut lefts = vec![0.0];
        for column in names.chunks(rows) {
            let widest = column.iter().map(width).fold(0.0, f64::max);
            lefts.push(lefts[lefts.len() - 1] + widest);
        }
        if lefts[lefts.len() - 1] <= room + COLUMN_GAP {
            return (rows, lefts);
        }
    }
    (names.len().max(1), vec![0.0; 2])
}

/// A short piece of what the entry names.
fn sample(entry: &Entry, x: f64, y: f64) -> Vec<Shape> {
    let shows = Some(Shows::Legend);
    let Some(shown) = entry.shown else {
        let corners =
            vec![(x, y - 6.0), (x + SAMPLE, y - 6.0), (x + SAMPLE, y + 6.0), (x, y + 6.0)];
        let fill = Some((Paint::Series(entry.look), BAND));
        return vec![Shape::Path {
            lines: vec![corners],
            is_closed: true,
            stroke: None,
            fill,
            shows,
        }];
    };
    let mut shapes = Vec::new();
    if let Some(stroke) = stroke(entry.look, shown) {
        let lines = vec![vec![(x, y), (x + SAMPLE, y)]];
        shapes.push(Shape::Path {
            lines,
            is_closed: false,
            stroke: Some(stroke),
            fill: None,
            shows,
        });
    }
    if shown != Shown::Emphasis {
        shapes.push(markers(entry.look, &[(x + 0.5 * SAMPLE, y)], shows));
    }
    shapes
}

/// The line of a look; none where only points are shown.
pub(super) fn stroke(look: usize, shown: Shown) -> Option<Stroke> {
    let width = match shown {
        Shown::Line => 1.5,
        Shown::Emphasis => 3.0,
        Shown::Points => return None,
    };
    Some(Stroke { paint: Paint::Series(look), width, dash: look::dash(look).to_vec() })
}

/// Markers of a look at some places.
pub(super) fn markers(look: usize, places: &[(f64, f64)], shows: Option<Shows>) -> Shape {
    let paint = Paint::Series(look);
    let mut lines = Vec::new();
    let mut is_closed = false;
    for place in places {
        let (outline, closed) = look::outline(look::marker(look), *place);
        lines.extend(outline);
        is_closed = closed;
    }
    let stroke = Some(Stroke { paint, width: 1.4, dash: Vec::new() });
    let fill = is_closed.then_some((paint, 1.0));
    Shape::Path { lines, is_closed, stroke, fill, shows }
}
