//! How series differ: colour, dash and marker, so that no pair depends on colour alone.

use std::fmt::Write;

use serde_json::{Value, json};

/// Colours that people with any colour vision distinguish (Okabe and Ito, "Color Universal Design", 2008), with grey in
/// place of their yellow, which cannot be seen on paper.
const COLOURS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#000000", "#cc79a7", "#56b4e9", "#e69f00", "#808080"];

/// The same on a dark page: black becomes white, and dark blue lighter.
const DARK_COLOURS: [&str; 8] =
    ["#4aa8e0", "#f07a2a", "#2fc496", "#ffffff", "#e09cc0", "#8fd0f5", "#f0b840", "#a0a0a0"];

/// Lengths of strokes and gaps in pixels; none is a solid line.
const DASHES: [&[f64]; 4] = [&[], &[8.0, 4.0], &[2.0, 3.0], &[10.0, 3.0, 2.0, 3.0]];

/// Shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Marker {
    Circle,
    Square,
    TriangleUp,
    Diamond,
    TriangleDown,
    Cross,
    Plus,
    Bar,
}

const MARKERS: [Marker; 8] = [
    Marker::Circle,
    Marker::Square,
    Marker::TriangleUp,
    Marker::Diamond,
    Marker::TriangleDown,
    Marker::Cross,
    Marker::Plus,
    Marker::Bar,
];

pub(super) fn colour(look: usize) -> &'static str {
    COLOURS[look % 8]
}

pub(super) fn dash(look: usize) -> &'static [f64] {
    DASHES[(look + look / 8) % 4]
}

/// Marker of a look: pairs of colour and marker repeat after 64.
pub(super) fn marker(look: usize) -> Marker {
    MARKERS[(look + look / 8) % 8]
}

/// Half the width of a marker in pixels.
pub(super) const MARKER: f64 = 3.5;

/// Outline of a marker around a place: lines to be joined, and whether they enclose an area.
pub(super) fn outline(marker: Marker, (x, y): (f64, f64)) -> (Vec<Vec<(f64, f64)>>, bool) {
    let r = MARKER;
    let at = |points: &[(f64, f64)]| points.iter().map(|&(u, v)| (x + r * u, y + r * v)).collect();
    match marker {
        // A polygon of twelve corners is round at this size.
        Marker::Circle => {
            let (a, b) = (0.5, 0.866_025_403_784_438_6);
            let corners = [
                (1.0, 0.0),
                (b, a),
                (a, b),
                (0.0, 1.0),
                (-a, b),
                (-b, a),
                (-1.0, 0.0),
                (-b, -a),
                (-a, -b),
                (0.0, -1.0),
                (a, -b),
                (b, -a),
            ];
            (vec![at(&corners)], true)
        }
        Marker::Square => (vec![at(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)])], true),
        Marker::TriangleUp => (vec![at(&[(0.0, -1.1), (1.1, 0.8), (-1.1, 0.8)])], true),
        Marker::Diamond => {
            (vec![at(&[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)])], true)
        }
        Marker::TriangleDown => (vec![at(&[(0.0, 1.1), (1.1, -0.8), (-1.1, -0.8)])], true),
        Marker::Cross => {
            (vec![at(&[(-1.0, -1.0), (1.0, 1.0)]), at(&[(-1.0, 1.0), (1.0, -1.0)])], false)
        }
        Marker::Plus => {
            (vec![at(&[(-1.2, 0.0), (1.2, 0.0)]), at(&[(0.0, -1.2), (0.0, 1.2)])], false)
        }
        Marker::Bar => (vec![at(&[(0.0, -1.4), (0.0, 1.4)])], false),
    }
}

/// What a page needs to draw series as pictures do.
pub(crate) struct PageLooks {
    /// Styles of the classes `l-s0`, `f-s0`, … for lines and areas; on a dark screen they are lighter.
    pub(crate) style: String,
    /// Dash and marker of every look, in their order.
    pub(crate) data: Value,
}

/// Colours, and dashes and markers of the first `count` looks, for a page.
pub(crate) fn looks_for_pages(count: usize) -> PageLooks {
    let rules = |colours: &[&str; 8]| {
        let mut rules = String::new();
        for (k, colour) in colours.iter().enumerate() {
            let _ =
                writeln!(rules, ".l-s{k} {{ stroke: {colour}; }} .f-s{k} {{ fill: {colour}; }}");
        }
        rules
    };
    let (light, dark) = (rules(&COLOURS), rules(&DARK_COLOURS));
    let style = format!("{light}@media screen and (prefers-color-scheme: dark) {{\n{dark}}}\n");
    // A tenth of a pixel.
    let round = |points: Vec<(f64, f64)>| -> Vec<[f64; 2]> {
        points.iter().map(|(x, y)| [(x * 10.0).round() / 10.0, (y * 10.0).round() / 10.0]).collect()
    };
    let looks = (0..count).map(|look| {
        let (lines, is_closed) = outline(marker(look), (0.0, 0.0));
        let lines: Vec<_> = lines.into_iter().map(round).collect();
        json!({ "dash": dash(look), "marker": { "outline": lines, "is_closed": is_closed } })
    });
    PageLooks { style, data: looks.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_looks_are_alike() {
        for a in 0..64 {
            for b in 0..a {
                let (one, other) = ((colour(a), marker(a)), (colour(b), marker(b)));
                assert_ne!(one, other, "looks {a} and {b}");
                // The first eight differ in colour, and in their markers as well.
                assert!(a >= 8 || (one.0 != other.0 && one.1 != other.1), "looks {a} and {b}");
                // Where colours repeat, marker or dash distinguishes.
                assert!(colour(a) != colour(b) || marker(a) != marker(b) || dash(a) != dash(b));
            }
        }
    }
}
