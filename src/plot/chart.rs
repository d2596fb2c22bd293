//! What a chart shows: panels with axes, series, bands and marks. Values are SI; an axis says in which unit they are shown.
//! Round numbers along an axis, and how they are written. Laid out it is a drawing: lines, areas and texts in pixels, y downwards; the input of the writers.

use std::collections::BTreeSet;

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
    /// Of a map: below everything else.
    pub cells: Vec<Cell>,
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
            cells: Vec::new(),
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
    /// Which colour, dash and marker it has: eight colours, then again from the first.
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
    /// Whether its width is the value, as part of a sum.
    pub is_stacked: bool,
}

/// An upright line with a word at its top.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Placed next to its top.
    pub name: String,
    /// Where, in SI.
    pub x: f64,
}

/// A rectangle of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// From left to right, in SI.
    pub x: (f64, f64),
    /// From bottom to top, in SI.
    pub y: (f64, f64),
    /// From 0, pale, to 1, deep.
    pub depth: f64,
    /// Its number, left out where there is no room.
    pub text: String,
}

/// A chart in pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width in pixels.
    pub width: f64,
    /// Height in pixels.
    pub height: f64,
    /// The chart's title, for readers who cannot see it.
    pub(crate) title: String,
    /// From the lowest to the topmost.
    pub(crate) shapes: Vec<Shape>,
    pub(crate) panels: Vec<PanelPlace>,
    /// In pixels from the top.
    pub(crate) legend_top: f64,
}

/// Where a panel's axes are and what they span.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PanelPlace {
    /// Left, top, right and bottom of the area between the axes, in pixels.
    pub area: [f64; 4],
    /// In SI.
    pub x_span: (f64, f64),
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
pub(crate) enum Paint {
    Paper,
    /// Texts and axes.
    Ink,
    /// Texts of less weight.
    Faint,
    Grid,
    /// The colour of a look: eight, then again from the first.
    Series(usize),
}

/// A line's look.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stroke {
    pub paint: Paint,
    pub width: f64,
    /// Lengths of strokes and gaps in pixels; empty for a solid line.
    pub dash: Vec<f64>,
}

/// Something that is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Lines, each through its points; an area if it is filled.
    Path {
        lines: Vec<Vec<(f64, f64)>>,
        /// Whether each line returns to its beginning.
        is_closed: bool,
        stroke: Option<Stroke>,
        /// Colour and opacity of the area, if it is filled.
        fill: Option<(Paint, f64)>,
        shows: Option<Shows>,
    },
    Text(Text),
}

/// What of a panel a shape shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shows {
    /// Panel, and ordinal of the series.
    Series(usize, usize),
    /// Panel, and ordinal of the band.
    Band(usize, usize),
    /// Ticks, their lines and numbers: what changes with the span.
    Ticks(usize),
    Legend,
}

/// A text of one line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Text {
    pub text: String,
    /// Where its baseline begins, in pixels.
    pub x: f64,
    pub y: f64,
    /// Height of a line in pixels.
    pub size: f64,
    /// Whether it runs upwards.
    pub is_upright: bool,
    pub paint: Paint,
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

    /// The characters of its texts that the font lacks: a box stands in the place of each.
    pub(crate) fn boxes(&self) -> BTreeSet<char> {
        let texts = self.text_boxes().into_iter();
        texts.flat_map(|(text, _)| text.chars()).filter(|c| !font::has(*c)).collect()
    }
}

/// Positions of ticks with the digits that they need after the point.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    pub(super) values: Vec<f64>,
    pub(super) step: f64,
    decimals: usize,
}

/// A power of ten, by multiplication: the same bits everywhere.
fn ten_to(power: i32) -> f64 {
    let mut value = 1.0;
    for _ in 0..power.abs() {
        value *= 10.0;
    }
    if power < 0 { 1.0 / value } else { value }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `least`, and the power.
fn round_up(least: f64) -> (f64, i32) {
    let mut power = 0;
    while power > -300 && ten_to(power) > least {
        power -= 1;
    }
    while power < 307 && ten_to(power + 1) <= least {
        power += 1;
    }
    for digit in [1.0, 2.0, 5.0] {
        if digit * ten_to(power) >= least {
            return (digit * ten_to(power), power);
        }
    }
    (10.0 * ten_to(power), power + 1)
}

/// The largest power of ten that is not above a value.
fn magnitude(value: f64) -> i32 {
    let mut power = 0;
    while power > -300 && ten_to(power) > value * (1.0 + 1e-9) {
        power -= 1;
    }
    while power < 308 && ten_to(power + 1) <= value * (1.0 + 1e-9) {
        power += 1;
    }
    power
}

/// Number of ticks above which a span is refused by all callers' sizes.
const MOST: f64 = 1e3;

impl Ticks {
    /// Ticks between `low` and `high`, about `most` of them at the most.
    pub(super) fn new(low: f64, high: f64, most: usize) -> Self {
        let width = (high - low).clamp(f64::MIN_POSITIVE, f64::MAX);
        // Numbers this close together relative to their size cannot be written apart.
        let least = (width / most.max(1) as f64).max(1e-9 * low.abs().max(high.abs()));
        let (step, power) = round_up(least);
        // In steps, so that nothing overflows.
        let slack = 1e-9;
        let first = (low / step - slack).ceil();
        let count = ((high / step + slack).floor() - first).clamp(-1.0, MOST) + 1.0;
        let values = (0..count as usize)
            .map(|k| (first + k as f64) * step)
            .filter(|v| v.is_finite())
            .collect();
        Self { values, step, decimals: usize::try_from(-power).unwrap_or(0) }
    }

    /// A tick's number: `-1.5`, `0`, `2e12`.
    pub(super) fn text(&self, value: f64) -> String {
        let value = if value.abs() < 1e-6 * self.step { 0.0 } else { value };
        if value == 0.0 && (self.decimals > 6 || self.step >= 1e6) {
            return "0".into();
        }
        if self.decimals > 6 || value.abs() >= 1e7 {
            // As many digits as distinguish neighbours.
            let digits = magnitude(value.abs()) - magnitude(self.step);
            let digits = usize::try_from(digits).unwrap_or_default();
            return format!("{value:.digits$e}").replace('-', "−");
        }
        format!("{value:.*}", self.decimals).replace('-', "−")
    }

    pub(super) fn texts(&self) -> impl Iterator<Item = (f64, String)> + '_ {
        self.values.iter().map(|&v| (v, self.text(v)))
    }
}

/// What an axis spans for these values: up to the next round numbers, with 0 where it is near.
pub(super) fn span(low: f64, high: f64, most: usize) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) || low > high {
        return (0.0, 1.0);
    }
    let (mut low, mut high) = (low, high);
    if low > 0.0 && low < 0.5 * high {
        low = 0.0;
    }
    if high < 0.0 && high > 0.5 * low {
        high = 0.0;
    }
    let near = low.abs().max(high.abs());
    if high - low <= 1e-9 * near || near == 0.0 {
        let half = if near == 0.0 { 0.5 } else { 0.05 * near };
        (low, high) = (low - half, high + half);
    }
    let (step, _) = round_up((high - low) / most.max(1) as f64);
    let slack = 1e-6;
    let (low, high) = ((low / step + slack).floor() * step, (high / step - slack).ceil() * step);
    // The next round number may be none any more.
    (low.max(f64::MIN), high.min(f64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(low: f64, high: f64, most: usize) -> Vec<String> {
        Ticks::new(low, high, most).texts().map(|(_, t)| t).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(texts(0.0, 5.0, 6), ["0", "1", "2", "3", "4", "5"]);
        assert_eq!(texts(-1.0, 5.5, 4), ["0", "2", "4"]);
        assert_eq!(texts(-0.3, 0.3, 6), ["−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(texts(0.0, 2e12, 2), ["0", "1e12", "2e12"]);
        assert_eq!(texts(1e9, 1.2e9, 2), ["1.0e9", "1.1e9", "1.2e9"]);
        assert_eq!(texts(1e-9, 3e-9, 4), ["1.0e−9", "1.5e−9", "2.0e−9", "2.5e−9", "3.0e−9"]);
    }

    #[test]
    fn spans_end_at_round_numbers() {
        assert_eq!(span(0.2, 4.3, 5), (0.0, 5.0));
        assert_eq!(span(-0.4, 4.3, 5), (-1.0, 5.0));
        let near = |(low, high): (f64, f64), (a, b): (f64, f64)| {
            assert!((low - a).abs() < 1e-12 && (high - b).abs() < 1e-12, "{low} {high}");
        };
        near(span(3.0, 3.0, 5), (2.8, 3.2));
        near(span(0.0, 0.0, 5), (-0.6, 0.6));
        assert_eq!(span(f64::NAN, 1.0, 5), (0.0, 1.0));
        assert_eq!(span(f64::INFINITY, f64::NEG_INFINITY, 5), (0.0, 1.0));
        let (low, high) = span(0.0, f64::MAX, 8);
        assert_eq!((low, high), (0.0, f64::MAX));
        assert_eq!(texts(low, high, 8), ["0", "5e307", "1.0e308", "1.5e308"]);
    }
}
