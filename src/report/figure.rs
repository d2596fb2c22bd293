//! A chart in the page: its picture, and its numbers for the script.

use serde_json::{Value, json};

use crate::plot::{Axis, Chart, Panel, PanelPlace, Shown, SvgFor};

/// Width of a picture on a narrow screen, such as a telephone's, in pixels.
const NARROW: f64 = 360.0;

/// A chart in the page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Figure {
    pub id: String,
    pub caption: String,
    pub notes: Vec<String>,
    pub svg: String,
    /// The same for a narrow screen, where the first would be too small to read.
    pub narrow_svg: String,
    /// What the script needs.
    pub data: Value,
    /// How many looks it needs.
    pub looks: usize,
}

impl Figure {
    /// `id` is unique in the page.
    pub(super) fn new(id: String, chart: Chart) -> Self {
        let mut chart = chart;
        // In the page, title and notes are text next to the picture.
        let caption = std::mem::take(&mut chart.title);
        let notes = std::mem::take(&mut chart.notes);
        let mut drawing = chart.drawing();
        drawing.title.clone_from(&caption);
        let places = chart.panels.iter().zip(&drawing.panels);
        let panels: Vec<Value> = places.map(|(panel, place)| panel_data(panel, place)).collect();
        let mut narrow = Chart { width: NARROW, ..chart.clone() }.drawing();
        narrow.title.clone_from(&caption);
        let data = json!({
            "panels": panels, "legend": drawing.legend_top, "width": drawing.width,
            "narrow": {
                "legend": narrow.legend_top, "width": narrow.width,
                "panels": chart.panels.iter().zip(&narrow.panels).map(|(p, place)| place_data(p, place)).collect::<Vec<_>>(),
            },
        });
        let series = chart.panels.iter().flat_map(|panel| &panel.series);
        let looks = series.map(|s| s.look + 1).max().unwrap_or_default();
        let (svg, narrow_svg) = (drawing.svg_for(SvgFor::Page), narrow.svg_for(SvgFor::Page));
        Self { id, caption, notes, svg, narrow_svg, data, looks }
    }
}

/// Axes and values of a panel; equal abscissas of several lines are there once.
fn panel_data(panel: &Panel, place: &PanelPlace) -> Value {
    let mut xs: Vec<Vec<Value>> = Vec::new();
    let mut abscissa = |values: Vec<Value>| {
        let at = xs.iter().position(|known| *known == values);
        at.unwrap_or_else(|| {
            xs.push(values);
            xs.len() - 1
        })
    };
    let common = common_points(panel, place);
    let series: Vec<Value> = panel
        .series
        .iter()
        .map(|s| {
            let points = match &common {
                Some(points) => points.clone(),
                None => place.telling(&s.x, &s.y),
            };
            let shown = match s.shown {
                Shown::Line => 0,
                Shown::Emphasis => 1,
                Shown::Points => 2,
                Shown::Assumed => 3,
            };
            let x = abscissa(numbers(&s.x, &points, &panel.x));
            json!({ "name": s.name, "look": s.look, "shown": shown, "x": x, "y": numbers(&s.y, &points, &panel.y) })
        })
        .collect();
    let bands: Vec<Value> = panel
        .bands
        .iter()
        .map(|b| {
            let mut points = place.telling(&b.x, &b.low);
            points.extend(place.telling(&b.x, &b.high));
            points.sort_unstable();
            points.dedup();
            json!({
                "name": b.name, "look": b.look, "is_stacked": b.is_stacked, "x": abscissa(numbers(&b.x, &points, &panel.x)),
                "low": numbers(&b.low, &points, &panel.y), "high": numbers(&b.high, &points, &panel.y),
            })
        })
        .collect();
    let mut data = place_data(panel, place);
    for (key, values) in [("xs", json!(xs)), ("series", json!(series)), ("bands", json!(bands))] {
        data[key] = values;
    }
    data
}

/// Where a panel is, and what its axes span.
fn place_data(panel: &Panel, place: &PanelPlace) -> Value {
    json!({
        "area": place.area.map(|v| (v * 10.0).round() / 10.0),
        "x": axis(&panel.x, place.x_span), "y": axis(&panel.y, place.y_span),
    })
}

/// Of lines over the same abscissas, such as histories of one run: the points that any of them needs, where that is
/// shorter.
fn common_points(panel: &Panel, place: &PanelPlace) -> Option<Vec<usize>> {
    let (first, others) = panel.series.split_first()?;
    if others.iter().any(|s| s.x != first.x) {
        return None;
    }
    let own: Vec<Vec<usize>> = panel.series.iter().map(|s| place.telling(&s.x, &s.y)).collect();
    // Abscissas and ordinates of each, if every line has its own.
    let apart: usize = own.iter().map(|points| 2 * points.len()).sum();
    let mut points: Vec<usize> = own.into_iter().flatten().collect();
    points.sort_unstable();
    points.dedup();
    (points.len() * (1 + panel.series.len()) <= apart).then_some(points)
}

fn axis(axis: &Axis, (low, high): (f64, f64)) -> Value {
    json!({
        "name": axis.quantity, "unit": axis.unit,
        "span": [number(low * axis.scale), number(high * axis.scale)],
    })
}

/// Some of the values, in the axis's unit.
fn numbers(values: &[f64], points: &[usize], axis: &Axis) -> Vec<Value> {
    points.iter().map(|i| number(values[*i] * axis.scale)).collect()
}

/// A number with five digits; null if it is none.
fn number(value: f64) -> Value {
    if !value.is_finite() {
        return Value::Null;
    }
    let digits: f64 = format!("{value:.4e}").parse().unwrap_or(value);
    // Whole numbers are shorter without their point.
    if digits.fract() == 0.0 && digits.abs() < 1e9 { json!(digits as i64) } else { json!(digits) }
}
