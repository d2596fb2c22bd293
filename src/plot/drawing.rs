//! A laid-out chart: lines, areas and texts in pixels, y downwards; the input of the writers.

use super::{font, thin};

/// A chart in pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width in pixels.
    pub width: f64,
    /// Height in pixels.
    pub height: f64,
    /// The chart's title, for who cannot see it.
    pub title: String,
    /// From the lowest to the topmost.
    pub shapes: Vec<Shape>,
    /// Where the panels are.
    pub(crate) panels: Vec<PanelPlace>,
    /// Where the legend begins, in pixels from the top.
    pub legend_top: f64,
}

/// Where a panel's axes are and what they span.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PanelPlace {
    /// Left, top, right and bottom of the area between the axes, in pixels.
    pub area: [f64; 4],
    /// What it spans to the right, in SI.
    pub x_span: (f64, f64),
    /// What it spans upwards, in SI.
    pub y_span: (f64, f64),
}

impl PanelPlace {
    /// Which of the points of a line show it, for a page that gives values under the pointer: those that its picture
    /// goes through, and no gap between them beyond a few pixels.
    pub(crate) fn telling(&self, x: &[f64], y: &[f64]) -> Vec<usize> {
        let points: Vec<(f64, f64)> = x.iter().zip(y).map(|(x, y)| self.place(*x, *y)).collect();
        let mut telling = Vec::new();
        let mut last: Option<usize> = None;
        for i in thin::kept(&points) {
            if let Some(before) = last {
                let far = |a: usize, b: usize| (points[a].0 - points[b].0).abs() > MOST_GAP;
                let mut from = before;
                for k in before + 1..i {
                    if far(k + 1, from) {
                        telling.push(k);
                        from = k;
                    }
                }
            }
            telling.push(i);
            last = Some(i);
        }
        telling
    }

    /// Where a pair of values is.
    pub(super) fn place(&self, x: f64, y: f64) -> (f64, f64) {
        let [left, top, right, bottom] = self.area;
        // Halves, so that a span of all numbers does not overflow.
        let share =
            |v: f64, (low, high): (f64, f64)| (0.5 * v - 0.5 * low) / (0.5 * high - 0.5 * low);
        (
            left + (right - left) * share(x, self.x_span),
            bottom - (bottom - top) * share(y, self.y_span),
        )
    }
}

/// Widest gap between the values that a page gives, in pixels.
const MOST_GAP: f64 = 4.0;

/// A colour by its meaning, so that a dark page can give it another value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paint {
    /// The ground.
    Paper,
    /// Texts and axes.
    Ink,
    /// Texts of less weight.
    Faint,
    /// Lines at ticks.
    Grid,
    /// The colour of a look: eight, then again from the first.
    Series(usize),
}

/// A line's look.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub paint: Paint,
    /// Its width in pixels.
    pub width: f64,
    /// Lengths of strokes and gaps in pixels; empty for a solid line.
    pub dash: Vec<f64>,
}

/// Something that is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Lines, each through its points; an area if it is filled.
    Path {
        /// Points of each line.
        lines: Vec<Vec<(f64, f64)>>,
        /// Whether each line returns to its beginning.
        is_closed: bool,
        /// The line, if it is drawn.
        stroke: Option<Stroke>,
        /// Colour and opacity of the area, if it is filled.
        fill: Option<(Paint, f64)>,
        /// Panel and ordinal among its series, or its bands, which it shows.
        shows: Option<Shows>,
    },
    /// A text of one line.
    Text(Text),
}

/// What of a panel a shape shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shows {
    /// Panel, and ordinal of the series.
    Series(usize, usize),
    /// Panel, and ordinal of the band.
    Band(usize, usize),
    /// Ticks, their lines and numbers: what changes with the span.
    Ticks(usize),
    /// The legend below the axes.
    Legend,
}

/// A text of one line.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// What it says.
    pub text: String,
    /// Where its baseline begins, in pixels.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// Height of a line in pixels.
    pub size: f64,
    /// Whether it runs upwards.
    pub is_upright: bool,
    /// Its colour.
    pub paint: Paint,
    /// What of a panel it belongs to.
    pub shows: Option<Shows>,
}

/// What a text covers.
#[derive(Clone, Debug, PartialEq)]
pub struct TextBox {
    /// The text.
    pub text: String,
    /// Left, top, right and bottom in pixels.
    pub place: [f64; 4],
}

impl Text {
    fn area(&self) -> [f64; 4] {
        let width = font::width(&self.text, self.size);
        let (up, down) = (font::ASCENT * self.size, font::DESCENT * self.size);
        if self.is_upright {
            [self.x - up, self.y - width, self.x + down, self.y]
        } else {
            [self.x, self.y - up, self.x + width, self.y + down]
        }
    }
}

impl Drawing {
    /// What each text covers, by the measures of the font.
    pub fn text_boxes(&self) -> Vec<TextBox> {
        let texts = self.shapes.iter().filter_map(|shape| match shape {
            Shape::Text(text) => Some(TextBox { text: text.text.clone(), place: text.area() }),
            Shape::Path { .. } => None,
        });
        texts.collect()
    }
}
