//! The runs of a proposal put into words: speeds and masses with where they are from, and what the
//! folders' names and decks say against them.

use super::agree::percent;
use super::describe::Seen;
use super::evidence::{Evidence, Proposed};
use super::explain::FOLLOWS;
use super::folders::speed_in;
use super::given::UserHints;
use super::masses::{self, MassEstimates, is_near};
use super::measure::{Measured, SAME_SPEED, SiRun};
use super::proposal::ProposedRun;
use super::propose::Recorded;
use super::units::digits;
use crate::study::StudyKind;
use crate::study::files::shown_name;
use crate::unit::{SPEED, km_per_h};

/// Masses of a pair whose velocities say that they differ by more are not one.
const UNEQUAL: f64 = 0.1;

/// The runs by speed, then by name.
pub(super) fn runs(
    measured: &Measured<'_>,
    given: &UserHints,
    truncated: &[Option<f64>],
    seen: Seen<'_>,
    warnings: &mut Vec<String>,
) -> Vec<ProposedRun> {
    let (bodies, others) = masses(measured, given, warnings);
    let is_half = names_say_half(measured, given);
    if is_half {
        warnings.push("the folders' names say twice the recorded speeds: closing speeds of half models? Then say --half-model".into());
    }
    let mut runs: Vec<ProposedRun> = measured
        .recorded
        .iter()
        .enumerate()
        .map(|(k, recorded)| {
            let run = measured.runs.get(k);
            let folder = recorded.run.path.clone();
            let no_units = || Proposed::missing("without units it is not known");
            ProposedRun {
                path: seen(&folder).unwrap_or_default(),
                folder,
                name: recorded.run.name.clone(),
                speed_m_per_s: run.map_or_else(no_units, |run| speed(run, measured, given)),
                mass_kg: bodies.get(k).cloned().unwrap_or_else(no_units),
                other_mass_kg: others.as_ref().and_then(|others| others.get(k)).cloned(),
                truncate_s: truncated.get(k).copied().flatten().map(|s| {
                    let from = "the last state comes too soon behind the one before for the filter";
                    Proposed::found(s, Evidence::Computed(from.into()))
                }),
                crush_m: run.map(|run| run.crush_m),
                states: recorded.record.states,
                notes: run.filter(|_| !is_half).map_or(Vec::new(), doubts_of_speed),
            }
        })
        .collect();
    let speed = |run: &ProposedRun| run.speed_m_per_s.value().copied().unwrap_or_default();
    runs.sort_by(|a, b| speed(a).total_cmp(&speed(b)).then(a.name.cmp(&b.name)));
    let alike = runs.windows(2).filter(|pair| {
        let (a, b) = (speed(&pair[0]), speed(&pair[1]));
        a > 0.0 && is_near(a, b, SAME_SPEED)
    });
    let alike: Vec<String> =
        alike.map(|pair| format!("{} and {}", pair[0].name, pair[1].name)).collect();
    if !alike.is_empty() {
        warnings.push(format!(
            "runs of one speed with different histories: {}; a group holds one design",
            alike.join(", ")
        ));
    }
    runs
}

/// Speed of a run, from its first velocities or those right before the contact.
fn speed(run: &SiRun<'_>, measured: &Measured<'_>, given: &UserHints) -> Proposed<f64> {
    let (state, time_s) = run.state;
    let record = &run.recorded.record;
    let values: Vec<String> = record.velocities.iter().map(|v| v[state].to_string()).collect();
    let nodes: Vec<String> = measured.agreed.nodes.iter().map(|n| n.id.to_string()).collect();
    let when = match state {
        0 => "in the first state".into(),
        _ => format!("in the last state before the contact, at {:.3} ms", time_s * 1e3),
    };
    let of = format!("{} of {} {when}", measured.agreed.direction.velocity(), nodes.join(" and "));
    let unit = measured.units.value().and_then(|units| SPEED.name_of(units.speed()));
    let values = format!("{} {}", values.join(" and "), unit.unwrap_or_default());
    let evidence = match (record.velocities.len(), given.half_model) {
        (1, false) => Evidence::Read(format!("{of}: {values}")),
        (1, true) => Evidence::Computed(format!("twice the {of}: {values}")),
        _ => Evidence::Computed(format!("difference of the {of}: {values}")),
    };
    Proposed::found(run.speed_m_per_s, evidence)
}

/// Whether the folders' names say twice the recorded speeds, of all runs whose name says one.
fn names_say_half(measured: &Measured<'_>, given: &UserHints) -> bool {
    let said: Vec<bool> = measured
        .runs
        .iter()
        .filter_map(|run| Some((run, speed_in(&run.recorded.run.name)?)))
        .map(|(run, said)| is_near(said, 2.0 * run.speed_m_per_s, SAME_SPEED))
        .collect();
    let is_single = measured.agreed.kind == StudyKind::Wall && !given.half_model;
    is_single && !said.is_empty() && said.into_iter().all(|is_twice| is_twice)
}

/// What a folder's name and the run's own deck say of its speed, where they say something else.
fn doubts_of_speed(run: &SiRun<'_>) -> Vec<String> {
    let Recorded { run: of, record } = run.recorded;
    let first = record.closing(run.state.0);
    let mut notes = Vec::new();
    let said = speed_in(&of.name);
    if let Some(said) = said.filter(|said| !is_near(*said, run.speed_m_per_s, SAME_SPEED)) {
        notes.push(format!(
            "the folder's name says {}, the record {}",
            km_per_h(said),
            km_per_h(run.speed_m_per_s)
        ));
    }
    if let Some((path, deck)) = &of.sources.deck
        && path.parent() == Some(&of.path)
        && let Some(said) =
            deck.impact_speed().filter(|said| !is_near(said.speed, first, SAME_SPEED))
    {
        notes.push(format!(
            "the deck {}, line {}, says {} in its units, the record {first}",
            shown_name(path),
            said.at.line,
            said.speed
        ));
    }
    notes
}

/// Masses of the bodies and of the other bodies, where these are others.
fn masses(
    measured: &Measured<'_>,
    given: &UserHints,
    warnings: &mut Vec<String>,
) -> (Vec<Proposed<f64>>, Option<Vec<Proposed<f64>>>) {
    let agreed = measured.agreed;
    let is_weak = agreed.force.is_some() && agreed.residual > FOLLOWS;
    let is_part = agreed.force.as_ref().is_some_and(|force| force.file == "secforc");
    let why = match &agreed.force {
        Some(_) if is_weak => format!(
            "impulse and change of velocity differ by {} %, so no mass follows from momentum; say --mass",
            percent(agreed.residual)
        ),
        Some(_) if is_part => {
            "a section may carry only part of what stops the body, so no mass follows from momentum; say --mass".into()
        }
        _ => "it follows from no force and no energy; say --mass".into(),
    };
    let of =
        |weighed: fn(&SiRun<'_>) -> Option<MassEstimates>| -> Option<Vec<(String, MassEstimates)>> {
            let all = measured.runs.iter().map(|run| {
                let weighed = match (is_weak, is_part) {
                    (true, _) => MassEstimates::default(),
                    (false, true) => MassEstimates { by_momentum: None, ..weighed(run)? },
                    (false, false) => weighed(run)?,
                };
                Some((run.recorded.run.name.clone(), weighed))
            });
            all.collect()
        };
    let stated = |kg: Option<f64>, by: &str| {
        kg.map(|kg| {
            let one = Proposed::found(kg, Evidence::UserHints(format!("by {by}")));
            vec![one; measured.recorded.len()]
        })
    };
    let of_bodies = of(|run| Some(run.body)).unwrap_or_default();
    let bodies = stated(given.mass_kg, "--mass")
        .unwrap_or_else(|| masses::agree(&of_bodies, &why, warnings));
    let others = stated(given.other_mass_kg, "--other-mass").or_else(|| {
        let of_others = of(|run| run.other).filter(|_| given.mass_kg.is_none())?;
        Some(masses::agree(&of_others, &why, &mut Vec::new()))
    });
    warnings.extend(masses::differ(&bodies));
    let (bodies, others) = match others {
        Some(others) if given.other_mass_kg.is_none() => one_mass(bodies, others),
        others => (bodies, others),
    };
    let is_weighed = given.mass_kg.is_none() && bodies.iter().any(|mass| mass.value().is_some());
    match others {
        None if !is_weighed => {
            let others = by_ratio(&bodies, measured, given, warnings);
            (bodies, others)
        }
        others => (bodies, others),
    }
}

/// Where nothing weighs the bodies, what the velocities say of the other ones: nothing, if they are
/// as heavy as the first ones.
fn by_ratio(
    bodies: &[Proposed<f64>],
    measured: &Measured<'_>,
    given: &UserHints,
    warnings: &mut Vec<String>,
) -> Option<Vec<Proposed<f64>>> {
    let times = digits(unequal(measured)?);
    if given.mass_kg.is_some() {
        warnings.push(format!(
            "mass: by their velocities the other body is {times} times as heavy, and --mass alone stands for both: say --other-mass"
        ));
        return None;
    }
    let why = format!("by their velocities {times} times the mass; say --other-mass");
    Some(vec![Proposed::missing(why); bodies.len()])
}

/// Mass of the other bodies over that of the first ones, if the velocities of the runs say in
/// the mean that they differ.
fn unequal(measured: &Measured<'_>) -> Option<f64> {
    if measured.agreed.residual > FOLLOWS {
        return None;
    }
    let ratios: Option<Vec<f64>> =
        measured.recorded.iter().map(|run| run.record.mass_ratio()).collect();
    let ratios = ratios.filter(|ratios| !ratios.is_empty())?;
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    (!is_near(mean, 1.0, UNEQUAL)).then_some(mean)
}

/// Masses of both bodies, as one where they are equal in all runs.
fn one_mass(
    bodies: Vec<Proposed<f64>>,
    others: Vec<Proposed<f64>>,
) -> (Vec<Proposed<f64>>, Option<Vec<Proposed<f64>>>) {
    let pairs = || bodies.iter().zip(&others);
    let are_equal = |(a, b): (&Proposed<f64>, &Proposed<f64>)| match (a.value(), b.value()) {
        (Some(a), Some(b)) => masses::are_equal(*a, *b),
        (None, None) => true,
        _ => false,
    };
    if pairs().all(are_equal) { (bodies, None) } else { (bodies, Some(others)) }
}
