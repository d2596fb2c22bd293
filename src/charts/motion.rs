//! A multi-body run over time: speeds, accelerations, forces, energies; force over deflection; and
//! the speeds of a train by several methods; histories of a solver file, raw and filtered.

use crate::assess::train::TrainComparison;
use crate::error::{Error, ErrorCode, error};
use crate::history::History;
use crate::multibody::{Chain, Run};
use crate::plot::{Axis, Chart, Panel, Series, Shown};
use crate::signal::cfc;
use crate::unit::UnitSystem;

/// What of a run is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Speeds of the bodies over time.
    Velocity,
    /// Accelerations of the bodies over time.
    Acceleration,
    /// Forces of the interfaces over time.
    Force,
    /// Forces of the interfaces over their deflection.
    Crush,
    /// Kinetic, stored and dissipated energy over time.
    Energy,
}

/// Histories of a body.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BodyMotion {
    pub(crate) name: String,
    /// Speed in m/s, one value per time.
    pub(crate) v_m_per_s: Vec<f64>,
    pub(crate) a_m_per_s2: Vec<f64>,
}

/// Histories of an interface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct InterfaceMotion {
    pub(crate) name: String,
    /// Deflection in m, one value per time.
    pub(crate) deflection_m: Vec<f64>,
    pub(crate) force_n: Vec<f64>,
}

/// Energies of the whole chain, one value per time, in J.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Energies {
    pub(crate) kinetic_j: Vec<f64>,
    /// That would come back.
    pub(crate) stored_j: Vec<f64>,
    /// Lost in the interfaces.
    pub(crate) dissipated_j: Vec<f64>,
}

/// A run as it is drawn: from a scenario, or from the file of a result.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Times in s.
    pub time_s: Vec<f64>,
    /// In the order of the legend.
    pub(crate) bodies: Vec<BodyMotion>,
    /// In the order of the legend.
    pub(crate) interfaces: Vec<InterfaceMotion>,
    /// Absent where the masses are not known.
    pub(crate) energies: Option<Energies>,
}

fn not_csv(error: csv::Error) -> Error {
    Error::below(ErrorCode::Plot, error)
}

impl Motion {
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
        let bodies: Vec<BodyMotion> = names("v_m_per_s")
            .into_iter()
            .map(|name| BodyMotion {
                v_m_per_s: of("v_m_per_s", &name),
                a_m_per_s2: of("a_m_per_s2", &name),
                name,
            })
            .collect();
        let interfaces: Vec<InterfaceMotion> = names("force_N")
            .into_iter()
            .map(|name| InterfaceMotion {
                deflection_m: of("deflection_m", &name),
                force_n: of("force_N", &name),
                name,
            })
            .collect();
        if bodies.is_empty() && interfaces.is_empty() {
            return Err(other_columns());
        }
        Ok(Self { time_s: columns.swap_remove(0), bodies, interfaces, energies: None })
    }

    /// Of a run of a chain, with the bodies in the order of `order` (indices into the chain).
    pub fn of_run(chain: &Chain, run: &Run, order: &[usize]) -> Self {
        let body = |&i: &usize| BodyMotion {
            name: chain.bodies()[i].name.clone(),
            v_m_per_s: run.bodies[i].v_m_per_s.clone(),
            a_m_per_s2: run.bodies[i].a_m_per_s2.clone(),
        };
        let interfaces = chain.interfaces().iter().zip(&run.interfaces);
        let states = run.time_s.len();
        let sum = |of: &dyn Fn(usize) -> f64| (0..states).map(of).collect::<Vec<f64>>();
        let kinetic = |t: usize| {
            let bodies = chain.bodies().iter().zip(&run.bodies);
            bodies.map(|(b, h)| 0.5 * b.mass_kg * h.v_m_per_s[t] * h.v_m_per_s[t]).sum()
        };
        Self {
            time_s: run.time_s.clone(),
            bodies: order.iter().map(body).collect(),
            interfaces: interfaces
                .map(|(interface, history)| InterfaceMotion {
                    name: interface.name.clone(),
                    deflection_m: history.deflection_m.clone(),
                    force_n: history.force_n.clone(),
                })
                .collect(),
            energies: Some(Energies {
                kinetic_j: sum(&kinetic),
                stored_j: sum(&|t| run.interfaces.iter().map(|i| i.stored_j[t]).sum()),
                dissipated_j: sum(&|t| run.interfaces.iter().map(|i| i.dissipated_j[t]).sum()),
            }),
        }
    }

    /// The chart of one quantity; `None` for energies that are not known.
    pub fn chart(&self, title: &str, quantity: Quantity) -> Option<Chart> {
        let panel = match quantity {
            Quantity::Velocity => {
                self.of_bodies(Axis::new("speed", "m/s", 1.0), |body| &body.v_m_per_s)
            }
            Quantity::Acceleration => {
                self.of_bodies(Axis::new("acceleration", "m/s²", 1.0), |body| &body.a_m_per_s2)
            }
            Quantity::Force => {
                let series =
                    self.interfaces.iter().enumerate().map(|(k, i)| {
                        Series::line(&i.name, k, self.time_s.clone(), i.force_n.clone())
                    });
                Panel { series: series.collect(), ..Panel::new(time(), self.force_axis()) }
            }
            Quantity::Crush => self.crush(),
            Quantity::Energy => self.energy()?,
        };
        Some(Chart::of(title, panel))
    }

    fn of_bodies(&self, y: Axis, values: impl Fn(&BodyMotion) -> &Vec<f64>) -> Panel {
        let series = self.bodies.iter().enumerate().map(|(k, body)| {
            Series::line(&body.name, k, self.time_s.clone(), values(body).clone())
        });
        Panel { series: series.collect(), ..Panel::new(time(), y) }
    }

    fn force_axis(&self) -> Axis {
        let forces = self.interfaces.iter().flat_map(|i| &i.force_n);
        Axis::prefixed("force", "N", forces.fold(0.0, |top: f64, f| top.max(f.abs())))
    }

    /// From where an interface closes; before, its gap is open.
    fn crush(&self) -> Panel {
        let mut panel = Panel::new(Axis::new("deflection", "m", 1.0), self.force_axis());
        for (k, interface) in self.interfaces.iter().enumerate() {
            let pairs = interface.deflection_m.iter().zip(&interface.force_n);
            let closed: Vec<(f64, f64)> =
                pairs.filter(|(d, f)| **d > 0.0 || **f != 0.0).map(|(d, f)| (*d, *f)).collect();
            let (d, f) = closed.into_iter().unzip();
            panel.series.push(Series::line(&interface.name, k, d, f));
        }
        panel
    }

    fn energy(&self) -> Option<Panel> {
        let Energies { kinetic_j, stored_j, dissipated_j } = self.energies.as_ref()?;
        let top = kinetic_j.iter().chain(dissipated_j).copied().fold(0.0, f64::max);
        let mut panel = Panel::new(time(), Axis::prefixed("energy", "J", top));
        let all = [("kinetic", kinetic_j), ("stored", stored_j), ("dissipated", dissipated_j)];
        for (k, (name, values)) in all.into_iter().enumerate() {
            panel.series.push(Series::line(name, k, self.time_s.clone(), values.clone()));
        }
        Some(panel)
    }
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
        let mut panel = Panel::new(Axis::new("time", "ms", 1e3), y);
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

/// Maximum number of lines of a chart.
const MOST: usize = 24;

/// Histories over time; quantities of different components are in panels side by side. Without
/// `units`, numbers stand as in the file; a channel frequency class of SAE J211-1, such as 60, adds
/// filtered lines.
///
/// # Errors
/// For none or more than 24 histories, or samples that the filter does not take.
pub fn histories(
    title: &str,
    histories: &[&History],
    units: Option<UnitSystem>,
    filter_class: Option<u32>,
) -> Result<Chart, Error> {
    if histories.is_empty() {
        return Err(error!(Plot, "there is no history: give other ids or components"));
    }
    if histories.len() > MOST {
        return Err(error!(
            Plot,
            "{found} histories are too many for one picture, {MOST} at most: choose with --id and --component",
            found = histories.len()
        ));
    }
    if filter_class.is_some() && units.is_none() {
        return Err(error!(Plot, "a CFC filter needs the unit of time: give the file's units"));
    }
    let mut components: Vec<&str> = Vec::new();
    for history in histories {
        if !components.contains(&&*history.component) {
            components.push(&history.component);
        }
    }
    let mut panels = Vec::new();
    for component in components {
        let of_component = || histories.iter().filter(|h| &*h.component == component);
        let (time, value) = axes(component, units, of_component().flat_map(|h| &h.values));
        let mut panel = Panel::new(time, value);
        for history in of_component() {
            add(&mut panel, history, filter_class.zip(units))?;
        }
        panels.push(panel);
    }
    Ok(Chart::row(title, panels))
}

/// What a component is measured in: its SI unit, and that unit in the file's.
fn unit(component: &str, units: &UnitSystem) -> Option<(&'static str, f64)> {
    let is_rotation =
        component.starts_with('r') && component.get(1..3).is_some_and(|c| c.ends_with('_'));
    let ends = |end: &str| component.ends_with(end);
    let per_s = 1.0 / units.time_s;
    Some(match () {
        () if ends("displacement") && is_rotation => ("rad", 1.0),
        () if ends("velocity") && is_rotation => ("rad/s", per_s),
        () if ends("acceleration") && is_rotation => ("rad/s²", per_s * per_s),
        () if ends("displacement") || ends("coordinate") => ("m", units.length_m),
        () if ends("velocity") => ("m/s", units.speed()),
        () if ends("acceleration") => ("m/s²", units.acceleration()),
        () if ends("force") => ("N", units.force()),
        () if ends("moment") => ("N·m", units.force() * units.length_m),
        () if ends("energy") || ends("work") => ("J", units.force() * units.length_m),
        () if ends("mass") => ("kg", units.mass_kg),
        () if ends("momentum") => ("kg·m/s", units.mass_kg * units.speed()),
        () => return None,
    })
}

/// Axes of time and of a component, whose values are in the file's units.
fn axes<'a>(
    component: &str,
    units: Option<UnitSystem>,
    values: impl Iterator<Item = &'a f64>,
) -> (Axis, Axis) {
    let as_in_file = |quantity: &str| Axis::new(quantity, "unit of the file", 1.0);
    let Some(units) = units else { return (as_in_file("time"), as_in_file(component)) };
    let time = Axis::new("time", "ms", 1e3 * units.time_s);
    let Some((unit, si)) = unit(component, &units) else { return (time, as_in_file(component)) };
    let largest = values.copied().filter(|v| v.is_finite()).fold(0.0, |l: f64, v| l.max(v.abs()));
    let value = match unit {
        "N" | "J" | "N·m" => Axis::prefixed(component, unit, si * largest),
        _ => Axis::new(component, unit, 1.0),
    };
    (time, Axis { scale: value.scale * si, ..value })
}

fn add(
    panel: &mut Panel,
    history: &History,
    filter: Option<(u32, UnitSystem)>,
) -> Result<(), Error> {
    let entity = history.entity.map_or_else(|| "whole model".to_string(), |e| e.to_string());
    let time = history.time.to_vec();
    let look = panel.series.len();
    panel.series.push(Series::line(&entity, look, time.clone(), history.values.clone()));
    let Some((class, units)) = filter else { return Ok(()) };
    let time_s: Vec<f64> = time.iter().map(|t| t * units.time_s).collect();
    let filtered = cfc::filter(class, &time_s, &history.values)
        .map_err(|source| error!(Plot, "{entity}: {source}").caused_by(source))?;
    let name = format!("{entity}, CFC {class}");
    let line = Series::line(&name, look + 1, time, filtered.values);
    panel.series.push(line.shown(Shown::Emphasis));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_lines_are_refused() {
        let history = History {
            entity: None,
            component: "kinetic_energy".into(),
            time: [0.0, 1.0].into(),
            values: vec![0.0, 1.0],
        };
        let all: Vec<&History> = std::iter::repeat_n(&history, MOST + 1).collect();
        let most = error!(
            Plot,
            "{found} histories are too many for one picture, {MOST} at most: choose with --id and --component",
            found = MOST + 1
        );
        assert_eq!(histories("", &all, None, None), Err(most));
        assert!(histories("", &all[1..], None, None).is_ok());
        assert_eq!(
            histories("", &[], None, None),
            Err(error!(Plot, "there is no history: give other ids or components"))
        );
    }
}
