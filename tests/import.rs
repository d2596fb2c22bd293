//! Curves of files into a database: every format, what is refused and in which words, and the way
//! of predicted curves back into a group on which models are trained.

use std::fs;
use std::path::Path;

use crumple::formats::{ReadCurve, ReadOptions, read, readers};
use crumple::unit::UnitSystem;
use proptest::prelude::*;
use serde_json::Value;

use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok, entries, fixture, json, read_json, says,
};

/// The curve of all these files: a rise, a fall, a plateau; in m and N.
pub const POINTS: [(f64, f64); 5] =
    [(0.0, 0.0), (0.05, 3e6), (0.25, 1e6), (0.5, 1.5e6), (1.0, 2.0e6)];

/// Its energy is that of 24 t at this speed, in m/s.
pub fn speed() -> f64 {
    let work: f64 = POINTS.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0)).sum();
    (2.0 * work / 24e3).sqrt()
}

pub fn given(units: Option<&str>) -> ReadOptions {
    let units = units.map(|units| UnitSystem::parse(units).unwrap());
    ReadOptions { units, ..ReadOptions::default() }
}

/// Reads a file of that name and content.
pub fn read_bytes(
    name: &str,
    bytes: &[u8],
    options: &ReadOptions,
) -> Result<(ReadCurve, &'static str), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    read(&path, options).map_err(|e| e.to_string())
}

pub fn is_points(curve: &ReadCurve, context: &str) {
    let points: Vec<(f64, f64)> =
        curve.deflection_m.iter().copied().zip(curve.force_n.iter().copied()).collect();
    assert_eq!(points.len(), POINTS.len(), "{context}: {points:?}");
    for ((d, f), (dp, fp)) in points.iter().zip(&POINTS) {
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
        assert!(close(*d, *dp) && close(*f, *fp), "{context}: {points:?}");
    }
}

/// Columns of the curve in other units, `separator` between and `decimal` in numbers.
pub fn rows(length: f64, force: f64, separator: &str, decimal: &str) -> String {
    let shown = |v: f64| format!("{v}").replace('.', decimal);
    POINTS
        .iter()
        .map(|(d, f)| format!("{}{separator}{}\n", shown(d / length), shown(f / force)))
        .collect()
}

#[test]
fn csv_headers_of_many_kinds() {
    fn t(header: &str, length: f64, force: f64) {
        let separator = if header.contains(';') {
            ";"
        } else if header.contains('\t') {
            "\t"
        } else {
            ","
        };
        let text = format!("{header}\n{}", rows(length, force, separator, "."));
        let (curve, format) = read_bytes("a.csv", text.as_bytes(), &given(None))
            .unwrap_or_else(|e| panic!("{header}: {e}"));
        assert_eq!(format, "csv");
        is_points(&curve, header);
        assert!(curve.notes[0].starts_with("columns: deflection of \""), "{:?}", curve.notes);
        // The same with a byte-order mark and lines that end as Windows has them.
        let text = format!("\u{feff}{}", text.replace('\n', "\r\n"));
        is_points(&read_bytes("a.csv", text.as_bytes(), &given(None)).unwrap().0, header);
    }
    t("d_m,force_N", 1.0, 1.0);
    t("d_mm, F_kN", 1e-3, 1e3);
    t("deflection_m;force_MN", 1.0, 1e6);
    t("displacement [mm];Force [kN]", 1e-3, 1e3);
    t("Displacement (mm),load (MN)", 1e-3, 1e6);
    t("crush_m,load_kN", 1.0, 1e3);
    t("s/mm;F/kN", 1e-3, 1e3);
    t("x [m]\tforce [N]", 1.0, 1.0);
    t("\"Crush [cm]\",\"Contact Force [kN]\"", 1e-2, 1e3);
    t("DEFLECTION_mm,FORCE_N", 1e-3, 1.0);
    t("x-displacement (mm);body force (N)", 1e-3, 1.0);
    t("# by hand\n# units: none\ndisp mm,force kN", 1e-3, 1e3);
    t("deflection;force\nmm;kN", 1e-3, 1e3);
    t("deflection;force\n[mm];[kN]", 1e-3, 1e3);
}

#[test]
fn csv_columns_in_any_order_with_decimal_commas_or_without_units() {
    let comma = format!("Weg;displacement [mm];Force [kN]\n{}", {
        rows(1e-3, 1e3, ";", ",").lines().map(|l| format!("1,5;{l}\n")).collect::<String>()
    });
    is_points(&read_bytes("a.csv", comma.as_bytes(), &given(None)).unwrap().0, "comma");
    for text in ["deflection,force\n", ""] {
        let text = format!("{text}{}", rows(1e-3, 1.0, ",", "."));
        let (curve, _) = read_bytes("a.csv", text.as_bytes(), &given(Some("mm-t-s"))).unwrap();
        is_points(&curve, &text);
        assert_eq!(curve.units, UnitSystem::parse("mm-t-s").ok());
        assert!(curve.notes[0].contains("in units mm-t-s as given"), "{:?}", curve.notes);
    }
    // Each column has a sign of its own, and neither separates thousands.
    let mixed =
        "t_s;d_mm;F_kN\n0,0010;0.0;0.0\n0,0020;5.125;990.5\n0,0030;10.5;1012.25\n0,0040;12.5;0.0\n";
    let (curve, _) = read_bytes("a.csv", mixed.as_bytes(), &given(None)).unwrap();
    assert_eq!(curve.force_n, [0.0, 990.5e3, 1012.25e3, 0.0]);
    let facts = "# force_kind: body\n# speed_m_per_s: 10\n# speed_kind: wall\n# mass_kg: 24000\n# unloading_stiffness_N_per_m: 8e7\n";
    let text = format!("{facts}time [ms],d_m,force_N\n0,0,0\n1,0.01,1e6\n2,0.02,2e6\n3,0.01,0\n");
    let (curve, _) = read_bytes("a.csv", text.as_bytes(), &given(None)).unwrap();
    assert_eq!(curve.time_s, Some(vec![0.0, 1e-3, 2e-3, 3e-3]));
    let backwards = "time [ms],d_m,force_N\n3,0.01,0\n2,0.02,2e6\n1,0.01,1e6\n0,0,0\n";
    let (reversed, _) = read_bytes("a.csv", backwards.as_bytes(), &given(None)).unwrap();
    assert_eq!(
        (&reversed.time_s, &reversed.deflection_m, &reversed.force_n),
        (&curve.time_s, &curve.deflection_m, &curve.force_n)
    );
    let note = "times: they fall from row to row, and the rows are reversed";
    assert!(reversed.notes.iter().any(|n| n == note), "{:?}", reversed.notes);
    assert_eq!(curve.facts.mass_kg, Some(24e3));
    assert_eq!(curve.facts.speed_m_per_s, Some(10.0));
    assert_eq!(curve.facts.unloading_stiffness_n_per_m, Some(8e7));
}

/// A deck with one curve; its points in mm and kN.
fn deck(title: &str, card: &str, points: &str) -> String {
    format!(
        "*KEYWORD\n$ by hand\n*DEFINE_CURVE_TITLE\n{title}\n$#    lcid      sidr       sfa       sfo      offa      offo    dattyp     lcint\n{card}\n{points}*END\n"
    )
}

fn fields(length: f64, force: f64) -> String {
    POINTS.iter().map(|(d, f)| format!("{:>20}{:>20}\n", d / length, f / force)).collect()
}

#[test]
fn lsdyna_decks() {
    fn t(text: &str, units: Option<&str>, notes: &[&str]) {
        let (curve, format) = read_bytes("a.k", text.as_bytes(), &given(units)).unwrap();
        assert_eq!(format, "lsdyna");
        is_points(&curve, text);
        for note in notes {
            assert!(curve.notes.iter().any(|n| n.contains(note)), "{note}: {:?}", curve.notes);
        }
    }
    let card = "       101         0       1.0       1.0       0.0       0.0         0         0";
    t(&deck("nose", card, &fields(1e-3, 1e3)), Some("mm-kg-ms"), &["units: mm-kg-ms as given"]);
    // Empty factors and factors of zero are 1.
    t(&deck("a, b", "       101", &fields(1e-3, 1e3)), Some("mm-kg-ms"), &["curve: 101"]);
    let zero = "       101         0       0.0       0.0       0.0       0.0";
    t(&deck("nöse", zero, &fields(1e-3, 1e3)), Some("mm-kg-ms"), &[]);
    // d = SFA (a + OFFA), F = SFO (o + OFFO).
    let scaled = "7,0,0.5,1000,-2.0,3";
    let points: String =
        POINTS.iter().map(|(d, f)| format!("{},{}\n", 2.0 * d + 2.0, f / 1e3 - 3.0)).collect();
    t(
        &deck("scaled", scaled, &points),
        Some("SI"),
        &["abscissas times 0.5 after -2 is added, ordinates times 1000 after 3"],
    );
    let own = deck("x", card, &fields(1e-3, 1.0))
        .replace("$ by hand", "$ units of the points: mm-t-s (length 1e-3 m)");
    t(&own, None, &["units: mm-t-s from line 2 of the file"]);
    // Compression in the third quadrant, as springs of S06 have it.
    let third: String = POINTS
        .iter()
        .rev()
        .map(|(d, f)| format!("{:>20}{:>20}\n", -d, -f))
        .chain([format!("{:>20}{:>20}\n", 0.5, 0)])
        .collect();
    t(&deck("x", card, &third), Some("SI"), &["third quadrant", "reverse order", "guard"]);
    // Fortran's exponents, a curve without title, other keywords around it.
    let text = format!(
        "*keyword\n*node\n  1,2,3\n*define_curve\n{card}\n{}*PART\nsomething\n",
        fields(1.0, 1e3).replace(" 3000", "3.0+3")
    );
    t(&text, Some("m-t-s"), &[]);
    // The long format.
    let card: String =
        ["101", "0", "1.0", "1.0", "0.0", "0.0"].map(|f| format!("{f:>20}")).concat();
    let long = deck("x", &card, &fields(1.0, 1.0)).replace("_TITLE", "_TITLE+");
    t(&long, Some("SI"), &[]);
}

#[test]
fn a_curve_of_several_is_chosen() {
    let card = |id: u32| format!("{id:>10}         0");
    let two = deck("one", &card(101), &fields(1.0, 1.0))
        + &deck("two", &card(102), "1,2\n2,3\n3,4\n4,5\n");
    let options = |curve: &str| ReadOptions { curve: Some(curve.into()), ..given(Some("SI")) };
    is_points(&read_bytes("a.k", two.as_bytes(), &options("101")).unwrap().0, "101");
    let error = read_bytes("a.k", two.as_bytes(), &given(Some("SI"))).unwrap_err();
    assert!(
        error.ends_with("a.k: the file holds several curves: choose one with --curve: 101 (\"one\"), 102 (\"two\")"),
        "{error}"
    );
    let error = read_bytes("a.k", two.as_bytes(), &options("7")).unwrap_err();
    assert!(
        error.ends_with("the file has no curve \"7\": it has 101 (\"one\"), 102 (\"two\")"),
        "{error}"
    );

    let values = rows(1.0, 1.0, " ", ".");
    let two = format!("#1\ndouble a(5,2) # d [m], F [N]\n{values}double b(5,2)\n{values}");
    is_points(&read_bytes("a.txt", two.as_bytes(), &options("a")).unwrap().0, "a");
    let error = read_bytes("a.txt", two.as_bytes(), &given(None)).unwrap_err();
    assert!(error.ends_with("choose one with --curve: a, b"), "{error}");

    let one = format!("title\nx (m)\ny (N)\nlabel\n{values}CONTINUE\n");
    let two = format!("{one}{}", one.replace("label", "other"));
    is_points(&read_bytes("a.cur", two.as_bytes(), &options("other")).unwrap().0, "other");
    is_points(&read_bytes("a.cur", two.as_bytes(), &options("1")).unwrap().0, "1");
    let error = read_bytes("a.cur", two.as_bytes(), &given(None)).unwrap_err();
    assert!(error.ends_with("--curve: 1 (\"label\"), 2 (\"other\")"), "{error}");
}

#[test]
fn modelica_tables() {
    fn t(text: &str, units: Option<&str>, note: &str) {
        let (curve, format) = read_bytes("a.txt", text.as_bytes(), &given(units)).unwrap();
        assert_eq!(format, "modelica");
        is_points(&curve, text);
        assert!(curve.notes.iter().any(|n| n.contains(note)), "{:?}", curve.notes);
    }
    let si = rows(1.0, 1.0, " ", ".");
    t(&format!("#1\ndouble fd_load(5,2)  # d [m], F [N]\n{si}"), None, "those of line 2");
    t(&format!("#1\ndouble fd_load(5,2)\n{si}"), None, "SI, as crumple export writes fd_load");
    let mm = rows(1e-3, 1.0, "\t", ".");
    t(&format!("#1\n# mine\ndouble nose(5, 2)\n{mm}"), Some("mm-t-s"), "mm-t-s as given");
    t(&format!("#1\n# units: mm-t-s\nfloat nose(5,2)\n{mm}"), None, "units: mm-t-s from line 2");
    let one_line = si.replace('\n', ", ");
    t(&format!("#1\ndouble fd_load(5,2)\n{one_line}\n"), None, "SI");
    let guarded = format!("#1\ndouble fd_load(7,2)\n-0.1 0\n{si}1.1 2e6\n");
    t(&guarded, None, "1 below zero deflection");
}

/// A matrix of a MAT file of version 4.
fn matrix(name: &str, rows: i32, columns: i32, values: &[f64], is_big: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let head = [if is_big { 1000 } else { 0 }, rows, columns, 0, name.len() as i32 + 1];
    for integer in head {
        bytes.extend(if is_big { integer.to_be_bytes() } else { integer.to_le_bytes() });
    }
    bytes.extend(name.bytes().chain([0]));
    for value in values {
        bytes.extend(if is_big { value.to_be_bytes() } else { value.to_le_bytes() });
    }
    bytes
}

/// The curve column by column.
fn columns() -> Vec<f64> {
    POINTS.iter().map(|p| p.0).chain(POINTS.iter().map(|p| p.1)).collect()
}

#[test]
fn mat_files_of_both_byte_orders() {
    for is_big in [false, true] {
        let ours = [
            matrix("fd_load", 5, 2, &columns(), is_big),
            matrix("fd_unload", 2, 2, &[1.0, 0.9, 2e6, 0.0], is_big),
            matrix("k_u", 1, 1, &[8e7], is_big),
        ];
        let (curve, format) = read_bytes("a.mat", &ours.concat(), &given(None)).unwrap();
        assert_eq!(format, "mat");
        is_points(&curve, "ours");
        assert_eq!(curve.facts.unloading_stiffness_n_per_m, Some(8e7));
        assert!(curve.notes[1].contains("SI, as crumple export writes fd_load"));
        let other = [matrix("n", 1, 1, &[5.0], is_big), matrix("fd", 5, 2, &columns(), is_big)];
        let other = other.concat();
        is_points(&read_bytes("b.mat", &other, &given(Some("SI"))).unwrap().0, "other");
        let error = read_bytes("b.mat", &other, &given(None)).unwrap_err();
        says(&error, "b.mat: the file does not state its units: give them with --units");
    }
}

/// A channel file.
pub fn channel(code: &str, unit: &str, values: &[f64]) -> String {
    let values: String = values.iter().map(|v| format!("{v}\n")).collect();
    format!(
        "Test object number        :1\nName of the channel       :{code}\nChannel code              :{code}\nUnit                      :{unit}\nReference channel         :implicit\nTime of first sample      :-0.002\nSampling interval         :0.001\nNumber of samples         :{}\n{values}",
        values.lines().count()
    )
}

#[test]
fn iso_mme_tests() {
    let folder = tempfile::tempdir().unwrap();
    let channels = folder.path().join("T1/Channel");
    fs::create_dir_all(&channels).unwrap();
    fs::write(folder.path().join("T1/T1.mme"), "Data format edition number :1.6\n").unwrap();
    let (d, f) = ([0.0, 5.0, 10.0, 15.0, 12.0], [0.0, 1.0, 2.0, 3.0, 0.0]);
    fs::write(channels.join("T1.chn"), "Number of channels :3\n").unwrap();
    fs::write(channels.join("T1.001"), channel("11VEHCCG0000ACXD", "m/s^2", &d)).unwrap();
    fs::write(channels.join("T1.002"), channel("11FRONT00000DSXP", "mm", &d)).unwrap();
    fs::write(channels.join("T1.003"), channel("11FRONT00000FOXP", "kN", &f)).unwrap();
    let expected_d = d.map(|d| d * 1e-3);
    for path in ["T1", "T1/T1.mme", "T1/Channel/T1.003", "T1/Channel/T1.001"] {
        let (curve, format) = read(&folder.path().join(path), &given(None)).unwrap();
        assert_eq!(format, "iso-mme");
        assert_eq!(curve.deflection_m, expected_d, "{path}");
        assert_eq!(curve.force_n, f.map(|f| f * 1e3));
        assert_eq!(curve.time_s.as_ref().unwrap()[..2], [-0.002, -0.002 + 0.001]);
        let mut files: Vec<_> = curve.files.iter().map(|f| f.path.clone()).collect();
        files.dedup();
        assert_eq!(files.len(), curve.files.len(), "{path}: no file twice");
    }
    // Masses and speeds of the test, with and without a unit.
    for (mass, speed) in [("24000", "10"), ("24 t", "36 km/h")] {
        let text = format!("Mass of test object 1 :{mass}\nVelocity test object 1 :{speed}\n");
        fs::write(folder.path().join("T1/T1.mme"), text).unwrap();
        let facts = read(&folder.path().join("T1"), &given(None)).unwrap().0.facts;
        assert_eq!((facts.mass_kg, facts.speed_m_per_s), (Some(24e3), Some(10.0)));
    }
    // A second force: the codes choose.
    fs::write(channels.join("T1.004"), channel("12FRONT00000FOXP", "kN", &f)).unwrap();
    let path = folder.path().join("T1");
    let error = read(&path, &given(None)).unwrap_err().to_string();
    says(
        &error,
        "choose one with --curve: displacement 11FRONT00000DSXP; force 11FRONT00000FOXP, 12FRONT00000FOXP",
    );
    let chosen =
        ReadOptions { curve: Some("11FRONT00000DSXP,12FRONT00000FOXP".into()), ..given(None) };
    assert!(read(&path, &chosen).is_ok());
    // Damage is named with its file and line.
    let t = |text: String, expected: &str| {
        fs::write(channels.join("T1.004"), text).unwrap();
        says(&read(&path, &chosen).unwrap_err().to_string(), expected);
    };
    let good = channel("12FRONT00000FOXP", "kN", &f);
    #[rustfmt::skip]
    let cases = [
        (good.replace("kN", "kgf"), "T1.004: line 4: the unit \"kgf\" of the force is not known: use one of N, kN, MN, lbf"),
        (good.replace("implicit", "explicit"), "T1.004: line 5: the times are those of another channel: expected \"Reference channel :implicit\" with an interval, or \"Reference channel name :\""),
        (good.replace("samples         :5", "samples         :9"), "T1.004: line 8: number of samples declares 9, but the file has 5 values"),
        (good.replace("\n2\n", "\nNOVALUE\n"), "T1.004: line 11: expected a number, found \"NOVALUE\""),
        (good.replace(":0.001", ":0"), "expected an interval above 0 in s, found \"0\""),
    ];
    cases.into_iter().for_each(|(text, expected)| t(text, expected));
}

#[test]
fn two_columns_below_titles_and_labels() {
    fn t(text: &str, units: Option<&str>) {
        let (curve, format) = read_bytes("a.cur", text.as_bytes(), &given(units))
            .unwrap_or_else(|e| panic!("{text}: {e}"));
        assert_eq!(format, "two-columns", "{text}");
        is_points(&curve, text);
    }
    let mm = rows(1e-3, 1e3, "  ", ".");
    let label = |x: &str, y: &str| {
        format!("$ T/HIS\nImpact of a nose, 2nd test\n{x}\n{y}\nnose\n{mm}CONTINUE\n")
    };
    t(&label("Displacement (mm)", "Force (kN)"), None);
    t(&label("X disp of node 12 [mm]", "Sum of rigid walls [kN]"), None);
    t(&label("a", "b"), Some("mm-kg-ms"));
    t(&format!("displacement [mm]   force [kN]\n{mm}"), None);
    t(&format!("# d_mm F_kN\n{mm}"), None);
    t(&format!("# units: mm-kg-ms\n{mm}"), None);
    t(&mm, Some("mm-kg-ms"));
    t(&format!("a title\n{}", rows(1.0, 1.0, ", ", ".")), Some("SI"));
}

/// Names, contents and options of files that are refused, with what the message must say.
#[test]
fn what_is_no_curve_is_refused_with_file_place_and_remedy() {
    fn t(name: &str, bytes: impl AsRef<[u8]>, units: Option<&str>, expected: &[&str]) {
        let error = read_bytes(name, bytes.as_ref(), &given(units)).unwrap_err();
        for part in [&[name][..], expected].concat() {
            assert!(error.contains(part), "expected {part}\nfound {error}");
        }
    }
    let csv = |rows: &str| format!("d_m,force_N\n{rows}");
    #[rustfmt::skip]
    let cases: [(&str, Vec<u8>, &[&str]); 21] = [
        ("a.csv", csv("0,0\n1,NaN\n2,3\n3,4\n").into(), &["line 3, field 2: expected a number, found \"NaN\""]),
        ("a.csv", csv("0,0\n1,ten\n2,3\n3,4\n").into(), &["line 3, field 2: expected a number, found \"ten\""]),
        ("a.csv", csv("0,0\n1\n2,3\n3,4\n").into(), &["line 3, field 2: expected a number, found \"\""]),
        ("a.csv", csv("0,0\n1,1e999\n2,3\n3,4\n").into(), &["line 3, field 2: expected a number"]),
        ("a.csv", csv("0,0\n1,2\n2,3\n").into(), &["the curve has 3 points: expected at least 4"]),
        ("a.csv", csv("").into(), &["the curve has 0 points"]),
        ("a.csv", csv("0,0\n2,2\n1,3\n3,4\n").into(), &["line 4: the deflection must increase", "or a time column"]),
        ("a.csv", csv("0,0\n1,2\n2,-1\n3,4\n").into(), &["line 4: the force is -1 N", "write tension as 0"]),
        ("a.csv", csv("-1,-2\n0,0\n1,2\n2,3\n").into(), &["line 2: the force is -2 N on the other side"]),
        ("a.csv", "d,force\n0,0\n1,2\n2,3\n3,4\n".into(), &["line 1: the deflection has no unit (\"d\")", "write it as d_m or d_mm", "give the file's units with --units (of crumple export: --input-units), such as mm-t-s or SI"]),
        ("a.csv", "0,0\n1,2\n2,3\n3,4\n".into(), &["line 1: the header (the names of the columns)", "--units"]),
        ("a.csv", "d [inch],force_N\n0,0\n1,2\n2,3\n3,4\n".into(), &["line 1: the unit \"inch\" of the deflection is not known: use one of mm, cm, m, in, ft"]),
        ("a.csv", "d_m,force [kn]\n0,0\n1,2\n2,3\n3,4\n".into(), &["the unit \"kn\" of the force is not known: use one of N, kN, MN, lbf"]),
        ("a.csv", "date,note\n0,0\n1,2\n2,3\n3,4\n".into(), &["line 1: expected a column deflection with its unit, such as d_m or d_mm, found \"date\""]),
        ("a.csv", "d_m,F1_kN,F2_kN\n0,0,0\n1,2,2\n2,3,3\n3,4,4\n".into(), &["expected a column force with its unit, such as force_N or force_kN, found \"F1_kN\", \"F2_kN\""]),
        ("a.csv", "d_m,note\n0,0\n1,2\n2,3\n3,4\n".into(), &["expected a column force with its unit, such as force_N or force_kN, found \"note\""]),
        ("a.csv", "# force_kind: big\nd_m,force_N\n0,0\n".into(), &["line 1: \"# force_kind: big\": expected \"body\" or \"contact\""]),
        ("a.csv", b"d_m,force_N\n0,\xff\n1,2\n".into(), &["line 2"]),
        ("a.json", "{}".into(), &["this is not a predicted curve", "give a JSON file made by crumple predict"]),
        ("a.json", "{\"deflection_m\": [0, 1".into(), &["line 1 column 22"]),
        ("a.bin", vec![0u8, 159, 146, 150], &["the format of this file cannot be recognised by its content", "--from"]),
    ];
    cases.into_iter().for_each(|(name, bytes, expected)| t(name, bytes, None, expected));
    for empty in ["a.csv", "a.json", "a.k", "a.txt", "a.mat", "a.cur", "a.mme"] {
        t(empty, "", None, &["expected a curve, found an empty file"]);
    }
    let card = "       101         0";
    #[rustfmt::skip]
    let cases = [
        ("a.k", deck("x", card, &fields(1.0, 1.0)), None, &["the file does not state its units", "\"$ units: mm-t-s\""][..]),
        ("a.k", deck("$x", card, &fields(1.0, 1.0)), Some("SI"), &["line 7, columns 1-10: expected the number of a curve (LCID)", "line 5 begins with $"][..]),
        ("a.k", deck("x", card, "  0.0 0.0\n"), Some("SI"), &["line 7, columns 1-20: expected one number in each field of 20 columns, or fields with commas between, found \"0.0 0.0\""][..]),
        ("a.k", deck("x", card, &fields(1.0, 1.0).replace("1000000", "&param")), Some("SI"), &["columns 21-40: expected a number, found \"&param\""][..]),
        ("a.k", deck("x", card, "1,2\n"), Some("SI"), &["the curve has 1 point:"][..]),
        ("a.k", deck("x", card, "0,0\n1,nan\n2,2\n3,3\n"), Some("SI"), &["line 8, field 2: expected a number, found \"nan\""][..]),
        ("a.csv", "d_mm;F_kN\n0.0;0\n5.0;990\n10.0;1,012\n".into(), None, &["line 4, field 2: \"1,012\" has the sign \",\", and \"0.0\" in line 2 the sign \".\": only one of them can be decimal"][..]),
        ("a.csv", "t_ms,d_mm,F_kN\n0,0,0\n1,5,90\n2,9,95\n1.5,7,99\n3,12,90\n".into(), None, &["line 5: the time 0.0015 s comes after 0.002 s: expected times that increase; sort the rows, or remove those that a restart has written again"][..]),
        ("a.k", "*KEYWORD\n*NODE\n1,2\n".into(), Some("SI"), &["expected a *DEFINE_CURVE, found none in this deck"][..]),
    ];
    cases.into_iter().for_each(|(name, bytes, units, expected)| t(name, bytes, units, expected));
    let table = |head: &str| format!("#1\n{head}\n{}", rows(1.0, 1.0, " ", "."));
    #[rustfmt::skip]
    let cases = [
        ("a.txt", table("double nose(5,2)"), None, &["does not state its units", "# d [m], F [N]"][..]),
        ("a.txt", table("double fd_load(9,2)"), None, &["line 2: table fd_load declares 9 rows of 2, but the file has 10 values for it"][..]),
        ("a.txt", table("double fd_load(3,2)"), None, &["line 6, field 1: expected no more than the 3 rows of 2 that table fd_load declares"][..]),
        ("a.txt", table("double fd_load(900000,900000)"), None, &["line 2: table fd_load declares 900000 rows of 900000, but the file has", "correct the size"][..]),
        ("a.txt", table("double fd_load(99999999999,2)"), None, &["more than 1000000 points"][..]),
        ("a.txt", table("double fd_load"), None, &["line 2: expected a table such as \"double fd_load(4,2)\""][..]),
        ("a.txt", table("double k(10,1)"), Some("SI"), &["expected a table of two columns"][..]),
        ("a.txt", table("double fd_load(5,2)").replace("1000000", "x"), None, &["expected a number, found \"x\""][..]),
    ];
    cases.into_iter().for_each(|(name, bytes, units, expected)| t(name, bytes, units, expected));
    let mat = matrix("fd_load", 5, 2, &columns(), false);
    #[rustfmt::skip]
    let cases = [
        ("a.mat", mat[..60].to_vec(), &["byte 0: matrix fd_load declares 5 rows of 2, but the file has 32 bytes after its name", "it may be truncated"][..]),
        ("a.mat", mat[..10].to_vec(), &["byte 0: expected a matrix of a MAT file of version 4"][..]),
        ("a.mat", matrix("fd_load", i32::MAX, i32::MAX, &[], false), &["declares 2147483647 rows of 2147483647"][..]),
        ("a.mat", matrix("fd_load", 5, 2, &[0.0, 1.0, 2.0, 3.0, 4.0, 0.0, f64::NAN, 1.0, 1.0, 1.0], false), &["row 2: the force is NaN: expected a finite number"][..]),
        ("a.mat", matrix("x", 2, 5, &columns(), false), &["expected a full matrix of doubles with two columns", "found x (2 x 5)"][..]),
        ("a.mat", "MATLAB 5.0 MAT-file".into(), &["of a later version: save it with -v4"][..]),
        ("a.cur", "t\nTime (ms)\nForce (kN)\nl\n0 0\n1 2\n2 3\n3 4\n".into(), &["line 2: expected a deflection in the first column, found \"Time (ms)\""][..]),
        ("a.cur", "t\nx\ny\nl\n0 0\n1 2\n2 3\n3 4\n".into(), &["the deflection has no unit", "--units"][..]),
        ("a.cur", "x (m)\ny (N)\n0 0\n1 abc\n2 3\n3 4\n".into(), &["line 4, field 2: expected a number, found \"abc\""][..]),
        ("a.cur", "x (m)\ny (N)\n0 0\n1 2 3\n".into(), &["line 4: expected two numbers, or CONTINUE after a curve"][..]),
    ];
    cases.into_iter().for_each(|(name, bytes, expected)| t(name, bytes, None, expected));
}

/// Files that hold next to nothing, a million times.
#[test]
fn memory_is_bounded_by_the_number_of_curves_and_points() {
    fn t(name: &str, text: &str, times: usize, expected: &str) {
        let error = read_bytes(name, text.repeat(times).as_bytes(), &given(Some("SI")));
        let error = error.unwrap_err();
        assert!(error.contains(expected), "{name}: {error}");
    }
    t("a.k", "*DEFINE_CURVE\n1\n", 20_000, "more than 10000 curves: extract the one");
    t("a.cur", "CONTINUE\n", 20_000, "more than 10000 curves");
    t("a.rad", "/FUNCT/1\n", 20_000, "more than 10000 curves");
    t("a.mo", "package a\n", 20_000, "more than 10000 curves");
    t("a.csv", "a;b c,d\te ", 2_000_000, "expected a column deflection");
    t("a.txt", "1 2 3\n", 1_100_000, "more than 1000000 points");
    t("a.csv", "1,1\n", 1_100_000, "more than 1000000 points: thin it out");
    t("a.cur", "1 1\n", 1_100_000, "more than 1000000 points");
    t("a.cur", "a (m) ", 1_000_000, "expected a curve: lines of two numbers");
}

/// Titles of 200 characters, beyond ASCII, with commas: kept, and cut behind 200.
#[test]
fn titles_are_kept() {
    let long = "ä".repeat(250);
    for title in ["Nase, 36 km/h; \"neu\"", "碰撞曲线", &long] {
        let kept: String = title.chars().take(200).collect();
        let card = "       101         0";
        let k = deck(title, card, &fields(1.0, 1.0));
        let (curve, _) = read_bytes("a.k", k.as_bytes(), &given(Some("SI"))).unwrap();
        assert_eq!(curve.title.as_deref(), Some(kept.trim()), "{title}");
        let cur = format!("t\nx (m)\ny (N)\n{title}\n{}", rows(1.0, 1.0, " ", "."));
        let (curve, _) = read_bytes("a.cur", cur.as_bytes(), &given(None)).unwrap();
        assert_eq!(curve.title.as_deref(), Some(kept.trim()), "{title}");
        let is_cut = curve.notes.iter().any(|n| n == "title: cut to its first 200 characters");
        assert_eq!(is_cut, title.len() > 300);
    }
}

/// The curve as a CSV file in a new folder.
fn here() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("d_mm,force_kN\n{}", rows(1e-3, 1e3, ",", "."));
    fs::write(folder.path().join("nose.csv"), text).unwrap();
    folder
}

/// The arguments of an import of `nose.csv` with these beside.
fn adding<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["db", "add", "c.h5", "nose.csv", "--group", "tests"][..], more].concat()
}

const WALL: [&str; 4] = ["--kind", "wall", "--mass", "24t"];

fn cases(folder: &Path, group: &str) -> Vec<Value> {
    let shown = crumple_ok(folder, &["db", "show", "c.h5", "--group", group, "--json"]);
    let shown: Value = serde_json::from_str(&shown).unwrap();
    shown["groups"][group].as_array().unwrap().clone()
}

#[test]
fn a_file_becomes_a_case_that_every_command_knows() {
    let folder = here();
    let here = folder.path();
    let v = format!("{}m/s", speed());
    let added =
        crumple_ok(here, &adding(&[&WALL[..], &["--speed", &v, "--unloading", "80MN/m"]].concat()));
    for part in [
        "nose",
        "1.0000",
        "80.0 MN/m",
        "columns: deflection of \"d_mm\" in mm",
        "motion: reconstructed",
        "force: taken as the contact force",
        "wrote c.h5 (group tests)",
    ] {
        assert!(added.contains(part), "{part} is missing in\n{added}");
    }
    let case = &cases(here, "tests")[0];
    assert_eq!(case["study"], "imported");
    assert_eq!(case["name"], "nose");
    assert_eq!(case["truncated"], false);
    let bytes = fs::read(here.join("nose.csv")).unwrap();
    assert_eq!(case["sources"][0]["path"], "nose.csv");
    assert_eq!(case["sources"][0]["size_bytes"], bytes.len());
    assert_eq!(case["sources"][0]["blake3"], blake3::hash(&bytes).to_hex().to_string());
    assert_eq!(case["recipe"]["imported"]["format"], "csv");
    // No point of the table is lost.
    let d: Vec<f64> = serde_json::from_value(case["original"]["deflection_m"].clone()).unwrap();
    let f: Vec<f64> = serde_json::from_value(case["original"]["force_N"].clone()).unwrap();
    for (dp, fp) in POINTS {
        let found = d.iter().zip(&f).any(|(d, f)| (d - dp).abs() < 1e-12 && (f - fp).abs() < 1e-5);
        assert!(found, "({dp}, {fp})");
    }
    let t: Vec<f64> = serde_json::from_value(case["time_s"].clone()).unwrap();
    assert!((t[1] - 0.75e-3).abs() < 1e-12);
    let check = crumple_ok(here, "db check c.h5 --strict");
    assert_eq!(check, "1 case checked, 0 findings\n");
}

#[test]
fn names_speeds_and_kinds_are_asked_for_and_nothing_is_written_before_all_fits() {
    let folder = here();
    let here = folder.path();
    let v = format!("{}m/s", speed());
    let t = |code: i32, more: &[&str], expected: &str| {
        let before = entries(here);
        let error = crumple_fails(here, code, &adding(more));
        assert!(error.contains(expected), "expected {expected}, found:\n{error}");
        assert_eq!(entries(here), before);
    };
    #[rustfmt::skip]
    let cases = [
        (&["--speed", &v, "--mass", "24t"][..], "nose.csv: the file does not state what its speed is measured against: give --kind wall"),
        (&["--speed", &v, "--kind", "wall"][..], "nose.csv: the file does not state the mass of the body: give --mass"),
        (&WALL, "nose.csv: the file does not state its speed: give --speed, such as --speed 36km/h"),
        (&["--speed", "36"][..], "speed \"36\" has no unit"),
    ];
    cases.into_iter().for_each(|(more, expected)| t(2, more, expected));
    let with = |more: &[&'static str]| -> Vec<String> {
        WALL.iter()
            .chain(&["--speed"])
            .map(std::string::ToString::to_string)
            .chain([v.clone()])
            .chain(more.iter().map(std::string::ToString::to_string))
            .collect()
    };
    let t_with = |code: i32, more: &[&'static str], expected: &str| {
        let with = with(more);
        t(code, &with.iter().map(String::as_str).collect::<Vec<_>>(), expected);
    };
    #[rustfmt::skip]
    let cases = [
        (2, &["other.csv"][..], "--speed is given 1 time for 2 files: give it once for each file, in the same order"),
        (2, &["--case", "a", "--case", "b"][..], "--case is given 2 times for 1 file"),
        (2, &["--other-mass", "3t"][..], "a wall has no mass: remove --other-mass"),
        (1, &["--case", "a/b"][..], "\"a/b\" cannot be the name of a case: it may not contain"),
        (2, &["--from", "xyz"][..], "there is no format \"xyz\" of curves that can be read: use one of mat, mdf, json, lsdyna"),
    ];
    cases.into_iter().for_each(|(code, more, expected)| t_with(code, more, expected));
    #[rustfmt::skip]
    let cases = [
        (&["--kind", "wall", "--mass", "240t", "--speed", &v][..], "nose.csv: the curve absorbs 0.1000 times the kinetic energy of 240.0 t"),
        (&["--kind", "wall", "--mass", "24t", "--speed", &v, "--unloading", "1MN/m"][..], "is softer than the line from the maximum deflection"),
        (&["--kind", "wall", "--mass", "24t", "--speed", &v, "--unloading", "8kN/m"][..], "check the units of the table and of the stiffness"),
    ];
    cases.into_iter().for_each(|(more, expected)| t(1, more, expected));
    // The second file is missing: the first is not written either.
    #[rustfmt::skip]
    let cases = [
        (&["missing.csv", "--kind", "wall", "--mass", "24t", "--speed", &v, "--speed", &v][..], "missing.csv: No such file"),
        (&[".", "--kind", "wall", "--mass", "24t", "--speed", &v, "--speed", &v][..], ".: this is a folder: give a file"),
    ];
    cases.into_iter().for_each(|(more, expected)| t(1, more, expected));
    crumple_ok(
        here,
        &with(&[]).iter().map(String::as_str).fold(adding(&[]), |mut a, s| {
            a.push(s);
            a
        }),
    );
    #[rustfmt::skip]
    let cases = [
        (&[][..], "group \"tests\" has a case \"nose\" already: replace it with --replace, or give another name with --case"),
        (&["--force", "body", "--case", "b"][..], "this curve has a body force, the cases of group \"tests\" have a contact one"),
    ];
    cases.into_iter().for_each(|(more, expected)| t_with(1, more, expected));
    t(
        1,
        &["--kind", "closing", "--mass", "24t", "--speed", &v, "--case", "b", "--accept-energy"],
        "this curve has a closing speed",
    );
    crumple_ok(
        here,
        &with(&["--replace"]).iter().map(String::as_str).fold(adding(&[]), |mut a, s| {
            a.push(s);
            a
        }),
    );
    // The kind is the group's where nothing else says it.
    let added = crumple_ok(here, &adding(&["--speed", &v, "--mass", "24t", "--case", "b"]));
    says(&added, "speed: wall as in the group");
    // A database that is none stays as it is.
    fs::write(here.join("c.h5"), "hello\n").unwrap();
    t_with(1, &[], "c.h5: ");
    assert_eq!(fs::read(here.join("c.h5")).unwrap(), b"hello\n");
}

/// A record with times keeps its motion: a mass on a spring, and what was before contact.
#[test]
fn a_record_over_time_is_extracted_as_one_of_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (m, v, k): (f64, f64, f64) = (24e3, 10.0, 40e6);
    let omega = (k / m).sqrt();
    let mut text = "time [ms];displacement [mm];force [kN]\n".to_string();
    for i in -100..=1_500 {
        let t = f64::from(i) * 1e-4;
        let half = std::f64::consts::PI / omega;
        let d = match t {
            t if t < 0.0 => v * t,
            t if t < half => v / omega * (omega * t).sin(),
            t => -v * (t - half),
        };
        // Displacement counts from where the record begins, compression is negative.
        let f = if (0.0..half).contains(&t) { -k * d } else { 0.0 };
        text += &format!("{};{};{}\n", t * 1e3, (d + 0.1) * 1e3, f * 1e-3).replace('.', ",");
    }
    fs::write(here.join("nose.csv"), &text).unwrap();
    let added = crumple_ok(here, &adding(&["--speed", "10m/s", "--kind", "wall", "--mass", "24t"]));
    says(&added, "motion: from the file's times");
    says(&added, "force: sign flipped, positive in compression");
    let case = &cases(here, "tests")[0];
    let crush = case["max_deflection_m"].as_f64().unwrap();
    // Contact is where the force has risen to 0.5 % of its largest, as in FE records.
    assert!((crush / (v / omega) - 1.0).abs() < 6e-3, "{crush}");
    assert!((case["work_over_energy"].as_f64().unwrap() - 1.0).abs() < 6e-3);
    assert!(case["contact_time_s"].as_f64().unwrap().abs() < 2e-4);
    assert!(!added.contains("there is no state between"), "{added}");
    // A hole in time is drawn across, and that is said.
    let kept = |line: &(usize, &str)| !(1_200..1_230).contains(&line.0);
    let lines: Vec<&str> = text.lines().enumerate().filter(kept).map(|(_, line)| line).collect();
    fs::write(here.join("nose.csv"), lines.join("\n") + "\n").unwrap();
    let output = crumple_in(
        here,
        &*adding(&["--speed", "10m/s", "--kind", "wall", "--mass", "24t", "--case", "hole"]),
    );
    says(
        &String::from_utf8_lossy(&output.stderr),
        "warning: hole: time: there is no state between time 0.1098",
    );
    // Through another unit system, the likely cause is found as in a build.
    let error = crumple_fails(
        here,
        1,
        &adding(&["--speed", "10m/s", "--kind", "wall", "--mass", "24kg", "--case", "b"]),
    );
    says(&error, "such an impact is impossible");
    says(&error, "--accept-energy");
    // Noise and a wrong value make no other speed: the energy is impossible.
    let mut noisy: Vec<String> = text.lines().map(String::from).collect();
    for (i, line) in noisy.iter_mut().enumerate().skip(1) {
        let fields: Vec<f64> =
            line.split(';').map(|f| f.replace(',', ".").parse().unwrap()).collect();
        let shake = 0.15 * (1e3 * i as f64).sin() + if i == 150 { 3.0 } else { 0.0 };
        *line =
            format!("{};{};{}", fields[0], fields[1] + shake, 2.0 * fields[2]).replace('.', ",");
    }
    fs::write(here.join("nose.csv"), noisy.join("\n")).unwrap();
    let right = ["--speed", "10m/s", "--kind", "wall", "--mass", "24t", "--case", "e"];
    let error = crumple_fails(here, 1, &adding(&right));
    assert!(!error.contains("another unit") && error.contains("impossible"), "{error}");
    fs::write(here.join("nose.csv"), &text).unwrap();
    // Another speed with as much energy.
    let other = ["--speed", "11m/s", "--kind", "wall", "--mass", "19.83t", "--case", "d"];
    let output = crumple_in(here, &*adding(&other));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    says(&said, "speed: its deflection starts at 9.9998 m/s");
    says(&said, "but 11.0000 m/s is stated");
    // Times in ms under a header of s.
    fs::write(here.join("nose.csv"), text.replace("[ms]", "[s]")).unwrap();
    let asked = ["--speed", "10m/s", "--kind", "wall", "--mass", "24t", "--case", "b"];
    let error = crumple_fails(here, 1, &adding(&asked));
    says(&error, "grows by 0.0100 m/s at most, but 10.0000 m/s is stated");
    says(&error, "the times are in another unit");
}

/// A load cell shows a force long before the impact, as an offset or as noise: that is not contact. Two bases of time are not none.
#[test]
fn a_sensor_before_the_impact_is_not_in_contact() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (m, v, k): (f64, f64, f64) = (24e3, 10.0, 10e6);
    let omega = (k / m).sqrt();
    let table = |header: &str, from: i32, sensor: &dyn Fn(i32) -> f64, digits: usize| {
        let mut text = format!("{header}\n");
        for i in from..=1_200 {
            let t = f64::from(i) * 1e-4;
            let d = if t < 0.0 { v * t } else { v / omega * (omega * t).sin() };
            let f = if t < 0.0 { 0.0 } else { (k * d).max(0.0) } + sensor(i);
            text += &format!("{t:.digits$},{d},{f}\n");
        }
        fs::write(here.join("nose.csv"), text).unwrap();
        let _ = fs::remove_file(here.join("c.h5"));
        let how = ["--speed", "10m/s", "--kind", "wall", "--mass", "24t"];
        String::from_utf8(crumple_in(here, &adding(&how)).stderr).unwrap()
    };
    let crush_m = || cases(here, "tests")[0]["max_deflection_m"].as_f64().unwrap();
    const HEADER: &str = "t_s,d_m,force_N";
    let exact_m = v / omega;
    let offset = |_: i32| 40e3;
    let noise = |i: i32| 60e3 * (f64::from(i) * 12.9898).sin() * (f64::from(i) * 78.233).cos();
    let sensors: [(&str, &dyn Fn(i32) -> f64); 2] = [("offset", &offset), ("noise", &noise)];
    for (name, sensor) in sensors {
        let said = table(HEADER, -1_000, sensor, 4);
        says(&said, "contact: there is a force before time 0, the offset or noise of a sensor");
        says(&said, "or set \"# contact_time_s: …\" above the header");
        assert!((crush_m() / exact_m - 1.0).abs() < 0.03, "{name}: {} for {exact_m}", crush_m());
    }
    let said = table("# contact_time_s: 0\nt_s,d_m,force_N", -1_000, &offset, 4);
    assert!(!said.contains("before time 0") && (crush_m() / exact_m - 1.0).abs() < 0.005, "{said}");
    let said = table(HEADER, -1_000, &|_| 0.0, 4);
    assert!(!said.contains("warning: nose: contact: there"), "{said}");
    // A coupler that is touched before a late trigger is not noise.
    let coupler = |i: i32| if i > -700 { 60e3 } else { 0.0 };
    let said = table(HEADER, -1_000, &coupler, 4);
    assert!(!said.contains("offset or noise"), "{said}");
    // A record that was triggered late, and one whose times have lost their digits.
    let said = table(HEADER, 150, &|_| 0.0, 4);
    says(&said, "the record begins with ");
    says(
        &said,
        "% of its peak force, and the body is slower than stated: the crush before it is missing",
    );
    let said = table(HEADER, -1_000, &|_| 0.0, 3);
    says(&said, "states left out because time did not increase: do its times have too few digits?");
    for header in [
        "t_d [s],d_m,t_F [s],force_N",
        "Time Disp [s],d_m,Time Force [s],force_N",
        "Time [s],d_m,Time2 [s],force_N",
    ] {
        fs::write(
            here.join("nose.csv"),
            format!("{header}\n0,0,0,0\n0.1,0.1,0.2,2e6\n0.2,0.15,0.3,3e6\n"),
        )
        .unwrap();
        let how = ["--speed", "10m/s", "--kind", "wall", "--mass", "24t"];
        let error = crumple_fails(here, 1, &adding(&how));
        says(
            &error,
            "nose.csv: line 1: expected one column of times, such as t_s or t_ms, found \"",
        );
        says(&error, "choose it with --time-column, or none");
        let error = crumple_fails(here, 1, &adding(&[&how[..], &["--time-column", "1"]].concat()));
        says(&error, "the curve has 3 points");
    }
}

/// Exports of a case over time say when contact begins: a body force, which rises late, and an offset come back as they are.
#[test]
fn the_contact_of_an_exported_case_comes_back() {
    let folder = here();
    let here = folder.path();
    let run = fixture("fe/lead-car-wall/36kmh");
    for (name, force, offset) in [
        (
            "body",
            "{ file = \"nodout\", node = 900001, component = \"x_velocity\", times = \"mass\" }",
            "",
        ),
        (
            "offset",
            "{ file = \"rwforc\", id = 1, component = \"normal_force\" }",
            "offset = \"20mm\"\n",
        ),
    ] {
        let study = format!(
            "[study]\nname = \"{name}\"\nunits = \"mm-t-s\"\ngroup = \"{name}\"\nkind = \"wall\"\n[recipe]\n\
             deflection = {{ file = \"nodout\", node = 900001, component = \"x_displacement\" }}\nforce = {force}\n\
             filter = \"none\"\nsampling = {{ states = 400, interval_ms = 0.75 }}\n\
             [[run]]\npath = {run:?}\nname = \"36kmh\"\nspeed = \"36km/h\"\nmass = \"24t\"\ncontact_time = \"0ms\"\n{offset}"
        );
        fs::write(here.join("study.toml"), study).unwrap();
        crumple_ok(here, &format!("build study.toml -o {name}.h5 -q"));
        let curve = |database: &str| -> (f64, Value) {
            let shown = json(&crumple_ok(here, &format!("db show {database} --json -q")));
            let group = shown["groups"].as_object().unwrap().values().next().unwrap()[0].clone();
            let crush = group["max_deflection_m"].as_f64().unwrap();
            (crush, group["force_kind"].clone())
        };
        let (crush_m, kind) = curve(&format!("{name}.h5"));
        for ending in ["mf4", "mme"] {
            crumple_ok(here, &format!("export {name}.h5 --case 36kmh -o {name}.{ending} -q"));
            crumple_ok(here, &format!("db add {name}-{ending}.h5 {name}.{ending} --group g -q"));
            let (found_m, found_kind) = curve(&format!("{name}-{ending}.h5"));
            assert!((found_m - crush_m).abs() < 1e-6, "{name}, {ending}: {found_m}, not {crush_m}");
            assert_eq!(found_kind, kind, "{name}, {ending}");
        }
    }
}

/// A contact that a file states within its record is where the deflection counts from, whatever its sign and origin.
#[test]
fn a_stated_contact_within_a_record_counts_no_way_before_it() {
    let folder = here();
    let here = folder.path();
    let (m, v, k): (f64, f64, f64) = (24e3, 10.0, 40e6);
    let omega = (k / m).sqrt();
    for sign in [1.0, -1.0] {
        let mut text = "# contact_time_s: 0.01\ntime [s],displacement [m],force [N]\n".to_string();
        for i in 0..=1_200 {
            let t = f64::from(i) * 1e-4;
            let (since, half) = (t - 0.01, std::f64::consts::PI / omega);
            let (d, f) = match since {
                s if s < 0.0 => (v * s, 0.0),
                s if s < half => (v / omega * (omega * s).sin(), m * v * omega * (omega * s).sin()),
                s => (-v * (s - half), 0.0),
            };
            text += &format!("{t},{},{f}\n", sign * (d + 0.1));
        }
        fs::write(here.join("r.csv"), text).unwrap();
        crumple_ok(
            here,
            "db add c.h5 r.csv --group g --replace --speed 10m/s --kind wall --mass 24t -q",
        );
        let shown = json(&crumple_ok(here, "db show c.h5 --json -q"));
        let crush = shown["groups"]["g"][0]["max_deflection_m"].as_f64().unwrap();
        assert!((crush / (v / omega) - 1.0).abs() < 1e-3, "{sign}: {crush}");
    }
}

/// A specimen a hundredth as long is hit in a hundredth of the time: at the same speed it is crushed a hundredth as far.
#[test]
fn a_short_crush_is_sampled_as_finely_as_a_long_one() {
    /// The crush at a training speed and between two, and what is said on the way.
    fn crushes_m(scale: f64) -> (f64, f64, String) {
        let folder = here();
        let step_s = 1e-5 * scale;
        let speeds = [5.0, 8.0, 11.0, 15.0];
        for v0 in speeds {
            let (mut d, mut v, mut most_m, mut top) = (0.0, v0, 0.0_f64, 0.0);
            let mut text = "time [s],displacement [m],force [N]\n".to_string();
            for i in 0..20_000 {
                let x: f64 = d / scale;
                let standing = (x / 0.02).clamp(0.0, 1.0) * (1.0 + 0.25 * (40.0 * x).sin());
                // Per unit of mass: loading with rate, and a straight way back.
                let per_mass = if d >= most_m {
                    (most_m, top) = (d, 80.0 / scale * standing * (1.0 + 0.04 * v));
                    top
                } else {
                    (top - 4e3 / scale.powi(2) * (most_m - d)).max(0.0)
                };
                if i % 10 == 0 {
                    let t = f64::from(i) * step_s;
                    text += &format!("{t:.9e},{d:.9e},{:.9e}\n", 24e3 * per_mass);
                }
                v -= per_mass * step_s;
                d += v * step_s;
            }
            fs::write(folder.path().join(format!("{v0}.csv")), text).unwrap();
        }
        let files = speeds.map(|v| format!("{v}.csv")).join(" ");
        let stated = speeds.map(|v| format!("{v}m/s")).join(",");
        let said = crumple_ok(
            folder.path(),
            &format!("db add c.h5 {files} --group g --kind wall --mass 24t --speed {stated}"),
        );
        crumple_ok(folder.path(), "train c.h5 --model rate -o c.model -q");
        let crush_m = |speed: &str| {
            let line = format!("predict c.model --speed {speed} --json -q");
            json(&crumple_ok(folder.path(), &line))["max_deflection_m"].as_f64().unwrap()
        };
        (crush_m("11m/s"), crush_m("13m/s"), said)
    }
    let (long, between, _) = crushes_m(1.0);
    let (short, short_between, said) = crushes_m(0.01);
    let off = |short: f64, long: f64| (100.0 * short / long - 1.0).abs();
    assert!(off(short, long) < 0.01, "{short} {long}");
    assert!(off(short_between, between) < 0.02, "{short_between} {between}");
    says(&said, "sampling: one state every 0.01 ms, as the crush is short");
}

/// Predicted curves of a model, written as JSON and CSV and added again, make a group on which
/// models train; a build into the same database keeps it.
#[test]
fn predicted_curves_come_back_as_a_group_that_trains() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::rename(build_fixture(here, "lead-car-wall"), here.join("c.h5")).unwrap();
    let train = |group: &str, model: &str| {
        crumple_ok(here, &["train", "c.h5", "--group", group, "--model", "linear", "-o", model]);
    };
    train("lead-car-wall", "a.model");
    let speeds = ["25", "36", "45", "54", "63"];
    for speed in speeds {
        let kmh = format!("{speed}km/h");
        let (json, csv) = (format!("{speed}.json"), format!("{speed}.csv"));
        crumple_ok(here, &["predict", "a.model", "--speed", &kmh, "-o", &json, "-o", &csv]);
    }
    for (format, group) in [("json", "again"), ("csv", "body")] {
        let files = speeds.map(|speed| format!("{speed}.{format}"));
        let mut arguments = vec!["db", "add", "c.h5", "--group", group, "--json"];
        arguments.extend(files.iter().map(String::as_str));
        let output = crumple_in(here, &arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{error}");
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        for case in report["cases"].as_array().unwrap() {
            // The model's own balance is not exact.
            let balance = case["work_over_energy"].as_f64().unwrap();
            assert!((0.9..1.1).contains(&balance), "{case}");
            assert_eq!(case["mass_kg"], 24e3);
            assert_eq!(case["force_kind"], if group == "body" { "body" } else { "contact" });
        }
    }
    // The whole way back: the curve of a middle speed, left out of nothing, is the first model's.
    train("again", "b.model");
    for model in ["a", "b"] {
        let (model, out) = (format!("{model}.model"), format!("{model}50.json"));
        crumple_ok(here, &["predict", &model, "--speed", "45km/h", "-o", &out]);
    }
    let of = |name: &str| -> Value { read_json(&here.join(name)) };
    let (first, second) = (of("a50.json"), of("b50.json"));
    for key in ["max_deflection_m", "energy_J"] {
        let (a, b) = (first[key].as_f64().unwrap(), second[key].as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 0.02, "{key}: {a} and {b}");
    }
    let rebound = |curve: &Value| curve["rebound"]["speed_m_per_s"].as_f64().unwrap();
    assert!(
        (rebound(&first) / rebound(&second) - 1.0).abs() < 0.1,
        "{} {}",
        rebound(&first),
        rebound(&second)
    );
    let report = crumple_ok(here, "validate c.h5 --group again --json");
    let report: Value = serde_json::from_str(&report).unwrap();
    assert!(report["groups"][0]["rows"].as_array().unwrap().len() > 3);
    // A build leaves them, in other groups and in its own.
    let nose = format!("d_m,force_N\n{}", rows(1.0, 1.0, ",", "."));
    fs::write(here.join("nose.csv"), nose).unwrap();
    let v = format!("{}m/s", speed());
    crumple_ok(here, &format!("db add c.h5 nose.csv --group lead-car-wall --speed {v} --mass 24t"));
    let study = crate::common::fixture("fe/lead-car-wall/study.toml");
    crumple_ok(here, &["build", study.to_str().unwrap(), "-o", "c.h5"]);
    assert_eq!(cases(here, "lead-car-wall").len(), 8);
    assert_eq!(cases(here, "again").len(), 5);
    train("lead-car-wall", "mixed.model");
    let error = crumple_fails(
        here,
        1,
        &format!(
            "db add c.h5 nose.csv --group lead-car-wall --speed {v} --mass 24t --case 36kmh --replace"
        ),
    );
    says(
        &error,
        "case \"36kmh\" of group \"lead-car-wall\" belongs to the study \"lead car to rigid wall\", which builds it",
    );
}

/// What crumple export writes comes back: the loading branch without the points that other tools
/// need, with what the header says of it.
#[test]
fn exported_curves_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    let group = ["--group", "lead-car-wall"];
    crumple_ok(
        here,
        &[&["train", "curves.h5", "--model", "linear", "-o", "a.model"], &group[..]].concat(),
    );
    let files = ["a.json", "a.csv", "a.k", "a.txt", "a.mat", "a.rad"];
    let outputs = files.iter().flat_map(|file| ["-o", file]);
    let predict = ["predict", "a.model", "--speed", "50km/h"].into_iter().chain(outputs);
    crumple_ok(here, &predict.collect::<Vec<_>>());
    let body = ReadOptions { force: Some(crumple::curve::ForceKind::Body), ..given(None) };
    let (expected, _) = read(&here.join("a.json"), &body).unwrap();
    for file in &files[1..] {
        let (curve, format) = read(&here.join(file), &given(None)).unwrap();
        assert_eq!(
            curve.deflection_m.len(),
            expected.deflection_m.len(),
            "{file}: {:?}",
            curve.notes
        );
        let close =
            |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-8 * b.abs());
        assert!(close(&curve.deflection_m, &expected.deflection_m), "{file}");
        assert!(close(&curve.force_n, &expected.force_n), "{file}");
        let (facts, expected) = (curve.facts, expected.facts);
        assert_eq!(facts.force, expected.force, "{file}: {format}");
        assert_eq!(facts.speed_kind, expected.speed_kind);
        assert_eq!(facts.mass_kg, expected.mass_kg);
        assert_eq!(facts.speed_m_per_s, expected.speed_m_per_s);
        let stiffness = facts.unloading_stiffness_n_per_m.unwrap();
        assert!((stiffness / expected.unloading_stiffness_n_per_m.unwrap() - 1.0).abs() < 1e-8);
        assert!(
            curve.notes.iter().any(|n| n.contains("beyond the maximum crush of")),
            "{file}: {:?}",
            curve.notes
        );
    }
    // The same case by each way.
    let files = ["a.csv", "a.k", "a.txt", "a.mat", "a.rad"];
    let names = ["csv", "k", "txt", "mat", "rad"].map(|name| ["--case", name]).concat();
    crumple_ok(here, &[&["db", "add", "c.h5", "--group", "all"], &files[..], &names].concat());
    let crushes: Vec<f64> =
        cases(here, "all").iter().map(|c| c["max_deflection_m"].as_f64().unwrap()).collect();
    assert!(crushes.iter().all(|c| (c / crushes[0] - 1.0).abs() < 1e-8), "{crushes:?}");
    // Histories of a recorded case.
    let export = ["export", "curves.h5", "--case", "36kmh", "--to", "iso-mme", "-o", "test"];
    crumple_ok(here, &[&export[..], &group].concat());
    crumple_ok(here, "db add c.h5 test --group mme --kind wall");
    let recorded = &cases(here, "mme")[0];
    let shown = crumple_ok(
        here,
        &[&["db", "show", "curves.h5", "--case", "36kmh", "--json"], &group[..]].concat(),
    );
    let shown: Value = serde_json::from_str(&shown).unwrap();
    let first = &shown["groups"]["lead-car-wall"][0];
    for key in ["max_deflection_m", "work_J", "speed_m_per_s", "mass_kg"] {
        let (a, b) = (recorded[key].as_f64().unwrap(), first[key].as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 2e-3, "{key}: {a} and {b}");
    }
}

#[test]
fn no_study_takes_the_name_of_what_was_added() {
    let study = fs::read_to_string(crate::common::fixture("fe/lead-car-wall/study.toml")).unwrap();
    let name = study.lines().find(|l| l.starts_with("name")).unwrap();
    let study = study.replace(name, "name = \"imported\"");
    let error = crumple::study::parse(Path::new("study.toml"), &study).unwrap_err().to_string();
    says(&error, "is the name of the curves that crumple db add takes");
}

/// Reads bytes as every format, by name and by content.
fn read_as_all(folder: &Path, bytes: &[u8]) {
    for name in ["a.csv", "a.mme", "a.001"] {
        fs::write(folder.join(name), bytes).unwrap();
    }
    for units in [None, Some("mm-t-s")] {
        let _ = read(&folder.join("a.csv"), &given(units));
        for format in readers() {
            let options = ReadOptions { format: Some(format.into()), ..given(units) };
            let _ = read(&folder.join("a.001"), &options);
        }
    }
    let _ = read(&folder.join("a.mme"), &given(None));
}

/// Good files of every format, to be damaged.
fn good() -> Vec<Vec<u8>> {
    let card = "       101         0       1.0       1.0       0.0       0.0         0         0";
    vec![
        format!(
            "# mass_kg: 24000\ntime [ms];d_mm;force_kN\n0;{}",
            rows(1e-3, 1e3, ";", ",").replace('\n', "\n1;")
        )
        .into_bytes(),
        deck("x", card, &fields(1.0, 1.0)).into_bytes(),
        format!("#1\ndouble fd_load(5,2)  # d [m], F [N]\n{}", rows(1.0, 1.0, " ", "."))
            .into_bytes(),
        [matrix("fd_load", 5, 2, &columns(), false), matrix("k_u", 1, 1, &[8e7], false)].concat(),
        channel("11FRONT00000FOXP", "kN", &[0.0, 1.0, 2.0, 3.0, 0.0]).into_bytes(),
        format!("t\nx (m)\ny (N)\nl\n{}CONTINUE\n", rows(1.0, 1.0, " ", ".")).into_bytes(),
        format!("Test 12\n\nNo Weg [mm] Kraft [kN]\n{}", rows(1.0, 1.0, " ", ",")).into_bytes(),
        format!("Test;ü\nt;Weg;Kraft\ns;mm;kN\n{}", rows(1.0, 1.0, ";", ",").replace('\n', "\n0;"))
            .encode_utf16()
            .flat_map(u16::to_le_bytes)
            .collect(),
        format!(
            "/BEGIN\na\nb\n{:>20}{:>20}{:>20}\n/FUNCT/1\nt\n{}/END\n",
            "Mg",
            "mm",
            "s",
            fields(1.0, 1.0)
        )
        .into_bytes(),
        b"// mass_kg: 24000\npackage a\n  constant Real d[4] = {\n 0, 1,\n 2, 3} \"m\";\n  constant Real f[4] = {0, 5, 4, 5};\nend a;\n".into(),
        channel("11FRONT00000DSXP", "mm", &[0.0, 5.0, 10.0, 15.0, 12.0])
            .replace(":implicit", ":explicit\nReference channel name :11FRONT00000TI00")
            .into_bytes(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn any_bytes_give_a_curve_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
        let folder = tempfile::tempdir().unwrap();
        read_as_all(folder.path(), &bytes);
    }

    #[test]
    fn damaged_files_give_a_curve_or_an_error(
        which in any::<prop::sample::Index>(),
        flips in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..12),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let good = good();
        let mut bytes = good[which.index(good.len())].clone();
        for (at, byte) in flips {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let folder = tempfile::tempdir().unwrap();
        read_as_all(folder.path(), &bytes);
    }

    /// Any table of positive forces gives a case or an error, in bounded time.
    #[test]
    fn any_table_gives_a_case_or_an_error(
        points in proptest::collection::vec((1e-6f64..1.0, 0.0f64..1e7), 3..40),
        v in 0.01f64..300.0,
        unloading in proptest::option::of(1e3f64..1e12),
    ) {
        use crumple::curve::{Impact, Table, from_table};
        let mut d = 0.0;
        let (mut deflection_m, mut force_n) = (vec![0.0], vec![0.0]);
        for (step, force) in points {
            d += step;
            deflection_m.push(d);
            force_n.push(force);
        }
        let table = Table { deflection_m: &deflection_m, force_n: &force_n, time_s: None, body_force_n: None };
        let impact = Impact {
            force_kind: crumple::curve::ForceKind::Contact,
            speed: crumple::unit::Speed { m_per_s: v, kind: crumple::unit::SpeedKind::Wall },
            masses: crumple::curve::Masses { body_kg: 24e3, other_kg: None },
            unloading_stiffness_n_per_m: unloading,
            body_unloading_stiffness_n_per_m: None,
            contact_time_s: None,
            units: UnitSystem::parse("SI").unwrap(),
            accept_energy: true,
        };
        if let Ok((curves, _)) = from_table(&table, &impact) {
            let states = curves.original.time_s().len();
            prop_assert!(states < 500_000, "{states} states");
            for d in &deflection_m {
                prop_assert!(curves.original.deflection_m().contains(d));
            }
        }
    }
}

/// A channel of the crush rests before contact, though the bodies close: its speed is not differentiated across that kink.
#[test]
fn a_crush_that_rests_before_contact_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    // A spring of 9.6 MN/m stops 24 t from 10 m/s: ω = 20 /s.
    let state = |ms: i32| {
        let t = 1e-3 * f64::from(ms.max(0));
        let d = 0.5 * (20.0 * t).sin().max(0.0);
        format!("{ms},{},{}\n", 1e3 * d, 9.6e3 * d)
    };
    let record = |from: i32| {
        let rows: String = (from..200).map(state).collect();
        format!("time [ms],deflection [mm],force [kN]\n{rows}")
    };
    for (name, from) in [("plain", 0), ("rests", -20)] {
        fs::write(folder.path().join(format!("{name}.csv")), record(from)).unwrap();
        crumple_ok(
            folder.path(),
            &format!("db add a.h5 {name}.csv --group {name} --speed 36km/h --mass 24t --kind wall"),
        );
        let database = crumple::database::Database::read(&folder.path().join("a.h5")).unwrap();
        let case = &database.cases(name)[0];
        let v = case.curves.closing_speed_m_per_s[0];
        assert!((v - 10.0).abs() < 0.05, "{name}: {v} m/s");
        let crush_m = case.curves.original.deflection_m().iter().copied().fold(0.0, f64::max);
        assert!((crush_m - 0.5).abs() < 0.012, "{name}: {crush_m} m");
    }
}
