//! What a chart shows: panels with axes, series, bands and marks. Values are SI; an axis says in which unit they are shown.

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
    pub fn prefixed(quantity: &str, unit: &str, largest: f64) -> Self {
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
