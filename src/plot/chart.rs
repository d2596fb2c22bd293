//! What a chart shows: panels with axes, series, bands and marks. Values are SI; an axis says in which unit they are shown.
//! Laid out it is a drawing: lines, areas and texts in pixels, y downwards; the input of the writers.

use super::{font, thin};

/// Panels side by side with one title and one legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Stands above; may be empty.
    pub title: String,
    /// From left to right, and in rows where they need the room; at least one.
    pub panels: Vec<Panel>,
    /// Lines below the legend: where the numbers come from.
    pub notes: Vec<String>,
    /// Width of the picture in pixels, at least 320.
    pub width: f64,
    /// Height of the axes' area in pixels, at least 80; title and legend add to it.
    pub height: f64,
}

impl Chart {
    /// A chart of one panel, 780 pixels wide.
    pub fn of(title: &str, panel: Panel) -> Self {
        Self::row(title, vec![panel])
    }

    /// A chart of panels side by side, 780 pixels wide.
    pub fn row(title: &str, panels: Vec<Panel>) -> Self {
        Self { title: title.into(), panels, notes: Vec::new(), width: 780.0, height: 320.0 }
    }
}

/// Axes and what is drawn between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Stands above the axes; may be empty.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// Below the series, in this order.
    pub bands: Vec<Band>,
    /// Later ones lie above earlier ones.
    pub series: Vec<Series>,
    /// Upright lines.
    pub marks: Vec<Mark>,
}

impl Panel {
    /// Axes without content.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self {
            title: String::new(),
            x,
            y,
            bands: Vec::new(),
            series: Vec::new(),
            marks: Vec::new(),
        }
    }
}

/// A quantity with the unit that it is shown in.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Such as `force`.
    pub quantity: String,
    /// Such as `MN`; empty for a number without unit.
    pub unit: String,
    /// Shown number over SI value: `1e-6` for MN.
    pub scale: f64,
    /// What the axis spans, in SI; `None`: all values, and 0 where that is near.
    pub span: Option<(f64, f64)>,
}

impl Axis {
    /// An axis over all values.
    pub fn new(quantity: &str, unit: &str, scale: f64) -> Self {
        Self { quantity: quantity.into(), unit: unit.into(), scale, span: None }
    }

    /// The same over a part, in SI.
    pub fn over(self, low: f64, high: f64) -> Self {
        Self { span: Some((low, high)), ..self }
    }

    /// The axis of a quantity in N, J, … with the prefix that suits its largest magnitude: kilo below 10⁶, mega
    /// above, none below 10³.
    pub(crate) fn prefixed(quantity: &str, unit: &str, largest: f64) -> Self {
        let (prefix, scale) = match largest.abs() {
            l if l >= 1e6 => ("M", 1e-6),
            l if l >= 1e3 => ("k", 1e-3),
            _ => ("", 1.0),
        };
        Self::new(quantity, &format!("{prefix}{unit}"), scale)
    }

    /// Quantity and unit: `force [MN]`.
    pub fn label(&self) -> String {
        match self.unit.as_str() {
            "" => self.quantity.clone(),
            unit => format!("{} [{unit}]", self.quantity),
        }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// A line with some markers on it.
    Line,
    /// A broader line, for what the chart is about.
    Emphasis,
    /// Markers alone, one for each point.
    Points,
    /// A dashed line: where it rests on no data.
    Assumed,
}

/// Points in the order in which they are joined.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Stands in the legend; series of one name and look have one entry.
    pub name: String,
    /// Which colour, dash and marker it has: see [`Paint::Series`](super::Paint::Series).
    pub look: usize,
    /// Line or points.
    pub shown: Shown,
    /// In SI; as many as `y`. Points that are not finite leave a gap.
    pub x: Vec<f64>,
    /// In SI.
    pub y: Vec<f64>,
}

impl Series {
    /// A line.
    pub fn line(name: &str, look: usize, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self { name: name.into(), look, shown: Shown::Line, x, y }
    }

    /// The same, shown in another way.
    pub fn shown(self, shown: Shown) -> Self {
        Self { shown, ..self }
    }
}

/// An area between two values at each place.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Stands in the legend: which band, its level, and from how many curves.
    pub name: String,
    /// That of the series that it belongs to.
    pub look: usize,
    /// In SI, rising.
    pub x: Vec<f64>,
    /// Lower edge in SI, as many as `x`.
    pub low: Vec<f64>,
    /// Upper edge in SI.
    pub high: Vec<f64>,
}

/// An upright line with a word at its top.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Placed next to its top.
    pub name: String,
    /// Where, in SI.
    pub x: f64,
}

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
    /// Each text and what it covers by the measures of the font: left, top, right and bottom in pixels.
    pub fn text_boxes(&self) -> Vec<(&str, [f64; 4])> {
        let texts = self.shapes.iter().filter_map(|shape| match shape {
            Shape::Text(text) => Some((&*text.text, text.area())),
            Shape::Path { .. } => None,
        });
        texts.collect()
    }
}
