//! From item to row: the varied scenario, its chain, its run.

use std::ops::{ControlFlow, Range};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::row::{BETWEEN, Row, Status};
use super::{Kept, Sweep};
use crate::error::{Error, ErrorCode};
use crate::multibody::{BodyHistory, InterfaceHistory, Record, Run, RunSettings, simulate};
use crate::parallel;
use crate::plan::ResultName;
use crate::scenario::{self, Prepared, Scenario};

/// How many items are run before their rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chunk {
    /// As many as take this long.
    Time(Duration),
    /// So many.
    Items(u64),
}

impl Default for Chunk {
    fn default() -> Self {
        Self::Time(Duration::from_millis(300))
    }
}

/// Bound of the rows that are held at once.
const MOST_ITEMS: u64 = 8192;
/// Items that a thread takes at once, at most; of few items fewer, so that all threads work.
const BLOCK: usize = 8;
const BLOCKS_PER_THREAD: usize = 4;
const KEPT_CHAINS: usize = 16;

/// Runs the items in pieces and hands on the rows of each piece in order with their lines, until `give`
/// breaks.
pub(crate) fn rows(
    sweep: &Sweep,
    items: Range<u64>,
    chunk: Chunk,
    mut give: impl FnMut(&[(Row, Vec<u8>)]) -> Result<ControlFlow<()>, Error>,
) -> Result<(), Error> {
    let names = sweep.names();
    let workers = Mutex::new(Vec::new());
    let threads = rayon::current_num_threads();
    let least = (2 * threads) as u64;
    let mut size = match chunk {
        Chunk::Items(items) => items.clamp(1, MOST_ITEMS),
        Chunk::Time(_) => least,
    };
    let mut at = items.start;
    while at < items.end {
        let end = items.end.min(at + size);
        let begun = Instant::now();
        let piece: Vec<u64> = (at..end).collect();
        let block = (piece.len() / (BLOCKS_PER_THREAD * threads)).clamp(1, BLOCK);
        let blocks: Vec<Vec<(Row, Vec<u8>)>> = parallel::map(piece.chunks(block), |block| {
            let held = || workers.lock().unwrap_or_else(PoisonError::into_inner);
            let mut worker = held().pop().unwrap_or_else(|| Worker::new(sweep));
            let line_of = |&item: &u64| {
                let row = worker.row(item);
                let mut line = Vec::with_capacity(24 * (row.values.len() + 2));
                row.write(&names, &mut line);
                (row, line)
            };
            let written = block.iter().map(line_of).collect();
            held().push(worker);
            written
        });
        let rows: Vec<(Row, Vec<u8>)> = blocks.into_iter().flatten().collect();
        if give(&rows)?.is_break() {
            return Ok(());
        }
        at = end;
        if let Chunk::Time(wanted) = chunk {
            let took = begun.elapsed();
            if took < wanted / 2 {
                size = (size * 2).min(MOST_ITEMS.max(least));
            } else if took > wanted * 2 {
                size = (size / 2).max(least);
            }
        }
    }
    Ok(())
}

struct Worker<'a> {
    sweep: &'a Sweep,
    values: Vec<f64>,
    /// Which variables decide the force laws.
    shaping: Vec<bool>,
    /// Chains by the values that decided their laws, the latest last.
    chains: Vec<(Vec<u64>, Prepared)>,
}

impl<'a> Worker<'a> {
    fn new(sweep: &'a Sweep) -> Self {
        let shaping = sweep.variables.iter().map(|v| v.shapes_laws(&sweep.scenario)).collect();
        Self { sweep, values: Vec::new(), shaping, chains: Vec::new() }
    }

    fn row(&mut self, item: u64) -> Row {
        let sweep = self.sweep;
        sweep.design.values(item, &mut self.values);
        let mut scenario = Scenario::clone(&sweep.scenario);
        for (variable, value) in sweep.variables.iter().zip(&self.values) {
            variable.apply(&mut scenario, &sweep.scenario, *value);
        }
        let (values, message) = (self.values.clone(), String::new());
        let mut row = Row { item, values, status: Status::Ok, message };
        let messages = match self.results(&scenario, &mut row.values) {
            Ok(warnings) if warnings.is_empty() => return row,
            Ok(warnings) => {
                row.status = Status::Warned;
                warnings
            }
            Err(error) => {
                row.status = Status::Failed;
                row.values.truncate(self.values.len());
                let columns = super::result_columns(&sweep.results, &sweep.base);
                row.values.resize(self.values.len() + columns.len(), f64::NAN);
                // The scenario's path is the same for all items and known to the reader.
                vec![error.message().to_string()]
            }
        };
        row.message = messages.join(BETWEEN).replace(|c: char| c.is_control(), " ");
        row
    }

    /// Appends the results of the scenario as it stands; returns warnings, or why it failed.
    fn results(
        &mut self,
        scenario: &Scenario,
        values: &mut Vec<f64>,
    ) -> Result<Vec<String>, Error> {
        let sweep = self.sweep;
        let prepared = self.prepared(scenario)?;
        // A row needs the summary only.
        let settings = RunSettings { record: Record::Summary, ..prepared.settings };
        let run = simulate(&prepared.chain, &settings)
            .map_err(|error| Error::below(ErrorCode::Simulation, error))?;
        push_results(&sweep.results, prepared, &run, values);
        // What nothing varies was said once; what the row's own numbers are in is the row's.
        let said = |w: &&String| sweep.base.warnings.contains(w);
        let mut all: Vec<String> = Vec::new();
        for warning in prepared.warnings.iter().filter(|w| !said(w)) {
            if !all.contains(warning) {
                all.push(warning.clone());
            }
        }
        all.extend(run.all_warnings());
        Ok(all)
    }

    /// The chain of the scenario as it stands; laws that do not change are not made again.
    fn prepared(&mut self, scenario: &Scenario) -> Result<&Prepared, Error> {
        let Self { sweep, values, shaping, chains } = self;
        let scenario = &sweep.scenario.vary(scenario)?;
        let shaping = values.iter().zip(&*shaping).filter(|(_, shapes)| **shapes);
        let key: Vec<u64> = shaping.map(|(value, _)| value.to_bits()).collect();
        match chains.iter().position(|(k, _)| *k == key) {
            Some(at) => {
                let (_, prepared) = &mut chains[at];
                scenario::adjust(&sweep.path, scenario, prepared)?;
                Ok(&chains[at].1)
            }
            None => {
                let made = scenario::assemble(&sweep.path, scenario, &sweep.sources)?;
                if chains.len() == KEPT_CHAINS {
                    chains.remove(0);
                }
                chains.push((key, made));
                Ok(&chains[chains.len() - 1].1)
            }
        }
    }
}

/// What a result is a number of: each interface, body or vehicle, or the run; NaN where there is none.
pub(super) enum Measure {
    Interface(fn(&InterfaceHistory) -> f64),
    Body(fn(&BodyHistory) -> f64),
    Vehicle(fn(&BodyHistory) -> f64),
    Run(fn(&Prepared, &Run) -> f64),
}

impl Measure {
    pub(super) fn of(result: ResultName) -> Self {
        fn known(value: Option<f64>) -> f64 {
            value.unwrap_or(f64::NAN)
        }
        match result {
            ResultName::PeakForce => Self::Interface(|i| i.peak_force_n),
            ResultName::MaxDeflection => Self::Interface(|i| i.max_deflection_m),
            ResultName::MaxDeflectionTime => Self::Interface(|i| i.max_deflection_time_s),
            ResultName::Restitution => Self::Interface(|i| known(i.restitution)),
            ResultName::Energy => Self::Interface(|i| known(i.energy_at_end_j())),
            ResultName::FinalSpeed => Self::Body(|b| b.final_v_m_per_s),
            ResultName::MeanDeceleration => Self::Body(|b| b.mean_deceleration_m_per_s2),
            ResultName::MovingMeanDeceleration => {
                Self::Body(|b| known(b.moving_mean_deceleration_m_per_s2))
            }
            ResultName::MainMeanDeceleration => Self::Body(|b| {
                b.main_contact.map_or(b.mean_deceleration_m_per_s2, |(mean, ..)| mean)
            }),
            ResultName::SecondaryImpact => Self::Vehicle(|b| known(b.secondary_impact_m_per_s)),
            ResultName::OccupantLoad => Self::Vehicle(|b| known(b.occupant_load_m_per_s2)),
            ResultName::EnergyError => Self::Run(|_, run| run.ledger.max_energy_error),
            ResultName::MomentumError => Self::Run(|_, run| run.ledger.max_momentum_error),
            ResultName::OverLimits => Self::Run(|prepared, run| {
                let limits = prepared.summary(run).limits;
                known(limits.and_then(|limits| limits.are_broken()).map(f64::from))
            }),
        }
    }
}

fn push_results(results: &[Kept], prepared: &Prepared, run: &Run, values: &mut Vec<f64>) {
    let Prepared { order, vehicles, .. } = prepared;
    for (result, _) in results {
        match Measure::of(*result) {
            Measure::Interface(of) => values.extend(run.interfaces.iter().map(of)),
            Measure::Body(of) => values.extend(order.iter().map(|&i| of(&run.bodies[i]))),
            Measure::Vehicle(of) => {
                let of_vehicles = order.iter().filter(|i| vehicles.contains(i));
                values.extend(of_vehicles.map(|&i| of(&run.bodies[i])));
            }
            Measure::Run(of) => values.push(of(prepared, run)),
        }
    }
}
