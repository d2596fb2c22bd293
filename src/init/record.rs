//! The histories of a run that the common recipe names, in the file's units, and what they say of
//! the impact.

use std::path::PathBuf;

use super::folders::{Reason, speed_in};
use super::measure::{Impact, MassEstimates, SAME_MASS, interval};
use super::recipe::CommonRecipe;
use super::sources::{ENERGIES, Source, Sources, component, impulse, picked, rising, velocity};
use super::survey::{STOPPED, Survey, bracketed};
use super::units::Magnitudes;
use crate::curve::contact::milliseconds;
use crate::history::{EntityId, History};
use crate::signal::interpolate;
use crate::solver::WantedId;
use crate::study::StudyKind;
use crate::unit::UnitSystem;

/// A run that was looked over.
pub(super) struct Run {
    pub path: PathBuf,
    pub name: String,
    pub sources: Sources,
    pub survey: Survey,
}

/// A force below this share of its largest is none.
const NO_FORCE: f64 = 0.01;
/// A force that begins within this share of its contact after the first state may have acted before that.
const AT_ONCE: f64 = 0.02;
/// A body that had moved by so much more than at its speed since time 0 has been slowed down.
const SLOWED: f64 = 0.005;
/// A constant force beside the contact's is seen where it leaves less than this share of the squares.
const EXPLAINED: f64 = 0.01;
/// A body that has moved by this share of what follows is slower than at the impact.
const MOVED: f64 = 0.1;
/// A motion that goes on for more states than this goes on without its force.
const FURTHER: usize = 3;
/// A flight after the contact that is shorter than this, in states and as a share of the record,
/// gives no mass.
const FREE: (usize, f64) = (5, 0.03);
/// A flight shorter than this share of the time over which the mass is taken shows no force that acts all along.
const MOMENT: f64 = 0.05;
/// A velocity has a trend if it changes by more than so many times its scatter.
const CHANCE: f64 = 3.0;
/// A force that changes a mass by less than this share is left out.
const LEAST_BESIDE: f64 = 0.01;
/// A weight accelerates by standard gravity (ISO 80000-3), as far as a record shows it.
const STANDARD_GRAVITY: f64 = 9.80665;
const WEIGHT: f64 = 0.03;
/// Accelerations before and after the contact that differ by less are that of one force, which acts all along.
const ALIKE: f64 = 0.2;

/// What the recipe names of a run, up to the last time that motion and force share.
pub(super) struct Record {
    pub run: Run,
    pub time: Vec<f64>,
    /// Of the node, and of a pair the other node.
    pub velocities: Vec<Vec<f64>>,
    /// Squares of their first speeds, which need not be along the motion.
    first_squares: Vec<f64>,
    /// Displacement of the node, less the other node's.
    pub travel: Vec<f64>,
    /// Empty if the recipe has no contact force, as the next three.
    pub force_time: Vec<f64>,
    pub force: Vec<f64>,
    /// Why its forces are means over their intervals, if they are.
    pub force_means: Option<String>,
    /// Ids of the walls whose force it is, if it is that of walls.
    pub wall_ids: Vec<i64>,
    /// At the motion's times.
    impulse: Vec<f64>,
    /// The force's file, if it ends before the motion.
    pub force_ends: Option<String>,
    /// Damage of the files, for messages.
    pub damage: Vec<String>,
    /// The smaller number of states of its files.
    pub states: usize,
    /// The same in SI, once the units are known.
    pub impact: Option<Impact>,
}

/// A record that ends while loading holds most of the crash if the bodies still close at less than this share of their first
/// speed: three quarters of the energy are gone.
const MOSTLY_STOPPED: f64 = 0.5;
/// The force acts still if its mean over the last tenth of such a record is more than this share of that over all of it: bodies
/// that have met an obstacle that moves go on with it.
const ACTS_STILL: f64 = 0.2;
/// Largest share of a mass that its crush zone may be; in the bundled groups it is at most a tenth.
const CRUSH_ZONE: f64 = 0.35;

impl Record {
    pub(super) fn read(run: Run, recipe: &CommonRecipe) -> Result<Self, Reason> {
        let unusable = |why: &str| Err(Reason::Unusable { why: why.into() });
        let bodies = if recipe.kind == StudyKind::Pair { 2 } else { 1 };
        if recipe.nodes.len() != bodies {
            return unusable("no node moves with the body, or with one of the two");
        }
        let (motion, direction) = (&run.sources.motion, recipe.direction);
        let ids = recipe.nodes.iter().map(|n| WantedId { id: n.id, side: None }).collect();
        let read = motion.read(Some(ids), &[direction.name(), direction.velocity()])?;
        let states = rising(&read.time);
        let mut damage = damage(motion, read.problems.first());
        let damage_of_motion = bracketed(damage.first().map(String::as_str));
        let (mut velocities, mut travels) = (Vec::new(), Vec::new());
        let mut first_squares = Vec::new();
        for node in &recipe.nodes {
            let entity = Some(EntityId::new(node.id));
            let of: Vec<History> =
                read.histories.iter().filter(|h| h.entity == entity).cloned().collect();
            let lacks =
                |what: &str| Reason::Unusable { why: format!("node {} has no {what}", node.id) };
            let velocity =
                velocity(&of, direction, &states).ok_or_else(|| lacks(direction.velocity()))?;
            let square = run.survey.first_square(node.id).or(velocity.first().map(|v| v * v));
            first_squares.extend(square);
            velocities.push(velocity);
            let travel = component(&of, direction.name()).ok_or_else(|| lacks(direction.name()))?;
            travels.push(picked(&travel.values, &states));
        }
        let mut travel = travels.swap_remove(0);
        if let Some(other) = travels.first() {
            travel.iter_mut().zip(other).for_each(|(a, b)| *a -= b);
        }
        let (mut time, mut all) = (picked(&read.time, &states), read.time.len());
        let (mut force_time, mut force, mut impulses) = (Vec::new(), Vec::new(), Vec::new());
        let (mut force_ends, mut force_means) = (None, None);
        if let Some(chosen) = &recipe.force {
            let unusable = |why: String| Reason::Unusable { why };
            let source = run.sources.force(chosen.file);
            let source = source.ok_or_else(|| unusable(format!("it has no {}", chosen.file)))?;
            let ids = &chosen.ids;
            let side = chosen.side;
            let wanted = ids.iter().map(|&id| WantedId { id, side }).collect();
            let read = source.read(Some(wanted), &[chosen.component])?;
            let of = |id: &i64| {
                let is = |history: &&History| history.entity.is_some_and(|of| of.id == *id);
                read.histories.iter().find(is)
            };
            let history = ids.iter().map(of).collect::<Option<Vec<_>>>();
            let history = history.and_then(|of| History::sum(&of)).ok_or_else(|| {
                let (path, component) = (source.shown(), chosen.component);
                unusable(format!("{path} has no {component} of {ids:?} at the same times"))
            })?;
            let history = &history;
            impulses = impulse(history, &time).ok_or_else(|| {
                let (history, file) = (history.label(), source.shown());
                let damage = bracketed(read.problems.first().map(ToString::to_string).as_deref());
                unusable(format!(
                    "{history} of {file} holds values that are not numbers{damage}: correct them, or name another force with --force"
                ))
            })?;
            let states = rising(&history.time);
            force_time = picked(&history.time, &states);
            force = picked(&history.values, &states);
            // Printed times of two files differ in their last digits.
            let last = force_time[force_time.len() - 1];
            let reach = last + 0.5 * (last - force_time[force_time.len() - 2]);
            let kept = time.iter().take_while(|&&t| t <= reach).count();
            force_means.clone_from(&source.means);
            force_ends = (kept + FURTHER < time.len()).then(|| source.shown());
            for values in [&mut time, &mut travel, &mut impulses].into_iter().chain(&mut velocities)
            {
                values.truncate(kept);
            }
            all = all.min(history.time.len());
            damage.extend(self::damage(source, read.problems.first()));
        }
        if velocities.iter().flatten().chain(&travel).any(|v| !v.is_finite()) {
            let what = "the motion of its nodes holds values that are not numbers";
            return unusable(&format!("{what}{damage_of_motion}"));
        }
        let record = Self {
            run,
            time,
            velocities,
            first_squares,
            travel,
            force_time,
            force,
            force_means,
            wall_ids: recipe
                .force
                .as_ref()
                .filter(|of| of.file == "rwforc")
                .map_or(Vec::new(), |of| of.ids.clone()),
            impulse: impulses,
            force_ends,
            damage,
            states: all,
            impact: None,
        };
        if record.time.len() < 2 || record.closing(0) == 0.0 {
            return unusable(&match &recipe.nodes[..] {
                [node] => format!(
                    "node {} does not move in its first state; if another body meets it, name both nodes (--kind pair --node ID --minus-node ID)",
                    node.id
                ),
                _ => "the bodies do not move towards each other in its first state".into(),
            });
        }
        Ok(record)
    }

    /// Closing speed of the node against the other body or the wall: positive at first.
    pub(super) fn closing(&self, state: usize) -> f64 {
        let relative = |state: usize| match &self.velocities[..] {
            [node, other] => node[state] - other[state],
            _ => self.velocities[0][state],
        };
        relative(0).signum() * relative(state)
    }

    /// The first state in which the bodies do not close any more: the end of the loading. Else the
    /// share of the first speed at which they still close.
    pub(super) fn loading_end(&self) -> Result<usize, f64> {
        let last = self.time.len() - 1;
        match (0..=last).find(|&i| self.closing(i) <= 0.0) {
            Some(end) => Ok(end),
            None if self.closing(last) < STOPPED * self.closing(0) => Ok(last),
            None => Err(self.closing(last) / self.closing(0)),
        }
    }

    /// Where such a record ends, and at what share of their first speed the bodies still close there.
    pub(super) fn end_while_loading(&self, units: Option<&UnitSystem>) -> (String, f64) {
        let end = self.time.last().copied().unwrap_or_default();
        let end = match units {
            Some(units) => milliseconds(end * units.time_s),
            None => format!("{end} in the file's unit of time"),
        };
        let of_force = |file: &String| format!(", where {file} ends but the motion goes on");
        let end = end + &self.force_ends.as_ref().map_or(String::new(), of_force);
        (end, self.loading_end().err().unwrap_or_default())
    }

    /// The files that hold the same motion: a solver may have written more of one than of the other.
    pub(super) fn other_files(&self) -> String {
        let motion = &self.run.sources.motion;
        match &motion.others[..] {
            [] => String::new(),
            others => format!(
                "; {} also holds it, and is read where there is no {}",
                others.join(" and "),
                motion.shown()
            ),
        }
    }

    /// Whether a record that ends while loading holds most of the crash of a body of `mass`, in the file's unit: the force still
    /// acts, and its impulse is what slowed this mass, and stopped at most a crush zone.
    pub(super) fn holds_most_of_a_crash(&self, mass: f64) -> bool {
        let (last, share) =
            (self.time.len() - 1, self.closing(self.time.len() - 1) / self.closing(0));
        let mean = |force: &[f64]| force.iter().map(|f| f.abs()).sum::<f64>() / force.len() as f64;
        let Some((first, _)) = self.contact() else { return false };
        let at = |time: f64| self.force_time.partition_point(|&t| t < time);
        // The motion may end before the force.
        let force = &self.force[at(first)..at(self.time[last]).max(at(first))];
        if force.len() < FREE.0 {
            return false;
        }
        let velocity = &self.velocities[0];
        let over = (self.impulse[last] / (velocity[last] - velocity[0])).abs() / mass;
        let most = 1.0 + CRUSH_ZONE * share / (1.0 - share);
        share < MOSTLY_STOPPED
            && mean(&force[force.len() - force.len().div_ceil(10)..]) > ACTS_STILL * mean(force)
            && (1.0 - SAME_MASS..=most + SAME_MASS).contains(&over)
            && !self.starts_in_contact()
    }

    /// What the body has moved at the times of the force, up to the end of the loading; in the file's unit.
    pub(super) fn path_while_loading(&self) -> Vec<f64> {
        let end = self.loading_end().unwrap_or(self.time.len() - 1);
        let until = |t: &&f64| **t <= self.time[end];
        // Before the first state of the motion nothing has moved.
        let times = self.force_time.iter().take_while(until).map(|t| t.max(self.time[0]));
        interpolate(&self.time, &self.travel, &times.collect::<Vec<_>>()).unwrap_or_default()
    }

    /// The first and the last time at which a force acts.
    fn contact(&self) -> Option<(f64, f64)> {
        let least = NO_FORCE * self.force.iter().map(|f| f.abs()).fold(0.0, f64::max);
        let acts = |f: &f64| f.abs() > least;
        let (first, last) = (self.force.iter().position(acts)?, self.force.iter().rposition(acts)?);
        Some((self.force_time[first], self.force_time[last]))
    }

    /// Whether the body had moved and the force acted before the motion's first state, so that its speed there is not that of
    /// the impact.
    pub(super) fn starts_in_contact(&self) -> bool {
        self.had_moved() && self.contact_since_first().is_some_and(|(since, _)| since <= 0.0)
    }

    /// Whether it may be so: the force begins at once after the first state, and the body had moved by more than it moves at
    /// its speed there from time 0 on.
    pub(super) fn may_start_in_contact(&self) -> bool {
        let at_speed = (self.closing(0) * self.time[0]).abs();
        let begins = |(since, lasts): (f64, f64)| (0.0..=AT_ONCE * lasts).contains(&since);
        self.had_moved()
            && self.travel[0].abs() > (1.0 + SLOWED) * at_speed
            && self.contact_since_first().is_some_and(begins)
    }

    fn had_moved(&self) -> bool {
        let moved = self.travel.iter().map(|d| (d - self.travel[0]).abs()).fold(0.0, f64::max);
        self.travel[0].abs() > MOVED * moved
    }

    /// When the force first acts after the first state, and for how long it does; `None` if that is over.
    fn contact_since_first(&self) -> Option<(f64, f64)> {
        let (first, last) = self.contact()?;
        (self.time[0] < last).then_some((first - self.time[0], last - first))
    }

    pub(super) fn damage(&self) -> String {
        bracketed(self.damage.first().map(String::as_str))
    }

    /// What depends on the units.
    pub(super) fn magnitudes(&self) -> Magnitudes {
        let end = self.loading_end().unwrap_or(self.time.len() - 1);
        let begins = self.contact().map_or(0.0, |(first, _)| first);
        // Without a force from the first state on.
        let before = self.time.partition_point(|&t| t < begins).saturating_sub(1);
        let begin = if self.force.is_empty() { 0 } else { before.min(end) };
        Magnitudes {
            speed: self.closing(0),
            crush: (self.travel[end] - self.travel[begin]).abs(),
            loading_time: self.time[end] - self.time[begin],
            mass: self.masses_by_momentum(|_| 0.0).map(|(masses, _)| masses[0]),
            named_m_per_s: speed_in(&self.run.name),
        }
    }

    /// What the run says of the mass of each body; `unit_kg`: the file's unit of mass.
    pub(super) fn masses(&self, units: UnitSystem) -> Vec<MassEstimates> {
        let unit_kg = units.mass_kg;
        let by_energy = self.masses_by_energy();
        // Where a kinetic energy gives the mass, momentum only confirms it.
        let gravity = STANDARD_GRAVITY * units.time_s.powi(2) / units.length_m;
        let beside = |velocity: &[f64]| match by_energy {
            Some(_) => None,
            None => self.in_flight(velocity).and_then(|of| of.all_along(gravity)),
        };
        let (by_momentum, in_free_flight) =
            self.masses_by_momentum(|velocity| beside(velocity).unwrap_or(0.0)).unzip();
        let kg = |masses: &Option<Vec<f64>>, k: usize| masses.as_ref().map(|of| of[k] * unit_kg);
        let estimates = |k: usize| MassEstimates {
            by_momentum: kg(&by_momentum, k),
            in_free_flight: in_free_flight.unwrap_or_default(),
            unexplained: match beside(&self.velocities[k]) {
                Some(_) => 0.0,
                None => self.unexplained(k),
            },
            has_constant_force: beside(&self.velocities[k]).is_some(),
            by_energy: kg(&by_energy, k),
            energy_is_whole: self
                .run
                .sources
                .energy
                .as_ref()
                .is_some_and(|e| e.name == ENERGIES[0]),
            is_shared: self.velocities.len() > 1,
            coarseness: self.coarseness().unwrap_or_default(),
            is_late: self.starts_in_contact(),
        };
        (0..self.velocities.len()).map(estimates).collect()
    }

    /// The interval of the states over the time from contact to the end of the loading. After the contact only that of the
    /// forces counts: velocities are constant.
    fn coarseness(&self) -> Option<f64> {
        let (first, end) = (self.contact()?.0, self.loading_end().ok()?);
        let mut interval_s = interval(&self.force_time);
        if self.free_flight(end).is_none() {
            interval_s = interval_s.max(interval(&self.time));
        }
        Some(interval_s / (self.time[end] - first)).filter(|c| c.is_finite() && *c > 0.0)
    }

    /// The first body's mass, given or by kinetic energy, over that by momentum.
    pub(super) fn over_momentum(&self, given: Option<f64>) -> Option<f64> {
        let mass = given.or_else(|| self.masses_by_energy()?.first().copied())?;
        Some(mass / self.masses_by_momentum(|_| 0.0)?.0.first()?)
    }

    /// The bodies' masses by momentum, `∫F dt / Δv`: after the contact, where both rest (and whether
    /// that is so); while it never ends, by all states of the loading together.
    ///
    /// `beside`: acceleration of a body by a force that acts all along.
    fn masses_by_momentum(&self, beside: impl Fn(&[f64]) -> f64) -> Option<(Vec<f64>, bool)> {
        let end = self.loading_end().ok()?;
        let free = self.free_flight(end);
        let body = |velocity: &Vec<f64>| {
            let beside = beside(velocity);
            let (mut of, mut by) = (0.0, 0.0);
            for i in free.map_or(0..end + 1, |from| from..self.time.len()) {
                let change = velocity[i] - velocity[0] - beside * (self.time[i] - self.time[0]);
                let weight = if free.is_some() { 1.0 } else { change };
                of += self.impulse[i] * weight;
                by += change * weight;
            }
            Some((of / by).abs()).filter(|mass: &f64| mass.is_finite() && *mass > 0.0)
        };
        let masses = self.velocities.iter().filter(|_| !self.impulse.is_empty()).map(body);
        Some((masses.collect::<Option<Vec<f64>>>().filter(|all| !all.is_empty())?, free.is_some()))
    }

    /// The first state after the contact from which no force acts, if that lasts.
    fn free_flight(&self, loading_end: usize) -> Option<usize> {
        let (_, last) = self.contact()?;
        let from = self.time.partition_point(|&t| t <= last).max(loading_end + 1);
        let states = self.time.len().checked_sub(from)?;
        let share = states as f64 / self.time.len() as f64;
        (states >= FREE.0 && share >= FREE.1).then_some(from)
    }

    /// The acceleration of a body before and after the contact.
    fn in_flight(&self, velocity: &[f64]) -> Option<Flights> {
        let (first, end) = (self.contact()?.0, self.loading_end().ok()?);
        let free = self.free_flight(end);
        let before = self.time.partition_point(|&t| t < first);
        let all = self.time.len();
        let at = free.map_or(end, |from| (from + all - 1) / 2);
        let span = self.time[at] - self.time[0];
        // What vibrates for a moment is not extended over the whole impact.
        let trend = |from: usize, to: usize| {
            let lasts = to.saturating_sub(from) >= FREE.0
                && self.time[to - 1] - self.time[from] >= MOMENT * span;
            lasts.then(|| Trend::of(&self.time[from..to], &velocity[from..to]))
        };
        Some(Flights {
            before: trend(0, before),
            after: trend(free.unwrap_or(all), all),
            share_of: span / (velocity[at] - velocity[0]).abs(),
            direction: velocity[0].signum(),
        })
    }

    /// What other forces than the contact's may change a mass by momentum, as a share, if it does not allow for them: the
    /// acceleration of body `k` before or after the contact, over the time and the change of velocity that the mass is taken from.
    fn unexplained(&self, k: usize) -> f64 {
        let Ok(end) = self.loading_end() else { return 0.0 };
        let velocity = &self.velocities[k];
        let Some(flights) = self.in_flight(velocity) else { return 0.0 };
        let free = self.free_flight(end);
        let while_loading = if free.is_none() {
            constant_force(&self.impulse[..=end], &velocity[..=end], &self.time[..=end])
        } else {
            0.0
        };
        let share = flights.most() * flights.share_of;
        if share.is_finite() { share.max(while_loading) } else { while_loading }
    }

    /// Mass of the other body over the first one's, by their changes of velocity: no force is needed for that. After the
    /// contact, where the crush zones move with their bodies, else while loading. `None` for one body.
    pub(super) fn mass_ratio(&self) -> Option<f64> {
        let [node, other] = &self.velocities[..] else { return None };
        let end = self.loading_end().ok()?;
        let states = self.free_flight(end).map_or(0..end + 1, |from| from..self.time.len());
        let changes = states.map(|i| (node[i] - node[0], other[i] - other[0]));
        let (of, by) = changes.fold((0.0, 0.0), |(of, by), (a, b)| (of - a * b, by + b * b));
        Some(of / by).filter(|ratio| ratio.is_finite() && *ratio > 0.0)
    }

    /// The masses by the kinetic energy of the first state, if all that moves is the bodies: that
    /// of two bodies is shared by the ratio of their changes of velocity.
    fn masses_by_energy(&self) -> Option<Vec<f64>> {
        let energy = self.run.sources.energy.as_ref()?.read(None, &["kinetic_energy"]).ok()?;
        // The energies may be recorded from an earlier time on than the motion.
        let is_late = self.starts_in_contact();
        let first = |part: &History| {
            if !is_late {
                return part.values.first().copied();
            }
            let states = rising(&part.time);
            let (time, values) = (picked(&part.time, &states), picked(&part.values, &states));
            let at = self.time[0].clamp(*time.first()?, *time.last()?);
            interpolate(&time, &values, &[at]).ok()?.first().copied()
        };
        let kinetic = energy.histories.iter().map(first).sum::<Option<f64>>()?;
        let mut shares = vec![1.0];
        if self.velocities.len() > 1 {
            shares.push(self.mass_ratio()?);
        }
        let squares = self.first_squares.iter().zip(&shares).map(|(square, share)| share * square);
        let body = 2.0 * kinetic / squares.sum::<f64>();
        (kinetic > 0.0 && body.is_finite()).then(|| shares.iter().map(|s| s * body).collect())
    }
}

/// By what share the mass from momentum changes with a constant force beside the contact's, such as a weight: where `∫F dt = m Δv + c t`
/// leaves hardly anything of what `c = 0` leaves; else 0.
fn constant_force(impulse: &[f64], velocity: &[f64], time: &[f64]) -> f64 {
    let since_first = |all: &[f64], i: usize| all[i] - all[0];
    let sum = |of: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
        let row = |i: usize| of(impulse[i], since_first(velocity, i), since_first(time, i));
        (0..impulse.len()).map(row).sum()
    };
    let [jv, jt, vv, vt, tt] = [
        sum(&|j, v, _| j * v),
        sum(&|j, _, t| j * t),
        sum(&|_, v, _| v * v),
        sum(&|_, v, t| v * t),
        sum(&|_, _, t| t * t),
    ];
    let (alone, mass) = (jv / vv, (jv * tt - jt * vt) / (vv * tt - vt * vt));
    let constant = (jt - mass * vt) / tt;
    let left = sum(&|j, v, t| (j - mass * v - constant * t).powi(2));
    let share = (mass / alone - 1.0).abs();
    let is_explained = left < EXPLAINED * sum(&|j, v, _| (j - alone * v).powi(2));
    if is_explained && share.is_finite() { share } else { 0.0 }
}

/// Slope of a velocity while no contact acts, and by how much it may be off by chance.
#[derive(Clone, Copy)]
struct Trend {
    slope: f64,
    by_chance: f64,
    /// Whether both halves have this slope.
    is_even: bool,
}

/// The accelerations of a body before and after the contact, where it flies for long enough.
struct Flights {
    before: Option<Trend>,
    after: Option<Trend>,
    /// By what share an acceleration all along changes the mass.
    share_of: f64,
    /// 1 or −1: of the body at first.
    direction: f64,
}

impl Flights {
    /// What surely is not chance, at most.
    fn most(&self) -> f64 {
        [self.before, self.after].into_iter().flatten().map(|of| of.sure()).fold(0.0, f64::max)
    }

    /// The acceleration by a force that changes the mass and acts all along: a weight, by which a falling body gains `gravity`, or what
    /// both flights show alike. A brake turns with the motion, and what a short flight shows may be a vibration.
    fn all_along(&self, gravity: f64) -> Option<f64> {
        let before =
            self.before.filter(|of| of.is_even && of.sure() * self.share_of > LEAST_BESIDE)?;
        let is_near = |a: f64, share: f64| (before.slope.abs() - a.abs()).abs() < share * a.abs();
        let is_same = |of: Trend| {
            is_near(of.slope, ALIKE)
                && of.slope * before.slope > 0.0
                && of.by_chance < of.slope.abs()
        };
        let is_weight = self.direction * before.slope > 0.0
            && is_near(gravity, WEIGHT)
            && before.by_chance < WEIGHT * gravity;
        match self.after {
            Some(after) => is_same(after),
            None => is_weight,
        }
        .then_some(before.slope)
    }
}

impl Trend {
    /// The slope of least squares. By chance, that of n independent values that scatter by s has a standard deviation of
    /// √12 s / (T √n), and they cross their line n/2 times; vibrations cross it less often.
    fn of(time: &[f64], values: &[f64]) -> Self {
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        let slope_of = |time: &[f64], values: &[f64]| {
            let (t0, v0) = (mean(time), mean(values));
            let pairs = time.iter().zip(values).map(|(t, v)| (t - t0, v - v0));
            let (of, by) = pairs.fold((0.0, 0.0), |(of, by), (t, v)| (of + t * v, by + t.powi(2)));
            of / by
        };
        let (t0, v0, slope) = (mean(time), mean(values), slope_of(time, values));
        let half = time.len() / 2;
        let halves = [(&time[..half], &values[..half]), (&time[half..], &values[half..])];
        let is_near = |(time, values)| (slope_of(time, values) - slope).abs() < ALIKE * slope.abs();
        let left = time.iter().zip(values).map(|(t, v)| v - v0 - slope * (t - t0));
        let left: Vec<f64> = left.collect();
        let scatter = (left.iter().map(|r| r * r).sum::<f64>() / time.len() as f64).sqrt();
        let crossings = left.windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count();
        let by_chance = CHANCE * scatter * (6.0 / crossings as f64).sqrt().min(1.0);
        let is_even = halves.into_iter().all(is_near);
        Self { slope, by_chance: by_chance / (time[time.len() - 1] - time[0]), is_even }
    }

    /// What surely is not chance.
    fn sure(&self) -> f64 {
        (self.slope.abs() - self.by_chance).max(0.0)
    }
}

/// The first damage of a source, found when it was listed or when it was read.
fn damage(source: &Source, read: Option<&impl ToString>) -> Vec<String> {
    let found = read.map(ToString::to_string).or_else(|| source.damage.clone());
    found.map(|problem| format!("{}: {problem}", source.shown())).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Neither vibrations of any period and phase nor noise are a drift; a drift beneath them is found.
    #[test]
    fn a_drift_is_told_from_vibrations() {
        let time: Vec<f64> = (0..120).map(|i| f64::from(i) * 0.75e-3).collect();
        let of = |value: &dyn Fn(f64) -> f64| {
            let values: Vec<f64> = time.iter().map(|&t| value(t)).collect();
            Trend::of(&time, &values).sure()
        };
        let span = 119.0 * 0.75e-3;
        for periods in [2.3, 5.0, 11.7, 30.0] {
            for phase in [0.0, 0.8, 1.6, 2.4, 3.1] {
                let wave = |t: f64| (std::f64::consts::TAU * periods * t / span + phase).sin();
                assert_eq!(of(&wave), 0.0, "{periods} periods from {phase}");
                if periods > 4.0 {
                    let found = of(&|t| wave(t) - 30.0 * t) / 30.0;
                    assert!(
                        (0.2..1.0).contains(&found),
                        "{found} of the drift: {periods}, {phase}"
                    );
                }
            }
        }
        let noise = |t: f64| ((t * 1e5).sin() * 43758.5453).fract();
        assert_eq!(of(&noise), 0.0);
    }

    /// A mass of 250 kg that falls onto a crush zone: its weight shows in the loading; a crush zone with mass of its own does not pass for one.
    #[test]
    fn a_weight_is_told_from_a_crush_zone() {
        let time: Vec<f64> = (0..200).map(|i| f64::from(i) * 2e-4).collect();
        let velocity: Vec<f64> = time.iter().map(|t| 5.0 - 100.0 * t - 400.0 * t * t).collect();
        let of = |more: &dyn Fn(f64) -> f64| {
            let impulse = velocity.iter().zip(&time).map(|(v, &t)| 250.0 * (5.0 - v) + more(t));
            constant_force(&impulse.collect::<Vec<f64>>(), &velocity, &time)
        };
        assert_eq!(of(&|_| 0.0), 0.0);
        let share = of(&|t| 250.0 * 9.81 * t);
        assert!((0.07..0.12).contains(&share), "{share}");
        assert_eq!(of(&|t| 25.0 * 5.0 * (t / 0.03).min(1.0)), 0.0);
    }
}
