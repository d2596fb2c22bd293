//! Comparison of the cases of one group: copies, another design, energy or impulse unlike the others'.

use std::collections::{BTreeMap, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

use super::from_table::IMPORTED;
use super::{Case, Curve, ForceKind, loading};
use crate::order;

/// Energy and impulse ratios of clean runs follow a line over the speed within 1 %.
const UNLIKE: f64 = 0.03;
/// And a ratio that is unlike them lies outside of theirs by more than this.
const OUTSIDE: f64 = 0.015;
/// Runs by whose ratios that of another is judged: those nearest in speed.
const NEIGHBOURS: usize = 8;
/// By how much more than that of any other run of its design the impulse of a force may be ahead of the body, as a share of the impact's
/// momentum: by 0.006 in the bundled groups; a force that is 5 ms early adds about 0.02 at 72 km/h.
const LEAD: f64 = 0.015;
/// Runs of one design among which one can be unlike the others.
const LEAST_ALIKE: usize = 3;
/// Parts of the common deflection over which two curves are compared.
const PARTS: usize = 12;
/// Mean force of the faster of two neighbours over that of the slower: of one design 0.99 to 1.17.
pub(crate) const LEAST_RATIO: f64 = 0.9;
const MOST_RATIO: f64 = 1.25;
/// Rate effects grow with the speed: the bound is multiplied by the ratio of the speeds to this power.
const RATE_POWER: f64 = 0.15;
/// Correlation of the two curves: of one design 0.74 and more in the bundled groups, down to 0 where folds move with the speed.
const LEAST_CORRELATION: f64 = 0.0;

/// Something unusual in a case compared with the others: its name, a code and words.
pub(crate) type Remark = (String, &'static str, String);

/// Unusual cases of a group. `cases`: readable, of one group, by speed.
pub(crate) fn remarks(cases: &[Case]) -> Vec<Remark> {
    let mut all = copies(cases);
    all.extend(titles(cases));
    let runs: Vec<&Case> =
        cases.iter().filter(|c| c.id.study != IMPORTED && !c.is_truncated()).collect();
    // What a crush zone stops is less of a heavier body: all are compared as if they had the largest mass.
    let of_mass = |case: &Case| case.conditions.masses.effective_kg();
    let heaviest_kg = runs.iter().map(|case| of_mass(case)).fold(0.0, f64::max);
    let scaled = |ratio: f64, by: f64| ratio + (ratio - 1.0) * (by - 1.0);
    let point = |case: &Case, ratio: f64| {
        (case.conditions.speed.m_per_s, scaled(ratio, of_mass(case) / heaviest_kg))
    };
    let energy = |case: &&Case| point(case, case.quality.audit.ratio());
    let impulse = |case: &&Case| point(case, impulse_ratio(case));
    let measures: [(_, _, Vec<(f64, f64)>); 2] = [
        ("group_energy", "W/E", runs.iter().map(energy).collect()),
        ("group_impulse", "impulse over momentum", runs.iter().map(impulse).collect()),
    ];
    for (code, what, points) in measures {
        let extremes = Extremes::of(points.iter().map(|point| point.1));
        for (i, case) in runs.iter().enumerate() {
            let Some(expected) = expected(&points, i) else { continue };
            let found = points[i].1;
            let (low, high) = extremes.without(found);
            // A line through few runs is not trusted beyond them.
            let is_outside = !(low - OUTSIDE..=high + OUTSIDE).contains(&found);
            // Two others show no line, which a run beyond both may follow.
            let is_end = points.len() == LEAST_ALIKE && i != 1;
            let unlike = if is_end { 2.0 * UNLIKE } else { UNLIKE };
            let is_unlike = |of: f64| (found / of - 1.0).abs() > unlike;
            if is_outside && is_unlike(expected) && is_unlike(expected.max(low).min(high)) {
                let own = |ratio: f64| scaled(ratio, heaviest_kg / of_mass(case));
                let (found, expected) = (own(found), own(expected));
                all.push((
                    case.id.name.clone(),
                    code,
                    format!(
                        "{what} is {found:.3}, that of the group's other runs is {expected:.3} at this speed: force, mass or speed may be off by {:+.1} %",
                        (found / expected - 1.0) * 100.0
                    ),
                ));
            }
        }
    }
    all.extend(early_forces(&runs, |case| of_mass(case) / heaviest_kg));
    all.extend(designs(&runs));
    all
}

/// Runs whose contact force runs further ahead of their body than that of any other run of their design does: a crush zone that is stopped
/// first takes a part that changes little with the speed.
/// `share` is that of a run's mass in the largest.
fn early_forces(runs: &[&Case], share: impl Fn(&Case) -> f64) -> Vec<Remark> {
    let mut alike: BTreeMap<String, Vec<&Case>> = BTreeMap::new();
    for case in runs.iter().filter(|case| case.curves.force_kind == ForceKind::Contact) {
        let of = alike.entry(format!("{:?}", case.conditions.parameters)).or_default();
        of.push(*case);
    }
    let mut found = Vec::new();
    for runs in alike.values().filter(|runs| runs.len() >= LEAST_ALIKE) {
        let of = |case: &Case, upto_m: f64| lead(case, upto_m) * share(case);
        let leads = Extremes::of(runs.iter().map(|case| of(case, f64::INFINITY)));
        let crushes = Extremes::of(runs.iter().map(|case| case.max_deflection_m()));
        for case in runs {
            // The longest crush has stopped more than the others can show.
            let lead = of(case, crushes.without(case.max_deflection_m()).1);
            let (_, most) = leads.without(of(case, f64::INFINITY));
            // Coarse states, missing ones and an uncertain contact shift the impulse by as much.
            let is_coarse = case.quality.warnings.iter().any(|warning| {
                ["contact:", "sampling:", "time:"].iter().any(|of| warning.starts_with(of))
            });
            if lead > most + LEAD && !is_coarse {
                let words = format!(
                    "the impulse of its force runs ahead of the momentum that the body has lost by up to {:.1} % of the impact's momentum, that of the group's other runs by {:.1} % at most: its force may be recorded early",
                    lead / share(case) * 100.0,
                    most / share(case) * 100.0
                );
                found.push((case.id.name.clone(), "group_lead", words));
            }
        }
    }
    found
}

/// By how much the impulse is ahead of the lost momentum, up to a deflection or the maximum one, at most, as a share of the impact's
/// momentum.
fn lead(case: &Case, upto_m: f64) -> f64 {
    let (curve, closing) = (&case.curves.sampled, &case.curves.closing_speed_m_per_s);
    let (t, f) = (curve.time_s(), curve.force_n());
    let momentum = case.conditions.masses.effective_kg() * closing[0];
    let mut impulse = 0.0;
    let d = curve.deflection_m();
    let states = (1..=loading::loading_end(curve)).take_while(|&i| d[i] <= upto_m);
    let ahead = states.map(|i| {
        impulse += 0.5 * (f[i] + f[i - 1]) * (t[i] - t[i - 1]);
        impulse / momentum - (1.0 - closing[i] / closing[0])
    });
    ahead.fold(0.0, f64::max)
}

/// Impulse up to the maximum deflection over mass times speed.
fn impulse_ratio(case: &Case) -> f64 {
    let (t, f) = (case.curves.original.time_s(), case.curves.original.force_n());
    let end = case.loading_end();
    let impulse: f64 = (1..=end).map(|i| 0.5 * (f[i] + f[i - 1]) * (t[i] - t[i - 1])).sum();
    impulse / (case.conditions.masses.effective_kg() * case.conditions.speed.m_per_s)
}

/// The two lowest and the two highest of some values.
struct Extremes {
    lowest: [f64; 2],
    highest: [f64; 2],
}

impl Extremes {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut all = Self { lowest: [f64::INFINITY; 2], highest: [0.0; 2] };
        for value in values {
            let [first, second] = all.lowest;
            all.lowest = [first.min(value), first.max(value).min(second)];
            let [first, second] = all.highest;
            all.highest = [first.max(value), first.min(value).max(second)];
        }
        all
    }

    /// The lowest and the highest if one of the values is left out.
    fn without(&self, value: f64) -> (f64, f64) {
        let other = |[first, second]: [f64; 2]| if first == value { second } else { first };
        (other(self.lowest), other(self.highest))
    }
}

/// The value of the others at the speed of point `i`: by the median slope and level of those nearest
/// in speed, or their median where they are few. One wrong run among them does not move it.
fn expected(points: &[(f64, f64)], i: usize) -> Option<f64> {
    // Points are in order of speed.
    let around = i.saturating_sub(NEIGHBOURS)..(i + NEIGHBOURS + 1).min(points.len());
    let mut others: Vec<(f64, f64)> = around.filter(|k| *k != i).map(|k| points[k]).collect();
    let at = points[i].0;
    order::sort(&mut others, |a, b| (a.0 - at).abs().total_cmp(&(b.0 - at).abs()));
    others.truncate(NEIGHBOURS);
    let slopes = others.iter().enumerate().flat_map(|(k, a)| {
        let later = others[k + 1..].iter();
        later.filter(|b| b.0 != a.0).map(|b| (b.1 - a.1) / (b.0 - a.0))
    });
    let slope = if others.len() < 3 { 0.0 } else { median(slopes.collect()).unwrap_or(0.0) };
    median(others.iter().map(|(v, ratio)| ratio + slope * (at - v)).collect())
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

/// Equal for curves of the same values, whatever files they come from.
pub(crate) fn key_of(curve: &Curve) -> u64 {
    let mut hash = DefaultHasher::new();
    for column in [curve.time_s(), curve.deflection_m(), curve.force_n()] {
        column.iter().for_each(|value| value.to_bits().hash(&mut hash));
    }
    hash.finish()
}

fn copies(cases: &[Case]) -> Vec<Remark> {
    let mut first: HashMap<u64, &Case> = HashMap::new();
    let mut found = Vec::new();
    for case in cases {
        let key = key_of(&case.curves.original);
        match first.get(&key) {
            Some(one) => found.push((
                case.id.name.clone(),
                "copy",
                format!(
                    "is a copy of {}: the same values at every state, so not a repeated run; scatter counts them once",
                    one.id.name
                ),
            )),
            None => {
                first.insert(key, case);
            }
        }
    }
    found
}

/// A title without the words that have numbers: those are speeds, dates and names of runs.
fn wording(title: &str) -> String {
    let words = title.split_whitespace().filter(|word| !word.contains(|c: char| c.is_numeric()));
    words.collect::<Vec<_>>().join(" ").to_lowercase()
}

/// Titles of the solver files that differ by more than numbers, and filters that differ, from those of most cases that no parameter
/// distinguishes.
fn titles(cases: &[Case]) -> Vec<Remark> {
    let mut alike: BTreeMap<String, Vec<&Case>> = BTreeMap::new();
    for case in cases {
        alike.entry(format!("{:?}", case.conditions.parameters)).or_default().push(case);
    }
    alike.values().flat_map(|cases| [titles_of(cases), filters_of(cases)].concat()).collect()
}

fn filters_of(cases: &[&Case]) -> Vec<Remark> {
    let remark = |(case, own, usual): (&Case, String, String)| {
        let words = format!(
            "the filter of its recipe is \"{own}\", that of others in the group \"{usual}\": their forces are not comparable; build all runs with one recipe"
        );
        (case.id.name.clone(), "filter_differs", words)
    };
    unlike_most(cases, Case::filter, str::to_string).map(remark).collect()
}

fn titles_of(cases: &[&Case]) -> Vec<Remark> {
    let title = |case: &Case| case.provenance.sources.iter().find_map(|s| s.title.clone());
    let remark = |(case, own, usual): (&Case, String, String)| {
        let words = format!(
            "the title of its files is \"{}\", that of others in the group \"{}\": it may be another design",
            own.trim().escape_debug(),
            usual.trim().escape_debug()
        );
        (case.id.name.clone(), "title_differs", words)
    };
    unlike_most(cases, title, wording).map(remark).collect()
}

/// The cases whose text, as compared, is not that of most, with both.
fn unlike_most<'a>(
    cases: &[&'a Case],
    of: impl Fn(&Case) -> Option<String>,
    compared: fn(&str) -> String,
) -> impl Iterator<Item = (&'a Case, String, String)> {
    let known: Vec<(&Case, String)> =
        cases.iter().filter_map(|&case| Some((case, of(case)?))).collect();
    let mut counts: HashMap<String, usize> = HashMap::new();
    for (_, text) in &known {
        *counts.entry(compared(text)).or_default() += 1;
    }
    let most = counts.values().copied().max().unwrap_or(0);
    let usual = known.iter().find(|(_, text)| counts[&compared(text)] == most);
    let usual = usual.map(|(_, text)| text.clone()).unwrap_or_default();
    let is_other = move |(case, own): (&'a Case, String)| {
        (compared(&own) != compared(&usual)).then(|| (case, own, usual.clone()))
    };
    known.into_iter().filter_map(is_other)
}

/// Mean forces over equal parts of the deflection, up to `end_m`.
fn parts(curve: &Curve, end_m: f64) -> Vec<f64> {
    let (d, f) = (curve.deflection_m(), curve.force_n());
    let mut work = vec![0.0; PARTS];
    let mut reached = d[0];
    for i in 1..=loading::loading_end(curve) {
        let from = reached.max(d[i - 1]);
        let to = d[i].min(end_m);
        if to <= from {
            continue;
        }
        let force = 0.5 * (f[i] + f[i - 1]);
        let part = |m: f64| ((m / end_m * PARTS as f64) as usize).min(PARTS - 1);
        for (k, work) in work.iter_mut().enumerate().take(part(to) + 1).skip(part(from)) {
            let ends = (end_m * k as f64 / PARTS as f64, end_m * (k + 1) as f64 / PARTS as f64);
            *work += force * (to.min(ends.1) - from.max(ends.0)).max(0.0);
        }
        reached = to;
    }
    work
}

/// Neighbours in speed whose curves are unlike those of one design.
fn designs(runs: &[&Case]) -> Vec<Remark> {
    let mut found = Vec::new();
    for pair in runs.windows(2) {
        let (slow, fast) = (pair[0], pair[1]);
        let (one, other) = (&slow.conditions, &fast.conditions);
        if one.parameters != other.parameters || slow.curves.force_kind != fast.curves.force_kind {
            continue;
        }
        let end_m = slow.max_deflection_m().min(fast.max_deflection_m());
        let (a, b) = (parts(&slow.curves.original, end_m), parts(&fast.curves.original, end_m));
        let ratio = b.iter().sum::<f64>() / a.iter().sum::<f64>();
        let most = MOST_RATIO * libm::pow(other.speed.m_per_s / one.speed.m_per_s, RATE_POWER);
        let likeness = correlation(&a, &b);
        let why = if !ratio.is_finite() {
            continue;
        } else if !(LEAST_RATIO..=most).contains(&ratio) {
            format!("its mean force is {ratio:.2} times that of {}", slow.id.name)
        } else if likeness < LEAST_CORRELATION {
            format!("its peaks come in a different order from those of {}", slow.id.name)
        } else {
            continue;
        };
        found.push((
            fast.id.name.clone(),
            "design_differs",
            format!(
                "over the {:.3} m that both are crushed, {why}: one of the two may be another design",
                end_m
            ),
        ));
    }
    found
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma).powi(2);
        bb += (y - mb).powi(2);
    }
    // Flat curves have no peaks to compare.
    let flat = |s: f64, m: f64| s <= 0.01 * a.len() as f64 * m * m;
    if flat(aa, ma) || flat(bb, mb) { 1.0 } else { ab / (aa * bb).sqrt() }
}
