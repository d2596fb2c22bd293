//! A multi-body run over time: speeds, accelerations, forces, energies; force over deflection; and
//! the speeds of a train by several methods.

use crate::assess::train::TrainComparison;
use crate::error::{Error, ErrorCode, error};
use crate::multibody::{Chain, Run};
use crate::plot::{Axis, Chart, Panel, Series, Shown};

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
        if header.first().map(String::as_str) != Some("time_s") || header.len() < 2 {
            return Err(error!(
                Plot,
                "line {line}: expected the columns of crumple simulate -o: \"time_s\", then for example \"v_m_per_s[A1]\" or \"force_N[A1|A2]\"; found \"{found}\"",
                found = header.join(",")
            ));
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
            return Err(error!(
                Plot,
                "line {line}: expected the columns of crumple simulate -o: \"time_s\", then for example \"v_m_per_s[A1]\" or \"force_N[A1|A2]\"; found \"{found}\"",
                found = header.join(",")
            ));
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
