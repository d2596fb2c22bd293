//! The choice among models that were validated, and the run that would help most.
//!
//! `auto` considers the models that are at or below `nearest`, `linear` and `forest` in mean force error and in mean
//! velocity error. Of these it takes the simplest one within 10 % of the smallest force error. Speeds inside the range and
//! its two ends are reported separately. The errors of the chosen model are optimistic, so `--nested` repeats the choice without each
//! left-out speed. For trains the ends count as much as the inner speeds, and among the best models those are preferred
//! whose force follows the closing speed.

use schemars::JsonSchema;
use serde::Serialize;

use crate::dataset::TrainingSet;
use crate::surrogate::MODELS;
use crate::surrogate::leave_one_out::{Means, Validation};
use crate::unit::km_per_h;

/// Mean errors that differ by less are a tie: three to five speeds resolve no more.
const TIE: f64 = 0.10;

/// Where the queries of a model will lie.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Purpose {
    /// Between the speeds of the runs: one vehicle that hits something.
    #[default]
    Vehicle,
    /// Beyond them as well: most vehicles of a train close more slowly than any run.
    Train,
}

/// Which model counts as chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Selection<'a> {
    /// The best for a purpose.
    Best(Purpose),
    /// The one of this name, whatever its errors.
    Named(&'a str),
}

/// The chosen model and why; `None` without means.
///
/// Of the models that are, in the mean over the speeds that count, at or below every baseline in
/// force and in velocity error, those within 10 % of the smallest force error tie, and the
/// simplest of them is taken; for trains first those whose force follows the closing speed. If none
/// keeps to all baselines, the one whose worst ratio to them is smallest.
pub(crate) fn choose(means: &[Means], purpose: Purpose) -> Option<(String, String)> {
    let entry = |m: &Means| MODELS.iter().find(|entry| entry.name == m.model);
    let baselines = || means.iter().filter(|m| entry(m).is_some_and(|e| e.baseline));
    let least = |of: fn(&Means) -> f64| baselines().map(of).fold(f64::INFINITY, f64::min);
    let (force, velocity) = (least(|m| m.force_l1), least(|m| m.velocity_l1));
    let keeps = |m: &&Means| m.force_l1 <= force && m.velocity_l1 <= velocity;
    let rank = |m: &Means| {
        let follows = entry(m).is_some_and(|e| e.follows_closing);
        (purpose == Purpose::Train && !follows, entry(m).map_or(u8::MAX, |e| e.complexity))
    };
    let (over, preferred) = match purpose {
        Purpose::Vehicle => ("", "the simplest"),
        Purpose::Train => (
            ", ends of the range included,",
            "the simplest, with a force that follows the closing speed,",
        ),
    };
    let best = means.iter().filter(keeps).map(|m| m.force_l1).fold(f64::INFINITY, f64::min);
    let tied = means.iter().filter(keeps).filter(|m| m.force_l1 <= (1.0 + TIE) * best);
    if let Some(chosen) = tied.min_by_key(|m| rank(m)) {
        let reason = format!(
            "{preferred} of the models whose mean force error{over} is within 10 % of the smallest (its own {:.2} %, smallest {:.2} %)",
            chosen.force_l1 * 100.0,
            best * 100.0
        );
        return Some((chosen.model.clone(), reason));
    }
    let worst = |m: &Means| (m.force_l1 / force).max(m.velocity_l1 / velocity);
    let chosen = means.iter().min_by(|a, b| worst(a).total_cmp(&worst(b)))?;
    let compared: Vec<&str> = baselines().map(|m| m.model.as_str()).collect();
    let reason = format!(
        "no model is at least as good as each of {} in both force and velocity; this one comes closest (force {:.2} %, velocity {:.2} %)",
        compared.join(", "),
        chosen.force_l1 * 100.0,
        chosen.velocity_l1 * 100.0
    );
    Some((chosen.model.clone(), reason))
}

/// The speed whose FE run would help most.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NextRun {
    /// The speed to run, in m/s.
    pub speed_m_per_s: f64,
    /// Training speeds that it lies between.
    pub between_m_per_s: (f64, f64),
    /// Force error expected there now, from the errors at the speeds that were left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_force_l1: Option<f64>,
    /// Why this one, in a sentence.
    pub reason: String,
    /// The other gaps, those where a run would bring more first.
    pub other_gaps: Vec<Gap>,
}

/// A gap between two neighbouring training speeds, and what a run in its middle would bring.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Gap {
    /// The two speeds, in m/s.
    pub between_m_per_s: (f64, f64),
    /// Force error expected in the middle, from the errors at the speeds that were left out: what a
    /// run there would take away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_force_l1: Option<f64>,
}

impl Gap {
    /// The gaps with a known error first, the largest first; without errors the widest relative to
    /// its speeds.
    fn rank(&self) -> (bool, f64) {
        let (low, high) = self.between_m_per_s;
        (self.expected_force_l1.is_some(), self.expected_force_l1.unwrap_or(high / low))
    }
}

/// The gaps between training speeds, those where a run would bring most first.
///
/// A left-out speed is predicted over the gap that its absence leaves; the error expected
/// in the middle of a gap is that of the speeds at its ends, relative to the gaps. Gaps at
/// the ends of the range have one such speed.
pub fn gaps(set: &TrainingSet, validation: &Validation) -> Vec<Gap> {
    let mut speeds: Vec<f64> = set.cases.iter().map(|c| c.speed_m_per_s).collect();
    speeds.dedup();
    let error_at = |v: f64| {
        let rows = validation.rows.iter();
        let of_chosen = rows.filter(|r| r.model == validation.chosen && r.inner);
        let errors: Vec<f64> =
            of_chosen.filter(|r| r.speed_m_per_s == v).map(|r| r.force_l1).collect();
        (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
    };
    let gap = |i: usize| {
        let width = speeds[i + 1] - speeds[i];
        let from = |k: usize| {
            let whole = speeds.get(k + 1)? - speeds[k.checked_sub(1)?];
            Some(error_at(speeds[k])? * width / whole)
        };
        let ends: Vec<f64> = [from(i), from(i + 1)].into_iter().flatten().collect();
        Gap {
            between_m_per_s: (speeds[i], speeds[i + 1]),
            expected_force_l1: (!ends.is_empty())
                .then(|| ends.iter().sum::<f64>() / ends.len() as f64),
        }
    };
    let mut gaps: Vec<Gap> = (0..speeds.len().saturating_sub(1)).map(gap).collect();
    gaps.sort_by(|a, b| {
        let (a, b) = (a.rank(), b.rank());
        b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
    });
    gaps
}

/// Proposes the middle of the first of [`gaps`]. `None` for fewer than two speeds.
pub(crate) fn next_run(set: &TrainingSet, validation: &Validation) -> Option<NextRun> {
    let mut gaps = gaps(set, validation).into_iter();
    let Gap { between_m_per_s: (low, high), expected_force_l1 } = gaps.next()?;
    let reason = match expected_force_l1 {
        Some(error) => format!(
            "of all intervals between training speeds, the one from {} to {} has the largest expected force error ({:.1} %), estimated from the errors at its two ends when left out",
            km_per_h(low),
            km_per_h(high),
            error * 100.0
        ),
        None => format!(
            "the interval from {} to {} is the widest relative to its speeds, and there are too few speeds to leave one out",
            km_per_h(low),
            km_per_h(high)
        ),
    };
    Some(NextRun {
        speed_m_per_s: 0.5 * (low + high),
        between_m_per_s: (low, high),
        expected_force_l1,
        reason,
        other_gaps: gaps.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surrogate::max_crush::MaxCrushRule;

    fn means(model: &str, force_l1: f64, velocity_l1: f64) -> Means {
        Means {
            model: model.into(),
            speeds: 3,
            force_l1,
            velocity_l1,
            energy_error: 0.0,
            max_crush_error: 0.0,
            max_crush_rule: MaxCrushRule::Energy,
            max_crush_errors: Default::default(),
            acceleration_l1: 0.0,
            acceleration_unfiltered_l1: 0.0,
        }
    }

    #[test]
    fn ties_go_to_the_simpler_model() {
        let chosen = |of: &[Means]| choose(of, Purpose::Vehicle).unwrap().0;
        let (nearest, forest) = (means("nearest", 0.2, 0.2), means("forest", 0.1, 0.1));
        let linear = means("linear", 0.05, 0.03);
        let rate = means("rate", 0.048, 0.02);
        let all = |rate: Means| [nearest.clone(), linear.clone(), forest.clone(), rate];
        assert_eq!(chosen(&all(rate)), "linear");
        assert_eq!(chosen(&all(means("rate", 0.040, 0.02))), "rate");
        assert_eq!(chosen(&all(means("rate", 0.040, 0.031))), "linear", "worse in velocity");
        assert!(choose(&[], Purpose::Vehicle).is_none());
        // For trains a force that follows the closing speed goes first, among those that tie.
        let for_train = |of: &[Means]| choose(of, Purpose::Train).unwrap().0;
        assert_eq!(for_train(&all(means("rate", 0.048, 0.02))), "rate");
        assert_eq!(for_train(&all(means("rate", 0.060, 0.02))), "linear");
    }

    /// Where linear wins in force and the forest in velocity, neither is chosen blindly.
    #[test]
    fn no_baseline_wins_in_both() {
        let of = [
            means("nearest", 0.2, 0.2),
            means("linear", 0.050, 0.030),
            means("forest", 0.09, 0.028),
            means("rate", 0.051, 0.0281),
        ];
        assert_eq!(choose(&of, Purpose::Vehicle).unwrap().0, "rate");
    }
}
