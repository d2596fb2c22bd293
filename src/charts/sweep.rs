//! Sweeps: results over one varied quantity, as lines with the range that the others leave, or over two as a map.

use super::motion::SMALL;
use crate::error::{Error, error};
use crate::guess::hint;
use crate::multibody::STANDARD_GRAVITY_M_PER_S2;
use crate::order;
use crate::plan::{OVER_LIMITS, RESULTS, ResultName};
use crate::plot::{Axis, Band, Cell, Chart, Panel, Series, Shown};
use crate::sweep::{ResultColumn, SweepColumns, share_interval};
use crate::words::counted;

/// More values than this were not written down as a grid.
const MOST_VALUES: usize = 60;
/// Bins of a quantity that is drawn from a distribution.
const BINS: usize = 12;
/// From so many rows on, a range of them is shown.
const LEAST_ROWS: usize = 5;
/// Fewest rows of near values that make a group.
const FEW_ROWS: usize = 10;
/// The range that is shown: from 5 to 95 % of the rows.
const RANGE: (f64, f64) = (0.05, 0.95);
/// Lines that one panel takes, and panels that are drawn at full height.
const MOST_LINES: usize = 6;

/// Results over what was varied. `over` names one or two of the varied quantities: the only ones, or the first, if it is
/// empty. `wanted` names results by their column (`peak_force_N[A1|wall]`), or all of a kind (`peak_force`).
///
/// # Errors
/// For a name that the sweep does not have, and for a sweep that varies nothing but curves.
pub(crate) fn sweep(
    title: &str,
    columns: &SweepColumns,
    over: &[String],
    wanted: &[String],
) -> Result<Chart, Error> {
    let varied: Vec<&ResultColumn> =
        columns.varied.iter().filter(|column| distinct(column).len() > 1).collect();
    if varied.is_empty() {
        return Err(error!(
            Plot,
            "the sweep varies no numeric quantity, so there is nothing to plot against"
        ));
    }
    let is_grid = |column: &ResultColumn| {
        let values = distinct(column).len();
        values <= MOST_VALUES && (varied.len() == 1 || 2 * values <= column.values.len())
    };
    let chosen: Vec<&ResultColumn> = match over {
        [] if varied.len() == 2 && varied.iter().all(|column| is_grid(column)) => varied.clone(),
        [] => varied[..1].to_vec(),
        names => {
            let found = names.iter().map(|name| {
                let of =
                    varied.iter().find(|column| column.name == *name || bare(&column.name) == name);
                if columns.curves.contains(name) {
                    return Err(error!(
                        Plot,
                        "{name} is a choice of curves, and only numbers are an axis: plot the rows of each curve apart"
                    ));
                }
                of.copied().ok_or_else(|| unknown("varied quantity", name, varied.iter().copied()))
            });
            found.collect::<Result<_, _>>()?
        }
    };
    let results = results(columns, wanted)?;
    let is_empty = |result: &&&ResultColumn| !result.values.iter().any(|value| value.is_finite());
    if let Some(result) = results.iter().find(is_empty) {
        return Err(no_result(result));
    }
    let mut chart = match chosen[..] {
        [x] => {
            let others_vary = varied.len() > 1 || !columns.curves.is_empty();
            over_one(title, x, &results, is_grid(x), others_vary)
        }
        [x, y] => over_two(title, [x, y], &results, [is_grid(x), is_grid(y)])?,
        _ => return Err(error!(Plot, "results are drawn over one or two varied quantities")),
    };
    let others = varied.iter().filter(|column| !chosen.iter().any(|c| c.name == column.name));
    let others = others.map(|column| &column.name).chain(&columns.curves);
    let others: Vec<&str> = others.map(|name| &**name).collect();
    if !others.is_empty() {
        chart.notes.push(format!("Also varied: {}.", others.join(", ")));
    }
    for result in results.iter().filter(|result| result.name != OVER_LIMITS) {
        let missing = result.values.iter().filter(|value| !value.is_finite()).count();
        if missing > 0 {
            let of = result.values.len();
            chart.notes.push(format!("{}: {missing} of {of} rows have no number.", result.name));
        }
    }
    let seen = chosen[0].values.len() as u64;
    if seen < columns.rows {
        chart.notes.push(format!("From {seen} of {} rows, chosen by their item.", columns.rows));
    }
    Ok(chart)
}

fn no_result(result: &ResultColumn) -> Error {
    error!(Plot, "no row has a number in {}: the column message says why", result.name)
}

fn unknown<'a>(what: &str, name: &str, all: impl Iterator<Item = &'a ResultColumn>) -> Error {
    let all: Vec<&str> = all.map(|column| &*column.name).collect();
    let all = all.join(", ");
    let guess = hint(name, &all);
    error!(Plot, "the sweep has no {what} \"{name}\": expected one of {all}{guess}")
}

/// The results that are asked for; the largest deflections, or the first of all, if none are.
fn results<'a>(
    columns: &'a SweepColumns,
    wanted: &[String],
) -> Result<Vec<&'a ResultColumn>, Error> {
    let named = |name: &str| {
        // As a plan names it.
        let planned: Option<ResultName> = serde_json::from_value(name.into()).ok();
        let planned = RESULTS.iter().find(|(result, _)| planned == Some(*result));
        let is = |column: &&ResultColumn| {
            column.name == name
                || kind(&column.name) == name
                || planned.is_some_and(|(_, quantity)| *quantity == bare(&column.name))
        };
        columns.results.iter().filter(is).collect::<Vec<_>>()
    };
    if wanted.is_empty() {
        let usual = named("max_deflection");
        return Ok(if usual.is_empty() { columns.results.iter().take(1).collect() } else { usual });
    }
    let mut found = Vec::new();
    for name in wanted {
        let of = named(name);
        if of.is_empty() {
            return Err(unknown("result", name, columns.results.iter()));
        }
        found.extend(of);
    }
    Ok(found)
}

/// A column's name without what it is of: `peak_force_N`.
fn bare(name: &str) -> &str {
    name.split('[').next().unwrap_or(name)
}

/// What it is of: `A1|wall`, or the quantity itself.
fn whose(name: &str) -> &str {
    name.split_once('[').map_or(name, |(_, of)| of.trim_end_matches(']'))
}

/// Endings of quantities, with the unit that they are shown in and its share of SI's.
const UNITS: [(&str, &str, f64); 7] = [
    ("_m_per_s2", "g", 1.0 / STANDARD_GRAVITY_M_PER_S2),
    ("_m_per_s", "m/s", 1.0),
    ("_kg", "t", 1e-3),
    ("_N", "N", 1.0),
    ("_J", "J", 1.0),
    ("_s", "ms", 1e3),
    ("_m", "m", 1.0),
];

/// A quantity without its unit: `peak_force`.
fn kind(name: &str) -> &str {
    let bare = bare(name);
    UNITS.iter().find_map(|(ending, ..)| bare.strip_suffix(ending)).unwrap_or(bare)
}

fn axis(column: &ResultColumn, is_varied: bool) -> Axis {
    let (bare, words) = (bare(&column.name), kind(&column.name).replace('_', " "));
    let largest =
        column.values.iter().filter(|v| v.is_finite()).fold(0.0, |l: f64, v| l.max(v.abs()));
    let unit = UNITS.iter().find(|(ending, ..)| bare.ends_with(ending));
    match unit {
        // Impact speeds are in km/h in this field.
        Some((_, "m/s", _)) if is_varied => Axis::new(&words, "km/h", 3.6),
        Some((_, unit @ ("N" | "J"), _)) => Axis::prefixed(&words, unit, largest),
        Some((_, unit, scale)) => Axis::new(&words, unit, *scale),
        None => Axis::new(&words, "", 1.0),
    }
}

fn named_axis(column: &ResultColumn) -> Axis {
    let (axis, values) = (axis(column, true), distinct(column));
    // Not from 0: what was not varied so far says nothing.
    let axis = axis.over(values[0], values[values.len() - 1]);
    Axis { quantity: format!("{} {}", axis.quantity, whose(&column.name)), ..axis }
}

/// Its values without repetitions, rising.
fn distinct(column: &ResultColumn) -> Vec<f64> {
    let mut values: Vec<f64> = column.values.iter().copied().filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// Rows in groups of equal or near values of a quantity, of near ones at least `least`: the middle of each, and its rows.
fn groups(column: &ResultColumn, is_grid: bool, least: usize) -> Vec<(f64, Vec<usize>)> {
    let mut rows: Vec<usize> =
        (0..column.values.len()).filter(|&k| column.values[k].is_finite()).collect();
    let of = |k: &usize| column.values[*k];
    order::sort(&mut rows, |a, b| of(a).total_cmp(&of(b)));
    if is_grid {
        return rows.chunk_by(|a, b| of(a) == of(b)).map(|g| (of(&g[0]), g.to_vec())).collect();
    }
    let count = (rows.len() / least).clamp(1, BINS);
    let middle = |group: &[usize]| 0.5 * (of(&group[0]) + of(&group[group.len() - 1]));
    let cut = |i: usize| i * rows.len() / count;
    let groups = (0..count).map(|i| &rows[cut(i)..cut(i + 1)]).filter(|group| !group.is_empty());
    groups.map(|group| (middle(group), group.to_vec())).collect()
}

/// By linear interpolation between order statistics; NaN without values.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = share * last as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    sorted[low] + (sorted[high] - sorted[low]) * (at - at.floor())
}

fn sorted(result: &ResultColumn, rows: &[usize]) -> Vec<f64> {
    let mut values: Vec<f64> =
        rows.iter().map(|&k| result.values[k]).filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values
}

fn over_one(
    title: &str,
    x: &ResultColumn,
    results: &[&ResultColumn],
    is_grid: bool,
    others_vary: bool,
) -> Chart {
    let groups = groups(x, is_grid, FEW_ROWS);
    let most = groups.iter().map(|(_, rows)| rows.len()).max().unwrap_or_default();
    let has_range = (is_grid || others_vary && groups.len() > 2) && most >= LEAST_ROWS;
    // So few rows do not show what the other quantities do: each is drawn as a point.
    let is_grouped = has_range || is_grid && (most == 1 || !others_vary);
    let mut panels: Vec<Panel> = Vec::new();
    let mut kinds: Vec<&str> = Vec::new();
    for result in results {
        let kind = kind(&result.name);
        let at = kinds.iter().rposition(|other| *other == kind);
        let at = at.filter(|&at| !has_range && panels[at].series.len() < MOST_LINES);
        let at = at.unwrap_or_else(|| {
            kinds.push(kind);
            panels.push(Panel::new(named_axis(x), axis(result, false)));
            panels.len() - 1
        });
        add_line(&mut panels[at], result, x, &groups, (is_grouped, has_range));
    }
    let chart = Chart::row(title, panels);
    if chart.panels.len() > MOST_LINES { Chart { height: SMALL, ..chart } } else { chart }
}

fn add_line(
    panel: &mut Panel,
    result: &ResultColumn,
    x: &ResultColumn,
    groups: &[(f64, Vec<usize>)],
    (is_grouped, has_range): (bool, bool),
) {
    let (look, name) = (panel.series.len(), whose(&result.name));
    if !is_grouped {
        let points = Series::line(name, look, x.values.clone(), result.values.clone());
        panel.series.push(points.shown(Shown::Points));
        return;
    }
    let middles: Vec<f64> = groups.iter().map(|(middle, _)| *middle).collect();
    if has_range && result.name == OVER_LIMITS {
        add_share(panel, result, middles, groups);
        return;
    }
    let of: Vec<Vec<f64>> = groups.iter().map(|(_, rows)| sorted(result, rows)).collect();
    let at = |share: f64| of.iter().map(|values| quantile(values, share)).collect::<Vec<f64>>();
    let name = if has_range { "median" } else { name };
    if has_range {
        panel.title = whose(&result.name).into();
        panel.bands.push(Band {
            name: "5 to 95 % of the runs".into(),
            look,
            x: middles.clone(),
            low: at(RANGE.0),
            high: at(RANGE.1),
            is_stacked: false,
        });
    }
    panel.series.push(Series::line(name, look, middles, at(0.5)));
}

/// The share of the runs that are over a limit: a median of yes and no says nothing. Runs without a verdict may be either.
fn add_share(
    panel: &mut Panel,
    result: &ResultColumn,
    middles: Vec<f64>,
    groups: &[(f64, Vec<usize>)],
) {
    let mut unknown = 0;
    let shares = groups.iter().map(|(_, rows)| {
        let known = sorted(result, rows);
        unknown += rows.len() - known.len();
        let (over, count) = (known.iter().sum::<f64>(), rows.len() as f64);
        let most = over + count - known.len() as f64;
        let interval = |runs: f64| share_interval(runs / count, rows.len() as u64);
        (over / count, (interval(over).0, interval(most).1))
    });
    let (shares, (low, high)): (Vec<f64>, (Vec<f64>, Vec<f64>)) = shares.unzip();
    panel.y = Axis::new("share of runs over a limit", "%", 1e2).over(0.0, 1.0);
    let mut name = "95 % confidence interval if drawn at random".to_string();
    if unknown > 0 {
        name.push_str(&format!("; {} without a verdict may be either", counted(unknown, "run")));
    }
    let x = middles.clone();
    panel.bands.push(Band { name, look: 0, x, low, high, is_stacked: false });
    panel.series.push(Series::line("known to be over a limit", 0, middles, shares));
}

/// A map for each result: the mean over the rows of each cell, by the depth of a colour.
fn over_two(
    title: &str,
    [x, y]: [&ResultColumn; 2],
    results: &[&ResultColumn],
    is_grid: [bool; 2],
) -> Result<Chart, Error> {
    let (columns, rows) = (groups(x, is_grid[0], 1), groups(y, is_grid[1], 1));
    let edges = |groups: &[(f64, Vec<usize>)]| {
        let middles: Vec<f64> = groups.iter().map(|(middle, _)| *middle).collect();
        let step = |k: usize| middles.get(k + 1).map(|next| 0.5 * (next - middles[k]));
        let first = middles[0] - step(0).unwrap_or(0.5);
        let last = middles.len() - 1;
        let end = middles[last] + last.checked_sub(1).and_then(step).unwrap_or(0.5);
        let between = middles.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        std::iter::once(first).chain(between).chain([end]).collect::<Vec<f64>>()
    };
    let (x_edges, y_edges) = (edges(&columns), edges(&rows));
    let row_of = {
        let mut row_of = vec![usize::MAX; y.values.len()];
        for (at, (_, members)) in rows.iter().enumerate() {
            members.iter().for_each(|&k| row_of[k] = at);
        }
        row_of
    };
    let mut chart = Chart::row(title, Vec::new());
    for result in results {
        let (own, mut panel) = (axis(result, false), Panel::new(named_axis(x), named_axis(y)));
        let (mut cells, mut unknown) = (Vec::new(), 0);
        for (i, (_, members)) in columns.iter().enumerate() {
            for j in 0..rows.len() {
                let inside: Vec<usize> =
                    members.iter().copied().filter(|&k| row_of[k] == j).collect();
                let values = sorted(result, &inside);
                let (sum, known, all) = (values.iter().sum::<f64>(), values.len(), inside.len());
                let mean = |of: usize, most: usize| (sum + most as f64) / of as f64;
                if result.name == OVER_LIMITS && all > 0 {
                    // Runs without a verdict may be either.
                    unknown += all - known;
                    cells.push((i, j, [mean(all, 0), mean(all, all - known)]));
                } else if known > 0 {
                    cells.push((i, j, [mean(known, 0); 2]));
                }
            }
        }
        if cells.is_empty() {
            return Err(no_result(result));
        }
        let all = cells.iter().map(|(.., [mean, _])| *mean);
        let (low, high) =
            all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let share = |mean: f64| if high > low { (mean - low) / (high - low) } else { 0.0 };
        panel.cells = cells
            .iter()
            .map(|&(i, j, [mean, most])| Cell {
                x: (x_edges[i], x_edges[i + 1]),
                y: (y_edges[j], y_edges[j + 1]),
                depth: share(mean),
                text: match three_digits(mean * own.scale) {
                    text if most > mean => format!("{text} to {}", three_digits(most * own.scale)),
                    text => text,
                },
            })
            .collect();
        panel.x = panel.x.over(x_edges[0], x_edges[columns.len()]);
        panel.y = panel.y.over(y_edges[0], y_edges[rows.len()]);
        let unit = if own.unit.is_empty() { String::new() } else { format!(" {}", own.unit) };
        let (low, high) = (three_digits(low * own.scale), three_digits(high * own.scale));
        panel.title = match whose(&result.name) {
            of if of == result.name => own.label(),
            of => format!("{} {of}{}", own.quantity, unit_in_brackets(&own.unit)),
        };
        let either = match unknown {
            0 => String::new(),
            _ => format!("; {} without a verdict may be either", counted(unknown, "run")),
        };
        chart.notes.push(format!(
            "{}: from {low}{unit} (pale) to {high}{unit} (deep); means of each cell{either}.",
            panel.title
        ));
        chart.panels.push(panel);
    }
    Ok(chart)
}

fn unit_in_brackets(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" [{unit}]") }
}

/// `0.412`, `12.3`, `1234`.
fn three_digits(value: f64) -> String {
    let before = if value == 0.0 { 1 } else { libm::log10(value.abs()).floor() as i32 + 1 };
    format!("{value:.*}", usize::try_from((3 - before).clamp(0, 6)).unwrap_or(0)).replace('-', "−")
}
