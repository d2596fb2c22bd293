//! The readers on small texts, each with one peculiarity of real files.

use crumple::history::{EntityId, Side};
use crumple::solver::{NoDataReason, ProblemCode, Selection, SolverFile, formats, read_from};

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
fn header_only_is_not_an_error() {
    for format in formats().filter(|f| !["binout", "t01"].contains(f)) {
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

/// Ten digits may also fill the columns of the id and the blank behind them.
#[test]
fn ids_that_fill_their_columns_are_read() {
    let rows = row("1234567890", "-3.70368E-11", 12).replacen("1234567890 ", "1234567890", 1);
    assert_eq!(rows.trim_end().len(), 154);
    let text = state(1, "0.0000000E+00") + TRANSLATIONS + &rows;
    let file = read("nodout", &(text + &state(2, "1.0000000E+00") + TRANSLATIONS + &rows));
    assert_eq!(file.problems, []);
    assert_eq!(values(&file, 1234567890, "x_displacement"), [-3.70368e-11; 2]);
    assert_eq!(values(&file, 1234567890, "z_coordinate"), [-3.70368e-11; 2]);
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
        let label = format!("invented energy {i}");
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

/// Holds every cut of a text against the whole: what is returned are its first states, with
/// every value, and a line that is cut is named.
fn cut_at_every_byte(format: &str, text: &str) {
    let whole = read(format, text);
    assert_eq!(whole.problems, [], "{format}");
    let first = (0..text.len())
        .find(|&at| text.as_bytes()[at] == b'\n' && read(format, &text[..=at]).time.len() == 1)
        .unwrap();
    // A first state that ends between two lines cannot be distinguished from a whole one.
    let one = (first..text.len()).rev().find(|&at| read(format, &text[..at]).time.len() == 1);
    for cut in one.unwrap().min(first + (text.len() - first) / 2)..text.len() {
        let file = read(format, &text[..cut]);
        let states = file.time.len();
        assert_eq!(file.time[..], whole.time[..states], "{format} cut at {cut}");
        if states == 0 {
            assert!(!file.problems.is_empty(), "{format} cut at {cut}");
            continue;
        }
        assert_eq!(file.histories.len(), whole.histories.len(), "{format} cut at {cut}");
        for (a, b) in file.histories.iter().zip(&whole.histories) {
            assert_eq!(a.label(), b.label(), "{format} cut at {cut}");
            assert_eq!(a.values, b.values[..states], "{format} cut at {cut}: {}", a.label());
        }
        let last_line = text[..cut].rsplit('\n').next().unwrap();
        let is_named = last_line.trim().is_empty() || !file.problems.is_empty();
        assert!(is_named, "{format} cut at {cut}: \"{last_line}\"");
    }
}

/// What a bndout of a prescribed motion is in releases that print no moments: the id of the
/// set ends the row.
#[test]
fn rows_of_a_bndout_may_end_with_the_id_of_their_set() {
    let number = format!("{:>13}", "-1.5000E+00");
    let state = |time: &str, ids: &[u32], tail: &str| {
        let mut text = format!(
            "\n n o d a l   f o r c e/e n e r g y    o u t p u t  t={time:>14}\n\n velocity boundary condition forces/rigid body moments \n\n"
        );
        for id in ids {
            let row = node_force("nd#", *id, false);
            text += &format!("{}   setid ={id:>8}{tail}\n", row.trim_end());
        }
        text + &node_force("", 0, true)
    };
    let moments = format!(" xmoment={number} ymoment={number} zmoment={number}");
    for tail in ["", &moments] {
        let text = state("0.00000E+00", &[145, 7], tail) + &state("1.00000E-03", &[145, 7], tail);
        let file = read("bndout", &text);
        assert_eq!(file.problems, []);
        assert_eq!(&file.time[..], [0.0, 1e-3]);
        assert_eq!(values(&file, 145, "energy"), [-1.5; 2]);
        let has_moments = file.history(Some(EntityId::new(145)), "xmoment").is_some();
        assert_eq!(has_moments, !tail.is_empty());
        cut_at_every_byte("bndout", &text);
    }
}

/// Another release may print wider numbers or columns; labels still tell what is what.
#[test]
fn labels_tell_the_numbers_whatever_their_width() {
    let mut text = String::new();
    for time in ["0.00000E+00", "1.00000E-03"] {
        text += &dotted("time", time);
        text += &format!(" {:.<35}{:>12}\n", "spring/damper number", 7);
        text += &format!(" {:.<35}{:>18}\n", "x-force", "1.500000000E+00");
    }
    let file = read("deforc", &text);
    assert_eq!((values(&file, 7, "x_force"), &file.problems[..]), (vec![1.5; 2], &[][..]));

    let mut text = String::new();
    for time in ["0.00000E+00", "1.00000E+00"] {
        text += &format!(
            "\n\n dt of cycle       1 is controlled by shell\n\n time...........................{time:>14}\n kinetic energy.................  1.5000000000E+00\n total energy........................   2.50000E+00\n"
        );
    }
    let file = read("glstat", &text);
    let value = |component: &str| file.history(None, component).unwrap().values.clone();
    assert_eq!(value("kinetic_energy"), [1.5; 2]);
    assert_eq!(value("total_energy"), [2.5; 2]);
    assert_eq!(file.problems, []);

    let mut text = String::new();
    for time in ["0.0000E+00", "1.0000E+00"] {
        text += &format!(
            "\n time ={time:>13}\n mat.#=  100    inten=   1.500000E+00  kinen=   2.500000E+00 heat=   1.0000E+00\n x-mom=  1.0E+00 y-mom=  2.0E+00 z-mom=  3.0E+00\n"
        );
    }
    let file = read("matsum", &text);
    assert_eq!(values(&file, 100, "kinetic_energy"), [2.5; 2]);
    assert_eq!(values(&file, 100, "z_momentum"), [3.0; 2]);
    assert_eq!(file.problems, []);

    let mut text = String::new();
    for time in ["0.00000000E+00", "1.00000000E-01"] {
        text += &format!(
            "  slave {:>17} time {time}  x  1.50000000E+00  y  2.50000000E+00  z  3.50000000E+00 mass  4.50000000E+00 heat 1.0E+00\n",
            7
        );
    }
    let file = read("rcforc", &text);
    let entity = EntityId { id: 7, side: Some(Side::SurfA) };
    assert_eq!(file.history(Some(entity), "z_force").unwrap().values, [3.5; 2]);
    assert_eq!((&file.time[..], &file.problems[..]), (&[0.0, 0.1][..], &[][..]));

    let mut text = String::from(" single point constraint forces\n");
    for time in ["0.00000E+00", "1.00000E-01"] {
        text += &format!(
            "\n output at time ={time:>14}\n node=       123 local x,y,z forces =  1.50000E+00  2.50000E+00  3.50000E+00 setid=        10\n"
        );
    }
    let file = read("spcforc", &text);
    assert_eq!(values(&file, 123, "z_force"), [3.5; 2]);
    assert_eq!(file.problems, []);

    let mut text = String::new();
    for time in ["0.00000E+00", "1.00000E-03"] {
        text += &format!(
            " constraint #      axial        shear         time  failure                                       length  rslt moment      torsion\n          1  1.50000E+00  2.50000E+00  {time}      0.0    constraint/weld  ID  12345678901   3.500000E+00\n"
        );
    }
    let file = read("swforc", &text);
    assert_eq!(values(&file, 12345678901, "length"), [3.5; 2]);
    assert_eq!(file.problems, []);

    let mut text = String::new();
    for time in ["0.0000000E+00", "1.0000000E-03"] {
        text += &format!(
            " contact interface energy file, time={time:>14}\n    #             slave       master       cycle=             1    frictional   transducer\n\n         7   1.5000E+00   2.5000E+00                               3.5000E+00   4.5000E+00\n\n summary   total slave side=  1.500000000E+00\n"
        );
    }
    let file = read("sleout", &text);
    assert_eq!(values(&file, 7, "friction_energy"), [3.5; 2]);
    assert_eq!(file.history(None, "total_slave").unwrap().values, [1.5; 2]);
    assert_eq!(file.problems, []);
}

/// A part's hourglass energy is printed only by some releases: a last row that ends before
/// it is not whole.
#[test]
fn a_matsum_cut_within_its_last_row_loses_that_state() {
    let state = |time: &str| {
        let labels = |labels: &[&str]| {
            labels.iter().map(|l| format!(" {l}={:>13}", "1.0000E+00")).collect::<String>() + "\n"
        };
        format!(
            "\n time ={time:>13}\n mat.#={:>5}     {}{}{}{}",
            1,
            labels(&["inten", "kinen", "eroded_ie", "eroded_ke"]),
            labels(&["x-mom", "y-mom", "z-mom"]),
            labels(&["x-rbv", "y-rbv", "z-rbv"]),
            labels(&["hgeng", "+mass", "eroded_he"]),
        )
    };
    cut_at_every_byte("matsum", &(state("0.0000E+00") + &state("1.0000E+00")));
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
    cut_at_every_byte("deforc", &text);
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
    cut_at_every_byte("jntforc", &text);
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
    cut_at_every_byte("rbdout", &text);
}

fn node_force(mark: &str, id: u32, sum: bool) -> String {
    let number = format!("{:>13}", "-1.5000E+00");
    if sum {
        format!(
            "              xtotal={number}   ytotal={number}  ztotal={number}   etotal={number}\n"
        )
    } else {
        format!(
            " {mark}{id:>8}  xforce={number}   yforce={number}  zforce={number}   energy={number}\n"
        )
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
    cut_at_every_byte("nodfor", &text);
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
    cut_at_every_byte("bndout", &text);
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

/// A node that two lists of the deck name has two equal rows in every state.
#[test]
fn a_node_that_is_written_twice_is_read_once() {
    let states = |again: &dyn Fn(u32) -> String| -> String {
        (0..4)
            .map(|k| {
                let time = format!("{k}.0000000E+00");
                let [first, last] = ["7", "8"].map(|id| row(id, VALUES[k as usize], 12));
                state(k, &time) + TRANSLATIONS + &first + &again(k) + &last
            })
            .collect()
    };
    let text = states(&|k| row("7", VALUES[k as usize], 12));
    let file = read("nodout", &text);
    assert_eq!(codes(&file), [ProblemCode::RepeatedLabel]);
    assert_eq!(file.problems[0].message, "7 is in every state twice; its first row is kept");
    for id in [7, 8] {
        assert_eq!(values(&file, id, "x_velocity"), [0.0, 1.0, 2.0, 3.0]);
        let one = read_with(
            "nodout",
            &text,
            &Selection { ids: Some(vec![id.to_string().parse().unwrap()]), ..Selection::all() },
        );
        assert_eq!(values(&one, id, "x_velocity"), [0.0, 1.0, 2.0, 3.0]);
    }
    // Another value is another row, and the state that has it is damaged.
    let other = states(&|k| row("7", if k == 2 { "9.00000E+00" } else { VALUES[k as usize] }, 12));
    let file = read("nodout", &other);
    assert_eq!(&file.time[..], [0.0, 1.0, 3.0]);
    // So is one that has it for the first time.
    let late = states(&|k| if k < 2 { String::new() } else { row("7", VALUES[k as usize], 12) });
    assert_eq!(&read("nodout", &late).time[..], [0.0, 1.0]);
}

const VALUES: [&str; 4] = ["0.00000E+00", "1.00000E+00", "2.00000E+00", "3.00000E+00"];

/// A restart that continues a file puts its header below the states before it.
#[test]
fn a_second_header_is_no_damage() {
    let states = |from: u32, to: u32| -> String {
        (from..to)
            .map(|k| {
                let time = format!("{:.7E}", f64::from(k)).replace('E', "E+0");
                state(k, &time) + TRANSLATIONS + &row("7", &format!("{k}.00000E+00"), 12)
            })
            .collect()
    };
    let legend = "\n{BEGIN LEGEND}\n Entity #        Title\n        7     seat\n{END LEGEND}\n";
    let later = HEADER.replace("12/12/2022", "13/12/2022");
    for blank in ["", "\n"] {
        let text = format!("{legend}{}{blank}{later}{legend}{}", states(0, 5), states(5, 9));
        let file = read("nodout", &text);
        assert_eq!(file.problems, []);
        let expected: Vec<f64> = (0..9).map(f64::from).collect();
        assert_eq!(
            (&file.time[..], values(&file, 7, "z_coordinate")),
            (&expected[..], expected.clone())
        );
        assert_eq!(file.entities[0].title.as_deref(), Some("seat"));
    }
    // What only looks like a title is damage as before.
    let text = states(0, 5) + "\n title of another file\n" + &states(5, 9);
    assert!(codes(&read("nodout", &text)).contains(&ProblemCode::BadLine));
}

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
    let bytes = crumple::history_hdf5::encode(&file, None, None, None).unwrap();
    let hdf5 = hdf5_pure::File::from_bytes(bytes).unwrap();
    assert_eq!(hdf5.dataset("x_force").unwrap().shape().unwrap(), [1, 8001]);
    let ids = hdf5.dataset("ids/x_force").unwrap().read_i64().unwrap();
    assert!(ids.iter().copied().eq(1..=8001));
    let sides = hdf5.dataset("sides/x_force").unwrap().read_string().unwrap();
    assert!(sides.len() == 8001 && sides.iter().all(|side| side == Side::SurfA.name()));
    let odd = hdf5.dataset("a_b").unwrap().attrs().unwrap();
    assert_eq!(odd["component"].as_str(), Some("a/b"));
}

/// States that somebody cut out of a file, or that a full disk swallowed.
#[test]
fn a_hole_in_time_is_named() {
    let heading = "    time       wall#   normal-force    x-force        y-force        z-force\n";
    let walls = |states: &[u32]| {
        let row = |state: &u32| {
            let time = format!("{:.5E}", f64::from(*state) * 7.5e-4);
            let (mantissa, exponent) = time.split_once('E').unwrap();
            let time = format!("{mantissa}E{:+03}", exponent.parse::<i32>().unwrap());
            format!("{time:>12}{:>8}{}\n", 1, format!("{:>15}", "1.500000E+06").repeat(4))
        };
        heading.to_string() + &states.iter().map(row).collect::<String>()
    };
    let all: Vec<u32> = (0..200).collect();
    assert_eq!(read("rwforc", &walls(&all)).problems, []);
    let holed: Vec<u32> = (0..40).chain(109..200).collect();
    let file = read("rwforc", &walls(&holed));
    assert_eq!(file.time.len(), 131, "nothing is put into the hole");
    assert_eq!(codes(&file), [ProblemCode::TimeGap]);
    assert_eq!(
        file.problems[0].to_string(),
        "there is no state between time 0.02925 and 0.08175 (states 40 and 41), although states are about 7.500e-4 apart there: about 69 seem to be missing"
    );
    // Many are counted.
    let torn: Vec<u32> = (0..30).flat_map(|k| k * 20..k * 20 + 12).collect();
    let file = read("rwforc", &walls(&torn));
    assert_eq!(file.problems.len(), 21);
    assert_eq!(file.problems[20].code, ProblemCode::MoreProblems);
}

/// Rows of a wall over time, and the text with one line changed.
fn wall_rows(rows: &[(&str, &str)]) -> String {
    let heading = "    time       wall#   normal-force    x-force        y-force        z-force\n";
    let row = |(time, force): &(&str, &str)| {
        format!("{time:>12}{:>8}{force:>15}{}\n", 1, format!("{:>15}", "1.500000E+06").repeat(3))
    };
    heading.to_string() + &rows.iter().map(row).collect::<String>()
}

/// A state whose time is known far better than states lie apart is the same state, written again.
#[test]
fn of_a_state_written_twice_the_last_writing_counts() {
    let (one, other) = ("1.000000E+06", "1.000000E+05");
    let rows =
        [("4.42521E-02", one), ("4.50020E-02", one), ("4.50020E-02", other), ("4.57518E-02", one)];
    let file = read("rwforc", &wall_rows(&rows));
    assert_eq!(&file.time[..], [0.0442521, 0.045002, 0.0457518]);
    assert_eq!(values(&file, 1, "normal_force"), [1e6, 1e5, 1e6]);
    assert_eq!(codes(&file), [ProblemCode::RepeatedState]);
    let message = file.problems[0].to_string();
    assert!(message.ends_with("the state at time 0.045002 is written twice: the last one counts"));
    // States as near to each other as their times can tell are not.
    let near = ["1.00000E+01", "1.00001E+01", "1.00001E+01", "1.00002E+01"].map(|t| (t, one));
    let file = read("rwforc", &wall_rows(&near));
    assert_eq!((file.time.len(), &file.problems[..]), (4, &[][..]));

    let one = |time: &str, force: &str| {
        format!(
            "\n n o d a l   f o r c e/e n e r g y    o u t p u t  t=  {time}\n\n velocity boundary condition forces/rigid body moments\n nd#       7  xforce=   {force} yforce=   {force} zforce=   {force} energy=   {force}\n"
        )
    };
    let (a, b) = ("1.0000E+00", "2.0000E+00");
    let text = one("1.00000E-03", a) + &one("2.00000E-03", a) + &one("2.00000E-03", b);
    let file = read("bndout", &(text + &one("3.00000E-03", a)));
    assert_eq!(values(&file, 7, "x_force"), [1.0, 2.0, 1.0]);
    assert_eq!(codes(&file), [ProblemCode::RepeatedState]);
}

/// What is left of a number is not another number: the state is left out, and it is reported.
#[test]
fn cut_numbers_are_not_read() {
    let states = |damaged: usize, value: &str| -> SolverFile {
        let text: String = (0..6)
            .map(|k| {
                let value = if k == damaged { value } else { "   1.71192E+09" };
                let time = format!("{k}.00000E-03");
                glstat(&time, &[("kinetic energy", value), ("total energy", "   2.00000E+09")])
            })
            .collect();
        read("glstat", &text)
    };
    for cut in
        ["  192E+09", "   1.7192E+09", "   1.71", "   1.71\n192E+09", "   1", "   1.71192E+9"]
    {
        let file = states(3, cut);
        let kinetic = &file.history(None, "kinetic_energy").unwrap().values;
        assert_eq!(kinetic[..], [1.71192e9; 5], "{cut:?}");
        assert!(codes(&file).contains(&ProblemCode::BadLine), "{cut:?}: {:?}", file.problems);
    }
    // In the first state nothing tells yet how wide numbers are.
    assert_eq!(states(0, "   1.7192E+09").problems[0].line, Some(8));

    let mut text = String::new();
    for (k, value) in ["   2.5000E+00", " 2.5000E+00", "   2.5000E+00"].iter().enumerate() {
        text += &format!("\n time =   {k}.0000E+00\n");
        text += &format!(" mat.#=    1             inten={value}     kinen=   1.0000E+00\n");
    }
    let file = read("matsum", &text);
    assert_eq!(&file.time[..], [0.0, 2.0]);
    assert_eq!(codes(&file), [ProblemCode::BadLine, ProblemCode::IncompleteState]);
}

/// Lines of another file between those that are read are counted.
#[test]
fn lines_of_another_file_are_named() {
    let state = |k: u32| glstat(&format!("{k}.00000E-03"), &[("kinetic energy", "   1.00000E+09")]);
    let text = state(0) + &state(1) + &wall_rows(&[("4.42521E-02", "1.000000E+06"); 3]);
    let file = read("glstat", &text);
    assert_eq!((file.time.len(), codes(&file)), (2, vec![ProblemCode::UnreadRows]));
    assert_eq!(
        file.problems[0].to_string(),
        "line 15: 4 lines between those of this file not read, the first \"time       wall#   normal-force    x-force        y-forc\": of another file?"
    );
    let known = " number of shell elements that\n reached the minimum time step..    0\n";
    assert_eq!(read("glstat", &(state(0) + known + &state(1) + known)).problems, []);

    let part = |time: u32| {
        format!(
            "\n time =   {time}.0000E+00\n mat.#=    1             inten=   2.5000E+00     kinen=   1.0000E+00\n"
        )
    };
    let file = read("matsum", &(part(0) + " Maximum mass increase in cycle 1\n" + &part(1)));
    assert_eq!(file.problems, []);
    let file = read("matsum", &(part(0) + "\n" + &wall_rows(&[]) + &part(1)));
    assert_eq!((file.time.len(), codes(&file)), (2, vec![ProblemCode::UnreadRows]));

    // The name decides which of them is the file's own.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run7.rwforc");
    let rows: Vec<String> = (1..9).map(|k| format!("{k}.00000E-02")).collect();
    let rows: Vec<(&str, &str)> = rows.iter().map(|time| (&time[..], "1.000000E+06")).collect();
    let text = format!("{HEADER}{}{}", state(0), wall_rows(&rows));
    std::fs::write(&path, text).unwrap();
    let file = crumple::solver::read(&path, None, &Selection::all()).unwrap();
    assert_eq!((file.format, file.time.len()), ("rwforc", 8));
    assert!(codes(&file).contains(&ProblemCode::BadLine));
}

#[test]
fn swapped_rows_of_a_section_are_not_another_quantity() {
    let state = |time: &str, order: [usize; 3]| {
        let four = |value: &str| format!("{value:>15}{0}{0}{0}", format!("{value:>12}"));
        let rows = [
            format!("{:>12}{time:>15}{}\n", 1, four("1.0000E+00")),
            format!("{:27}{}\n", "global system", four("2.0000E+00")),
            format!("{:27}{}\n", "", four("3.0000E+00")),
        ];
        order.map(|k| &rows[k][..]).concat() + "\n"
    };
    let heading =
        " line#1  section#     time        x-force     y-force     z-force    magnitude\n";
    for swapped in [[0, 2, 1], [1, 0, 2], [2, 1, 0], [1, 2, 0]] {
        let text = heading.to_string()
            + &state("0.00000E+00", [0, 1, 2])
            + &state("1.00000E-03", [0, 1, 2])
            + &state("2.00000E-03", swapped)
            + &state("3.00000E-03", [0, 1, 2]);
        let file = read("secforc", &text);
        assert_eq!(&file.time[..], [0.0, 1e-3, 3e-3], "{swapped:?}");
        assert_eq!(values(&file, 1, "x_moment"), [2.0; 3]);
        assert_eq!(values(&file, 1, "area"), [3.0; 3]);
        assert!(codes(&file).contains(&ProblemCode::BadLine));
    }
}

/// A bag with two vents of one part has two rows of its material.
#[test]
fn a_material_may_be_there_for_each_vent() {
    let mut text = String::new();
    for k in 0..3 {
        text += "      time   airbag/cv #  volume        pressure    internal energy      dm/dt in      density dm/dt out  total mass gas temp. surface area   reaction dm/dt outp dm/dt outv\n";
        text += &format!("{:>12}{:>8}", format!("{k}.00000E-03"), 3);
        text += &format!("{:>15}", "1.0000E+03").repeat(5);
        text += &(format!("{:>11}", "1.000E+00").repeat(7) + "\n");
        for area in ["1.0000E-01", "2.0000E-01"] {
            text += &format!(
                "    Material I.D.=           7  Unblocked  Area=  {area}    Blocked  Area=  0.0000E+00    Leakage      =  0.0000E+00\n"
            );
        }
    }
    let file = read("abstat", &text);
    assert_eq!((file.time.len(), &file.problems[..]), (3, &[][..]));
    assert_eq!(values(&file, 3, "volume"), [1000.0; 3]);
    assert_eq!(values(&file, 3, "unblocked_area_mat7"), [0.1; 3]);
    assert_eq!(values(&file, 3, "unblocked_area_mat7_2"), [0.2; 3]);
}

/// Details of solids at integration points and nodes; of shells, whose strains have no heading; both in one state.
#[test]
fn details_of_elements_in_all_their_forms() {
    let six = |value: &str| format!("{value:>12}").repeat(6);
    let state = |cycle: u32, time: &str, stress: &str| {
        let heading = |what: &str| {
            format!(
                "\n\n\n e l e m e n t   {what}   c a l c u l a t i o n s   f o r   t i m e  s t e p{cycle:>9}   ( at time {time:>12} )\n\n"
            )
        };
        let (stresses, blank) = (six(stress), " ".repeat(17));
        let mut text = heading("s t r e s s") + " element  materl\n";
        text += "     ipt  stress       sig-xx      sig-yy      sig-zz      sig-xy      sig-yz      sig-zx                       yield      location\n           state                                                                                  effsg      function\n";
        text += "       7-      1\n";
        for place in ["int. point  1", "int. point  2", "node      501"] {
            let further = format!("{:>14}{:>14}", "3.0000E+00", "4.0000E+00");
            text += &format!("         elastic {stresses}{further}      {place}\n");
        }
        text += &(heading("s t r a i n")
            + " element  strain       eps-xx      eps-yy\n num/ipt   state\n");
        text += "       7-      1\n";
        for place in ["int. point  1", "node      501"] {
            text += &format!("{blank}{}      {place}\n", six("5.0000E-03"));
        }
        text += &(heading("s t r e s s") + " element  materl(global)\n");
        text += " ipt-shl  stress       sig-xx      sig-yy      sig-zz      sig-xy      sig-yz      sig-zx       plastic      location\n           state                                                 strain \n";
        text += "       9-      2\n";
        text += &format!("   1-  2 elastic {stresses}{:>14}  int. point  1\n", "6.0000E+00");
        text += &format!("   2-  2 elastic {stresses}{:>14}  node      601\n", "6.0000E+00");
        text += "\n ipt-shl  strain       eps-xx      eps-yy      eps-zz      eps-xy      eps-yz      eps-zx        location          \n\n";
        text += "       9-      2\n";
        text += &format!("   1-            {}   int. point  1\n", six("7.0000E-03"));
        text
    };
    let text = state(1, "0.00000E+00", "1.0000E+00")
        + &state(2, "1.00000E-03", "1.0000E+00")
        + &state(2, "1.00000E-03", "2.0000E+00");
    for format in ["eloutdet", "elout"] {
        let file = read(format, &text);
        assert_eq!(&file.time[..], [0.0, 1e-3]);
        assert_eq!(codes(&file), [ProblemCode::RepeatedState], "{:?}", file.problems);
        for (id, component, expected) in [
            (7, "sig_xx_point2", [1.0, 2.0]),
            (7, "yield_node501", [4.0, 4.0]),
            (7, "eps_zx_node501", [5e-3, 5e-3]),
            (9, "plastic_strain_point1", [6.0, 6.0]),
            (9, "sig_zx_ip2_node601", [1.0, 2.0]),
            (9, "eps_xx_point1", [7e-3, 7e-3]),
        ] {
            assert_eq!(values(&file, id, component), expected, "{component}");
        }
    }
}

/// A time that has lost a digit is not another time.
#[test]
fn a_time_that_lost_digits_is_named() {
    let nodes = |time: &str| state(1, time) + TRANSLATIONS + &row("7", "1.50000E+00", 12);
    let text = nodes("0.0000000E+00") + &nodes("1.0000000E-03") + &nodes("2.500000E-03");
    let file = read("nodout", &(text + &nodes("3.0000000E-03")));
    assert_eq!(&file.time[..], [0.0, 1e-3, 3e-3]);
    assert!(codes(&file).contains(&ProblemCode::BadLine));

    let part = |time: &str| {
        format!(
            "\n time ={time:>13}\n mat.#=    1             inten=   2.5000E+00     kinen=   1.0000E+00\n"
        )
    };
    let text = part("0.0000E+00") + &part("1.0000E+00") + &part("2.500E+00") + &part("3.0000E+00");
    let file = read("matsum", &text);
    assert_eq!(&file.time[..], [0.0, 1.0, 3.0]);
    assert!(codes(&file).contains(&ProblemCode::BadLine));
    // The first one is reported by those below.
    let text = part("0.500E+00") + &part("1.0000E+00") + &part("2.0000E+00");
    assert_eq!(read("matsum", &text).problems[0].line, Some(4));
}
