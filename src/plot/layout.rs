//! Places a chart: margins from the measured texts, axes, series, marks, legend, notes.

use super::chart::{
    self, Axis, Chart, Drawing, Mark, Paint, Panel, PanelPlace, Shape, Shown, Shows, Stroke, Text,
    Ticks,
};
use super::{font, style, thin};

/// Around the picture, in pixels.
pub(super) const MARGIN: f64 = 12.0;
const TITLE: f64 = 15.0;
const LABEL: f64 = 13.0;
const TICK: f64 = 12.0;
const NOTE: f64 = 11.0;
/// A line of text takes its size times this.
const LINE: f64 = 1.35;
/// Between ticks, upwards, in pixels at least; less in low panels, where two would not do.
const TICK_ROOM: f64 = 40.0;
const LOW_TICK_ROOM: f64 = 26.0;
const LOW: f64 = 160.0;
/// Between the numbers of two ticks, in pixels at least.
const NUMBER_GAP: f64 = 14.0;
/// Between markers along a line, in pixels.
const MARKER_STEP: f64 = 90.0;
/// Of at most so many points each has a marker.
const FEW_POINTS: usize = 12;
/// A number for which there is always room, so that a page can zoom.
const USUAL: &str = "0.000";
/// Smallest width of the area between the axes where there is another beside it.
const LEAST_AREA: f64 = 150.0;
/// Width of an area for which margins are measured.
const USUAL_AREA: f64 = 400.0;

impl Chart {
    /// Places everything. Sizes below the least are raised; a chart without panels is its title.
    pub fn drawing(&self) -> Drawing {
        let chart = &Chart {
            width: self.width.clamp(320.0, 1e4),
            height: self.height.clamp(80.0, 1e4),
            ..self.clone()
        };
        let mut shapes = Vec::new();
        let mut y = MARGIN;
        for line in font::wrapped(&chart.title, TITLE, chart.width - 2.0 * MARGIN) {
            shapes.push(text(&line, (MARGIN, y + TITLE), TITLE, Paint::Ink, None));
            y += LINE * TITLE;
        }
        let places = places(chart, y);
        for (number, (panel, place)) in chart.panels.iter().zip(&places).enumerate() {
            draw_panel(&mut shapes, number, panel, place, chart.width);
        }
        y = places.last().map_or(y, |last| last.area[3] + below_axes());
        let left = places.first().map_or(MARGIN, |p| p.area[0].min(0.2 * chart.width));
        let legend_top = y;
        let (entries, end) = draw_legend(chart, left, legend_top);
        shapes.extend(entries);
        y = end + 4.0;
        for note in &chart.notes {
            for line in font::wrapped(note, NOTE, chart.width - left - MARGIN) {
                shapes.push(text(&line, (left, y + NOTE), NOTE, Paint::Faint, None));
                y += LINE * NOTE;
            }
        }
        let height = (y + MARGIN).ceil();
        let title = chart.title.clone();
        Drawing { width: chart.width, height, title, shapes, panels: places, legend_top }
    }
}

fn text(text: &str, (x, y): (f64, f64), size: f64, paint: Paint, shows: Option<Shows>) -> Shape {
    Shape::Text(Text { text: text.into(), x, y, size, is_upright: false, paint, shows })
}

/// A text with its middle at `x`.
fn centred(what: &str, (x, y): (f64, f64), size: f64, paint: Paint, shows: Option<Shows>) -> Shape {
    text(what, (x - 0.5 * font::width(what, size), y), size, paint, shows)
}

/// What an axis spans, in SI.
fn span(axis: &Axis, values: impl Iterator<Item = f64>, most: usize) -> (f64, f64) {
    if let Some((low, high)) = axis.span
        && low < high
        && (high - low).is_finite()
    {
        return (low, high);
    }
    let finite = values.filter(|v| v.is_finite()).map(|v| v * axis.scale);
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let (low, high) = chart::span(low, high, most);
    (low / axis.scale, high / axis.scale)
}

/// Ticks of an axis over a span, in shown units.
fn shown_ticks(axis: &Axis, (low, high): (f64, f64), most: usize) -> Ticks {
    let (a, b) = (low * axis.scale, high * axis.scale);
    Ticks::new(a.min(b), a.max(b), most)
}

fn most_y_ticks(height: f64) -> usize {
    (height / if height < LOW { LOW_TICK_ROOM } else { TICK_ROOM }) as usize
}

fn y_ticks(panel: &Panel, place: &PanelPlace) -> Ticks {
    let height = place.area[3] - place.area[1];
    shown_ticks(&panel.y, place.y_span, most_y_ticks(height))
}

/// As many ticks as their numbers have room for.
fn x_ticks(panel: &Panel, place: &PanelPlace) -> Ticks {
    let width = place.area[2] - place.area[0];
    let mut most = (width / 40.0) as usize;
    loop {
        let ticks = shown_ticks(&panel.x, place.x_span, most);
        let widest = ticks.texts().map(|(_, t)| font::width(&t, TICK)).fold(0.0, f64::max);
        let (low, high) = place.x_span;
        let apart = ticks.step / ((high - low) * panel.x.scale).abs() * width;
        if apart >= widest + NUMBER_GAP || ticks.values.len() < 2 || most < 2 {
            return ticks;
        }
        most -= 1;
    }
}

/// What is below axes: numbers, label, some room.
fn below_axes() -> f64 {
    8.0 + LINE * TICK + LINE * LABEL + 8.0
}

/// Places of the panels from a height downwards: side by side in equal areas, in as many rows as leave each area
/// wide enough, with margins for numbers and labels.
fn places(chart: &Chart, top: f64) -> Vec<PanelPlace> {
    let mut places: Vec<PanelPlace> = Vec::new();
    let (mut left, mut right) = (0.0_f64, 0.0_f64);
    for panel in &chart.panels {
        let (place, margins) = unplaced(panel, chart.height);
        places.push(place);
        (left, right) = (left.max(margins.0), right.max(margins.1));
    }
    let count = places.len().max(1);
    let widest = |columns: usize| chart.width / columns as f64 - left - right;
    let columns = (1..=count).rev().find(|c| widest(*c) >= LEAST_AREA).unwrap_or(1);
    // Rows as full as each other.
    let columns = count.div_ceil(count.div_ceil(columns));
    let width = widest(columns).max(1.0);
    let has_titles = chart.panels.iter().any(|p| !p.title.is_empty());
    let above = if has_titles { LINE * LABEL + 8.0 } else { 10.0 };
    for (k, place) in places.iter_mut().enumerate() {
        let (row, column) = ((k / columns) as f64, (k % columns) as f64);
        let from = column * (left + width + right) + left;
        let upper = top + above + row * (above + chart.height + below_axes());
        place.area = [from, upper, from + width, upper + chart.height];
    }
    places
}

/// What a panel's axes span, and its margins to the left and right, before its place is known.
fn unplaced(panel: &Panel, height: f64) -> (PanelPlace, (f64, f64)) {
    let xs = panel.series.iter().flat_map(|s| &s.x).chain(panel.bands.iter().flat_map(|b| &b.x));
    let bands = panel.bands.iter().flat_map(|b| b.low.iter().chain(&b.high));
    let ys = panel.series.iter().flat_map(|s| &s.y).chain(bands);
    let x_span = span(&panel.x, xs.chain(panel.marks.iter().map(|m| &m.x)).copied(), 10);
    let y_span = span(&panel.y, ys.copied(), most_y_ticks(height));
    let place = PanelPlace { area: [0.0, 0.0, USUAL_AREA, height], x_span, y_span };
    let widest =
        |ticks: Ticks| ticks.texts().map(|(_, t)| font::width(&t, TICK)).fold(0.0, f64::max);
    let numbers = widest(y_ticks(panel, &place)).max(font::width(USUAL, TICK));
    let left = MARGIN + LINE * LABEL + 4.0 + numbers + 8.0;
    let right = (0.5 * widest(x_ticks(panel, &place))).max(4.0) + MARGIN;
    (place, (left, right))
}

fn draw_panel(
    shapes: &mut Vec<Shape>,
    number: usize,
    panel: &Panel,
    place: &PanelPlace,
    picture_width: f64,
) {
    let [left, top, right, bottom] = place.area;
    if !panel.title.is_empty() {
        let title = font::fitted(&panel.title, LABEL, right - left);
        shapes.push(text(&title, (left, top - 8.0), LABEL, Paint::Ink, None));
    }
    draw_ticks(shapes, number, panel, place);
    draw_cells(shapes, panel, place);
    draw_labels(shapes, panel, place, picture_width);
    for (k, band) in panel.bands.iter().enumerate() {
        let edges: Vec<(f64, f64, f64)> =
            (0..band.x.len().min(band.low.len()).min(band.high.len()))
                .map(|i| {
                    let (x, low) = place.place(band.x[i], band.low[i]);
                    (x, low, place.place(band.x[i], band.high[i]).1)
                })
                .collect();
        let edges = thin::band(&edges, place.area);
        let low = thin::thinned(&edges.iter().map(|e| (e.0, e.1)).collect::<Vec<_>>());
        let high = thin::thinned(&edges.iter().map(|e| (e.0, e.2)).collect::<Vec<_>>());
        let outline: Vec<(f64, f64)> = low.into_iter().chain(high.into_iter().rev()).collect();
        shapes.push(Shape::Path {
            lines: vec![outline],
            is_closed: true,
            stroke: None,
            fill: Some((Paint::Series(band.look), opacity(band.is_stacked))),
            shows: Some(Shows::Band(number, k)),
        });
    }
    for k in 0..panel.series.len() {
        draw_series(shapes, number, k, panel, place);
    }
    let frame = Stroke { paint: Paint::Ink, width: 1.0, dash: Vec::new() };
    let corner = vec![(left, top), (left, bottom), (right, bottom)];
    shapes.push(path(vec![corner], frame, None));
    draw_marks(shapes, &panel.marks, place);
}

/// Paler than this a cell would look empty, deeper than that no number could be read on it.
const DEPTHS: (f64, f64) = (0.08, 0.9);

fn draw_cells(shapes: &mut Vec<Shape>, panel: &Panel, place: &PanelPlace) {
    for cell in &panel.cells {
        let (left, bottom) = place.place(cell.x.0, cell.y.0);
        let (right, top) = place.place(cell.x.1, cell.y.1);
        let corners = vec![(left, top), (right, top), (right, bottom), (left, bottom)];
        let opacity = DEPTHS.0 + (DEPTHS.1 - DEPTHS.0) * cell.depth.clamp(0.0, 1.0);
        let stroke = Some(Stroke { paint: Paint::Paper, width: 1.0, dash: Vec::new() });
        let fill = Some((Paint::Series(0), opacity));
        shapes.push(Shape::Path {
            lines: vec![corners],
            is_closed: true,
            stroke,
            fill,
            shows: None,
        });
        let (x, y) = (0.5 * (left + right), 0.5 * (top + bottom) + 0.35 * NOTE);
        if font::width(&cell.text, NOTE) + 2.0 <= right - left && LINE * NOTE <= bottom - top {
            let paint = if opacity > 0.5 { Paint::Paper } else { Paint::Ink };
            shapes.push(centred(&cell.text, (x, y), NOTE, paint, None));
        }
    }
}

fn path(lines: Vec<Vec<(f64, f64)>>, stroke: Stroke, shows: Option<Shows>) -> Shape {
    Shape::Path { lines, is_closed: false, stroke: Some(stroke), fill: None, shows }
}

/// Lines across at the ticks, and their numbers.
fn draw_ticks(shapes: &mut Vec<Shape>, number: usize, panel: &Panel, place: &PanelPlace) {
    let [left, _, right, bottom] = place.area;
    let shows = Some(Shows::Ticks(number));
    let (mut across, mut below) = (Vec::new(), Vec::new());
    let mut numbers = Vec::new();
    for (value, number) in y_ticks(panel, place).texts() {
        let (_, y) = place.place(place.x_span.0, value / panel.y.scale);
        across.push(vec![(left, y), (right, y)]);
        let x = left - 7.0 - font::width(&number, TICK);
        numbers.push(text(&number, (x, y + 0.35 * TICK), TICK, Paint::Ink, shows));
    }
    for (value, number) in x_ticks(panel, place).texts() {
        let (x, _) = place.place(value / panel.x.scale, place.y_span.0);
        below.push(vec![(x, bottom), (x, bottom + 4.0)]);
        numbers.push(centred(&number, (x, bottom + 6.0 + TICK), TICK, Paint::Ink, shows));
    }
    let line = |paint| Stroke { paint, width: 1.0, dash: Vec::new() };
    shapes.push(path(across, line(Paint::Grid), shows));
    shapes.push(path(below, line(Paint::Ink), shows));
    shapes.extend(numbers);
}

/// Quantities and units along the axes.
fn draw_labels(shapes: &mut Vec<Shape>, panel: &Panel, place: &PanelPlace, picture_width: f64) {
    let [left, top, right, bottom] = place.area;
    let label =
        font::fitted(&panel.x.label(), LABEL, (right - left).min(picture_width - left - MARGIN));
    let below = bottom + 6.0 + LINE * TICK + LABEL;
    shapes.push(centred(&label, (0.5 * (left + right), below), LABEL, Paint::Ink, None));
    let label = font::fitted(&panel.y.label(), LABEL, bottom - top);
    let ticks = y_ticks(panel, place);
    let widest = ticks.texts().map(|(_, t)| font::width(&t, TICK)).fold(0.0, f64::max);
    shapes.push(Shape::Text(Text {
        x: left - 7.0 - widest.max(font::width(USUAL, TICK)) - 8.0,
        y: 0.5 * (top + bottom) + 0.5 * font::width(&label, LABEL),
        text: label,
        size: LABEL,
        is_upright: true,
        paint: Paint::Ink,
        shows: None,
    }));
}

fn draw_series(
    shapes: &mut Vec<Shape>,
    number: usize,
    k: usize,
    panel: &Panel,
    place: &PanelPlace,
) {
    let series = &panel.series[k];
    let shows = Some(Shows::Series(number, k));
    let points: Vec<(f64, f64)> =
        series.x.iter().zip(&series.y).map(|(&x, &y)| place.place(x, y)).collect();
    let Some(stroke) = stroke(series.look, series.shown) else {
        let seen: Vec<_> = points.into_iter().filter(|p| thin::holds(place.area, *p)).collect();
        shapes.push(markers(series.look, &seen, shows));
        return;
    };
    let parts = thin::clipped_line(&points, place.area);
    let lines: Vec<Vec<(f64, f64)>> = parts.iter().map(|part| thin::thinned(part)).collect();
    // Between so few points a marker would look like another point.
    let at: Vec<(f64, f64)> = match points.len() {
        ..=FEW_POINTS => points.into_iter().filter(|p| thin::holds(place.area, *p)).collect(),
        _ => along(&lines, series.look),
    };
    shapes.push(path(lines, stroke, shows));
    if series.shown == Shown::Line && !at.is_empty() {
        shapes.push(markers(series.look, &at, shows));
    }
}

/// Places of markers: at equal ways along the lines, each look beginning elsewhere.
fn along(lines: &[Vec<(f64, f64)>], look: usize) -> Vec<(f64, f64)> {
    let mut places = Vec::new();
    let mut next = MARKER_STEP * (0.3 + 0.125 * (look % 8) as f64);
    let mut way = 0.0;
    for pair in lines.iter().flat_map(|line| line.windows(2)) {
        let (a, b) = (pair[0], pair[1]);
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let length = (dx * dx + dy * dy).sqrt();
        while length > 0.0 && next <= way + length {
            let t = (next - way) / length;
            places.push((a.0 + t * dx, a.1 + t * dy));
            next += MARKER_STEP;
        }
        way += length;
    }
    places
}

/// Paper below a word, so that lines do not run through it.
fn ground([left, top, right, bottom]: [f64; 4]) -> Shape {
    let corners = vec![(left, top), (right, top), (right, bottom), (left, bottom)];
    let fill = Some((Paint::Paper, 0.8));
    Shape::Path { lines: vec![corners], is_closed: true, stroke: None, fill, shows: None }
}

/// Upright lines; their words below each other where they would overlap, and none where there is no room.
fn draw_marks(shapes: &mut Vec<Shape>, marks: &[Mark], place: &PanelPlace) {
    let [left, top, right, bottom] = place.area;
    let mut taken: Vec<[f64; 4]> = Vec::new();
    for mark in marks {
        let (x, _) = place.place(mark.x, place.y_span.0);
        if !(left..=right).contains(&x) {
            continue;
        }
        let stroke = Stroke { paint: Paint::Faint, width: 1.0, dash: vec![4.0, 3.0] };
        shapes.push(path(vec![vec![(x, top), (x, bottom)]], stroke, None));
        let word = font::fitted(&mark.name, TICK, 0.5 * (right - left) - 6.0);
        let width = font::width(&word, TICK);
        let from = if x + 5.0 + width <= right { x + 5.0 } else { x - 5.0 - width };
        let rows = ((bottom - top) / (LINE * TICK)) as usize;
        let free = (0..rows).map(|row| top + LINE * TICK * row as f64).find(|y| {
            let overlaps = |b: &&[f64; 4]| {
                from < b[2] && b[0] < from + width && *y < b[3] && b[1] < y + LINE * TICK
            };
            taken.iter().find(overlaps).is_none()
        });
        if let Some(y) = free {
            taken.push([from, y, from + width, y + LINE * TICK]);
            shapes.push(ground([from - 2.0, y, from + width + 2.0, y + LINE * TICK]));
            shapes.push(text(&word, (from, y + TICK), TICK, Paint::Faint, None));
        }
    }
}

/// Width of the sample beside a name, in pixels.
const SAMPLE: f64 = 34.0;
const GAP: f64 = 7.0;
const COLUMN_GAP: f64 = 20.0;
const ROW: f64 = 19.0;
pub(super) const SIZE: f64 = 13.0;

/// Parts of a sum meet no line of their own, so they are stronger than the band around one.
pub(super) fn opacity(is_stacked: bool) -> f64 {
    if is_stacked { 0.6 } else { 0.22 }
}

#[derive(PartialEq)]
struct Entry<'a> {
    name: &'a str,
    look: usize,
    /// Of a band: whether it is stacked.
    shown: Result<Shown, bool>,
}

fn entries(chart: &Chart) -> Vec<Entry<'_>> {
    let mut entries: Vec<Entry> = Vec::new();
    for panel in &chart.panels {
        let series =
            panel.series.iter().map(|s| Entry { name: &s.name, look: s.look, shown: Ok(s.shown) });
        let bands = panel.bands.iter().map(|b| Entry {
            name: &b.name,
            look: b.look,
            shown: Err(b.is_stacked),
        });
        for entry in series.chain(bands) {
            if !entry.name.is_empty() && !entries.contains(&entry) {
                entries.push(entry);
            }
        }
    }
    entries
}

/// The legend's shapes from a height downwards, and the height where it ends.
fn draw_legend(chart: &Chart, left: f64, top: f64) -> (Vec<Shape>, f64) {
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
    let shown = match entry.shown {
        Ok(shown) => shown,
        Err(is_stacked) => {
            let corners =
                vec![(x, y - 6.0), (x + SAMPLE, y - 6.0), (x + SAMPLE, y + 6.0), (x, y + 6.0)];
            let fill = Some((Paint::Series(entry.look), opacity(is_stacked)));
            let lines = vec![corners];
            return vec![Shape::Path { lines, is_closed: true, stroke: None, fill, shows }];
        }
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
    if matches!(shown, Shown::Line | Shown::Points) {
        shapes.push(markers(entry.look, &[(x + 0.5 * SAMPLE, y)], shows));
    }
    shapes
}

/// The line of a look; none where only points are shown.
pub(super) fn stroke(look: usize, shown: Shown) -> Option<Stroke> {
    let width = match shown {
        Shown::Line => 1.5,
        Shown::Emphasis => 3.0,
        Shown::Assumed => 1.5,
        Shown::Points => return None,
    };
    let dash = if shown == Shown::Assumed { &[3.0, 3.0] } else { style::dash(look) };
    Some(Stroke { paint: Paint::Series(look), width, dash: dash.to_vec() })
}

/// Markers of a look at some places.
pub(super) fn markers(look: usize, places: &[(f64, f64)], shows: Option<Shows>) -> Shape {
    let paint = Paint::Series(look);
    let mut lines = Vec::new();
    let mut is_closed = false;
    for place in places {
        let (outline, closed) = style::outline(style::marker(look), *place);
        lines.extend(outline);
        is_closed = closed;
    }
    let stroke = Some(Stroke { paint, width: 1.4, dash: Vec::new() });
    let fill = is_closed.then_some((paint, 1.0));
    Shape::Path { lines, is_closed, stroke, fill, shows }
}
