//! Multi-body runs over time: speeds, accelerations, forces, energies; force over deflection; and
//! the speeds of a train by several methods.

use crate::assess::train::TrainComparison;
use crate::error::{Error, ErrorCode, error};
use crate::guess::hint;
use crate::history::{TimeGap, time_gaps};
use crate::multibody::{BodyHistory, Run, STANDARD_GRAVITY_M_PER_S2};
use crate::order;
use crate::plot::{Axis, Band, Chart, Panel, Series, Shown};
use crate::rating::acceptance::StageRecord;
use crate::scenario::{PLATES, Prepared};
use crate::signal::{CfcError, cfc, mean_rates};
use crate::words::counted;

/// What of a run is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Speeds of the bodies over time.
    Velocity,
    /// Accelerations of the bodies over time, in g, filtered.
    Acceleration,
    /// Forces of the interfaces over time.
    Force,
    /// Forces of the interfaces over their deflection.
    Crush,
    /// Energy over time: what each interface has taken, and what is still kinetic.
    Energy,
}

impl Quantity {
    /// Whether it is of interfaces, else of bodies.
    pub fn is_of_interfaces(self) -> bool {
        matches!(self, Self::Force | Self::Crush | Self::Energy)
    }
}

/// Histories of a body.
#[derive(Clone, Debug, PartialEq)]
struct BodyMotion {
    name: String,
    /// Speed in m/s, one value per time.
    v_m_per_s: Vec<f64>,
    /// Whether it is drawn without being asked for: crush zones are not.
    is_usual: bool,
}

/// Histories of an interface.
#[derive(Clone, Debug, PartialEq)]
struct InterfaceMotion {
    name: String,
    /// Deflection in m, one value per time.
    deflection_m: Vec<f64>,
    force_n: Vec<f64>,
    /// Stored, dissipated and, if that is known of each interface, damped in J; empty where they are not known.
    taken_j: Vec<f64>,
    /// Deflection in m up to which its curve has data.
    data_end_m: f64,
    /// Whether it is drawn without being asked for: plates that meet are not.
    is_usual: bool,
}

/// A run as it is drawn: from a scenario, or from the file of a result.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Times in s.
    time_s: Vec<f64>,
    /// In the order of the legend.
    bodies: Vec<BodyMotion>,
    /// In the order of the legend.
    interfaces: Vec<InterfaceMotion>,
    /// Kinetic energy in J; empty where the masses are not known.
    kinetic_j: Vec<f64>,
    /// What is neither kinetic nor taken by an interface.
    rest: &'static str,
    /// Where the curves come from.
    notes: Vec<String>,
}

/// Whether a body is the crush zone of another one, by their names.
fn is_crush_zone(name: &str, all: &[String]) -> bool {
    let vehicle = name.strip_suffix(" front").or(name.strip_suffix(" rear"));
    vehicle.is_some_and(|vehicle| all.iter().any(|other| other == vehicle))
}

fn not_csv(error: csv::Error) -> Error {
    Error::below(ErrorCode::Plot, error)
}

impl Motion {
    /// Intervals without a row, far longer than those around them: nothing is known there.
    pub(crate) fn gaps(&self) -> Vec<TimeGap> {
        time_gaps(&self.time_s)
    }

    /// Of the CSV file of a result, as `crumple simulate -o` writes it.
    ///
    /// # Errors
    /// If it has other columns, or fields that are not finite numbers.
    pub fn of_csv(text: &[u8]) -> Result<Self, Error> {
        let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
        let mut table = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(text);
        let header = table.headers().map_err(not_csv)?.clone();
        let line = header.position().map_or(1, csv::Position::line);
        let header: Vec<String> = header.iter().map(String::from).collect();
        let other_columns = || {
            let found = header.join(",");
            error!(
                Plot,
                "line {line}: expected the columns of crumple simulate -o: \"time_s\", then for example \"v_m_per_s[A1]\" or \"force_N[A1|A2]\"; found \"{found}\""
            )
        };
        if header.first().map(String::as_str) != Some("time_s") || header.len() < 2 {
            return Err(other_columns());
        }
        let mut columns = vec![Vec::new(); header.len()];
        for row in table.records() {
            let row = row.map_err(not_csv)?;
            let line = row.position().map_or(0, csv::Position::line);
            if row.len() > header.len() {
                return Err(error!(
                    Plot,
                    "line {line}: expected {} fields, one for each column, found {}",
                    header.len(),
                    row.len()
                ));
            }
            for (k, column) in columns.iter_mut().enumerate() {
                let found = row.get(k).unwrap_or_default();
                let number = found.parse::<f64>().ok().filter(|number| number.is_finite());
                column.push(number.ok_or_else(|| {
                    let at = k + 1;
                    error!(Plot, "line {line}, column {at}: expected a number, found \"{found}\"")
                })?);
            }
            if let [.., before, time] = columns[0][..]
                && time <= before
            {
                return Err(error!(
                    Plot,
                    "line {line}, column 1: expected a time after {before} s, found {time}: rows must be in the order of time"
                ));
            }
        }
        if columns[0].is_empty() {
            return Err(error!(Plot, "there are no rows below the header: was the run stopped?"));
        }
        let of = |quantity: &str, name: &str| {
            let wanted = format!("{quantity}[{name}]");
            header.iter().position(|h| *h == wanted).map(|k| columns[k].clone()).unwrap_or_default()
        };
        let names = |quantity: &'static str| {
            let inside = move |h: &String| {
                Some(h.strip_prefix(quantity)?.strip_prefix('[')?.strip_suffix(']')?.to_string())
            };
            header.iter().filter_map(inside).collect::<Vec<String>>()
        };
        let known = names("v_m_per_s");
        let bodies: Vec<BodyMotion> = known
            .iter()
            .cloned()
            .map(|name| BodyMotion {
                v_m_per_s: of("v_m_per_s", &name),
                is_usual: !is_crush_zone(&name, &known),
                name,
            })
            .collect();
        let interfaces: Vec<InterfaceMotion> = names("force_N")
            .into_iter()
            .map(|name| InterfaceMotion {
                deflection_m: of("deflection_m", &name),
                force_n: of("force_N", &name),
                taken_j: Vec::new(),
                data_end_m: f64::INFINITY,
                is_usual: true,
                name,
            })
            .collect();
        if bodies.is_empty() && interfaces.is_empty() {
            return Err(other_columns());
        }
        let time_s = columns.swap_remove(0);
        Ok(Self { time_s, bodies, interfaces, kinetic_j: Vec::new(), rest: "", notes: Vec::new() })
    }

    /// Of a run of a scenario. `notes` say where its curves come from, a line each.
    pub fn of_run(prepared: &Prepared, run: &Run, notes: Vec<String>) -> Self {
        let bodies = prepared.chain.bodies();
        let body = |&i: &usize| BodyMotion {
            name: bodies[i].name.clone(),
            v_m_per_s: run.bodies[i].v_m_per_s.clone(),
            is_usual: prepared.vehicles.contains(&i),
        };
        let interfaces = prepared.chain.interfaces().iter().zip(&run.interfaces);
        let kinetic = |t: usize| {
            let masses_kg = run.masses_kg(&prepared.chain, t).into_iter();
            let of = |(m, h): (f64, &BodyHistory)| 0.5 * m * h.v_m_per_s[t] * h.v_m_per_s[t];
            masses_kg.zip(&run.bodies).map(of).sum()
        };
        Self {
            time_s: run.time_s.clone(),
            bodies: prepared.order.iter().map(body).collect(),
            interfaces: interfaces
                .zip(&prepared.used)
                .map(|((interface, history), used)| InterfaceMotion {
                    name: interface.name.clone(),
                    deflection_m: history.deflection_m.clone(),
                    force_n: history.force_n.clone(),
                    taken_j: (0..history.stored_j.len())
                        .map(|t| {
                            let damped_j = history.damped_so_far_j.get(t).unwrap_or(&0.0);
                            history.stored_j[t] + history.dissipated_j[t] + damped_j
                        })
                        .collect(),
                    data_end_m: history.data_end_m,
                    is_usual: used.curve != PLATES,
                })
                .collect(),
            kinetic_j: (0..run.time_s.len()).map(kinetic).collect(),
            rest: if run.interfaces.iter().any(|of| of.damped_so_far_j.is_empty()) {
                "rate, stopped mass, dampers, resistance"
            } else if run.ledger.resisted_j == 0.0 {
                "error of the method"
            } else {
                "resistance"
            },
            notes,
        }
    }

    /// Every interface as a stage of the run.
    pub(crate) fn stages(&self) -> Vec<StageRecord<'_>> {
        let interfaces = self.interfaces.iter();
        let stages = interfaces.map(|InterfaceMotion { name, deflection_m, force_n, .. }| {
            StageRecord { name, time_s: &self.time_s, deflection_m, force_n }
        });
        stages.collect()
    }

    /// Whether it has values of a quantity, of any body or interface.
    fn holds(&self, quantity: Quantity) -> bool {
        let (mut bodies, mut interfaces) = (self.bodies.iter(), self.interfaces.iter());
        match quantity {
            Quantity::Velocity | Quantity::Acceleration => {
                bodies.any(|body| !body.v_m_per_s.is_empty())
            }
            Quantity::Crush => interfaces.any(|of| !of.deflection_m.is_empty()),
            Quantity::Force => interfaces.any(|of| !of.force_n.is_empty()),
            // That of a result is refused where it is drawn.
            Quantity::Energy => true,
        }
    }

    /// Bodies or interfaces by name, with whether each is drawn without being asked for.
    fn names(&self, of_interfaces: bool) -> Vec<(&str, bool)> {
        if of_interfaces {
            self.interfaces.iter().map(|i| (&*i.name, i.is_usual)).collect()
        } else {
            self.bodies.iter().map(|b| (&*b.name, b.is_usual)).collect()
        }
    }
}

/// Lines that one panel takes; more get a panel each.
const MOST_LINES: usize = 6;
/// Height of a panel among many, in pixels.
pub(super) const SMALL: f64 = 110.0;
/// Interfaces that the stack of energies names, as many as there are colours for; of more, all but five are one area.
const MOST_AREAS: usize = 6;
/// Class of the filter that accelerations of vehicles are compared with.
pub(crate) const USUAL_CLASS: u32 = 60;

/// One quantity of a run, or of several over one another, each with a name. `chosen` names the bodies or
/// interfaces; the vehicles, and all interfaces but plates, if it is empty. Accelerations are filtered with a channel
/// frequency class of SAE J211-1. More than six lines are drawn in a panel per body or interface.
///
/// # Errors
/// For a name that no run has, and for a quantity that a result does not hold.
pub fn motion(
    title: &str,
    runs: &[(String, Motion)],
    quantity: Quantity,
    chosen: &[String],
    filter_class: u32,
) -> Result<Chart, Error> {
    if let Some((name, _)) = runs.iter().find(|(_, run)| !run.holds(quantity)) {
        let missing = match quantity {
            Quantity::Velocity | Quantity::Acceleration => {
                "speeds of bodies: expected columns such as v_m_per_s[A1]"
            }
            Quantity::Crush => "deflections: expected columns such as deflection_m[A1|A2]",
            _ => "forces of interfaces: expected columns such as force_N[A1|A2]",
        };
        return Err(error!(Plot, "{name} has no {missing}"));
    }
    let short = runs.iter().find(|(_, run)| run.time_s.len() < 2);
    if let (Some((name, _)), Quantity::Acceleration) = (short, quantity) {
        return Err(error!(Plot, "{name} has one row: an acceleration needs two or more"));
    }
    let names = names(runs, quantity, chosen)?;
    let mut chart = match quantity {
        Quantity::Energy => {
            // One colour for an interface in all runs; those that take the most have one.
            let mut of: Vec<(&str, f64)> = Vec::new();
            for interface in runs.iter().flat_map(|(_, run)| areas(run, &names).0) {
                match of.iter_mut().find(|(name, _)| *name == interface.name) {
                    Some((_, most_j)) => *most_j = most_j.max(most(&interface.taken_j)),
                    None => of.push((&interface.name, most(&interface.taken_j))),
                }
            }
            let mut largest: Vec<f64> = of.iter().map(|(_, most_j)| *most_j).collect();
            order::sort(&mut largest, |a, b| b.total_cmp(a));
            let least_j = largest.get(MOST_AREAS - 1).copied().unwrap_or(0.0);
            let looks = of.iter().filter(|(_, most_j)| of.len() <= MOST_AREAS || *most_j > least_j);
            let looks: Vec<String> = looks.map(|(name, _)| name.to_string()).collect();
            let panels = runs.iter().map(|(name, run)| energy(name, run, &looks, runs.len() > 1));
            Chart::row(title, panels.collect::<Result<_, _>>()?)
        }
        _ => lines(title, runs, quantity, &names, filter_class),
    };
    for (name, run) in runs {
        chart.notes.extend(run.notes.iter().map(|note| match runs {
            [_] => note.clone(),
            _ => format!("{name}: {note}"),
        }));
    }
    Ok(chart)
}

/// The names that are drawn, in the order of the first run that has them.
fn names(
    runs: &[(String, Motion)],
    quantity: Quantity,
    chosen: &[String],
) -> Result<Vec<String>, Error> {
    let mut known: Vec<(&str, bool)> = Vec::new();
    for (_, run) in runs {
        for (name, is_usual) in run.names(quantity.is_of_interfaces()) {
            if known.iter().all(|(other, _)| *other != name) {
                known.push((name, is_usual));
            }
        }
    }
    for name in chosen {
        if known.iter().all(|(known, _)| known != name) {
            let what = if quantity.is_of_interfaces() { "interface" } else { "body" };
            let all: Vec<&str> = known.iter().map(|(known, _)| *known).collect();
            let (all, guess) = (all.join(", "), hint(name, &all.join(", ")));
            return Err(error!(
                Plot,
                "there is no {what} \"{name}\": expected one of {all}{guess}"
            ));
        }
    }
    let is_drawn = |(name, is_usual): &(&str, bool)| match chosen {
        [] => *is_usual,
        chosen => chosen.iter().any(|chosen| chosen == name),
    };
    Ok(known.into_iter().filter(is_drawn).map(|(name, _)| name.into()).collect())
}

/// A line of a run, before it is known in which panel it is.
struct Line<'a> {
    of: &'a str,
    run: usize,
    shown: Shown,
    x: Vec<f64>,
    y: Vec<f64>,
}

fn lines(
    title: &str,
    runs: &[(String, Motion)],
    quantity: Quantity,
    names: &[String],
    filter_class: u32,
) -> Chart {
    let mut lines = Vec::new();
    let mut notes: Vec<String> = Vec::new();
    for (k, (_, run)) in runs.iter().enumerate() {
        for name in names {
            let body = run.bodies.iter().find(|body| body.name == *name);
            let interface = run.interfaces.iter().find(|interface| interface.name == *name);
            let over_time = |y| (Shown::Line, run.time_s.clone(), y);
            let parts = match (quantity, body, interface) {
                (Quantity::Velocity, Some(body), _) => vec![over_time(body.v_m_per_s.clone())],
                (Quantity::Acceleration, Some(body), _) => {
                    let (time_s, a) = filtered(run, body, filter_class, &mut notes);
                    vec![(Shown::Line, time_s, a)]
                }
                (Quantity::Force, _, Some(of)) => vec![over_time(of.force_n.clone())],
                (Quantity::Crush, _, Some(of)) => crush(of),
                _ => Vec::new(),
            };
            lines.extend(parts.into_iter().map(|(shown, x, y)| Line {
                of: name,
                run: k,
                shown,
                x,
                y,
            }));
        }
    }
    let (x, y) = axes(quantity, &lines);
    let title = match quantity {
        Quantity::Acceleration if notes.is_empty() => &format!("{title}, CFC {filter_class}"),
        _ => title,
    };
    let count = runs.len() * names.len();
    let label = |line: &Line<'_>, is_alone: bool| match (line.shown, is_alone, runs) {
        (Shown::Assumed, ..) => "beyond the data of the curve".into(),
        (_, false, [_]) => line.of.to_string(),
        (_, false, _) => format!("{}, {}", line.of, runs[line.run].0),
        (_, true, [_]) => y.quantity.clone(),
        (_, true, _) => runs[line.run].0.clone(),
    };
    let mut chart = if count <= MOST_LINES {
        let mut panel = Panel::new(x, y.clone());
        for line in &lines {
            let at = names.iter().position(|name| name == line.of).unwrap_or_default();
            let look = line.run * names.len() + at;
            let name = label(line, false);
            let series = Series::line(&name, look, line.x.clone(), line.y.clone());
            panel.series.push(series.shown(line.shown));
        }
        Chart::of(title, panel)
    } else {
        let panels = names.iter().map(|name| {
            let mut panel = Panel::new(x.clone(), y.clone());
            panel.title.clone_from(name);
            for line in lines.iter().filter(|line| line.of == name) {
                let name = label(line, true);
                let series = Series::line(&name, line.run, line.x.clone(), line.y.clone());
                panel.series.push(series.shown(line.shown));
            }
            panel
        });
        Chart { height: SMALL, ..Chart::row(title, panels.collect()) }
    };
    chart.notes = notes;
    chart
}

/// Axes that are the same for every panel, so that these can be compared.
fn axes(quantity: Quantity, lines: &[Line<'_>]) -> (Axis, Axis) {
    let largest = |of: for<'l> fn(&'l Line<'_>) -> &'l Vec<f64>| {
        let values = lines.iter().flat_map(of).copied().filter(|v| v.is_finite());
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
    };
    let (low, high) = largest(|line| &line.y);
    let y = match quantity {
        Quantity::Velocity => Axis::new("speed", "m/s", 1.0),
        Quantity::Acceleration => Axis::new("acceleration", "g", 1.0 / STANDARD_GRAVITY_M_PER_S2),
        _ => Axis::prefixed("force", "N", low.abs().max(high.abs())),
    };
    let x = match quantity {
        Quantity::Crush => Axis::new("deflection", "m", 1.0),
        _ => time(),
    };
    let room = 0.04 * (high - low);
    let y = y.over((low - room).min(0.0), (high + room).max(0.0));
    // Interfaces that pull do so at negative deflections.
    let (start, end) = largest(|line| &line.x);
    let x = if quantity == Quantity::Crush { x.over(1.02 * start.min(0.0), 1.02 * end) } else { x };
    (x, y)
}

/// A body's mean accelerations between the outputs, filtered, with their times; as they are, and why, where the filter does
/// not take them.
fn filtered(
    run: &Motion,
    body: &BodyMotion,
    class: u32,
    notes: &mut Vec<String>,
) -> (Vec<f64>, Vec<f64>) {
    let (time_s, a_m_per_s2) = mean_rates(&run.time_s, &body.v_m_per_s);
    let values = match cfc::filter_from_rest(class, &time_s, &a_m_per_s2) {
        Ok(filtered) => filtered.values,
        Err(error) => {
            let why = match error {
                CfcError::TooCoarse { class, .. } => {
                    format!("the output interval is too long for CFC {class}")
                }
                CfcError::Uneven { .. } => "the output intervals are not equal".into(),
            };
            let note = format!("Not filtered: {why}.");
            if !notes.contains(&note) {
                notes.push(note);
            }
            a_m_per_s2
        }
    };
    (time_s, values)
}

type Part = (Shown, Vec<f64>, Vec<f64>);

/// Force over deflection from where the interface closes, before which its gap is open, with the slack of a coupling that pulls; from
/// where it is crushed further than its curve has data it is another part.
fn crush(interface: &InterfaceMotion) -> Vec<Part> {
    let pairs = || interface.deflection_m.iter().copied().zip(interface.force_n.iter().copied());
    let pulled_m = pairs().filter(|(_, f)| *f != 0.0).map(|(d, _)| d).fold(0.0, f64::min);
    let mut closed: Vec<(f64, f64)> = pairs()
        .skip_while(|(d, f)| *d <= 0.0 && *f == 0.0)
        .filter(|(d, f)| *d > pulled_m || *f != 0.0)
        .collect();
    if closed.first().is_some_and(|(d, _)| *d > 0.0) {
        closed.insert(0, (0.0, 0.0));
    }
    let end = closed.iter().position(|(d, _)| *d > interface.data_end_m).unwrap_or(closed.len());
    let known = closed[..end].iter().copied().unzip();
    // They meet in the last point of the first.
    let beyond = closed[end.saturating_sub(1)..].iter().copied().unzip();
    let part = |shown, (d, f): (Vec<f64>, Vec<f64>)| (shown, d, f);
    let parts = [part(Shown::Line, known), part(Shown::Assumed, beyond)];
    parts.into_iter().take(if end < closed.len() { 2 } else { 1 }).collect()
}

/// The most that an interface has taken: what springs back is gone at the end.
fn most(taken_j: &[f64]) -> f64 {
    taken_j.iter().copied().fold(0.0, f64::max)
}

/// The interfaces that have areas of their own, in the order of the chain, and the others that take energy.
fn areas<'a>(
    run: &'a Motion,
    names: &[String],
) -> (Vec<&'a InterfaceMotion>, Vec<&'a InterfaceMotion>) {
    let (mut of, mut others): (Vec<_>, Vec<_>) =
        run.interfaces.iter().enumerate().partition(|(_, of)| names.contains(&of.name));
    order::sort(&mut of, |(_, a), (_, b)| most(&b.taken_j).total_cmp(&most(&a.taken_j)));
    others.extend(of.split_off(if of.len() > MOST_AREAS { MOST_AREAS - 1 } else { of.len() }));
    order::sort_by_key(&mut of, |(place, _)| *place);
    others.retain(|(_, of)| most(&of.taken_j) > 0.0);
    let alone =
        |all: Vec<(usize, &'a InterfaceMotion)>| all.into_iter().map(|(_, of)| of).collect();
    (alone(of), alone(others))
}

/// What the interfaces have taken, one above the other, then what is still kinetic. `looks` has the names of the interfaces with areas
/// in the order of their colours.
fn energy(name: &str, run: &Motion, looks: &[String], is_named: bool) -> Result<Panel, Error> {
    if run.kinetic_j.is_empty() {
        return Err(error!(
            Plot,
            "{name} has no energies, which need the masses: give the scenario itself"
        ));
    }
    let start_j = run.kinetic_j.first().copied().unwrap_or_default();
    let mut panel = Panel::new(time(), Axis::prefixed("energy", "J", start_j));
    if is_named {
        panel.title = name.into();
    }
    let (of, others) = areas(run, looks);
    let look = |name: &str| looks.iter().position(|other| *other == name).unwrap_or(0);
    let mut parts: Vec<(String, usize, Vec<f64>)> =
        of.iter().map(|of| (of.name.clone(), look(&of.name), of.taken_j.clone())).collect();
    let states = run.time_s.len();
    let sum = |t: usize| others.iter().map(|of| of.taken_j[t]).sum();
    let sums: Vec<f64> = (0..states).map(sum).collect();
    if most(&sums) > 1e-3 * start_j {
        let look = looks.len().max(MOST_AREAS - 1);
        parts.push((counted(others.len(), "further interface"), look, sums));
    }
    let all = |t: usize| run.interfaces.iter().map(|of| of.taken_j[t]).sum::<f64>();
    let lost: Vec<f64> = (0..states).map(|t| start_j - run.kinetic_j[t] - all(t)).collect();
    // Below this it is the method's own error.
    if most(&lost) > 1e-3 * start_j {
        parts.push((run.rest.into(), MOST_AREAS, lost));
    }
    parts.push(("kinetic".into(), MOST_AREAS + 1, run.kinetic_j.clone()));
    let mut low = vec![0.0; states];
    for (name, look, values) in parts {
        let high: Vec<f64> =
            low.iter().zip(&values).map(|(low, value)| low + value.max(0.0)).collect();
        let x = run.time_s.clone();
        panel.bands.push(Band { name, look, x, low, high: high.clone(), is_stacked: true });
        low = high;
    }
    Ok(panel)
}

fn time() -> Axis {
    Axis::new("time", "ms", 1e3)
}

/// Methods that are parts of another; they are in the table, and more lines than looks would be
/// distinguished by nothing.
const ON_THE_WAY: [&str; 2] = ["rate_only", "rate_live"];

/// A panel for each vehicle, with FE's speed and that of every method, but for those that are parts
/// of `split_ends`.
pub fn train_speeds(title: &str, comparison: &TrainComparison) -> Chart {
    let speeds =
        comparison.fe.values().chain(comparison.rows.iter().flat_map(|r| r.velocities.values()));
    let (low, high) = speeds
        .flatten()
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    let room = 0.05 * (high - low);
    let panels = comparison.fe.iter().map(|(vehicle, fe)| {
        // One span for all, so that vehicles can be compared.
        let y = Axis::new("speed", "m/s", 1.0).over(low - room, high + room);
        let mut panel = Panel::new(time(), y);
        panel.title = vehicle.clone();
        let time_s = &comparison.time_s;
        panel.series.push(Series::line("FE", 3, time_s.clone(), fe.clone()).shown(Shown::Emphasis));
        // The look of FE is left out of those of the methods.
        let looks = [1, 0, 2, 4, 5, 6, 7].into_iter().cycle();
        let rows = comparison.rows.iter().filter(|row| !ON_THE_WAY.contains(&row.method.as_str()));
        for (row, look) in rows.zip(looks) {
            if let Some(speeds) = row.velocities.get(vehicle) {
                panel.series.push(Series::line(&row.method, look, time_s.clone(), speeds.clone()));
            }
        }
        panel
    });
    Chart::row(title, panels.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slack_of_a_coupling_has_no_force_and_a_flight_is_left_out() {
        let of = |pairs: &[(f64, f64)]| {
            let (deflection_m, force_n) = pairs.iter().copied().unzip();
            let (name, taken_j) = (String::new(), Vec::new());
            let interface = InterfaceMotion {
                name,
                deflection_m,
                force_n,
                taken_j,
                data_end_m: 1.0,
                is_usual: true,
            };
            let [(_, d, f)] = &crush(&interface)[..] else { panic!() };
            d.iter().copied().zip(f.iter().copied()).collect::<Vec<(f64, f64)>>()
        };
        let pushed = [(-0.1, 0.0), (0.1, 5e5), (0.05, 0.0)];
        let pulled = [(-0.02, 0.0), (-0.06, -4e5), (-0.02, 0.0), (0.1, 4e5)];
        let drawn = [&[(0.0, 0.0)], &pushed[1..], &pulled].concat();
        assert_eq!(of(&[&pushed[..], &pulled].concat()), drawn);
        // Without tension it flies apart and comes back.
        let again = [(-0.3, 0.0), (-2.0, 0.0), (0.2, 6e5)];
        let drawn = [&[(0.0, 0.0)], &pushed[1..], &again[2..]].concat();
        assert_eq!(of(&[&pushed[..], &again].concat()), drawn);
    }

    #[test]
    fn energies_add_up_to_the_first_though_springs_give_theirs_back() {
        let at = |k: usize| format!("I{k}");
        let interfaces = (0..8).map(|k| InterfaceMotion {
            name: at(k),
            deflection_m: vec![0.0; 3],
            force_n: vec![0.0; 3],
            // The last ones give it back.
            taken_j: vec![0.0, 10.0, if k < 4 { 10.0 } else { 0.0 }],
            data_end_m: 1.0,
            is_usual: true,
        });
        let run = Motion {
            time_s: vec![0.0, 1.0, 2.0],
            bodies: Vec::new(),
            interfaces: interfaces.collect(),
            kinetic_j: vec![100.0, 20.0, 60.0],
            rest: "resistance",
            notes: Vec::new(),
        };
        let names: Vec<String> = (0..8).map(at).collect();
        let looks: Vec<String> = areas(&run, &names).0.iter().map(|of| of.name.clone()).collect();
        let panel = energy("", &run, &looks, false).unwrap();
        let last = panel.bands.last().unwrap();
        assert_eq!((last.name.as_str(), &last.high), ("kinetic", &vec![100.0; 3]));
        let shown: Vec<&str> = panel.bands.iter().map(|band| band.name.as_str()).collect();
        let expected = ["I0", "I1", "I2", "I3", "I4", "3 further interfaces", "kinetic"];
        assert_eq!(shown, expected);
    }
}
