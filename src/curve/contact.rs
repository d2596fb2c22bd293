//! Contact: when it starts in a record, and which force pulses are not contact.
//!
//! Contact begins with the force pulse that holds most of the impulse, where the force crosses its threshold between two
//! states. A record that starts in contact counts from its first state. Impulses (OpenRadioss) show more: what the interval of the contact
//! leaves of one, against the force of the next intervals, gives the place within it. The sign of a force is that of its impulse, which one
//! wrong state does not reverse. A body slows down two to four milliseconds after its nose has touched, so for a body force the
//! start of contact is taken from a contact force named in the recipe (`contact`), or a warning is given.

/// A contact force is above this share of the largest, unless the recipe says otherwise.
pub(crate) const THRESHOLD: f64 = 0.005;
/// Before the crossing the force is gone where it is below this share of the threshold.
const GONE: f64 = 0.1;
/// Force pulses closer than this belong together: a nose plate may bounce.
pub(super) const PAUSE_S: f64 = 0.010;
/// By about this share of an interval contacts that are found within it are off: those of vehicle-pair, whose plates begin 0.5 mm from
/// the plane at every speed, by up to 0.2; of a force that begins with a step by nothing, of one that rises over one to two intervals
/// and then stays by up to 0.6.
const SHARE_OFF: f64 = 0.25;
/// Of intervals of several milliseconds, in which the first peak of a nose lies, by up to 0.75 (every k-th state of the bundled runs).
const MOST_OFF: f64 = 0.75;
/// Of the impulse of an interval so much may be left where the line through the next ones begins, by their curvature and digits.
const MOST_LEFT: f64 = 0.2;
/// So many states before the threshold is reached may have a force of the contact.
const LATE: usize = 2;
/// A first piece of the contact with less than this share of its impulse may be noise.
const SMALL_SHARE: f64 = 1e-3;
/// Pulses before the contact that are listed individually.
const NAMED: usize = 3;

/// What states the contact of a run, in messages.
pub(super) const STATED_BY: &str = "contact_time or gap in the run";
pub(super) const OR_BY: &str = ", or contact_threshold in the recipe";

/// The force above which a record is in contact: a share of its largest.
pub(crate) fn threshold_n(force_n: &[f64], share: f64) -> f64 {
    share * force_n.iter().copied().fold(0.0, f64::max)
}

/// When contact begins, found from a force that is positive in compression.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Onset {
    /// Where the force crosses the threshold, in s, between two states.
    pub time_s: f64,
    /// From the last state without force to the first in contact, in s; `None` if the record
    /// begins in contact.
    pub interval_s: Option<f64>,
    /// By how much it may be off at most, by impulses, in s.
    pub at_most_s: Option<f64>,
    /// What the user should check: pulses before the contact, and a doubtful start.
    pub warnings: Vec<String>,
    /// The first state above the threshold.
    first: usize,
}

/// States whose force is above the threshold, without a pause of [`PAUSE_S`] or longer.
#[derive(Clone, Copy)]
struct Spell {
    first: usize,
    last: usize,
    states: usize,
    impulse_ns: f64,
    largest_n: f64,
}

/// The onset of the pulse that holds most of the impulse; `None` if the force never exceeds the
/// threshold.
///
/// `time_s`: increasing, in s; `force_n`: as many values, in N, not filtered (a filter without
/// phase shift begins ahead of the contact).
pub(crate) fn onset(time_s: &[f64], force_n: &[f64], threshold_n: f64) -> Option<Onset> {
    let pieces = spells(time_s, force_n, threshold_n, 0.0);
    let spells = spells(time_s, force_n, threshold_n, PAUSE_S);
    let main = spells
        .iter()
        .enumerate()
        .reduce(|a, b| if b.1.impulse_ns > a.1.impulse_ns { b } else { a })
        .map(|(k, _)| k)?;
    let total_ns: f64 = spells.iter().map(|s| s.impulse_ns).sum();
    let contact = spells[main];
    let (crossing_s, interval_s) = match contact.first {
        0 => (time_s[0], None),
        i => {
            let share = (threshold_n - force_n[i - 1]) / (force_n[i] - force_n[i - 1]);
            let crossing_s = time_s[i - 1] + share.clamp(0.0, 1.0) * (time_s[i] - time_s[i - 1]);
            // A sensor with an offset never comes near 0.
            let is_gone = |k: &usize| force_n[*k] <= GONE * threshold_n;
            let mut gone = (0..i).rev().find(is_gone).unwrap_or(i - 1);
            // A force that rises gently begins further down.
            while gone > 0 && force_n[gone] > 0.0 && force_n[gone - 1] < force_n[gone] {
                gone -= 1;
            }
            (crossing_s, Some(time_s[i] - time_s[gone]))
        }
    };
    let mut warnings: Vec<String> = spells[..main]
        .iter()
        .take(NAMED)
        .map(|spell| {
            format!(
                "contact: ignored the {} at {}, with {} of the impulse; contact starts at {} ({STATED_BY} overrides this)",
                spell.shown(),
                milliseconds(time_s[spell.first]),
                percent(spell.impulse_ns / total_ns),
                milliseconds(crossing_s)
            )
        })
        .collect();
    if main > NAMED {
        warnings.push(format!("contact: {} more force pulses precede it", main - NAMED));
    }
    let first = pieces.iter().find(|p| p.first == contact.first);
    let second = pieces.iter().find(|p| p.first > contact.first && p.first <= contact.last);
    if let (Some(first), Some(second)) = (first, second)
        && first.impulse_ns < SMALL_SHARE * contact.impulse_ns
    {
        warnings.push(format!(
            "contact: starts at {} with the {}, {} of the impulse, and resumes at {}: if that is noise, set {STATED_BY}",
            milliseconds(crossing_s),
            first.shown(),
            percent(first.impulse_ns / contact.impulse_ns),
            milliseconds(time_s[second.first])
        ));
    }
    let at_most_s = None;
    Some(Onset { time_s: crossing_s, interval_s, at_most_s, warnings, first: contact.first })
}

impl Onset {
    /// The onset in a force that is the central difference of an impulse, so that the last state without contact has half of the
    /// first force already. Where the interval after it has less of the impulse than the force of the next two intervals,
    /// continued backwards, would have left, the contact is within it, and the forces at its ends become those on that line; else a
    /// peak may have begun anywhere in it, and its first force is the mean over it. `from_rest`: the record begins with the run.
    pub(crate) fn by_impulse(
        self,
        time_s: &[f64],
        force_n: &mut [f64],
        threshold_n: f64,
        from_rest: bool,
    ) -> Self {
        const STEPS: usize = 200;
        let is_gone = |i: usize| force_n[i] <= GONE * threshold_n;
        // Late in an interval a contact leaves less than the threshold at the state before.
        let earliest = self.first.saturating_sub(LATE);
        let i = (earliest..self.first).rev().take_while(|&i| !is_gone(i)).last();
        let i = i.unwrap_or(self.first);
        let begins = if i == 0 { from_rest } else { is_gone(i - 1) };
        if !begins || i + 3 >= time_s.len() {
            return self;
        }
        let step_s = |k: usize| time_s[k + 1] - time_s[k];
        let over = |k: usize| force_n[k] * (time_s[k + 1] - time_s[k.saturating_sub(1)]);
        // Impulses up to the next three states.
        let first_ns = over(i);
        let second_ns = over(i + 1);
        let third_ns = first_ns + over(i + 2);
        let second_n = (second_ns - first_ns) / step_s(i + 1);
        // A force that falls had a peak before, of a height that is not known.
        let rise_n = ((third_ns - second_ns) / step_s(i + 2) - second_n).max(0.0);
        let line_n = |share: f64| second_n + rise_n * (share - 1.5);
        let mut left_ns = first_ns;
        let share = (0..STEPS).rev().map(|k| (k as f64 + 0.5) / STEPS as f64).find(|&share| {
            left_ns -= line_n(share).max(0.0) * step_s(i) / STEPS as f64;
            // Where the line begins at 0, digits decide.
            left_ns <= 0.0 || line_n(share) <= 0.0 && left_ns < MOST_LEFT * first_ns
        });
        let Some(share) = share else {
            force_n[i] = first_ns / step_s(i);
            let (interval_s, at_most_s) = ((i > 0).then_some(step_s(i)), Some(step_s(i)));
            return Self { time_s: time_s[i], interval_s, at_most_s, ..self };
        };
        // No earlier than where the line begins: nothing pulls.
        let share = if rise_n > 0.0 { share.max(1.5 - second_n / rise_n) } else { share };
        (force_n[i], force_n[i + 1]) = (line_n(0.0), line_n(1.0));
        let interval_s = Some(SHARE_OFF * step_s(i));
        let at_most_s = Some(MOST_OFF * step_s(i));
        Self { time_s: time_s[i] + share * step_s(i), interval_s, at_most_s, ..self }
    }
}

/// Pulses: states above the threshold; those less than `pause_s` apart are one.
fn spells(time_s: &[f64], force_n: &[f64], threshold_n: f64, pause_s: f64) -> Vec<Spell> {
    let mut spells: Vec<Spell> = Vec::new();
    let last = time_s.len().saturating_sub(1);
    for i in (0..time_s.len()).filter(|&i| force_n[i] > threshold_n) {
        let width_s = 0.5 * (time_s[(i + 1).min(last)] - time_s[i.saturating_sub(1)]);
        let impulse_ns = force_n[i] * width_s;
        match spells.last_mut() {
            Some(spell) if spell.last + 1 == i || time_s[i] - time_s[spell.last] < pause_s => {
                spell.last = i;
                spell.states += 1;
                spell.impulse_ns += impulse_ns;
                spell.largest_n = spell.largest_n.max(force_n[i]);
            }
            _ => spells.push(Spell {
                first: i,
                last: i,
                states: 1,
                impulse_ns,
                largest_n: force_n[i],
            }),
        }
    }
    spells
}

impl Spell {
    fn shown(&self) -> String {
        let states = if self.states == 1 { "state" } else { "states" };
        format!("force of up to {:.3} kN over {} {states}", self.largest_n / 1e3, self.states)
    }
}

/// A time for messages: `12.345 ms`.
pub(crate) fn milliseconds(time_s: f64) -> String {
    format!("{} ms", (time_s * 1e6).round() / 1e3)
}

fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 ms apart, 1 MN from 50 ms to 150 ms.
    fn record() -> (Vec<f64>, Vec<f64>) {
        let time_s: Vec<f64> = (0..200).map(|i| f64::from(i) * 1e-3).collect();
        let force_n = (0..200).map(|i| if (50..150).contains(&i) { 1e6 } else { 0.0 }).collect();
        (time_s, force_n)
    }

    fn of((time_s, force_n): &(Vec<f64>, Vec<f64>)) -> Onset {
        onset(time_s, force_n, threshold_n(force_n, THRESHOLD)).unwrap()
    }

    #[test]
    fn the_crossing_lies_between_two_states() {
        let found = of(&record());
        // The threshold, 5 kN, is 0.5 % of the way from 0 to 1 MN.
        assert!((found.time_s - 49.005e-3).abs() < 1e-12, "{}", found.time_s);
        assert!((found.interval_s.unwrap() - 1e-3).abs() < 1e-12);
        assert_eq!(found.warnings, [""; 0]);
    }

    #[test]
    fn a_noisy_state_long_before_is_named_and_is_no_contact() {
        let mut noisy = record();
        noisy.1[15] = 2e4;
        let found = of(&noisy);
        assert_eq!(found.time_s, of(&record()).time_s);
        assert_eq!(
            found.warnings,
            [
                "contact: ignored the force of up to 20.000 kN over 1 state at 15 ms, with 0.02 % of the impulse; contact starts at 49.005 ms (contact_time or gap in the run overrides this)"
            ]
        );
    }

    #[test]
    fn a_bounce_belongs_to_the_contact() {
        let mut bounced = record();
        bounced.1[42] = 5e5;
        let found = of(&bounced);
        assert!((found.time_s - 41.01e-3).abs() < 1e-12, "{}", found.time_s);
        assert_eq!(found.warnings, [""; 0], "half a per cent of the impulse is a nose plate");
        bounced.1[42] = 2e4;
        assert!(of(&bounced).warnings[0].contains("if that is noise"), "{:?}", of(&bounced));
    }

    #[test]
    fn a_record_may_begin_in_contact() {
        let (time_s, force_n) = record();
        let found = onset(&time_s[60..], &force_n[60..], 1e3).unwrap();
        assert_eq!((found.time_s, found.interval_s), (0.06, None));
        assert_eq!(onset(&time_s, &vec![0.0; 200], 1e3), None);
        // Impulses of a force that rises less and less: of a record that begins later than the run they show nothing.
        let mut rising: Vec<f64> = (0..140).map(|i| 1e5 * f64::from(i + 1).sqrt()).collect();
        let of = onset(&time_s[60..], &rising, 1e3).unwrap();
        let found = of.by_impulse(&time_s[60..], &mut rising, 1e3, false);
        assert_eq!((found.time_s, found.interval_s, rising[0]), (0.06, None, 1e5));
    }

    /// 1 MN from 49.3 ms on, and a force that rises evenly from there: both as central differences of their impulses, which are not 0 at the state
    /// before.
    #[test]
    fn impulses_show_where_in_an_interval_the_contact_begins() {
        let time_s = record().0;
        let of = |begins_s: f64, impulse_ns: &dyn Fn(f64) -> f64| {
            let impulses: Vec<f64> =
                time_s.iter().map(|t| impulse_ns((t - begins_s).max(0.0))).collect();
            let mut force_n = crate::signal::derivative(&time_s, &impulses);
            let limit_n = threshold_n(&force_n, THRESHOLD);
            let found = onset(&time_s, &force_n, limit_n).unwrap();
            (found.by_impulse(&time_s, &mut force_n, limit_n, true), force_n)
        };
        // At any place in the interval, and as strong as it is.
        for share in [0.01, 0.3, 0.7, 0.98, 0.99, 0.993, 0.997, 0.999] {
            let (found, force_n) = of(0.049 + 1e-3 * share, &|t| 1e6 * t);
            let off_s = found.time_s - (0.049 + 1e-3 * share);
            assert!(off_s.abs() < 5e-6 && found.warnings.is_empty(), "{share}: {found:?}");
            assert!((found.interval_s.unwrap() - 0.25e-3).abs() < 1e-9);
            assert!((found.at_most_s.unwrap() - 0.75e-3).abs() < 1e-9);
            assert!(
                (49..=60).all(|i| (force_n[i] / 1e6 - 1.0).abs() < 1e-9),
                "{share}: {force_n:?}"
            );
        }
        for begins_s in [0.0, 0.3e-3, 49.3e-3] {
            let (rising, force_n) = of(begins_s, &|t| 5e6 * t * t);
            assert!((rising.time_s - begins_s).abs() < 5e-6, "{rising:?}");
            let i = (begins_s / 1e-3) as usize + 1;
            let share = (rising.time_s - time_s[i - 1]) / 1e-3;
            assert!((1.0 - share) * force_n[i - 1] + share * force_n[i] > -1e-3, "{force_n:?}");
            let expected_n = 1e7 * (time_s[i] - begins_s);
            assert!((force_n[i] / expected_n - 1.0).abs() < 0.02, "{} N", force_n[i]);
        }
        // A force that rises within 1.3 intervals and then stays is found late.
        for share in 0..20 {
            let begins_s = 0.049 + 5e-5 * f64::from(share);
            let rises_s = 1.3e-3_f64;
            let of_ramp =
                |t: f64| 1e6 * (t.min(rises_s).powi(2) / (2.0 * rises_s) + (t - rises_s).max(0.0));
            let late_s = of(begins_s, &of_ramp).0.time_s - begins_s;
            assert!((-1e-5..0.65e-3).contains(&late_s), "{share}: {late_s} s");
        }
        // A peak at the contact leaves more than what follows would: it may have begun anywhere.
        let (peak, force_n) = of(49.3e-3, &|t| 1e6 * t + if t > 0.0 { 800.0 } else { 0.0 });
        assert!((peak.time_s - 0.049).abs() < 1e-12, "{peak:?}");
        assert!((peak.interval_s.unwrap() - 1e-3).abs() < 1e-9);
        assert!((peak.at_most_s.unwrap() - 1e-3).abs() < 1e-9);
        let (peak, _) = of(0.3e-3, &|t| 1e6 * t + if t > 0.0 { 800.0 } else { 0.0 });
        assert_eq!((peak.time_s, peak.interval_s, peak.at_most_s), (0.0, None, Some(1e-3)));
        assert!((force_n[49] / 1.5e6 - 1.0).abs() < 1e-9, "{}", force_n[49]);
    }
}
