//! Results of the chosen histories of a run in SI: speed, crush, times, masses; and what follows from
//! them for filter and sampling.

use super::record::Record;
use super::units::{digits, shown_mass, trimmed};
use super::write::Evidence::{Computed, Guessed, Read};
use super::write::Proposed;
use crate::curve::contact;
use crate::curve::recipe::{Filter, Sampling};
use crate::order;
use crate::signal::integral;
use crate::unit::UnitSystem;

/// Speeds that differ by less are one.
pub(super) const SAME_SPEED: f64 = 0.01;

/// What a run's record says in SI.
#[derive(Clone, Debug, Default)]
pub(super) struct Impact {
    /// Closing speed before the contact, twice the run's for half a model.
    pub speed_m_per_s: f64,
    /// The state that it is taken from, and its time.
    pub state: (usize, f64),
    pub crush_m: f64,
    pub contact_s: f64,
    /// From contact to it.
    pub crush_time_s: f64,
    pub last_s: f64,
    /// Usual interval of the states.
    pub interval_s: f64,
    pub states: usize,
    /// Of the body, and of a pair the other body.
    pub masses: Vec<MassEstimates>,
    /// Empty without a force.
    pub force_time_s: Vec<f64>,
    /// Positive in compression.
    pub force_n: Vec<f64>,
}

impl Impact {
    pub(super) fn of(record: &Record, units: UnitSystem, half_model: bool) -> Self {
        let bodies = if half_model { 2.0 } else { 1.0 };
        let in_s = |time: &[f64]| time.iter().map(|t| t * units.time_s).collect::<Vec<f64>>();
        let (time_s, force_time_s) = (in_s(&record.time), in_s(&record.force_time));
        // Turned so that the impulse is positive.
        let impulse = integral(&record.force_time, &record.force).last().copied();
        let sign = if impulse.is_some_and(|impulse| impulse < 0.0) { -1.0 } else { 1.0 };
        let mut force_n: Vec<f64> = record.force.iter().map(|f| sign * f * units.force()).collect();
        let mut contact_s = time_s[0];
        if !force_n.is_empty() {
            let threshold_n = contact::threshold_n(&force_n, contact::THRESHOLD);
            let onset = contact::onset(&force_time_s, &force_n, threshold_n);
            let from_rest = force_time_s[0] == 0.0 && record.travel[0] == 0.0;
            let onset = match &record.force_means {
                Some(_) => onset.map(|onset| {
                    onset.by_impulse(&force_time_s, &mut force_n, threshold_n, from_rest)
                }),
                None => onset,
            };
            contact_s = onset.map_or(contact_s, |onset| onset.time_s.max(contact_s));
        }
        let before = time_s.partition_point(|&t| t <= contact_s).saturating_sub(1);
        // The first velocities are the deck's; where they have changed by the contact, these count.
        let is_kept = is_near(record.closing(0), record.closing(before), SAME_SPEED);
        let state = if is_kept { 0 } else { before };
        let end = record.loading_end().unwrap_or(time_s.len() - 1);
        let begin = before.min(end);
        let after = (begin + 1).min(end);
        let step_s = time_s[after] - time_s[begin];
        let share = if step_s > 0.0 { (contact_s - time_s[begin]) / step_s } else { 0.0 };
        let to_contact = share.clamp(0.0, 1.0) * (record.travel[after] - record.travel[begin]);
        let crush = (record.travel[end] - record.travel[begin] - to_contact).abs();
        Self {
            speed_m_per_s: bodies * record.closing(state) * units.speed(),
            state: (state, time_s[state]),
            crush_m: bodies * crush * units.length_m,
            contact_s,
            crush_time_s: time_s[end] - contact_s,
            last_s: time_s[time_s.len() - 1],
            interval_s: interval(if force_n.is_empty() { &time_s } else { &force_time_s }),
            states: record.states,
            masses: record.masses(units),
            force_time_s,
            force_n,
        }
    }
}

/// Masses by momentum and by kinetic energy that differ by less are one.
const SAME_BY_ENERGY: f64 = 0.05;
/// Masses of runs that differ by less are one: so much two runs of one model scatter.
pub(super) const SAME_MASS: f64 = 0.03;
/// The same for masses that the kinetic energy at the start gives: files print it with five digits or more, and before the
/// contact, mass scaling and rotating parts add nearly the same share to all runs of one model. A model takes no smaller difference
/// as a parameter.
pub(super) const SAME_EXACT_MASS: f64 = 0.005;

/// Largest share by which coarse records may let a mass be off.
const MOST_COARSE: f64 = 0.03;

/// What a run says of a mass, in kg.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct MassEstimates {
    pub by_momentum: Option<f64>,
    /// Whether that was taken after the contact.
    pub in_free_flight: bool,
    /// Share by which other forces than the contact's may have changed it.
    pub unexplained: f64,
    /// Whether it allows for a constant force, such as a weight.
    pub has_constant_force: bool,
    pub by_energy: Option<f64>,
    /// Whether that is the energy of all that moves: sums over parts lack lumped masses.
    pub energy_is_whole: bool,
    /// Whether two bodies have that energy.
    pub is_shared: bool,
    /// Interval of the states over the time from contact to the largest crush, of which a mass by momentum may be off by
    /// half; after the contact that of the forces alone.
    pub coarseness: f64,
    /// Whether the record starts in contact: what is stopped already has no part in a mass by momentum.
    pub is_late: bool,
}

/// The share of a mass that momentum gives at least where a record starts in contact: crush zones are lighter than the rest.
const LEAST_LEFT: f64 = 0.85;

/// Above it other forces are warned of; the waves in a body that has left the contact look like less.
const UNEXPLAINED: f64 = 0.05;

impl MassEstimates {
    /// The mass, and whether it is that by energy.
    fn kg(&self) -> Option<(f64, bool)> {
        match (self.by_momentum, self.by_energy) {
            (Some(momentum), Some(energy))
                if self.is_too_heavy(momentum, energy) || self.is_explained(momentum, energy) =>
            {
                Some((energy, true))
            }
            (Some(momentum), _) => Some((momentum, false)),
            (None, energy) => Some((energy?, true)),
        }
    }

    /// Masses that differ from this one by less may be the same. An energy that two bodies share is as exact as the
    /// ratio of their changes of velocity, which momentum after the contact confirms.
    pub(super) fn same(&self) -> f64 {
        let confirms =
            |energy| self.by_momentum.is_some_and(|m| is_near(m, energy, SAME_EXACT_MASS));
        match self.kg() {
            Some((kg, true)) if !self.is_shared || (self.in_free_flight && confirms(kg)) => {
                SAME_EXACT_MASS
            }
            _ => SAME_MASS,
        }
    }

    /// Whether no body can have the mass by momentum.
    fn is_too_heavy(&self, momentum: f64, energy: f64) -> bool {
        self.energy_is_whole && momentum > energy
    }

    /// Whether both ways give one mass, but for what other forces do to the one by momentum.
    fn is_explained(&self, momentum: f64, energy: f64) -> bool {
        is_near(momentum, energy, SAME_BY_ENERGY.max(1.5 * self.unexplained))
    }

    /// What the mass follows from.
    fn from(&self) -> String {
        const IMPULSE: &str = "impulse of the force over the change of velocity";
        let by_energy = (self.by_energy, "kinetic energy at the start");
        let (from, (other, way)) = match self.kg() {
            Some((_, true)) if self.is_shared => (
                "kinetic energy of the model at the start, shared by the bodies' changes of velocity".into(),
                (self.by_momentum, "momentum"),
            ),
            Some((_, true)) => (
                "kinetic energy of the model at the start over ½v²".into(),
                (self.by_momentum, "momentum"),
            ),
            _ if self.has_constant_force => (
                format!("{IMPULSE}, less that of the force that accelerates the body before the contact (gravity, brakes, friction)"),
                by_energy,
            ),
            _ if self.in_free_flight => (format!("{IMPULSE}, after the contact"), by_energy),
            _ => (format!("{IMPULSE}, while loading (accurate to a few per cent)"), by_energy),
        };
        let other = other.map(|kg| format!(" ({way} gives {})", shown_mass(kg)));
        from + &other.unwrap_or_default()
    }
}

/// A mass given by the user that differs from that of a record by this share, and more than the record leaves open, may have another unit.
const CONTRADICTS: f64 = 0.1;

/// What to say if a mass that the user gives by `option` is not that of the records.
pub(super) fn contradicts(
    runs: &[(String, MassEstimates)],
    option: &str,
    given_kg: f64,
) -> Option<String> {
    let other = |(name, mass): &(String, MassEstimates)| {
        let (kg, _) = mass.kg()?;
        let open = CONTRADICTS + mass.unexplained + 0.5 * mass.coarseness;
        (!is_near(kg, given_kg, open)).then(|| {
            format!(
                "mass: {option} is {}, but the record of {name} gives {}: check it, and its unit",
                shown_mass(given_kg),
                shown_mass(kg)
            )
        })
    };
    runs.iter().find_map(other)
}

/// The mass of each run: one for all runs that scatter about it.
///
/// `what`: `mass` or `other mass`. `why`: why a run has none. Warns where the two ways differ.
pub(super) fn agree(
    what: &str,
    runs: &[(String, MassEstimates)],
    why: &str,
    warnings: &mut Vec<String>,
) -> Vec<Proposed<f64>> {
    let option = format!("--{}", what.replace(' ', "-"));
    for (name, mass) in runs {
        if let (Some(momentum), Some(energy)) = (mass.by_momentum, mass.by_energy)
            && !mass.is_explained(momentum, energy)
        {
            let why = if mass.is_too_heavy(momentum, energy) {
                "the force is larger than what stops the body: is it counted twice, that of another run, or in other units? The energy's mass is taken"
            } else {
                "the force acts on only part of the moving mass, or more than the bodies is moving"
            };
            warnings.push(format!(
                "{what}: in {name} momentum gives {}, the kinetic energy at the start {}: {why}",
                shown_mass(momentum),
                shown_mass(energy)
            ));
        }
        if let Some((_, false)) = mass.kg()
            && mass.unexplained > UNEXPLAINED
        {
            warnings.push(format!(
                "{what}: in {name} the body's speed also changes without the force (gravity, brakes, another contact), which may change the mass from momentum by {:.0} %: give {option}",
                100.0 * mass.unexplained
            ));
        }
    }
    let is_late =
        |mass: &MassEstimates| mass.is_late && mass.kg().is_some_and(|(_, by_energy)| !by_energy);
    let are_all_late = runs.iter().all(|(_, mass)| mass.kg().is_none() || is_late(mass));
    let of = |(k, (_, mass)): (usize, &(String, MassEstimates))| {
        let (kg, by_energy) = mass.kg().filter(|_| are_all_late || !is_late(mass))?;
        let coarse = if by_energy { 0.0 } else { (0.5 * mass.coarseness).min(MOST_COARSE) };
        Some((k, kg, mass.same(), coarse))
    };
    type Weighed = (usize, f64, f64, f64);
    let mut by_mass: Vec<Weighed> = runs.iter().enumerate().filter_map(of).collect();
    order::sort(&mut by_mass, |a, b| a.1.total_cmp(&b.1));
    let mut found: Vec<Proposed<f64>> = runs.iter().map(|_| Proposed::missing(why)).collect();
    // Near all of them, not only the last: of many in small steps, the ends are two masses.
    let is_one = |a: &Weighed, b: &Weighed| is_near(a.1, b.1, a.2.max(b.2) + a.3 + b.3);
    let mut groups: Vec<Vec<Weighed>> = Vec::new();
    for run in by_mass {
        match groups.last_mut().filter(|group| group.iter().all(|of| is_one(of, &run))) {
            Some(group) => group.push(run),
            None => groups.push(vec![run]),
        }
    }
    for one in groups {
        let median = 0.5 * (one[(one.len() - 1) / 2].1 + one[one.len() / 2].1);
        let (least, most) = (one[0].1, one[one.len() - 1].1);
        if !is_near(least, most, SAME_MASS) {
            warnings.push(format!(
                "{what}: the runs' masses by momentum lie between {} and {}, which their records leave open: one mass is taken; give {option} if it is known",
                shown_mass(least),
                shown_mass(most)
            ));
        }
        for &(k, ..) in &one {
            let mut from = runs[k].1.from();
            if one.len() > 1 {
                let range = if is_near(least, most, 5e-4) {
                    "all alike".into()
                } else {
                    format!("{} to {} kg", least.round(), most.round())
                };
                from = format!("{from}; median of {} runs, {range}", one.len());
            }
            found[k] = Proposed::found(rounded(median), Computed, from);
        }
    }
    // Such a mass is too low, by what is stopped already: one that is further off is that of another vehicle.
    let agreed: Vec<f64> = found.iter().filter_map(|mass| mass.value().copied()).collect();
    for (k, (_, mass)) in runs.iter().enumerate() {
        let Some((own, _)) = mass.kg().filter(|_| !are_all_late && is_late(mass)) else { continue };
        let lacks = |kg: &&f64| (LEAST_LEFT..=1.0 + SAME_MASS).contains(&(own / **kg));
        let nearest = |a: &&f64, b: &&f64| (own / **b).total_cmp(&(own / **a));
        found[k] = match agreed.iter().filter(lacks).min_by(nearest) {
            Some(kg) => {
                let own = shown_mass(own);
                let from = format!(
                    "that of other runs; this record starts in contact, and momentum gives {own}"
                );
                Proposed::found(*kg, Computed, from)
            }
            None => Proposed::found(rounded(own), Computed, mass.from()),
        };
    }
    found
}

pub(super) fn is_near(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * a.abs().max(b.abs())
}

/// Four significant digits: more is not known.
fn rounded(kg: f64) -> f64 {
    format!("{kg:.3e}").parse().unwrap_or(kg)
}

/// A mass as in a study.
pub(super) fn text(kg: f64) -> String {
    if kg >= 1e3 { format!("{}t", kg / 1e3) } else { format!("{kg}kg") }
}

/// That masses of the runs differ, if they do; `what`: `mass` or `other mass`.
pub(super) fn differ(what: &str, masses: &[Proposed<f64>]) -> Option<String> {
    let mut all: Vec<f64> = masses.iter().filter_map(|mass| mass.value().copied()).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    (all.len() > 1).then(|| {
        let shown: Vec<String> = all.iter().map(|kg| (rounded(*kg) / 1e3).to_string()).collect();
        format!(
            "{what}: the runs' masses differ ({} t): do they belong to one vehicle? Models take a mass that differs as a parameter",
            shown.join(", ")
        )
    })
}

/// Classes that are proposed: that of domain practice for forces of crash structures, and those for shorter impacts.
pub(super) const CLASSES: [u32; 4] = [60, 180, 600, 1000];
/// Finer records are sampled at this interval, but for a short crush: CFC 60 leaves nothing that needs more.
const FINEST_S: f64 = 1e-4;
const MOST_STATES: f64 = 20_000.0;

/// Steps that differ from their median by less than this factor are one rate with jitter.
const JITTER: f64 = 0.5;

/// The usual interval of rising times: the mean of those near the median, since solvers write the
/// first cycle after each multiple. 0 for fewer than two times.
pub(super) fn interval(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let Some(&median) = steps.get(steps.len() / 2) else { return 0.0 };
    let usual = steps.iter().filter(|step| is_near(**step, median, JITTER));
    let (sum, count) = usual.fold((0.0, 0.0), |(sum, count), step| (sum + step, count + 1.0));
    sum / count
}

/// `means`: why the forces are means over their intervals, if they are.
pub(super) fn filter(means: Option<&str>, interval_s: f64) -> Proposed<Filter> {
    let usual = CLASSES[0];
    let longest_s = 1.0 / (10.0 * f64::from(usual));
    let ms = digits(interval_s * 1e3);
    match means {
        Some(why) => Proposed::found(Filter::None, Read, why),
        None if interval_s <= longest_s => {
            let from = format!("the usual class; one force every {ms} ms allows it");
            Proposed::found(Filter::Cfc(usual), Guessed, from)
        }
        None => {
            let needed = digits(longest_s * 1e3);
            let from = format!(
                "one force every {ms} ms is too coarse for CFC {usual}, which needs one every {needed} ms"
            );
            Proposed::found(Filter::None, Computed, from)
        }
    }
}

/// Common times that cover every record from its contact on; the coarsest interval of all.
pub(super) fn sampling(runs: &[&Impact]) -> Option<Proposed<Sampling>> {
    let coarsest = runs.iter().map(|run| run.interval_s).fold(0.0, f64::max);
    let longest = runs.iter().map(|run| run.last_s - run.contact_s).fold(0.0, f64::max);
    if !(coarsest > 0.0 && longest > 0.0) {
        return None;
    }
    let shortest = runs.iter().map(|run| run.crush_time_s).filter(|s| *s > 0.0);
    let finest = FINEST_S.min(Sampling::interval_for(shortest.fold(f64::INFINITY, f64::min), 0.0));
    let least = coarsest.max(finest).max(longest / MOST_STATES);
    let interval_s = rounded_interval(least, longest);
    // The largest crush may be in a record's last state.
    let crush = runs.iter().map(|run| run.crush_time_s).fold(0.0, f64::max);
    let last = (longest / interval_s * (1.0 + 1e-6)).floor();
    let states = last.max((crush / interval_s * (1.0 - 1e-6)).ceil()) as usize + 1;
    let alike = runs.iter().all(|run| is_near(run.interval_s, coarsest, 0.01));
    let ms = |s: f64| digits(s * 1e3);
    let from = if least > 1.01 * coarsest {
        let (interval, enough) = (ms(coarsest), ms(interval_s));
        format!("the coarsest record has a state every {interval} ms; {enough} ms is enough")
    } else if alike {
        let most = runs.iter().map(|run| run.states).max().unwrap_or(0);
        format!("interval and length of the records, of up to {most} states")
    } else {
        "interval of the coarsest record, length of the longest".into()
    };
    Some(Proposed::found(Sampling { states: states.max(2), interval_s }, Computed, from))
}

/// The shortest decimal that is off by less than half an interval at the end of the record:
/// solvers write the first cycle after each multiple.
fn rounded_interval(interval_s: f64, longest_s: f64) -> f64 {
    let ms = interval_s * 1e3;
    let states = longest_s / interval_s;
    let decimals = (0..12).map(|digits| trimmed(&format!("{ms:.digits$}")));
    decimals
        .filter_map(|text| text.parse::<f64>().ok())
        .find(|short| *short > 0.0 && (short / ms - 1.0).abs() * states < 0.5)
        .map_or(interval_s, |short| short * 1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_momentum(kg: f64) -> MassEstimates {
        MassEstimates { by_momentum: Some(kg), in_free_flight: true, ..MassEstimates::default() }
    }

    #[test]
    fn runs_that_scatter_have_one_mass() {
        let runs =
            [24_010.0, 23_990.0, 24_004.4, 20_240.0].map(|kg| (format!("{kg}"), by_momentum(kg)));
        let mut warnings = Vec::new();
        let found = agree("mass", &runs, "unknown", &mut warnings);
        let values: Vec<f64> = found.iter().map(|m| *m.value().unwrap()).collect();
        assert_eq!(values, [24_000.0, 24_000.0, 24_000.0, 20_240.0]);
        assert_eq!(
            found[0].to_string(),
            "computed: impulse of the force over the change of velocity, after the contact; median of 3 runs, 23990 to 24010 kg"
        );
        assert_eq!(warnings, [""; 0]);
        assert!(differ("mass", &found).unwrap().contains("(20.24, 24 t)"));
        // What is stopped before a record begins has no part in its mass.
        let late = |kg: f64| MassEstimates { is_late: true, ..by_momentum(kg) };
        let runs = [("a", by_momentum(24e3)), ("b", late(22_100.0)), ("c", by_momentum(60e3))];
        let found = agree("mass", &runs.map(|(name, mass)| (name.into(), mass)), "", &mut warnings);
        assert_eq!(found[1].value(), Some(&24e3));
        assert!(found[1].to_string().ends_with("starts in contact, and momentum gives 22.1 t"));
        let runs = [("a", by_momentum(24e3)), ("b", late(30e3)), ("c", late(15e3))];
        let found = agree("mass", &runs.map(|(name, mass)| (name.into(), mass)), "", &mut warnings);
        assert_eq!((found[1].value(), found[2].value()), (Some(&30e3), Some(&15e3)));
        let found = agree("mass", &[("b".into(), late(22_100.0))], "", &mut warnings);
        assert_eq!(found[0].value(), Some(&22.1e3));
        // A state every 2 ms of a crash of 60 ms leaves a few per cent open.
        let coarse = |kg: f64, coarseness| MassEstimates { coarseness, ..by_momentum(kg) };
        assert!(warnings.is_empty());
        for (coarseness, masses) in [(0.03, 1), (0.001, 2), (0.0, 2)] {
            let runs = [19_480.0, 20_440.0].map(|kg| (format!("{kg}"), coarse(kg, coarseness)));
            let mut found: Vec<f64> = agree("mass", &runs, "unknown", &mut warnings)
                .iter()
                .map(|mass| *mass.value().unwrap())
                .collect();
            found.dedup();
            assert_eq!(found.len(), masses, "{coarseness}: {found:?}");
            assert_eq!(warnings.drain(..).count(), 2 - masses, "one mass of several is said");
        }
    }

    #[test]
    fn kinetic_energy_is_exact_where_both_agree() {
        let both = |energy| MassEstimates { by_energy: Some(energy), ..by_momentum(23_500.0) };
        let mut warnings = Vec::new();
        let found = agree("mass", &[("a".into(), both(24_000.0))], "", &mut warnings);
        assert_eq!(found[0].value(), Some(&24_000.0));
        assert_eq!(warnings, [""; 0]);
        let found = agree("mass", &[("a".into(), both(48_000.0))], "", &mut warnings);
        assert_eq!(found[0].value(), Some(&23_500.0));
        assert!(
            warnings[0].starts_with("mass: in a momentum gives 23.5 t, the kinetic"),
            "{warnings:?}"
        );
    }

    /// What momentum alone leaves open may be one mass, the kinetic energy shows how many there are.
    #[test]
    fn masses_are_one_within_their_accuracy() {
        let loading = |kg| MassEstimates { in_free_flight: false, ..by_momentum(kg) };
        let exact = |kg| MassEstimates { by_energy: Some(kg), ..by_momentum(kg) };
        let shared = |kg| MassEstimates { is_shared: true, ..exact(kg) };
        let guessed = |kg| MassEstimates { is_shared: true, by_energy: Some(kg), ..loading(kg) };
        type Of<'a> = &'a dyn Fn(f64) -> MassEstimates;
        let cases: [(Of<'_>, &[f64], &[f64]); 6] = [
            (&exact, &[24e3, 24.6e3, 25.2e3], &[24e3, 24.6e3, 25.2e3]),
            (&exact, &[24e3, 24.02e3, 24.05e3], &[24.02e3; 3]),
            (&shared, &[24e3, 24.6e3], &[24e3, 24.6e3]),
            (&guessed, &[24e3, 24.6e3], &[24.3e3; 2]),
            (&by_momentum, &[24e3, 24.6e3], &[24.3e3; 2]),
            // In small steps from one mass to another.
            (&loading, &[23e3, 23.6e3, 24.2e3, 24.8e3], &[23.3e3, 23.3e3, 24.5e3, 24.5e3]),
        ];
        for (of, kg, expected) in cases {
            let runs: Vec<_> = kg.iter().map(|kg| (format!("{kg}"), of(*kg))).collect();
            let mut warnings = Vec::new();
            let found = agree("other mass", &runs, "unknown", &mut warnings);
            let found: Vec<f64> = found.iter().map(|mass| *mass.value().unwrap()).collect();
            assert_eq!((&*found, warnings), (expected, Vec::new()), "{kg:?}");
        }
    }

    /// A mass that falls during its impact takes up more impulse than it had; brakes take some of it away.
    #[test]
    fn other_forces_leave_the_mass_by_energy() {
        let falling = MassEstimates { unexplained: 0.34, ..by_momentum(32_200.0) };
        let known = MassEstimates { by_energy: Some(24_000.0), ..falling };
        let mut warnings = Vec::new();
        let found = agree("mass", &[("a".into(), known)], "", &mut warnings);
        assert_eq!((found[0].value(), warnings.len()), (Some(&24_000.0), 0));
        let found = agree("mass", &[("a".into(), falling)], "", &mut warnings);
        assert_eq!(found[0].value(), Some(&32_200.0));
        assert!(warnings[0].ends_with("by 34 %: give --mass"), "{warnings:?}");
    }

    #[test]
    fn masses_are_written_with_four_digits() {
        assert_eq!(
            [24_003.7, 20_241.2, 812.34].map(|kg| text(rounded(kg))),
            ["24t", "20.24t", "812.3kg"]
        );
    }

    fn record(interval_s: f64, contact_s: f64, last_s: f64) -> Impact {
        let states = (last_s / interval_s) as usize + 1;
        Impact { contact_s, last_s, interval_s, states, ..Impact::default() }
    }

    fn proposed(runs: &[Impact]) -> Sampling {
        *sampling(&runs.iter().collect::<Vec<_>>()).unwrap().value().unwrap()
    }

    #[test]
    fn the_records_interval_is_taken_without_the_solvers_jitter() {
        let found = proposed(&[record(0.7500057e-3, 0.0, 0.2992523)]);
        assert_eq!((found.states, found.interval_s), (400, 0.75e-3));
        let found = proposed(&[record(1e-5, 0.01, 0.11)]);
        assert_eq!((found.states, found.interval_s), (1001, 1e-4));
        let found = proposed(&[record(1e-3, 0.0, 0.1), record(0.5e-3, 0.0, 0.2)]);
        assert_eq!((found.states, found.interval_s), (201, 1e-3));
        assert!(sampling(&[]).is_none());
        // The largest crush, in the last state, lies between two multiples of the interval.
        let late = Impact { crush_time_s: 0.0767, ..record(2e-4, 1e-3, 0.0777) };
        assert_eq!(
            (proposed(&[late]).states, proposed(&[record(2e-4, 1e-3, 0.0777)]).states),
            (385, 384)
        );
        // A short crush of a fine record.
        let short = Impact { crush_time_s: 1.3e-3, ..record(1e-6, 0.001, 0.005) };
        assert_eq!(proposed(&[short]).interval_s, 2e-5);
    }

    #[test]
    fn the_filter_is_what_the_interval_allows() {
        assert_eq!(filter(None, 1e-4).value(), Some(&Filter::Cfc(60)));
        assert_eq!(filter(None, 2e-3).value(), Some(&Filter::None));
        assert_eq!(filter(Some("a mean"), 1e-4).to_string(), "read: a mean");
    }
}
