//! The choice among models that were validated, and the run that would help most.
//!
//! Two to five left-out speeds decide little: the model with the smallest mean is often the luckiest one. `auto` therefore starts
//! from the simplest model of the physics that the runs allow (`crush-law`; `rate` where that cannot be had, or needs more stopped mass than crush
//! zones hold), and leaves it only for one whose errors at the speeds left out are smaller by more than the differences scatter: in force, velocity, acceleration and crush together. `validate --subsets` shows what that costs
//! against the best model in hindsight. The errors of the chosen model are a little optimistic, so `--nested` repeats the choice without
//! each left-out speed. For trains the ends of the range count as much as the inner speeds. Two speeds leave nothing to choose by: the
//! default stands.
//!
//! Tried and dropped: a mean of `crush-law` with `rate` or `gaussian-process`. It takes a little off the force error where runs are few,
//! and adds to the velocity error where they are many.

use serde::Serialize;

use crate::dataset::{TrainingSet, is_within, nearly_same};
use crate::order;
use crate::surrogate::leave_one_out::{LeftOut, Means, Validation};
use crate::surrogate::max_crush::MaxCrushRule;
use crate::surrogate::{MODELS, Model, ModelKind};
use crate::unit::km_per_h;
use crate::words::counted;

/// Fewest left-out speeds whose scatter says something.
const LEAST_SPEEDS: usize = 3;
/// With fewer, another model must come below this share of the error of the default at each of them.
const GROSSLY_BETTER: f64 = 0.5;

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

/// The chosen model and why, by its errors `of` the speeds that count for the purpose; `None` without any model.
///
/// The default is the first of the `physical` ones, or if there is none, the one with the smallest mean error.
/// Another takes its place if the mean of the paired differences is larger than their standard deviation, from three speeds on; or, of
/// fewer, if it is grossly better at each. `what` was left out, in a word.
pub(crate) fn choose(
    of: &[(&str, Vec<f64>)],
    purpose: Purpose,
    physical: &[&str],
    what: &str,
) -> Option<(String, String)> {
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    let best = of.iter().min_by(|a, b| mean(&a.1).total_cmp(&mean(&b.1)))?;
    let physical = physical.iter().find_map(|name| of.iter().find(|model| model.0 == *name));
    let default = physical.unwrap_or(best);
    let is_better = |(_, errors): &&(&str, Vec<f64>)| {
        let gains: Vec<f64> =
            default.1.iter().zip(errors).map(|(own, other)| own - other).collect();
        let gain = mean(&gains);
        let squares: f64 = gains.iter().map(|g| (g - gain).powi(2)).sum();
        if gains_tell(gains.len()) {
            gain > (squares / (gains.len() - 1) as f64).sqrt()
        } else {
            let grossly = |(own, other): (&f64, &f64)| *other < GROSSLY_BETTER * own;
            gains.len() > 1 && default.1.iter().zip(errors).all(grossly)
        }
    };
    let rivals = of.iter().filter(|model| model.0 != default.0);
    let better = rivals.clone().filter(is_better).min_by(|a, b| mean(&a.1).total_cmp(&mean(&b.1)));
    let ends = match purpose {
        Purpose::Vehicle => "",
        Purpose::Train => ", ends of the range included,",
    };
    let speeds = format!("{} left out{ends}", counted(default.1.len(), what));
    let share = |other: &[f64]| 100.0 * (mean(other) / mean(&default.1) - 1.0);
    if let Some((name, errors)) = better {
        let less = -share(errors);
        let reason = format!(
            "its errors at {speeds} are {less:.0} % smaller than those of {}, beyond their scatter",
            default.0
        );
        return Some(((*name).into(), reason));
    }
    let next = rivals.min_by(|a, b| mean(&a.1).total_cmp(&mean(&b.1)));
    let reason = match next {
        Some((name, errors)) if physical.is_some() => {
            let more = share(errors);
            let direction = if more < 0.0 { "smaller" } else { "larger" };
            let within = match gains_tell(default.1.len()) {
                _ if more >= 0.0 => "",
                true => ", within their scatter",
                false => ", too few to tell",
            };
            format!(
                "the default; the errors of the next best, {name}, at {speeds} are {:.0} % {direction}{within}",
                more.abs()
            )
        }
        Some(_) => format!("it has the smallest errors with {speeds}"),
        None => "no other model fits these runs".into(),
    };
    Some((default.0.into(), reason))
}

/// The models whose force follows the closing speed, the default first: by simplicity, but the crush law last if it needs
/// more stopped mass than crush zones hold.
pub(super) fn physical(set: &TrainingSet) -> Vec<&'static str> {
    let masses = set.cases.iter().map(|case| case.effective_mass_kg);
    let lightest_kg = masses.fold(f64::INFINITY, f64::min);
    let is_doubtful = set.stopped_mass().is_some_and(|m| !m.is_usual(lightest_kg));
    let mut physical: Vec<_> = MODELS.iter().filter(|entry| entry.follows_closing).collect();
    order::sort_by_key(&mut physical, |entry| {
        (entry.needs_crush_law && is_doubtful, entry.complexity)
    });
    physical.into_iter().map(|entry| entry.name).collect()
}

/// Whether differences at so many speeds have a scatter that says something.
fn gains_tell(speeds: usize) -> bool {
    speeds >= LEAST_SPEEDS
}

/// Errors of each model that has means, at the speeds left out that count for a purpose: force, velocity, acceleration and crush, each
/// relative to what the models have in the median, and averaged. The crush is that of the motion, where it has one: by another rule it may
/// be right although the curve is not.
pub(crate) fn scores<'a>(
    means: &'a [Means],
    rows: &[LeftOut],
    purpose: Purpose,
) -> Vec<(&'a str, Vec<f64>)> {
    let measures = |row: &LeftOut| {
        let crush = row.max_crush_errors.get(&MaxCrushRule::Motion);
        let crush = crush.unwrap_or(&row.max_crush_error);
        [row.force_l1, row.velocity_l1, row.acceleration_l1, crush.abs()]
    };
    let counts = |row: &&LeftOut| row.inner || purpose == Purpose::Train;
    let of = |model: &'a Means| {
        let own = rows.iter().filter(|row| row.model == model.model).filter(counts);
        (&*model.model, own.map(measures).collect::<Vec<_>>())
    };
    let mut all: Vec<(&str, Vec<[f64; 4]>)> = means.iter().map(of).collect();
    let most = all.iter().map(|(_, rows)| rows.len()).max().unwrap_or(0);
    all.retain(|(_, rows)| rows.len() == most && most > 0);
    let median = |k: usize| {
        let sum = |(_, rows): &(&str, Vec<[f64; 4]>)| rows.iter().map(|row| row[k]).sum::<f64>();
        let mut sums: Vec<f64> = all.iter().map(sum).collect();
        sums.sort_by(f64::total_cmp);
        sums.get(sums.len() / 2).map_or(1.0, |sum| sum / most as f64)
    };
    let scale = [0, 1, 2, 3].map(median);
    let score = |row: &[f64; 4]| {
        let relative = |k: usize| if scale[k] > 0.0 { row[k] / scale[k] } else { 0.0 };
        (0..4).map(relative).sum::<f64>() / 4.0
    };
    all.iter().map(|(name, rows)| (*name, rows.iter().map(score).collect())).collect()
}

/// The speed whose FE run would help most.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct NextRun {
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
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Gap {
    /// The two speeds, in m/s.
    pub between_m_per_s: (f64, f64),
    /// Force error expected in the middle, from the errors at the speeds that were left out: what a
    /// run there would take away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_force_l1: Option<f64>,
    /// Whether the collapse mode changes between the two speeds, which a run there decides.
    pub mode_switch: bool,
}

impl Gap {
    /// Changes of mode and the gaps with a known error first, the largest first; without errors the widest relative to
    /// its speeds.
    fn rank(&self) -> (bool, bool, f64) {
        let (low, high) = self.between_m_per_s;
        let known = self.expected_force_l1;
        (self.mode_switch, known.is_some(), known.unwrap_or(high / low))
    }
}

/// The gaps between training speeds, those where a run would bring most first.
///
/// A left-out speed is predicted over the gap that its absence leaves; the error expected
/// in the middle of a gap is that of the speeds at its ends, relative to the gaps. Gaps at
/// the ends of the range have one such speed. Speeds that nearly repeat one another, which are left out together, are one; runs that
/// ended before a slower one stood do not count.
pub fn gaps(set: &TrainingSet, validation: &Validation) -> Vec<Gap> {
    let speeds = set.speeds_of_crush_m_per_s();
    let mut ends: Vec<(f64, f64)> = speeds.iter().map(|v| nearly_same(&speeds, *v)).collect();
    ends.dedup_by(|next, before| {
        let is_one = is_within(next.0, *before);
        before.1 = if is_one { before.1.max(next.1) } else { before.1 };
        is_one
    });
    let error_at = |of: (f64, f64)| {
        let rows = validation.rows.iter();
        let of_chosen = rows.filter(|r| r.model == validation.chosen && r.inner);
        let errors: Vec<f64> =
            of_chosen.filter(|r| is_within(r.speed_m_per_s, of)).map(|r| r.force_l1).collect();
        (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
    };
    let switches = Model::fit(set, ModelKind::linear());
    let switches = switches.map(|model| model.mode_switches_m_per_s).unwrap_or_default();
    let gap = |i: usize| {
        let (low, high) = (ends[i].1, ends[i + 1].0);
        let from = |k: usize| {
            let whole = ends.get(k + 1)?.0 - ends[k.checked_sub(1)?].1;
            Some(error_at(ends[k])? * (high - low) / whole)
        };
        let known: Vec<f64> = [from(i), from(i + 1)].into_iter().flatten().collect();
        Gap {
            between_m_per_s: (low, high),
            expected_force_l1: (!known.is_empty())
                .then(|| known.iter().sum::<f64>() / known.len() as f64),
            mode_switch: switches.contains(&(low, high)),
        }
    };
    let mut gaps: Vec<Gap> = (0..ends.len().saturating_sub(1)).map(gap).collect();
    order::sort(&mut gaps, |a, b| {
        let (a, b) = (a.rank(), b.rank());
        (b.0, b.1).cmp(&(a.0, a.1)).then(b.2.total_cmp(&a.2))
    });
    gaps
}

/// Proposes the middle of the first of [`gaps`]. `None` for fewer than two speeds.
pub(crate) fn next_run(set: &TrainingSet, validation: &Validation) -> Option<NextRun> {
    let mut gaps = gaps(set, validation).into_iter();
    let Gap { between_m_per_s: (low, high), expected_force_l1, mode_switch } = gaps.next()?;
    let reason = match expected_force_l1 {
        _ if mode_switch => format!(
            "the collapse mode changes between {} and {}: a run in the middle decides which of the two a speed between them follows",
            km_per_h(low),
            km_per_h(high)
        ),
        Some(error) => format!(
            "of all intervals between training speeds, the one from {} to {} has the largest expected force error ({:.1} %), estimated from the leave-one-out errors at its inner ends",
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
    let mut also: Vec<&str> = set.features.iter().map(|f| &*f.parameter).collect();
    also.dedup();
    let reason = match also.is_empty() {
        true => reason,
        // Errors at a speed are means over its cases.
        false => format!("{reason}; run it with the {} whose curve is needed", also.join(", ")),
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

    fn chosen(of: &[(&str, &[f64])]) -> String {
        let of: Vec<(&str, Vec<f64>)> = of.iter().map(|(m, e)| (*m, e.to_vec())).collect();
        choose(&of, Purpose::Vehicle, &["crush-law", "rate"], "speed").unwrap().0
    }

    #[test]
    fn the_default_stands_unless_another_is_better_beyond_chance() {
        let law: (&str, &[f64]) = ("crush-law", &[1.0, 1.2, 0.9]);
        // Better on average, and by less than the differences scatter.
        assert_eq!(chosen(&[law, ("extra", &[0.9, 0.5, 1.0])]), "crush-law");
        assert_eq!(chosen(&[law, ("extra", &[0.8, 0.9, 0.7])]), "extra");
        // Of two speeds no scatter is known.
        let law: (&str, &[f64]) = ("crush-law", &[1.0, 1.2]);
        assert_eq!(chosen(&[law, ("extra", &[0.8, 1.0])]), "crush-law");
        assert_eq!(chosen(&[law, ("extra", &[0.4, 0.5])]), "extra");
        assert_eq!(chosen(&[("crush-law", &[1.0]), ("extra", &[0.1])]), "crush-law");
        assert!(choose(&[], Purpose::Vehicle, &["rate"], "speed").is_none());
    }

    #[test]
    fn the_default_is_the_first_that_follows_the_closing_speed() {
        let rate: (&str, &[f64]) = ("rate", &[1.0]);
        let linear: (&str, &[f64]) = ("linear", &[0.9]);
        assert_eq!(chosen(&[linear, rate]), "rate");
        assert_eq!(chosen(&[linear, rate, ("crush-law", &[1.1])]), "crush-law");
        // Cases that differ in more than speed leave forests alone.
        assert_eq!(chosen(&[("forest", &[0.9, 1.0]), ("extra", &[0.8, 1.0])]), "extra");
    }
}
