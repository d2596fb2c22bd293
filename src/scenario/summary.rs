//! A run in numbers: bodies, interfaces, what happened when, limits.

use std::ops::Range;

use serde::Serialize;

use super::sequence::{Event, common_speed_time_s, sequence};
use super::{CurveInUse, LimitsTable, PLATES, Prepared};
use crate::multibody::{Interface, InterfaceHistory, Run, STANDARD_GRAVITY_M_PER_S2};
use crate::signal::{cfc, mean_rates};

/// A run in numbers.
#[derive(Serialize)]
pub(crate) struct Summary<'a> {
    /// In the order of the scenario.
    pub(crate) bodies: Vec<BodySummary<'a>>,
    pub(crate) interfaces: Vec<InterfaceSummary<'a>>,
    /// When what happened, in order of time.
    pub(crate) sequence: Vec<Event<'a>>,
    /// When the centres of mass of both trains first have one speed, or that of the train has none against a wall.
    pub(crate) common_speed_time_s: Option<f64>,
    pub(crate) step_s: f64,
    /// Time of the last output, which the final speeds are for.
    pub(crate) end_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) limits: Option<Limits<'a>>,
}

#[derive(Serialize)]
pub(crate) struct BodySummary<'a> {
    pub(crate) name: &'a str,
    /// Of a vehicle with its crush zones.
    #[serde(skip)]
    pub(crate) mass_kg: f64,
    #[serde(skip)]
    pub(crate) initial_v_m_per_s: f64,
    pub(crate) final_v_m_per_s: f64,
    mean_deceleration_m_per_s2: f64,
    pub(crate) mean_deceleration_g: f64,
    /// From when until when it is the mean; null for a body without contact.
    pub(crate) mean_deceleration_span_s: Option<(f64, f64)>,
    /// The same of a later contact that changes the speed more than any other; null if the first one does.
    pub(crate) main_mean_deceleration_g: Option<f64>,
    pub(crate) main_mean_deceleration_span_s: Option<(f64, f64)>,
    /// Largest in magnitude of the deceleration filtered with CFC 60 (SAE J211-1), and its time; null where the outputs
    /// are too coarse for the filter.
    pub(crate) peak_deceleration_g: Option<f64>,
    pub(crate) peak_deceleration_time_s: Option<f64>,
    /// Whether it is the crush zone of a vehicle's end, which stops at once: its decelerations are
    /// no vehicle's.
    pub(crate) is_crush_zone: bool,
    /// The run ended before the contact of a mean did: it is the mean of a part.
    pub(crate) still_loaded_at_end: bool,
    /// Over the 120 ms in which it is largest in magnitude; null in a shorter run.
    pub(crate) moving_mean_deceleration_g: Option<f64>,
    /// Speed at which an unrestrained occupant meets the interior after 0.6 m; null for a crush zone, and if the run
    /// ends before.
    pub(crate) secondary_impact_m_per_s: Option<f64>,
    /// Occupant load criterion: 65 mm of slack, then stopped within 235 mm; null as above.
    pub(crate) occupant_load_g: Option<f64>,
}

impl BodySummary<'_> {
    /// The mean decelerations and over which times they are the mean.
    pub(crate) fn mean_text(&self) -> String {
        let of = |mean_g: f64, span_s: Option<(f64, f64)>, is_last: bool| match span_s {
            Some((from_s, _)) if is_last && self.still_loaded_at_end => {
                format!("{mean_g:.2} g so far, from {:.0} ms", 1e3 * from_s)
            }
            Some((from, to)) => {
                let digits = if to - from < 0.01 { 1 } else { 0 };
                format!("{mean_g:.2} g, {:.digits$} to {:.digits$} ms", 1e3 * from, 1e3 * to)
            }
            None => format!("{mean_g:.2} g"),
        };
        let main_g = self.main_mean_deceleration_g;
        let first = of(self.mean_deceleration_g, self.mean_deceleration_span_s, main_g.is_none());
        let main = main_g.map(|mean_g| of(mean_g, self.main_mean_deceleration_span_s, true));
        [Some(first), main].into_iter().flatten().collect::<Vec<_>>().join("; then ")
    }

    /// Of the mean decelerations that are not of a part of a contact the one with the largest magnitude: it is held
    /// against a limit.
    pub(crate) fn largest_mean_g(&self) -> Option<f64> {
        let whole = |is_last: bool| !(is_last && self.still_loaded_at_end);
        let main_g = self.main_mean_deceleration_g;
        let first = whole(main_g.is_none()).then_some(self.mean_deceleration_g);
        let main = main_g.filter(|_| whole(true));
        [first, main].into_iter().flatten().reduce(|a, b| if b.abs() > a.abs() { b } else { a })
    }

    /// The largest filtered deceleration and when it is.
    pub(crate) fn peak_text(&self) -> Option<String> {
        let (g, time_s) = self.peak_deceleration_g.zip(self.peak_deceleration_time_s)?;
        Some(format!("{g:.1} g, {:.0} ms", 1e3 * time_s))
    }
}

impl Summary<'_> {
    /// Whether a coupling has pulled.
    pub(crate) fn pulls(&self) -> bool {
        self.interfaces.iter().any(|of| of.history.peak_tension_n > 0.0)
    }
}

impl InterfaceSummary<'_> {
    /// The largest force; of plates, which are stopped at once, that would be their own impact and no load of a vehicle.
    pub(crate) fn load_n(&self) -> Option<f64> {
        (self.used.curve != PLATES).then_some(self.history.peak_force_n)
    }
}

#[derive(Serialize)]
pub(crate) struct InterfaceSummary<'a> {
    pub(crate) name: &'a str,
    #[serde(flatten)]
    pub(crate) history: &'a InterfaceHistory,
    /// Stored, dissipated and damped until the end; null if the last is not known.
    #[serde(rename = "energy_J")]
    pub(crate) energy_j: Option<f64>,
    /// Its share of what all interfaces have taken.
    pub(crate) energy_share: Option<f64>,
    #[serde(flatten)]
    pub(crate) used: &'a CurveInUse,
}

/// Mean decelerations against a limit: of the first contact of a body, and of the one that changes its speed most.
#[derive(Serialize)]
pub(crate) struct Limits<'a> {
    pub(crate) standard: &'a str,
    pub(crate) edition: &'a str,
    pub(crate) mean_deceleration_limit_g: f64,
    /// Trains that it is for; null for all.
    pub(crate) trains: &'a Option<Vec<String>>,
    /// Their vehicles.
    #[serde(skip)]
    pub(crate) judged: Vec<&'a str>,
    /// Bodies whose mean deceleration is over it.
    pub(crate) over: Vec<&'a str>,
    /// Bodies that are still loaded at the end, so that their mean may yet rise or fall, or that a contact may still reach;
    /// all if an interface went beyond its data.
    pub(crate) unknown: Vec<&'a str>,
    /// Limits on what occupants meet.
    pub(crate) occupants: Vec<OccupantLimit<'a>>,
    /// Interfaces that went beyond the data of their curves: then nothing here is a verdict.
    pub(crate) beyond_data: Vec<&'a str>,
    pub(crate) statement: String,
}

impl Limits<'_> {
    /// Whether a vehicle is over any of them; `None` if that is not known.
    pub(crate) fn are_broken(&self) -> Option<bool> {
        let is_broken =
            !self.over.is_empty() || self.occupants.iter().any(|of| !of.over.is_empty());
        let none_is_unknown =
            self.unknown.is_empty() && self.occupants.iter().all(|of| of.unknown.is_empty());
        ((is_broken || none_is_unknown) && self.beyond_data.is_empty()).then_some(is_broken)
    }

    /// Which bodies are over the limit of the mean deceleration, in words.
    pub(crate) fn text(&self) -> String {
        self.known(&self.over, &self.unknown)
    }

    /// The same of a limit on what occupants meet.
    pub(crate) fn occupants_text(&self, of: &OccupantLimit<'_>) -> String {
        let (what, unit) = match of.what {
            "occupant_load_g" => ("occupant load", "g"),
            _ => ("secondary impact", "m/s"),
        };
        format!("{what} above {} {unit}: {}", of.limit, self.known(&of.over, &of.unknown))
    }

    fn known(&self, over: &[&str], unknown: &[&str]) -> String {
        if !self.beyond_data.is_empty() {
            let beyond = self.beyond_data.join(", ");
            return format!("unknown: {beyond} went beyond the data of its curve");
        }
        let known = match (over, unknown) {
            ([], []) => "no vehicle".into(),
            ([], _) => "no vehicle for which it is known".into(),
            (over, _) => over.join(", "),
        };
        match unknown {
            [] => known,
            names => format!("{known}; the run ended before it was known for {}", names.join(", ")),
        }
    }
}

/// What occupants meet against a limit.
#[derive(Serialize)]
pub(crate) struct OccupantLimit<'a> {
    /// `secondary_impact_m_per_s` or `occupant_load_g`.
    pub(crate) what: &'static str,
    pub(crate) limit: f64,
    pub(crate) over: Vec<&'a str>,
    /// Bodies whose run ended before it was known, and all if an interface went beyond its data.
    pub(crate) unknown: Vec<&'a str>,
}

impl Prepared {
    /// Whether a contact that acts when the run ends, or one that is to come, may change the speed of body `i` by more than the largest so
    /// far: what it has changed, the bodies that still close with it, a neighbour that bodies beyond it throw back, and a rebound by
    /// as much as all these are all that can drive it.
    fn may_have_larger_contact(&self, run: &Run, i: usize) -> bool {
        let count = self.chain.bodies().len();
        // A wall stands still.
        let speed = |k: usize| run.bodies.get(k).map_or(0.0, |body| body.final_v_m_per_s);
        let mass_kg =
            |k: usize| self.chain.bodies().get(k).map_or(f64::INFINITY, |body| body.mass_kg);
        let closing = |k: usize| speed(k) - speed(k + 1);
        let has = |k: usize| k < run.interfaces.len();
        // What closes may drive body `k` away, the next one turn it round, and what the interface to that stores push it, if it
        // is pushed. Where forces balance, a train that is pressed together springs back in many small steps.
        let thrown = |k: usize, next: usize, beyond: Range<usize>| {
            let speed_of = |energy_j: f64| (2.0 * energy_j / mass_kg(k)).sqrt();
            let closing_j = |k: usize| {
                let closing = closing(k).max(0.0);
                0.5 * closing * closing / (1.0 / mass_kg(k) + 1.0 / mass_kg(k + 1))
            };
            let is_pushed = run.bodies[k].running_and_largest_change.0.is_some();
            let [next_j, stored_j] = match beyond.contains(&next) {
                true if is_pushed => [closing_j(next), run.interfaces[next].stored_at_end_j],
                true => [closing_j(next), 0.0],
                false => [0.0; 2],
            };
            speed_of(stored_j) + speed_of(beyond.map(closing_j).sum()) + speed_of(next_j)
        };
        // Of what it gains in a rebound, by a body that is lighter than it.
        let share = |k: usize| mass_kg(k) / (mass_kg(k) + mass_kg(i));
        let mut behind = i;
        while behind > 0 && closing(behind - 1) > -LEAST_CLOSING_M_PER_S {
            behind -= 1;
        }
        let mut ahead = i;
        while ahead < count && has(ahead) && closing(ahead) > -LEAST_CLOSING_M_PER_S {
            ahead += 1;
        }
        let (running, largest) = run.bodies[i].running_and_largest_change;
        let is_hit = |k: usize| has(k) && closing(k) > LEAST_CLOSING_M_PER_S;
        let goes_on = running.is_some() || i > 0 && is_hit(i - 1) || is_hit(i);
        let pushed = (speed(behind) - speed(i)).max(speed(i) - speed(ahead));
        let drive = if goes_on { running.unwrap_or(0.0) + pushed.max(0.0) } else { 0.0 };
        let behind =
            (i > 0).then(|| (i - 1, closing(i - 1) + thrown(i - 1, i.wrapping_sub(2), 0..i - 1)));
        let ahead = (i + 1 < count && has(i))
            .then(|| (i + 1, closing(i) + thrown(i + 1, i + 1, i + 1..run.interfaces.len())));
        let back = [behind, ahead].into_iter().flatten();
        let back = back.filter(|(_, speed)| *speed > LEAST_CLOSING_M_PER_S);
        2.0 * back.map(|(k, speed)| share(k) * speed).fold(drive, f64::max) > largest
    }

    /// What `run`, a run of this scenario, comes to.
    pub(crate) fn summary<'a>(&'a self, run: &'a Run) -> Summary<'a> {
        let (bodies, interfaces) = (self.chain.bodies(), self.chain.interfaces());
        let is_crush_zone = |i: usize| !self.vehicles.contains(&i);
        let is_zone_of = |zone: &str, vehicle: &str| {
            zone.strip_prefix(vehicle).is_some_and(|end| [" front", " rear"].contains(&end))
        };
        let of_body = |&i: &usize| {
            let (body, history) = (&bodies[i], &run.bodies[i]);
            let in_g = |a_m_per_s2: f64| a_m_per_s2 / STANDARD_GRAVITY_M_PER_S2;
            let peak = peak_deceleration(&run.time_s, &history.v_m_per_s);
            BodySummary {
                name: &body.name,
                mass_kg: body.mass_kg
                    + bodies
                        .iter()
                        .enumerate()
                        .filter(|(k, of)| is_crush_zone(*k) && is_zone_of(&of.name, &body.name))
                        .map(|(_, of)| of.mass_kg)
                        .sum::<f64>(),
                initial_v_m_per_s: body.speed_m_per_s,
                final_v_m_per_s: history.final_v_m_per_s,
                mean_deceleration_m_per_s2: history.mean_deceleration_m_per_s2,
                mean_deceleration_g: in_g(history.mean_deceleration_m_per_s2),
                mean_deceleration_span_s: history.loaded_s,
                main_mean_deceleration_g: history.main_contact.map(|(mean, ..)| in_g(mean)),
                main_mean_deceleration_span_s: history.main_contact.map(|(_, span_s, _)| span_s),
                peak_deceleration_g: peak.map(|(_, a)| in_g(a)),
                peak_deceleration_time_s: peak.map(|(time_s, _)| time_s),
                is_crush_zone: is_crush_zone(i),
                still_loaded_at_end: history
                    .main_contact
                    .map_or(history.is_loaded_at_end, |(.., is_cut)| is_cut),
                moving_mean_deceleration_g: history.moving_mean_deceleration_m_per_s2.map(in_g),
                secondary_impact_m_per_s: history
                    .secondary_impact_m_per_s
                    .filter(|_| !is_crush_zone(i)),
                occupant_load_g: history
                    .occupant_load_m_per_s2
                    .filter(|_| !is_crush_zone(i))
                    .map(in_g),
            }
        };
        let bodies: Vec<BodySummary<'a>> = self.order.iter().map(of_body).collect();
        let judged = || {
            let all = self.order.iter().zip(&bodies).filter(|(i, _)| self.limited.contains(i));
            all.map(|(i, body)| (*i, body))
        };
        // A body that is still without contact may yet have one.
        let final_v = |k: usize| run.bodies.get(k).map_or(0.0, |body| body.final_v_m_per_s);
        let closes = |k: usize| {
            !run.interfaces[k].has_touched() && final_v(k) - final_v(k + 1) > LEAST_CLOSING_M_PER_S
        };
        let closing: Vec<usize> = (0..run.interfaces.len()).filter(|k| closes(*k)).collect();
        let goes_on = !closing.is_empty() || bodies.iter().any(|body| body.still_loaded_at_end);
        // Itself, or with one of its crush zones.
        let is_beside = |name: &str| {
            let beside = closing.iter().flat_map(|k| [*k, k + 1]);
            let mut names = beside.filter_map(|k| Some(&*self.chain.bodies().get(k)?.name));
            names.any(|other| other == name || is_zone_of(other, name))
        };
        let is_open = |i: usize, body: &BodySummary<'_>| {
            let has_no_contact = body.mean_deceleration_span_s.is_none();
            body.still_loaded_at_end
                || has_no_contact && goes_on
                || is_beside(body.name)
                || self.may_have_larger_contact(run, i)
        };
        // No path between the two grows any more.
        let is_with_its_occupant = |body: &BodySummary<'_>| {
            (body.final_v_m_per_s - body.initial_v_m_per_s).abs() <= LEAST_CLOSING_M_PER_S
        };
        let beyond_data: Vec<&str> = run.beyond_data().map(|k| &*interfaces[k].name).collect();
        // Beyond its data the force is an assumption, and with it all that follows.
        let is_known = beyond_data.is_empty();
        let occupants = |limits: &LimitsTable| {
            type Met<'a> = fn(&BodySummary<'a>) -> Option<f64>;
            let speed = limits.secondary_impact.as_ref().map(|speed| speed.0);
            let of: [(_, _, Met<'a>); 2] = [
                ("secondary_impact_m_per_s", speed, |body| body.secondary_impact_m_per_s),
                ("occupant_load_g", limits.occupant_load_g, |body| body.occupant_load_g),
            ];
            let asked = of.into_iter().filter_map(|(what, limit, met)| Some((what, limit?, met)));
            let judged = |(what, limit, met): (_, f64, Met<'a>)| OccupantLimit {
                what,
                limit,
                over: judged()
                    .map(|(_, body)| body)
                    .filter(|body| is_known && met(body).is_some_and(|met| met.abs() > limit))
                    .map(|body| body.name)
                    .collect(),
                unknown: judged()
                    .filter(|(_, body)| {
                        !is_known || met(body).is_none() && (goes_on || !is_with_its_occupant(body))
                    })
                    .map(|(_, body)| body.name)
                    .collect(),
            };
            asked.map(judged).collect()
        };
        let is_over = |body: &BodySummary<'_>| {
            let limit_g = self.limits.as_ref().map_or(f64::INFINITY, |of| of.mean_deceleration_g);
            body.largest_mean_g().is_some_and(|mean_g| mean_g.abs() > limit_g)
        };
        let limits = self.limits.as_ref().map(|limits| Limits {
            standard: &limits.standard,
            edition: &limits.edition,
            mean_deceleration_limit_g: limits.mean_deceleration_g,
            trains: &limits.trains,
            judged: judged().map(|(_, body)| body.name).collect(),
            over: judged()
                .filter(|(_, body)| is_known && is_over(body))
                .map(|(_, body)| body.name)
                .collect(),
            unknown: judged()
                .filter(|(i, body)| !is_known || is_open(*i, body) && !is_over(body))
                .map(|(_, body)| body.name)
                .collect(),
            occupants: occupants(limits),
            beyond_data,
            statement: format!(
                "these values come from a one-dimensional model and say nothing about survival space; they are not evidence of conformity with {}:{}",
                limits.standard, limits.edition
            ),
        });
        let energy_j = InterfaceHistory::energy_at_end_j;
        let all_j: Option<f64> = run.interfaces.iter().map(energy_j).sum();
        let of_interface = |((of, history), used): ((&'a Interface, &'a InterfaceHistory), _)| {
            let energy_j = energy_j(history);
            let share = |(energy_j, all_j): (f64, f64)| energy_j / all_j;
            let energy_share = energy_j.zip(all_j.filter(|all_j| *all_j > 0.0)).map(share);
            InterfaceSummary { name: &of.name, history, energy_j, energy_share, used }
        };
        let interfaces = interfaces.iter().zip(&run.interfaces).zip(&self.used);
        Summary {
            bodies,
            interfaces: interfaces.map(of_interface).collect(),
            sequence: sequence(self, run),
            common_speed_time_s: common_speed_time_s(self, run),
            step_s: run.step_s,
            end_s: run.time_s.last().copied().unwrap_or_default(),
            limits,
        }
    }
}

/// Bodies that close more slowly do not meet.
const LEAST_CLOSING_M_PER_S: f64 = 1e-3;

/// Class of the filter for decelerations of vehicles.
const CLASS: u32 = 60;

/// Time in s, and largest filtered deceleration in m/s², in magnitude, of the mean ones between the outputs.
fn peak_deceleration(time_s: &[f64], v_m_per_s: &[f64]) -> Option<(f64, f64)> {
    let (time_s, a_m_per_s2) = mean_rates(time_s, v_m_per_s);
    let filtered = cfc::filter_from_rest(CLASS, &time_s, &a_m_per_s2).ok()?.values;
    let pairs = time_s.iter().zip(&filtered);
    pairs.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map(|(time_s, a)| (*time_s, -a))
}
