//! Units of components, by their names as in binout.

use crate::unit::{UnitSystem, named_or};

/// What a component is of.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Quantity {
    Length,
    Angle,
    Velocity,
    AngularVelocity,
    Acceleration,
    AngularAcceleration,
    Force,
    Moment,
    Energy,
    Momentum,
    Mass,
    MassFlow,
    Stress,
    Area,
    Volume,
    Density,
    Time,
    Pure,
}

/// Endings of names, and what such a component is of; the first that fits counts.
const ENDINGS: [(&str, Quantity); 30] = [
    ("energy_ratio", Quantity::Pure),
    ("energy_ratio_wo_eroded", Quantity::Pure),
    ("rx_displacement", Quantity::Angle),
    ("ry_displacement", Quantity::Angle),
    ("rz_displacement", Quantity::Angle),
    ("rx_velocity", Quantity::AngularVelocity),
    ("ry_velocity", Quantity::AngularVelocity),
    ("rz_velocity", Quantity::AngularVelocity),
    ("rx_acceleration", Quantity::AngularAcceleration),
    ("ry_acceleration", Quantity::AngularAcceleration),
    ("rz_acceleration", Quantity::AngularAcceleration),
    ("displacement", Quantity::Length),
    ("coordinate", Quantity::Length),
    ("centroid", Quantity::Length),
    ("velocity", Quantity::Velocity),
    ("acceleration", Quantity::Acceleration),
    ("force", Quantity::Force),
    ("moment", Quantity::Moment),
    ("momentum", Quantity::Momentum),
    ("energy", Quantity::Energy),
    ("external_work", Quantity::Energy),
    ("etotal", Quantity::Energy),
    ("mass", Quantity::Mass),
    ("effsg", Quantity::Stress),
    ("yield", Quantity::Stress),
    ("pressure", Quantity::Stress),
    ("area", Quantity::Area),
    ("volume", Quantity::Volume),
    ("density", Quantity::Density),
    ("time_step", Quantity::Time),
];

/// Parts of names: of stresses and strains of a layer, in a direction, of an integration point; of areas of a material.
const PARTS: [(&str, Quantity); 4] = [
    ("sig_", Quantity::Stress),
    ("sigma_", Quantity::Stress),
    ("eps", Quantity::Pure),
    ("blocked_area", Quantity::Area),
];

/// Names that alone determine the quantity of a component of one section.
const OF_SECTION: [(&str, &[&str], Quantity); 9] = [
    (
        "sleout",
        &["slave", "master", "total_slave", "total_master", "total_friction"],
        Quantity::Energy,
    ),
    ("spcforc", &["x_resultant", "y_resultant", "z_resultant"], Quantity::Force),
    ("bndout", &["x_total", "y_total", "z_total"], Quantity::Force),
    ("elout", &["axial", "shear_s", "shear_t"], Quantity::Force),
    ("elout", &["moment_s", "moment_t", "torsion"], Quantity::Moment),
    ("swforc", &["axial", "shear"], Quantity::Force),
    ("swforc", &["torsion"], Quantity::Moment),
    ("swforc", &["length"], Quantity::Length),
    ("abstat", &["dm_dt_in", "dm_dt_out", "dm_dt_outp", "dm_dt_outv"], Quantity::MassFlow),
];

fn quantity(section: &str, component: &str) -> Option<Quantity> {
    let section = section.split('/').next().unwrap_or_default();
    let of_section = OF_SECTION
        .iter()
        .find(|(name, components, _)| *name == section && components.contains(&component));
    if let Some((.., quantity)) = of_section {
        return Some(*quantity);
    }
    let ending = ENDINGS.iter().find(|(ending, _)| component.ends_with(ending));
    let part = || PARTS.iter().find(|(part, _)| component.contains(part));
    ending.or_else(part).map(|(_, quantity)| *quantity)
}

/// The unit of a component's values, such as `mm/s^2`; `None` if its name does not determine it.
pub(super) fn unit_of(section: &str, component: &str, system: UnitSystem) -> Option<String> {
    let (length, mass, time) = system.names();
    let force =
        named_or(system.force(), &["N", "kN", "MN", "GN"], || format!("{mass} {length}/{time}^2"));
    Some(match quantity(section, component)? {
        Quantity::Length => length.into(),
        Quantity::Angle => "rad".into(),
        Quantity::Velocity => format!("{length}/{time}"),
        Quantity::AngularVelocity => format!("rad/{time}"),
        Quantity::Acceleration => format!("{length}/{time}^2"),
        Quantity::AngularAcceleration => format!("rad/{time}^2"),
        Quantity::Force => force,
        Quantity::Moment => format!("{force} {length}"),
        Quantity::Energy => {
            let size = system.force() * system.length_m;
            named_or(size, &["J", "kJ", "MJ", "GJ"], || format!("{force} {length}"))
        }
        Quantity::Momentum => format!("{mass} {length}/{time}"),
        Quantity::Mass => mass.into(),
        Quantity::MassFlow => format!("{mass}/{time}"),
        Quantity::Stress => {
            let size = system.force() / (system.length_m * system.length_m);
            named_or(size, &["Pa", "kPa", "MPa", "GPa"], || format!("{force}/{length}^2"))
        }
        Quantity::Area => format!("{length}^2"),
        Quantity::Volume => format!("{length}^3"),
        Quantity::Density => format!("{mass}/{length}^3"),
        Quantity::Time => time.into(),
        Quantity::Pure => "1".into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_components() {
        let t = |system: &str, section: &str, component: &str, expected: Option<&str>| {
            let system = UnitSystem::parse(system).unwrap();
            assert_eq!(unit_of(section, component, system).as_deref(), expected, "{component}");
        };
        t("mm-t-s", "nodout", "x_displacement", Some("mm"));
        t("mm-t-s", "nodout", "ry_displacement", Some("rad"));
        t("mm-t-s", "nodout", "x_acceleration", Some("mm/s^2"));
        t("mm-t-s", "rwforc", "normal_force", Some("N"));
        t("mm-kg-ms", "rcforc", "x_force", Some("kN"));
        t("mm-g-ms", "rcforc", "x_force", Some("N"));
        t("cm-g-us", "rcforc", "x_force", Some("g cm/us^2"));
        t("mm-t-s", "secforc", "total_moment", Some("N mm"));
        t("mm-t-s", "matsum", "x_momentum", Some("t mm/s"));
        t("mm-t-s", "glstat", "kinetic_energy", Some("N mm"));
        t("mm-kg-ms", "glstat", "kinetic_energy", Some("J"));
        t("SI", "glstat", "energy_ratio", Some("1"));
        t("mm-t-s", "elout/shell", "upper_sig_xx", Some("MPa"));
        t("mm-t-s", "elout", "plastic_eps_ip2", Some("1"));
        t("mm-t-s", "elout/beam", "axial", Some("N"));
        t("mm-t-s", "swforc", "failure", None);
        t("mm-t-s", "swforc", "length", Some("mm"));
        t("mm-t-s", "abstat", "dm_dt_in", Some("t/s"));
        t("mm-t-s", "abstat", "blocked_area_mat_3", Some("mm^2"));
    }
}
