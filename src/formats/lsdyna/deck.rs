//! A complete LS-DYNA input: one mass on the spring against a fixed point, or two masses with the spring between.

use super::super::text::{Lines, nine_digits, title};
use super::super::{ExportCurve, NUMBER_OF_STATES, run_time_s};
use super::{InUnits, Material, TITLE_WIDTH};

/// Everything besides curves and material. The moving body is node 2 at +x and moves towards −x.
pub(crate) fn write(
    lines: &mut Lines,
    curve: &ExportCurve,
    units: InUnits,
    material: Material,
    material_id: u32,
) {
    let system = units.0;
    // Free length: more than any crush, so that the nodes never pass each other.
    let length = 1.2 * curve.loading.end_m() / system.length_m;
    let end = run_time_s(curve) / system.time_s;
    let number = |value: f64| nine_digits(value);
    lines.add(format_args!("*TITLE"));
    lines.add(format_args!("{}", title(&format!("one mass on {}", curve.headline()), TITLE_WIDTH)));
    lines.add(format_args!("*CONTROL_TERMINATION"));
    lines.add(format_args!("$#  endtim"));
    lines.add(format_args!("{:>10}", fixed(end)));
    lines.add(format_args!("*CONTROL_TIMESTEP"));
    lines.add(format_args!("$#  dtinit    tssfac"));
    lines.add(format_args!("{:>10}{:>10}", "0.0", "0.1"));
    for file in ["NODOUT", "DEFORC", "GLSTAT"] {
        lines.add(format_args!("*DATABASE_{file}"));
        lines.add(format_args!("{:>10.3e}", end / NUMBER_OF_STATES));
    }
    lines.add(format_args!("*DATABASE_HISTORY_NODE"));
    lines.add(format_args!("{:>10}{:>10}", 1, 2));
    lines.add(format_args!("*NODE"));
    lines.add(format_args!("{:>8}{:>16}{:>16}{:>16}", 1, "0.0", "0.0", "0.0"));
    lines.add(format_args!("{:>8}{:>16}{:>16}{:>16}", 2, number(length), "0.0", "0.0"));
    lines.add(format_args!("*PART"));
    lines.add(format_args!("{}", title(&curve.headline(), TITLE_WIDTH)));
    lines.add(format_args!("$#     pid     secid       mid"));
    lines.add(format_args!("{:>10}{:>10}{material_id:>10}", 1, 1));
    match material {
        Material::S08 | Material::S06 => discrete_element(lines),
        Material::Mat121 => beam_element(lines),
    }
    masses(lines, curve, units);
    supports(lines, curve, units);
}

/// Section and element of S06 and S08.
fn discrete_element(lines: &mut Lines) {
    lines.add(format_args!("*SECTION_DISCRETE"));
    lines.add(format_args!("$#   secid       dro        kd        v0        cl        fd"));
    lines.add(format_args!(
        "{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}",
        1, 0, "0.0", "0.0", "0.0", "0.0"
    ));
    lines.add(format_args!("$#     cdl       tdl"));
    lines.add(format_args!("{:>10}{:>10}", "0.0", "0.0"));
    lines.add(format_args!("*ELEMENT_DISCRETE"));
    lines.add(format_args!("$#   eid     pid      n1      n2     vid               s"));
    lines.add(format_args!("{:>8}{:>8}{:>8}{:>8}{:>8}{:>16}", 1, 1, 1, 2, 0, "1.0"));
}

/// Section and element of MAT_121: ELFORM 6 is a discrete beam, SCOOR 2 keeps its axis along the nodes.
fn beam_element(lines: &mut Lines) {
    lines.add(format_args!("*SECTION_BEAM"));
    lines.add(format_args!("$#   secid    elform      shrf   qr/irid       cst     scoor"));
    lines.add(format_args!("{:>10}{:>10}{:>10}{:>10}{:>10}{:>10}", 1, 6, "1.0", 2, 0, "2.0"));
    lines.add(format_args!("$#     vol      iner       cid        ca    offset"));
    lines.add(format_args!("{:>10}{:>10}{:>10}{:>10}{:>10}", "1.0", "1.0e-6", 0, "0.0", "0.0"));
    lines.add(format_args!("*ELEMENT_BEAM"));
    lines.add(format_args!("$#   eid     pid      n1      n2      n3"));
    lines.add(format_args!("{:>8}{:>8}{:>8}{:>8}{:>8}", 1, 1, 1, 2, 0));
}

fn masses(lines: &mut Lines, curve: &ExportCurve, units: InUnits) {
    let mass = |kg: f64| nine_digits(kg / units.0.mass_kg);
    lines.add(format_args!("*ELEMENT_MASS"));
    lines.add(format_args!("$#   eid     nid            mass"));
    lines.add(format_args!("{:>8}{:>8}{:>16}", 2, 2, mass(curve.predicted.mass_kg)));
    if let Some(other) = curve.other_mass_kg() {
        lines.add(format_args!("{:>8}{:>8}{:>16}", 3, 1, mass(other)));
    }
}

/// Speed of the moving body, and the constraints that guide both.
fn supports(lines: &mut Lines, curve: &ExportCurve, units: InUnits) {
    let speed = curve.predicted.speed_m_per_s / units.0.speed();
    lines.add(format_args!("*INITIAL_VELOCITY_NODE"));
    lines.add(format_args!("$#     nid        vx        vy        vz"));
    lines.add(format_args!("{:>10}{:>10}{:>10}{:>10}", 2, fixed(-speed), "0.0", "0.0"));
    lines.add(format_args!("*BOUNDARY_SPC_NODE"));
    lines.add(format_args!(
        "$#     nid       cid      dofx      dofy      dofz     dofrx     dofry     dofrz"
    ));
    let free = usize::from(curve.other_mass_kg().is_none());
    for (node, along) in [(1, free), (2, 0)] {
        lines.add(format_args!(
            "{node:>10}{:>10}{along:>10}{:>10}{:>10}{:>10}{:>10}{:>10}",
            0, 1, 1, 1, 1, 1
        ));
    }
}

/// A number in ten columns with as many decimals as fit; it may touch the field before it.
fn fixed(value: f64) -> String {
    let text = (0..9).rev().map(|digits| format!("{value:.digits$}")).find(|t| t.len() <= 10);
    text.unwrap_or_else(|| format!("{value:.3e}"))
}
