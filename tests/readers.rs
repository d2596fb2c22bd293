//! The readers on small texts, each with one peculiarity of real files.

use crumple::history::{EntityId, Side};
use crumple::solver::{FORMATS, NoDataReason, ProblemCode, Selection, SolverFile, read_from};

const HEADER: &str =
    " title\n                    ls-dyna smp d R14 R14.0_515_8a12796 date 12/12/2022\n";

fn read(format: &str, body: &str) -> SolverFile {
    read_with(format, body, &Selection::all())
}

fn read_with(format: &str, body: &str, selection: &Selection) -> SolverFile {
    let text = format!("{HEADER}{body}");
    read_from(format, &[Box::new(text.into_bytes())], selection).unwrap().remove(0)
}

fn values(file: &SolverFile, id: i64, component: &str) -> Vec<f64> {
    file.history(Some(EntityId::new(id)), component).unwrap().values.clone()
}

fn codes(file: &SolverFile) -> Vec<ProblemCode> {
    file.problems.iter().map(|p| p.code).collect()
}

/// State line of a nodout.
fn state(cycle: u32, time: &str) -> String {
    format!(
        "\n\n\n n o d a l   p r i n t   o u t   f o r   t i m e  s t e p{cycle:8}                              ( at time {time} )\n\n"
    )
}

const TRANSLATIONS: &str = " nodal point  x-disp     y-disp      z-disp      x-vel       y-vel       z-vel      x-accl      y-accl      z-accl      x-coor      y-coor      z-coor\n";
const ROTATIONS: &str = " nodal point  x-rot      y-rot       z-rot       x-rot vel   y-rot vel   z-rot vel   x-rot acc   y-rot acc   z-rot acc\n";

/// A row of `n` equal fields of 12 columns.
fn row(id: &str, field: &str, n: usize) -> String {
    format!("{id:>9} {}\n", format!("{field:>12}").repeat(n))
}

#[test]
fn touching_fields_and_rotations() {
    let mut text = String::new();
    for (cycle, time, value) in
        [(1, "0.0000000E+00", "-1.50000E+00"), (9, "1.0000000E-01", "-2.5000-101")]
    {
        text += &state(cycle, time);
        text += TRANSLATIONS;
        text += &row("7", value, 12);
        text += &row("12345678", value, 12);
        text += &state(cycle, time);
        text += ROTATIONS;
        text += &row("12345678", "1.00000E-03", 9);
    }
    let file = read("nodout", &text);
    assert_eq!(file.problems, []);
    assert_eq!(&file.time[..], [0.0, 0.1]);
    assert_eq!(values(&file, 7, "z_coordinate"), [-1.5, -2.5e-101]);
    assert_eq!(values(&file, 12345678, "rz_acceleration"), [1e-3, 1e-3]);
    assert!(
        file.history(Some(EntityId::new(7)), "rx_displacement").is_none(),
        "node 7 has no rotations"
    );
    let windows = read("nodout", &text.replace('\n', "\r\n"));
    assert_eq!(windows.histories, file.histories);
}

#[test]
fn header_only_is_no_error() {
    let text_formats = FORMATS.iter().filter(|f| !["binout", "t01"].contains(&f.name));
    for format in text_formats.map(|f| f.name) {
        let file = read(format, "");
        assert_eq!((file.time.len(), file.problems.len()), (0, 0), "{format}");
        assert_eq!(file.version.as_deref(), Some("smp d R14 R14.0_515_8a12796"));
        assert_eq!(file.title.as_deref(), Some("title"));
    }
}

/// l2a writes ids as `%9ld`: wider ones push the row to the right. However the file is cut,
/// no digit of a neighbouring field may become a number.
#[test]
fn wide_ids_cut_at_every_byte() {
    let rows = row("1234567890", "-3.70368E-11", 12) + &row("1234567891", "-4.70368E-11", 12);
    let text = state(1, "0.0000000E+00")
        + TRANSLATIONS
        + &rows
        + &state(2, "1.0000000E+00")
        + TRANSLATIONS
        + &rows;
    let one = Selection { components: Some(vec!["x_displacement".into()]), ..Selection::all() };
    let whole = read_with("nodout", &text, &one);
    assert_eq!(values(&whole, 1234567890, "x_displacement"), [-3.70368e-11; 2]);
    for cut in text.len() - 400..text.len() - 1 {
        let file = read_with("nodout", &text[..cut], &one);
        assert_eq!(file.time.len(), 1, "cut at {cut}");
        assert_eq!(values(&file, 1234567891, "x_displacement"), [-4.70368e-11]);
        assert!(!file.problems.is_empty());
    }
}

#[test]
fn damage_in_fields_that_are_not_kept_is_found_by_an_audit() {
    let text = state(1, "0.0000000E+00") + TRANSLATIONS + &row("7", "************", 12);
    assert_eq!(
        codes(&read_with("nodout", &text, &Selection::nothing())),
        [ProblemCode::OverflowedField; 12]
    );
    let other = Selection { ids: Some(vec!["8".parse().unwrap()]), ..Selection::all() };
    assert_eq!(read_with("nodout", &text, &other).problems, [], "only what is kept is read");
}

#[test]
fn a_legend_that_is_not_closed_ends_at_the_first_state() {
    let text =
        "\n{BEGIN LEGEND}\n Entity #        Title\n        7     slave of nothing\n{XND LEGEND}\n"
            .to_string()
            + &state(1, "0.0000000E+00")
            + TRANSLATIONS
            + &row("7", "1.00000E+00", 12);
    let file = read("nodout", &text);
    assert_eq!(file.time.len(), 1);
    assert_eq!(file.entities[0].title.as_deref(), Some("slave of nothing"));
    assert_eq!(codes(&file), [ProblemCode::BadLine]);
    let cut = read("nodout", "\n{BEGIN LEGEND}\n Entity #        Title\n        7     a\n");
    assert_eq!(codes(&cut), [ProblemCode::BadLine]);
    assert_eq!(cut.without_data[0].reason, NoDataReason::LegendOnly);
}

const FORCES: &str = "  x  1.00000E+00  y -2.00000E+00  z  3.00000E+00 mass  4.00000E+00";
const MOMENTS: &str = "  mx  5.00000E+00  my  6.00000E+00  mz  7.00000E+00";
const TIED: &str = "  tied          9  tied area  8.00000E+00";

fn side(name: &str, id: u32, time: &str, rest: &str) -> String {
    format!("  {name:<6}{id:>11} time {time:>11}{rest}\n")
}

#[test]
fn both_generations_of_side_names_and_undefined_contacts() {
    let mut text = String::new();
    for time in ["0.00000E+00", "1.00000E+00"] {
        let undefined = " interface number,     10001,is single surface-resultants are undefined\n";
        text += &undefined.repeat(2);
        text += &side("slave", 2, time, &format!("{FORCES}{MOMENTS}"));
        text += &side("SURFB", 2, time, &format!("{FORCES}{MOMENTS}"));
    }
    let file = read("rcforc", &text);
    assert_eq!(file.problems, []);
    let sides: Vec<_> = file.entities.iter().map(|e| e.id.side).collect();
    assert_eq!(sides, [Some(Side::SurfA), Some(Side::SurfB)]);
    assert_eq!(file.without_data[0].id, 10001);
    assert_eq!(file.time.len(), 2);
}

/// Two states so close that six digits print one time.
#[test]
fn equal_printed_times_are_two_states() {
    let one = side("slave", 2, "1.00000E+00", FORCES) + &side("master", 2, "1.00000E+00", FORCES);
    let file = read("rcforc", &one.repeat(3));
    assert_eq!(&file.time[..], [1.0; 3]);
    assert_eq!(file.problems, []);
}

/// Two states may print one time, but their cycles differ.
#[test]
fn a_state_with_the_same_time_and_a_later_cycle_is_another() {
    let one =
        |cycle: u32| state(cycle, "1.0000000E-01") + TRANSLATIONS + &row("7", "1.50000E+00", 12);
    let file = read("nodout", &(one(10) + &one(11) + &one(12)));
    assert_eq!(file.time.len(), 3);
    assert_eq!(file.problems, []);
    let again = read("nodout", &(one(10) + &one(11) + &one(11)));
    assert_eq!(&again.time[..], [0.1; 2]);
    assert_eq!(codes(&again), [ProblemCode::RepeatedState]);
}

/// A node in two sets of constraints has two rows in a state.
#[test]
fn constraints_of_a_node_in_two_sets() {
    let one = |time: &str| {
        let row = |node: u32, force: &str, set: u32| {
            format!(" node={node:6} local x,y,z forces ={}  setid={set:8}\n", force.repeat(3))
        };
        format!(" single point constraint forces\n\n output at time ={time:>14}\n")
            + &row(1, "    1.0000E+00", 10)
            + &row(2, "    2.0000E+00", 10)
            + &row(1, "    3.0000E+00", 20)
            + &format!("             force resultants   ={}\n", "    6.0000E+00".repeat(3))
    };
    let file = read("spcforc", &(one("0.00000E+00") + &one("1.00000E-01")));
    assert_eq!(file.problems, []);
    assert_eq!(file.time.len(), 2);
    assert_eq!(values(&file, 1, "x_force"), [1.0; 2]);
    assert_eq!(values(&file, 1, "x_force_2"), [3.0; 2]);
    assert_eq!(values(&file, 2, "x_force"), [2.0; 2]);
    assert!(file.history(Some(EntityId::new(2)), "x_force_2").is_none());
}

#[test]
fn old_files_without_moments_and_mixed_tied_contacts() {
    let old = read("rcforc", &side("slave", 2, "0.00000E+00", FORCES));
    let names: Vec<&str> = old.components.iter().map(|c| &**c).collect();
    assert_eq!(names, ["x_force", "y_force", "z_force", "mass"]);

    for tied_first in [true, false] {
        let tied = format!("{FORCES}{MOMENTS}{TIED}");
        let plain = format!("{FORCES}{MOMENTS}");
        let rests = if tied_first { [&tied, &plain] } else { [&plain, &tied] };
        let mut text = String::new();
        for time in ["0.00000E+00", "1.00000E+00"] {
            text += &side("slave", 1, time, rests[0]);
            text += &side("slave", 2, time, rests[1]);
        }
        let file = read("rcforc", &text);
        assert_eq!(file.problems, [], "tied first: {tied_first}");
        assert_eq!(file.time.len(), 2);
        let tied_id = if tied_first { 1 } else { 2 };
        let of = |id| {
            let entity = EntityId { id, side: Some(Side::SurfA) };
            file.history(Some(entity), "tie_area").map(|h| h.values.clone())
        };
        assert_eq!(of(tied_id), Some(vec![8.0, 8.0]));
        assert_eq!(of(3 - tied_id), None);
    }
    // Without moments, the tied columns stand behind 51 blanks.
    let text = side("slave", 1, "0.00000E+00", &format!("{FORCES}{}{TIED}", " ".repeat(51)));
    let file = read("rcforc", &text);
    assert_eq!(file.problems, []);
    assert!(file.components.iter().any(|c| &**c == "tie_count"));
}

#[test]
fn a_cut_first_row_is_not_a_state() {
    let text = side("slave", 1, "0.00000E+00", &format!("{FORCES}{MOMENTS}"));
    for cut in 1..text.len() - 1 {
        let file = read("rcforc", &text[..cut]);
        assert_eq!(file.time.len(), 0, "cut at {cut}");
        let blank = text[..cut].trim().is_empty();
        assert_eq!(file.problems.is_empty(), blank, "cut at {cut}");
    }
}

#[test]
fn several_walls_and_a_wide_wall_id() {
    let heading = "    time       wall#   normal-force    x-force        y-force        z-force\n";
    let wall = |time: &str, id: &str| {
        format!(" {time:>11}{id:>8}{}\n", format!("{:>15}", "1.500000E+06").repeat(4))
    };
    let text = heading.to_string()
        + &wall("0.00000E+00", "1")
        + &wall("0.00000E+00", "123456789")
        + &wall("1.00000E-03", "1")
        + &wall("1.00000E-03", "123456789");
    let file = read("rwforc", &text);
    assert_eq!(file.problems, []);
    assert_eq!(&file.time[..], [0.0, 1e-3]);
    assert_eq!(values(&file, 123456789, "normal_force"), [1.5e6; 2]);
}

fn glstat(time: &str, labels: &[(&str, &str)]) -> String {
    let mut text = format!(
        "\n\n dt of cycle       1 is controlled by shell\n\n time...........................{time:>14}\n"
    );
    for (label, value) in labels {
        text += &format!(" {label:.<31}{value}\n");
    }
    text
}

#[test]
fn labels_may_be_absent_or_repeat_for_every_wall() {
    let first = glstat(
        "0.00000E+00",
        &[
            ("kinetic energy", "   1.00000E+00"),
            ("stonewall energy", "   2.00000E+00 wall# 1"),
            ("stonewall energy", "   3.00000E+00 wall# 2"),
            ("time per zone cycle.(nanosec)", "             7"),
        ],
    );
    let second = glstat(
        "1.00000E+00",
        &[
            ("kinetic energy", "   4.00000E+00"),
            ("total energy", "   5.00000E+00"),
            ("time per zone cycle.(nanosec)", "             7"),
        ],
    );
    let file = read("glstat", &(first + &second));
    let value = |component: &str| file.history(None, component).unwrap().values.clone();
    assert_eq!(value("kinetic_energy"), [1.0, 4.0]);
    assert_eq!(value("stonewall_energy_wall_2")[0], 3.0);
    assert!(value("stonewall_energy_wall_2")[1].is_nan());
    assert!(value("total_energy")[0].is_nan());
    assert_eq!(value("nzc"), [7.0, 7.0]);
    assert_eq!(codes(&file), [ProblemCode::AbsentComponent; 3], "absence is said");
}

/// Labels without end must not fill the memory.
#[test]
fn labels_are_bounded() {
    let mut text = String::new();
    for i in 0..2_000 {
        let label = format!("invented energy {}", i);
        text += &glstat("0.00000E+00", &[(&label, "   1.00000E+00")]);
    }
    let file = read("glstat", &text);
    assert!(file.components.len() <= 500);
    assert!(codes(&file).contains(&ProblemCode::UnreadRows));
}

#[test]
fn times_that_go_back_are_named() {
    let row = |time| side("slave", 2, time, FORCES);
    let file = read("rcforc", &(row("1.00000E+00") + &row("2.00000E+00") + &row("1.50000E+00")));
    assert_eq!(&file.time[..], [1.0, 2.0, 1.5]);
    assert_eq!(codes(&file), [ProblemCode::TimeGoesBack]);
}

/// A line of a label with dots to column 30 and its value.
fn dotted(label: &str, value: &str) -> String {
    format!(" {label:.<29}{value:>14}\n")
}

/// Layouts of deforc, jntforc, rbdout, nodfor and of bndout's rigid bodies are known from
/// the source of LSTC's converter l2a only: these texts are as it writes them.
#[test]
fn discrete_elements() {
    let mut text = String::new();
    for (time, value) in [("0.00000E+00", "1.50000E+00"), ("1.00000E-03", "-2.50000E+00")] {
        text += "\n";
        text += &dotted("time", time);
        for id in [7, 1234567] {
            text += &format!(" {:.<29}{id:>10}\n", "spring/damper number");
            for label in ["x-force", "y-force", "z-force", "resultant force", "change in length"] {
                text += &dotted(label, value);
            }
        }
        text += &format!(" {:.<29}{:>10}\n", "spring/damper number", 8);
        for label in ["x-moment", "y-moment", "z-moment", "resultant moment", "relative rotation"] {
            text += &dotted(label, value);
        }
    }
    let file = read("deforc", &text);
    assert_eq!(file.problems, []);
    assert_eq!(&file.time[..], [0.0, 1e-3]);
    assert_eq!(values(&file, 1234567, "displacement"), [1.5, -2.5]);
    assert_eq!(values(&file, 8, "relative_rotation"), [1.5, -2.5]);
    assert!(file.history(Some(EntityId::new(8)), "x_force").is_none());
    for cut in text.len() - 100..text.len() - 1 {
        let file = read("deforc", &text[..cut]);
        assert_eq!((file.time.len(), file.problems.is_empty()), (1, false), "cut at {cut}");
    }
}

#[test]
fn joints_and_joint_stiffnesses() {
    let mut text = String::new();
    for time in ["0.00000E+00", "1.00000E-03"] {
        text += &dotted("time", time);
        text += &format!(" {:.<29}{:>10}\n", "joint ID", 3);
        for label in ["x-force  (local) ", "resultant force", "resultant moment"] {
            text += &dotted(label, "3.00000E+00");
        }
        text += &format!(" {:.<29}{:>10}\n", "joint stiffness id number", 4);
        for label in
            ["phi (degrees)", "d(phi)/dt (degrees)", "phi moment-stiffness", "joint energy"]
        {
            text += &dotted(label, "4.00000E+00");
        }
    }
    let file = read("jntforc", &text);
    assert_eq!(file.problems, []);
    assert_eq!(values(&file, 3, "x_force"), [3.0; 2]);
    assert_eq!(values(&file, 4, "d(phi)_dt"), [4.0; 2]);
    assert_eq!(values(&file, 4, "phi_moment_stiffness"), [4.0; 2]);
}

#[test]
fn rigid_bodies() {
    let six = "  1.0000E+00 -2.0000E+00  3.0000E+00  4.0000E+00  5.0000E+00  6.0000E+00";
    let mut text = String::new();
    for time in ["0.000000E+00", "1.000000E-03"] {
        text += &format!(
            "1\n\n  r i g i d   b o d y   m o t i o n   a t  cycle={:8}    time={time:>15}\n",
            1
        );
        for name in [" rigid body      12", " nodal rigid body      13"] {
            text += &format!(
                "\n{name}\n   global             x           y           z          x-rot       y-rot       z-rot\n"
            );
            text += "   coordinates:    1.0000E+00 -2.0000E+00  3.0000E+00\n";
            let motion = |label: &str| format!("{label:>15}  {six}\n");
            let motions: String =
                ["displacements:", "velocities:", "accelerations:"].map(motion).concat();
            text += &motions;
            text += "\nprincipal or user defined local coordinate direction vectors\n                     a           b           c\n";
            for row in 1..=3 {
                text += &format!("     row {row}{}\n", format!("{:>15}", "1.0000E+00").repeat(3));
            }
            text += "\n output in principal or user defined local coordinate directions\n                      a           b           c          a-rot       b-rot       c-rot\n";
            text += &motions;
        }
    }
    let file = read("rbdout", &text);
    assert_eq!(file.problems, []);
    assert_eq!(values(&file, 13, "global_rvz"), [6.0; 2]);
    assert_eq!(values(&file, 12, "local_dy"), [-2.0; 2]);
    assert_eq!(values(&file, 12, "dircos_33"), [1.0; 2]);
}

fn node_force(mark: &str, id: u32, sum: bool) -> String {
    let number = format!("{:>13}", "-1.5000E+00");
    match sum {
        true => format!(
            "              xtotal={number}   ytotal={number}  ztotal={number}   etotal={number}\n"
        ),
        false => format!(
            " {mark}{id:>8}  xforce={number}   yforce={number}  zforce={number}   energy={number}\n"
        ),
    }
}

#[test]
fn groups_of_nodes() {
    let mut text = String::new();
    for time in ["0.000E+00", "1.000E-03"] {
        text += &format!("\n n o d a l   f o r c e   g r o u p    o u t p u t   t={time}\n");
        for group in [1, 2] {
            text += &format!("\n\n nodal group output number {group:2}\n\n");
            text += &node_force("nd#", 7, false);
            text += &node_force("", 0, true);
        }
    }
    let file = read("nodfor", &text);
    assert_eq!(file.problems, []);
    assert_eq!(&file.time[..], [0.0, 1e-3]);
    assert_eq!(values(&file, 7, "x_force"), [-1.5; 2]);
    assert_eq!(values(&file, 7, "group2_energy"), [-1.5; 2], "one node in two groups");
    assert_eq!(file.history(None, "group2_etotal").unwrap().values, [-1.5; 2]);
}

#[test]
fn prescribed_motions_of_rigid_bodies_and_pressures() {
    let number = format!("{:>13}", "2.0000E+00");
    let mut text = String::new();
    for time in ["0.00000E+00", "1.00000E-03"] {
        for heading in [
            "velocity boundary condition forces/rigid body moments",
            "pressure boundary condition forces",
        ] {
            text += &format!(
                "\n n o d a l   f o r c e/e n e r g y    o u t p u t  t={time:>14}\n\n {heading} \n\n"
            );
            text += &node_force("nd#", 7, false);
            if heading.starts_with('v') {
                text += &node_force("mat#", 3, false).trim_start().replace("\n", "\n             ");
                text += &format!("xmoment={number}  ymoment={number} zmoment={number}\n");
            }
            text += &node_force("", 0, true);
        }
    }
    let file = read("bndout", &text);
    assert_eq!(file.problems, []);
    assert_eq!(file.time.len(), 2);
    assert_eq!(values(&file, 3, "ymoment"), [2.0; 2]);
    assert_eq!(values(&file, 7, "pressure_x_force"), [-1.5; 2]);
}

/// Stresses of shells at two integration points; an element that erodes; a new one.
#[test]
fn eroded_elements_have_no_values() {
    let six = "  1.0000E+00".repeat(6);
    let mut text = String::new();
    for (time, ids) in
        [("0.00000E+00", vec![4, 5]), ("1.00000E-03", vec![5]), ("2.00000E-03", vec![5, 6])]
    {
        text += &format!(
            "\n\n\n e l e m e n t   s t r e s s   c a l c u l a t i o n s   f o r   t i m e  s t e p{:9}   ( at time {time:>12} )\n\n element  materl\n ipt-shl  stress       sig-xx      sig-yy      sig-zz      sig-xy      sig-yz      sig-zx       plastic\n           state                                                                                 strain \n",
            1
        );
        for id in ids {
            text += &format!("{id:>8}-{:>7}\n", 1);
            for point in 1..=2 {
                text += &format!("{point:>4}-{:>3} elastic {six}{:>14}\n", 2, "2.0000E+00");
            }
        }
    }
    let file = read("elout", &text);
    assert_eq!(codes(&file), [ProblemCode::AbsentEntity; 2], "{:?}", file.problems);
    assert_eq!(values(&file, 5, "plastic_strain_ip2"), [2.0; 3]);
    let gone = values(&file, 4, "sig_xx");
    assert!(gone[0] == 1.0 && gone[1].is_nan() && gone[2].is_nan());
    let new = values(&file, 6, "sig_xx_ip2");
    assert!(new[0].is_nan() && new[1].is_nan() && new[2] == 1.0);
}

/// Entities that come and go without end must not fill the memory.
#[test]
fn absent_values_are_bounded() {
    let mut text = String::new();
    for k in 0..20_000 {
        text += &format!(
            "\n e l e m e n t   s t r a i n   c a l c u l a t i o n s   f o r   t i m e  s t e p{k:>9}   ( at time {k:>5}.0 )\n\n"
        );
        text += &format!("{k:>8}-      1\n      1  elastic{}\n", "  1.0000E+00".repeat(6));
    }
    let file = read("elout", &text);
    let cells: usize = file.histories.iter().map(|h| h.values.len()).sum();
    assert!(cells < 40_000_000, "{cells}");
    assert!(codes(&file).contains(&ProblemCode::IncompleteState));
}

/// What a restart writes again replaces what the interrupted run had written.
#[test]
fn a_restart_replaces_the_states_it_writes_again() {
    let state_at = |cycle: u32, time: &str, value: &str| {
        state(cycle, time) + TRANSLATIONS + &row("7", value, 12)
    };
    let times = ["0.0000000E+00", "1.0000000E-01", "2.0000000E-01", "3.0000000E-01"];
    let mut text = String::new();
    for (k, time) in times.iter().enumerate() {
        text += &state_at(k as u32, time, " 1.00000E+00");
    }
    for (k, time) in times.iter().enumerate().skip(2) {
        text += &state_at(10 + k as u32, time, " 2.00000E+00");
    }
    text += &state_at(20, "4.0000000E-01", " 2.00000E+00");
    let file = read("nodout", &text);
    assert_eq!(&file.time[..], [0.0, 0.1, 0.2, 0.3, 0.4]);
    assert_eq!(values(&file, 7, "x_displacement"), [1.0, 1.0, 2.0, 2.0, 2.0]);
    assert_eq!(codes(&file), [ProblemCode::RepeatedState]);
    let message = file.problems[0].to_string();
    assert!(
        message.contains("from time 0.2 on: 2 states above, from time 0.2 to 0.3"),
        "{message}"
    );
    assert!(file.problems[0].byte.is_some());
}

/// The first state is the damaged one: the others decide which entities there are.
#[test]
fn a_first_state_that_differs_is_left_out() {
    let forces = |id: u32, time: &str| side("slave", id, time, FORCES);
    let mut text = forces(9, "0.00000E+00") + &forces(3, "0.00000E+00");
    for time in ["1.00000E+00", "2.00000E+00", "3.00000E+00"] {
        text += &(forces(2, time) + &forces(3, time));
    }
    let file = read("rcforc", &text);
    assert_eq!(&file.time[..], [1.0, 2.0, 3.0]);
    let ids: Vec<i64> = file.entities.iter().map(|e| e.id.id).collect();
    assert_eq!(ids, [2, 3]);
    assert_eq!(codes(&file), [ProblemCode::IncompleteState]);
}

/// More interfaces than an attribute can name, and a name that would be a path.
#[test]
fn histories_of_many_interfaces_as_hdf5() {
    let state: String = (1..=8001).map(|id| side("slave", id, "1.00000E+00", FORCES)).collect();
    let mut file = read("rcforc", &state);
    assert_eq!(file.problems, []);
    let mut odd = file.histories[0].clone();
    odd.component = "a/b".into();
    file.histories.push(odd);
    let bytes = crumple::database::histories_to_hdf5(&file).unwrap();
    let hdf5 = hdf5_pure::File::from_bytes(bytes).unwrap();
    assert_eq!(hdf5.dataset("x_force").unwrap().shape().unwrap(), [1, 8001]);
    let ids = hdf5.dataset("ids/x_force").unwrap().read_i64().unwrap();
    assert!(ids.iter().copied().eq(1..=8001));
    let sides = hdf5.dataset("sides/x_force").unwrap().read_string().unwrap();
    assert!(sides.len() == 8001 && sides.iter().all(|side| side == Side::SurfA.name()));
    let odd = hdf5.dataset("a_b").unwrap().attrs().unwrap();
    assert!(matches!(&odd["component"], hdf5_pure::AttrValue::String(name) if name == "a/b"));
}
