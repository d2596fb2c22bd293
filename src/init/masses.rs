//! The masses of the bodies: by momentum, held against the kinetic energy at the start.

use super::evidence::{Evidence, Proposed};
use super::units::{digits, shown_mass};

/// Masses by momentum and by kinetic energy that differ by less are one.
const SAME_BY_ENERGY: f64 = 0.05;
/// Masses of runs that differ by less are one: so much two runs of one model scatter.
const SAME_MASS: f64 = 0.03;

/// What a run says of a mass, in kg.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct MassEstimates {
    pub by_momentum: Option<f64>,
    /// Whether that was taken behind the contact.
    pub in_free_flight: bool,
    pub by_energy: Option<f64>,
}

impl MassEstimates {
    /// The mass, and whether it is that by energy.
    fn kg(&self) -> Option<(f64, bool)> {
        match (self.by_momentum, self.by_energy) {
            (Some(momentum), Some(energy)) if is_near(momentum, energy, SAME_BY_ENERGY) => {
                Some((energy, true))
            }
            (Some(momentum), _) => Some((momentum, false)),
            (None, energy) => Some((energy?, true)),
        }
    }

    fn evidence(&self) -> String {
        let other = |kg: Option<f64>, way: &str| {
            kg.map_or(String::new(), |kg| format!(" ({way} {})", shown_mass(kg)))
        };
        match self.kg() {
            Some((_, true)) => format!(
                "kinetic energy of the model at the start over ½v²{}",
                other(self.by_momentum, "momentum gives")
            ),
            _ if self.in_free_flight => format!(
                "impulse of the force over the change of velocity, behind the contact{}",
                other(self.by_energy, "kinetic energy at the start gives")
            ),
            _ => format!(
                "impulse of the force over the change of velocity, while loading (good to a few per cent){}",
                other(self.by_energy, "kinetic energy at the start gives")
            ),
        }
    }
}

/// The mass of each run: one for all runs that scatter about it.
///
/// `why`: why a run has none. Warns where the two ways differ.
pub(super) fn agree(
    runs: &[(String, MassEstimates)],
    why: &str,
    warnings: &mut Vec<String>,
) -> Vec<Proposed<f64>> {
    warnings.extend(runs.iter().filter_map(|(name, weighed)| doubt(name, weighed)));
    let known: Vec<(usize, f64)> =
        runs.iter().enumerate().filter_map(|(k, (_, w))| Some((k, w.kg()?.0))).collect();
    let mut by_mass = known.clone();
    by_mass.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut found: Vec<Proposed<f64>> = runs.iter().map(|_| Proposed::missing(why)).collect();
    for one in by_mass.chunk_by(|a, b| is_near(a.1, b.1, SAME_MASS)) {
        let median = 0.5 * (one[(one.len() - 1) / 2].1 + one[one.len() / 2].1);
        let (least, most) = (one[0].1, one[one.len() - 1].1);
        for &(k, _) in one {
            let mut from = runs[k].1.evidence();
            if one.len() > 1 {
                let range = if is_near(least, most, 5e-4) {
                    "all alike".into()
                } else {
                    format!("{} to {} kg", least.round(), most.round())
                };
                from = format!("{from}; median of {} runs, {range}", one.len());
            }
            found[k] = Proposed::found(rounded(median), Evidence::Computed(from));
        }
    }
    found
}

/// Where momentum and kinetic energy give two masses.
fn doubt(name: &str, weighed: &MassEstimates) -> Option<String> {
    let (momentum, energy) = (weighed.by_momentum?, weighed.by_energy?);
    (!is_near(momentum, energy, SAME_BY_ENERGY)).then(|| {
        format!(
            "mass: in {name} momentum gives {}, the kinetic energy at the start {}: the force acts on part of what moves, or more moves than the bodies",
            shown_mass(momentum),
            shown_mass(energy)
        )
    })
}

pub(super) fn is_near(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * a.abs().max(b.abs())
}

/// Four significant digits: more is not known.
fn rounded(kg: f64) -> f64 {
    format!("{kg:.3e}").parse().unwrap_or(kg)
}

/// A mass as a study has it.
pub(super) fn text(kg: f64) -> String {
    if kg >= 1e3 { format!("{}t", kg / 1e3) } else { format!("{kg}kg") }
}

/// Of the masses of a pair whether they are one.
pub(super) fn are_equal(body: f64, other: f64) -> bool {
    is_near(body, other, SAME_MASS)
}

/// That masses of the runs differ, if they do.
pub(super) fn differ(masses: &[Proposed<f64>]) -> Option<String> {
    let mut all: Vec<f64> = masses.iter().filter_map(|mass| mass.value().copied()).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    (all.len() > 1).then(|| {
        let shown: Vec<String> = all.iter().map(|kg| digits(kg / 1e3)).collect();
        format!(
            "mass: the runs' masses differ ({} t): are they of one vehicle? Models then take the mass as a parameter",
            shown.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by_momentum(kg: f64) -> MassEstimates {
        MassEstimates { by_momentum: Some(kg), in_free_flight: true, by_energy: None }
    }

    #[test]
    fn runs_that_scatter_have_one_mass() {
        let runs =
            [24_010.0, 23_990.0, 24_004.4, 20_240.0].map(|kg| (format!("{kg}"), by_momentum(kg)));
        let mut warnings = Vec::new();
        let found = agree(&runs, "unknown", &mut warnings);
        let values: Vec<f64> = found.iter().map(|m| *m.value().unwrap()).collect();
        assert_eq!(values, [24_000.0, 24_000.0, 24_000.0, 20_240.0]);
        assert_eq!(
            found[0].to_string(),
            "computed: impulse of the force over the change of velocity, behind the contact; median of 3 runs, 23990 to 24010 kg"
        );
        assert_eq!(warnings, [""; 0]);
        assert!(differ(&found).unwrap().contains("(20.2, 24 t)"));
    }

    #[test]
    fn kinetic_energy_is_exact_where_both_agree() {
        let both = |energy| MassEstimates { by_energy: Some(energy), ..by_momentum(23_500.0) };
        let mut warnings = Vec::new();
        let found = agree(&[("a".into(), both(24_000.0))], "", &mut warnings);
        assert_eq!(found[0].value(), Some(&24_000.0));
        assert_eq!(warnings, [""; 0]);
        let found = agree(&[("a".into(), both(48_000.0))], "", &mut warnings);
        assert_eq!(found[0].value(), Some(&23_500.0));
        assert!(
            warnings[0].starts_with("mass: in a momentum gives 23.5 t, the kinetic"),
            "{warnings:?}"
        );
    }

    #[test]
    fn masses_are_written_with_four_digits() {
        assert_eq!(
            [24_003.7, 20_241.2, 812.34].map(|kg| text(rounded(kg))),
            ["24t", "20.24t", "812.3kg"]
        );
    }
}
