//! Curve files as instruments and other programs write them: titles, odd headers, encodings, jumps of the force, decks; each
//! beside a file of the kind that is wrong.

use std::fs;
use std::path::Path;

use crumple::formats::{ReadOptions, read};
use serde_json::Value;

use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok, demo_folder, json, read_json, says,
};
use crate::import::{POINTS, channel, given, is_points, read_bytes, rows, speed};

/// The curve of a file of that name, which is a table; its notes.
fn table(name: &str, bytes: &[u8], options: &ReadOptions) -> Vec<String> {
    let (curve, format) =
        read_bytes(name, bytes, options).unwrap_or_else(|e| panic!("{}: {e}", text(bytes)));
    assert_eq!(format, "csv", "{}", text(bytes));
    is_points(&curve, &text(bytes));
    curve.notes
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What is reported where a file is refused.
fn refused(name: &str, bytes: &[u8], options: &ReadOptions) -> String {
    match read_bytes(name, bytes, options) {
        Ok((curve, format)) => panic!("{format} took {}: {curve:?}", text(bytes)),
        Err(error) => error,
    }
}

fn has(notes: &[String], part: &str) {
    assert!(notes.iter().any(|note| note.contains(part)), "{part}: {notes:?}");
}

#[test]
fn titles_above_the_header_are_skipped() {
    let mm = |separator, decimal| rows(1e-3, 1e3, separator, decimal);
    let head = "Presse 4, Werk 2\nDatum: 12.03.2024\nSpecimen: 12\n\n";
    let note = "titles: lines 1 to 3 are titles, not part of the table: \"Presse 4, Werk 2\", \"Datum: 12.03.2024\", \"Specimen: 12\"";
    for table_text in [
        format!("Weg;Kraft\n[mm];[kN]\n{}", mm(";", ",")),
        format!("Weg;Kraft\n(mm);(kN)\n\n{}", mm(";", ".")),
        format!("displacement,force\nmm,kN\n{}", mm(",", ".")),
        format!("Weg [mm]\tKraft [kN]\n{}", mm("\t", ",")),
        format!("Displacement [mm]  Force [kN]\n{}", mm("   ", ".")),
    ] {
        let text = format!("{head}{table_text}");
        for (name, text) in [("a.csv", text.clone()), ("a.txt", text.replace('\n', "\r\n"))] {
            has(&table(name, text.as_bytes(), &given(None)), note);
        }
    }
    // Titles that have as many fields as the table; rows of separators as spreadsheets write them.
    let text = format!("Test;12\nForce;curve\n;;\nZyklus;Weg;Kraft\n;mm;kN\n{}", {
        mm(";", ",").lines().map(|line| format!("1;{line}\n")).collect::<String>()
    });
    let notes = table("a.csv", format!("{text};;\n;;\n").as_bytes(), &given(None));
    has(&notes, "titles: lines 1 to 2");
    has(&notes, "columns: deflection of \"Weg\" in mm, force of \"Kraft\" in kN");
    // Comments still say what they say.
    let text = format!("Test 12\n# mass_kg: 24000\nWeg;Kraft\nmm;kN\n{}", mm(";", "."));
    let (curve, _) = read_bytes("a.csv", text.as_bytes(), &given(None)).unwrap();
    assert_eq!((curve.facts.mass_kg, curve.title.as_deref()), (Some(24e3), Some("Test 12")));
    // Wrong: damage, units and headers are named with their lines.
    let wrong = |from: &str, to: &str, expected: &str| {
        let good = format!("{head}Weg;Kraft\n[mm];[kN]\n{}", mm(";", ","));
        assert!(good.contains(from));
        let error = refused("a.csv", good.replacen(from, to, 1).as_bytes(), &given(None));
        assert!(error.contains(expected), "{expected}: {error}");
    };
    #[rustfmt::skip]
    let cases = [
        ("\n50;3000", "\n50;drei", "line 8, field 2: expected a number, found \"drei\""),
        ("\n0;0", "\n0;null", "line 7, field 2: expected a number, found \"null\""),
        ("[kN]", "[kgf]", "line 6: the unit \"kgf\" of the force is not known"),
        ("Weg;", "Weg [cm];", "line 6, field 1: expected the unit of the header, cm, found \"mm\""),
        ("Weg;Kraft", "Hub;Last", "line 5: expected a column deflection with its unit, such as d_m or d_mm, found \"Hub\", \"Last\"; or choose the column with --deflection-column"),
        ("\n[mm];[kN]", "", "line 5: the deflection has no unit (\"Weg\")"),
    ];
    cases.into_iter().for_each(|(from, to, expected)| wrong(from, to, expected));
}

#[test]
fn headers_of_instruments() {
    fn t(header: &str, separator: &str) {
        let text = format!("{header}\n{}", rows(1e-3, 1e3, separator, "."));
        table("a.csv", text.as_bytes(), &given(None));
    }
    t("Displacement (X) [mm],Y Force [kN]", ",");
    t("Displacement (X) [mm],\"Force, contact [kN]\"", ",");
    t("Displacement (X) [mm];Force, contact [kN]", ";");
    t("Weg / mm;Kraft / kN", ";");
    t("Weg in mm;Standardkraft in kN", ";");
    t("Compression mm,Load kN", ",");
    t("Traverse: Weg (mm)\tKraft F1 (kN)", "\t");
    t("Extension (mm),Load (kN)", ",");
    t("dist. travel [mm]  Fz [kN]", "  ");
    // Edges, bounds and rates are not a second force, and a whole name is better than a word within one.
    for other in
        ["Force max [kN]", "Force rate [kN/s]", "force_low_kN", "Force, filtered [kN]", "Kraft"]
    {
        let rows: String =
            rows(1e-3, 1e3, ";", ".").lines().map(|line| format!("{line};7\n")).collect();
        let text = format!("d [mm];Force [kN];{other}\n{rows}");
        let notes = table("a.csv", text.as_bytes(), &given(None));
        let is_said = notes.iter().any(|n| n == &format!("columns: not used: \"{other}\" (force)"));
        assert_eq!(is_said, ["Force, filtered [kN]", "Kraft"].contains(&other), "{notes:?}");
    }
}

/// Two columns that could be the force: one is chosen by its name or number.
#[test]
fn a_column_of_several_is_chosen() {
    let rows: String = rows(1e-3, 1e3, ";", ".").lines().map(|l| format!("0;{l};1\n")).collect();
    let text = format!("No;Displacement LVDT [mm];Force A [kN];Force B [kN]\n{rows}");
    let error = refused("a.csv", text.as_bytes(), &given(None));
    assert!(error.ends_with("line 1: several columns could be the force: \"Force A [kN]\", \"Force B [kN]\"; choose one with --force-column, by its name or number"), "{error}");
    let chosen = |force: &str| ReadOptions { force_column: Some(force.into()), ..given(None) };
    for force in ["Force A [kN]", "force a [kn]", "3"] {
        table("a.csv", text.as_bytes(), &chosen(force));
    }
    let error = refused("a.csv", text.as_bytes(), &chosen("Force C"));
    says(
        &error,
        "line 1: --force-column \"Force C\" is not a column: expected a number from 1, or one of \"No\", \"Displacement LVDT [mm]\"",
    );
    assert!(refused("a.csv", text.as_bytes(), &chosen("9")).contains("--force-column \"9\""));
    // Columns that no header names, and those of a table without one.
    let by = |deflection: &str, force: &str, units| ReadOptions {
        deflection_column: Some(deflection.into()),
        force_column: Some(force.into()),
        ..given(units)
    };
    let odd = format!("Title\nNo;Kanal 1 [mm];Kanal 2 [kN];Rest\n{rows}");
    table(
        "a.txt",
        odd.as_bytes(),
        &ReadOptions { format: Some("csv".into()), ..by("2", "3", None) },
    );
    table("a.csv", odd.as_bytes(), &by("Kanal 1 [mm]", "Kanal 2 [kN]", None));
    table("a.csv", rows.as_bytes(), &by("2", "3", Some("mm-kg-ms")));
    // Formats without columns.
    let deck = "*KEYWORD\n*DEFINE_CURVE\n1\n0,0\n1,2\n2,3\n3,4\n";
    let error = refused("a.k", deck.as_bytes(), &chosen("2"));
    assert!(error.ends_with("this is read as lsdyna, which has no columns to choose: remove --force-column, or read it as a table with --from csv"), "{error}");
}

#[test]
fn tables_with_blanks_and_tabs_under_any_name() {
    let si = rows(1.0, 1.0, "  ", ".");
    let three: String = si.lines().map(|line| format!("0.5 {line}\n")).collect();
    for name in ["a.csv", "a.txt", "a.dat"] {
        table(name, format!("x d_m force_N\n{three}").as_bytes(), &given(None));
        table(name, format!("x  d   force\n-  m   N\n{three}").as_bytes(), &given(None));
        table(name, format!("Nr [-] Weg [m] Kraft [N]\n{three}").as_bytes(), &given(None));
        table(
            name,
            format!("d_m\tforce_N\n{}", rows(1.0, 1.0, "\t", ",")).as_bytes(),
            &given(None),
        );
        table(name, rows(1.0, 1.0, "\t", ".").as_bytes(), &given(Some("SI")));
        table(name, rows(1.0, 1.0, " ", ",").as_bytes(), &given(Some("SI")));
        // Two plain columns, with a header, a comment for one, or none.
        for head in ["", "d_m force_N\n", "# d_m force_N\n", "# measured\n# d_m  force_N\n"] {
            let units = head.is_empty().then_some("SI");
            let text = format!("{head}{si}");
            let (curve, _) = read_bytes(name, text.as_bytes(), &given(units)).unwrap();
            is_points(&curve, &format!("{name} {head}"));
        }
        // A title of as many words is not a header; columns that are named otherwise can be chosen.
        let text = format!("Test 12\n{si}");
        is_points(&read_bytes(name, text.as_bytes(), &given(Some("SI"))).unwrap().0, &text);
        let odd = ReadOptions {
            format: Some("csv".into()),
            deflection_column: Some("1".into()),
            force_column: Some("2".into()),
            ..given(None)
        };
        table(name, format!("A [m] B [N]\n{si}").as_bytes(), &odd);
        let error = refused(name, si.as_bytes(), &given(None));
        assert!(error.contains("has no unit") && error.contains("--units"), "{error}");
        // The header's order counts, and a damaged first row is not a title.
        let swapped: String = POINTS.iter().map(|(d, f)| format!("{f} {d}\n")).collect();
        for head in ["load displacement\n", "load displacement\nN m\n"] {
            let text = format!("{head}{swapped}");
            is_points(&read_bytes(name, text.as_bytes(), &given(Some("SI"))).unwrap().0, &text);
        }
        let title = format!("Force (N) vs displacement (m)\n{si}");
        let error = refused(name, title.as_bytes(), &given(None));
        assert!(
            error.contains("line 1: expected a deflection") || error.contains("has no unit"),
            "{error}"
        );
        let text = format!("d_m force_N\n{}", si.replacen("0  0", "0  1O", 1));
        let error = refused(name, text.as_bytes(), &given(None));
        says(&error, "line 2, field 2: expected a number, found \"1O\"");
        let text = format!("36 km/h\n{si}");
        is_points(&read_bytes(name, text.as_bytes(), &given(Some("SI"))).unwrap().0, &text);
        let error = refused(name, si.replace("1000000", "x").as_bytes(), &given(Some("SI")));
        says(&error, "line 3, field 2: expected a number, found \"x\"");
    }
}

#[test]
fn texts_in_every_encoding() {
    let good = format!("Prüfkörper 4 µ°\nWeg;Kraft;Temperatur °C\nmm;kN;°C\n{}", {
        rows(1e-3, 1e3, ";", ",").lines().map(|line| format!("{line};20\n")).collect::<String>()
    });
    let pairs = |of: fn(u16) -> [u8; 2]| good.encode_utf16().flat_map(of).collect::<Vec<u8>>();
    let latin1: Vec<u8> = good.chars().map(|c| c as u8).collect();
    for (bytes, note) in [
        (good.clone().into_bytes(), None),
        ([b"\xEF\xBB\xBF", good.as_bytes()].concat(), None),
        ([vec![0xFF, 0xFE], pairs(u16::to_le_bytes)].concat(), Some("text: UTF-16, little-endian")),
        ([vec![0xFE, 0xFF], pairs(u16::to_be_bytes)].concat(), Some("text: UTF-16, big-endian")),
        (latin1, Some("text: Latin-1, because it is not UTF-8")),
    ] {
        for name in ["a.csv", "a.txt"] {
            let (curve, _) = read_bytes(name, &bytes, &given(None)).unwrap();
            is_points(&curve, &format!("{note:?}"));
            assert_eq!(curve.title.as_deref(), Some("Prüfkörper 4 µ°"));
            assert_eq!(curve.notes.iter().any(|n| Some(n.as_str()) == note), note.is_some());
        }
    }
    // Cut in the middle of a character, and in a unit.
    let cut = [vec![0xFF, 0xFE], pairs(u16::to_le_bytes)].concat();
    says(&refused("a.csv", &cut[..cut.len() - 25], &given(None)), "a.csv: line");
    let micro = "Zeit [µs];d_m;force_N\n0;0;0\n1;0.1;2\n2;0.2;3\n3;0.1;0\n";
    let bytes: Vec<u8> = micro.chars().map(|c| c as u8).collect();
    let (curve, _) = read_bytes("a.csv", &bytes, &given(None)).unwrap();
    assert_eq!(curve.time_s.unwrap(), [0.0, 1e-6, 2e-6, 3e-6]);
    let micro = "d [µm];force_N\n0;0\n1;2\n2;3\n3;4\n";
    let (curve, _) = read_bytes("a.csv", micro.as_bytes(), &given(None)).unwrap();
    assert_eq!(curve.deflection_m[..2], [0.0, 1e-6]);
}

/// CSV of LS-PrePost: a title, and a comma at each line's end. Curve files: `Curveplot`, `#pts=`, `endcurve`.
#[test]
fn curves_of_ls_prepost() {
    let mm = given(Some("mm-t-s"));
    let lines: String =
        rows(1e-3, 1.0, ",    ", ".").lines().map(|l| format!("   {l},\n")).collect();
    let csv = format!("Cross plot,Force vs displacement\nX-displacement,A1,\n{lines}");
    let notes = table("a.csv", csv.as_bytes(), &mm);
    has(&notes, "line 1 is a title");
    has(&notes, "force of \"A1\" in units mm-t-s as given");
    let refused_csv = |from: &str, to: &str, expected: &str| {
        assert!(csv.contains(from));
        let error = refused("a.csv", csv.replace(from, to).as_bytes(), &mm);
        assert!(error.contains(expected), "{expected}: {error}");
    };
    refused_csv(
        "Force vs",
        "A vs",
        "line 2: expected a column force with its unit, such as force_N or force_kN, found \"A1\"",
    );
    refused_csv("A1", "Force rate", "line 2: expected a column force");
    refused_csv("A1", "A1 [J]", "line 2: expected a column force");
    let three = csv.replace("A1,", "A1,B2,").replace(",\n ", ",1,\n ");
    let error = refused("a.csv", three.as_bytes(), &mm);
    says(&error, "several columns could be the force: \"A1\", \"B2\"");
    says(&refused("a.csv", csv.as_bytes(), &given(None)), "line 2: the deflection has no unit");

    let points = rows(1e-3, 1.0, "   ", ".");
    let one =
        |name: &str| format!("{name} #pts=5\n* Minval=  0.0 at time= 0.0\n{points}endcurve\n");
    let head = "Curveplot\nbox against a wall\nX-displacement\nX-force\n";
    let read = |text: &str, curve: Option<&str>| {
        let options = ReadOptions { curve: curve.map(Into::into), ..mm.clone() };
        let (curve, format) = read_bytes("a.crv", text.as_bytes(), &options)?;
        assert_eq!(format, "two-columns");
        is_points(&curve, text);
        Ok::<_, String>(curve)
    };
    let single = format!("{head}{}", one("A-1"));
    assert_eq!(read(&single, None).unwrap().title.as_deref(), Some("A-1"));
    let two = format!("{single}{}", one("B-2").replace("3000000", "3000001"));
    read(&two, Some("A-1")).unwrap();
    read(&two, Some("1")).unwrap();
    let wrong = |text: &str, curve: Option<&str>, expected: &str| {
        let error = read(text, curve).map(|_| ()).unwrap_err();
        assert!(error.contains(expected), "{expected}: {error}");
    };
    #[rustfmt::skip]
    let cases = [
        (&two, None, "choose one with --curve: 1 (\"A-1\"), 2 (\"B-2\")"),
        (&two, Some("C"), "the file has no curve \"C\": it has 1 (\"A-1\")"),
        (&two.replace("B-2", "A-1"), Some("A-1"), "the file has 2 curves \"A-1\""),
        (&single.replace("#pts=5", "#pts=6"), None, "line 5: the curve declares 6 points (#pts), but the file has 5 for it: write the file again: it may be truncated"),
        (&single.replace("1000   2000000\n", ""), None, "line 5: the curve declares 5 points (#pts), but the file has 4"),
        (&single.replace("50   3000000", "50   x"), None, "line 8, field 2: expected a number, found \"x\""),
        (&single.replace("X-force", "Time"), None, "line 4: expected a force in the second column, found \"Time\""),
    ];
    cases.into_iter().for_each(|(text, curve, expected)| wrong(text, curve, expected));
}

/// Labels of T/HIS that say the size of their unit in SI.
#[test]
fn factors_of_oasys_curves() {
    let text =
        |x: &str, y: &str| format!("Nose\n{x}\n{y}\nbox, 36 km/h\n{}", rows(1e-3, 1e3, ", ", "."));
    let (x, y) = ("Crush <LENGTH/0.001>;", "Contact force <FORCE/1000>;");
    let (curve, format) = read_bytes("a.cur", text(x, y).as_bytes(), &given(None)).unwrap();
    assert_eq!(format, "two-columns");
    is_points(&curve, "factors");
    has(&curve.notes, "columns: deflection of \"Crush <LENGTH/0.001>;\" in LENGTH/0.001");
    // They hold against what is given beside the file.
    let given_units = given(Some("SI"));
    is_points(&read_bytes("a.cur", text(x, y).as_bytes(), &given_units).unwrap().0, "given");
    let wrong = |x: &str, y: &str, expected: &str| {
        let error = refused("a.cur", text(x, y).as_bytes(), &given_units);
        assert!(error.contains(expected), "{expected}: {error}");
    };
    #[rustfmt::skip]
    let cases = [
        (y, x, "line 2: expected a deflection in the first column, found \"Contact force <FORCE/1000>;\": choose the columns with --deflection-column"),
        ("Crush <FORCE/1000>;", y, "line 2: the unit \"FORCE/1000\" of the deflection is not known"),
        ("Crush <LENGTH/mm>;", y, "line 2: the unit \"LENGTH/mm\" of the deflection is not known"),
        ("Velocity (m/s)", y, "line 2: the unit \"m/s\" of the deflection is not known"),
    ];
    cases.into_iter().for_each(|(x, y, expected)| wrong(x, y, expected));
    let chosen = |deflection: &str, force: &str| ReadOptions {
        deflection_column: Some(deflection.into()),
        force_column: Some(force.into()),
        ..given(None)
    };
    let swapped: String = rows(1e-3, 1e3, " ", ".")
        .lines()
        .map(|line| line.split_once(' ').map(|(d, f)| format!("{f} {d}\n")).unwrap())
        .collect();
    let swapped = format!("Nose\n{y}\n{x}\nbox\n{swapped}");
    is_points(&read_bytes("a.cur", swapped.as_bytes(), &chosen("2", "1")).unwrap().0, "swapped");
}

/// A row with more fields than the header has: a decimal comma between commas, or a column that nothing names.
#[test]
fn rows_with_more_fields_than_the_header_are_refused() {
    for text in ["d_m,force_N\n0,0\n0,5,1,5\n1,2\n2,3\n", "d_m,force_N\n0,0\n1,2\n2,3,7\n3,4\n"] {
        let line = 2 + text.lines().skip(1).position(|l| l.matches(',').count() > 1).unwrap();
        let error = refused("a.csv", text.as_bytes(), &given(None));
        says(
            &error,
            &format!("line {line}: expected 2 fields, one for each column of the table, found"),
        );
        let folder = file(text, "a.csv");
        for command in [&["plot", "a.csv", "-o", "a.svg"][..], &["rate", "a.csv", "a.csv"]] {
            let error = crumple_fails(folder.path(), 1, command);
            says(&error, &format!("line {line}: expected 2 fields"));
        }
    }
    let error = refused("a.txt", b"d_m  x  force_N\n0 1 0\n1 2\n2 1 3\n3 1 4\n", &given(None));
    says(&error, "line 3, field 3: expected a number, found \"\"");
    let error = refused("a.txt", b"d_m  force_N  x\n0 0 1\n1 2\n2 3 1\n3 4 1\n", &given(None));
    says(&error, "line 3: expected 3 fields");
    // Empty fields at the end are none.
    let text = format!("d_m,force_N\n{}", rows(1.0, 1.0, ",", ".").replace('\n', ",,\n"));
    table("a.csv", text.as_bytes(), &given(None));
}

/// A scenario says how what it cannot choose is chosen there; a picture chooses as `db add` does.
#[test]
fn curves_are_chosen_for_pictures_too() {
    let head = "Curveplot\nbox\nX-displacement\nX-force\n";
    let points = rows(1e-3, 1.0, " ", ".");
    let folder =
        file(&format!("{head}A #pts=5\n{points}endcurve\nB #pts=5\n{points}endcurve\n"), "a.crv");
    let here = folder.path();
    let plot = ["plot", "a.crv", "-o", "a.svg", "--units", "mm-t-s"];
    assert!(
        crumple_fails(here, 1, &plot).contains("choose one with --curve: 1 (\"A\"), 2 (\"B\")")
    );
    crumple_ok(here, &[&plot[..], &["--curve", "B"]].concat());
    fs::write(
        here.join("s.toml"),
        "[run]\nduration = \"100ms\"\n[curves]\nc = { file = \"a.crv\", units = \"mm-t-s\" }\n[[train]]\nname = \"A\"\nspeed = \"10m/s\"\nvehicles = [{ name = \"A1\", mass = \"24t\" }]\n[wall]\n[contact]\ncurve = \"c\"\n",
    )
    .unwrap();
    says(&crumple_fails(here, 1, "simulate s.toml"), "; here as curve = \"…\" beside file");
}

fn file(text: &str, name: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), text).unwrap();
    folder
}

const WALL: [&str; 4] = ["--kind", "wall", "--mass", "24t"];

/// The same, borrowed.
fn texts(texts: &[String]) -> Vec<&str> {
    texts.iter().map(String::as_str).collect()
}

/// The document of an import into a new database.
fn added(here: &Path, file: &str, more: &[&str]) -> Value {
    let arguments = ["db", "add", "new.h5", file, "--group", "g", "--json", "--replace"];
    serde_json::from_str(&crumple_ok(here, &[&arguments[..], more].concat())).unwrap()
}

/// A vertical drop of the force is taken, said, and keeps the energy; what repeats is dropped.
#[test]
fn jumps_of_the_force_are_taken_and_said() {
    // 24 t at 10 m/s: 1.2 MJ.
    let text =
        "d_mm,force_kN\n0,0\n0,1000\n400,1000\n400,2000\n700,2000\n700,2000\n700,1000\n900,1000\n";
    let folder = file(text, "jump.csv");
    let here = folder.path();
    let plain =
        [&["db", "add", "new.h5", "jump.csv", "--group", "g", "--speed", "10m/s"][..], &WALL];
    let error = crumple_fails(here, 1, &plain.concat());
    says(&error, "the curve rises by jumps alone, so its unloading stiffness must be given");
    let impact = [&WALL[..], &["--speed", "10m/s", "--unloading", "80MN/m"]].concat();
    let said = added(here, "jump.csv", &impact);
    let case = &said["cases"][0];
    let ratio = case["work_over_energy"].as_f64().unwrap();
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    let notes = case["notes"].to_string();
    says(&notes, "points: 1 removed (repeats of the previous one)");
    says(
        &notes,
        "the force jumps from 0 to 1000000 N at 0 m (line 2), from 1000000 to 2000000 N at 0.4 m (line 4), from 2000000 to 1000000 N at 0.7 m (line 6): the points there are set apart by 0.0001 of the maximum deflection",
    );
    // Such a curve trains nothing by itself, but it runs and goes out.
    crumple_ok(here, "export new.h5 --to lsdyna -o a.k");
    // Back and forth is still refused.
    fs::write(here.join("wave.csv"), text.replace("700,1000", "650,1000")).unwrap();
    let error = crumple_fails(
        here,
        1,
        &[&["db", "add", "new.h5", "wave.csv", "--group", "g", "--speed", "10m/s"][..], &WALL]
            .concat(),
    );
    says(&error, "line 8: the deflection must increase up to the largest, found 0.65 m after 0.7");
}

/// Functions of a Radioss deck by hand: units of /BEGIN, a choice by number, damage.
#[test]
fn radioss_functions() {
    let points = |length: f64, force: f64| -> String {
        POINTS.iter().map(|(d, f)| format!("{:>20}{:>20}\n", d / length, f / force)).collect()
    };
    let funct = |id: u32, points: &str| format!("/FUNCT/{id}\nnose {id}\n#   X   Y\n{points}");
    let begin = |units: &str| {
        format!(
            "#RADIOSS STARTER\n/BEGIN\nrun\n      2022         0\n{units}\n{units}\n/NODE\n         1  1.0  2.0\n"
        )
    };
    let fields = |units: [&str; 3]| units.map(|unit| format!("{unit:>20}")).concat();
    let t = |text: &str, options: &ReadOptions, notes: &[&str]| {
        let (curve, format) = read_bytes("a.rad", text.as_bytes(), options).unwrap();
        assert_eq!(format, "radioss");
        is_points(&curve, text);
        notes.iter().for_each(|note| has(&curve.notes, note));
    };
    let one = funct(5, &points(1e-3, 1.0));
    t(&one, &given(Some("mm-t-s")), &["curve: /FUNCT/5 of the deck", "units: mm-t-s as given"]);
    let own = begin(&fields(["Mg", "mm", "s"])) + &one + "/END\n";
    t(&own, &given(None), &["units: mm-t-s from line 5 of the file"]);
    let ms = begin(&fields(["kg", "mm", "ms"])) + &funct(5, &points(1e-3, 1e3));
    t(&ms, &given(None), &["units: mm-kg-ms from line 5"]);
    t(&(begin(&fields(["1000", "0.001", "1"])) + &one), &given(None), &["from line 5"]);
    t(&format!("# units: mm-t-s\n{one}"), &given(None), &["from line 1"]);
    // Compression in the third quadrant, as our export has it.
    let third: String =
        POINTS.iter().rev().map(|(d, f)| format!("{:>20}{:>20}\n", -d, -f)).collect();
    t(&funct(5, &third), &given(Some("SI")), &["third quadrant", "reverse order"]);
    let two = format!("{}{}", funct(5, &points(1.0, 1.0)), funct(6, &points(2.0, 1.0)));
    let options = ReadOptions { curve: Some("5".into()), ..given(Some("SI")) };
    t(&two, &options, &["/FUNCT/5"]);
    let wrong = |text: &str, options: &ReadOptions, expected: &str| {
        let error = refused("a.rad", text.as_bytes(), options);
        assert!(error.contains(expected), "{expected}: {error}");
    };
    let si = given(Some("SI"));
    wrong(&two, &si, "choose one with --curve: 5 (\"nose 5\"), 6 (\"nose 6\")");
    let seven = ReadOptions { curve: Some("7".into()), ..si.clone() };
    #[rustfmt::skip]
    let cases = [
        (&two, &seven, "the file has no curve \"7\": it has 5 (\"nose 5\")"),
        (&one, &given(None), "the file does not state its units"),
        (&begin("x"), &si, "expected a /FUNCT, found none in this file (in a run, the starter, _0000.rad, has them)"),
        (&"/RUN/x/1\n0.2\n/TFILE/4\n0.1\n".into(), &si, "expected a /FUNCT"),
        (&one.replace("1000000", "&p"), &si, "line 6, columns 21-40: expected a number, found \"&p\""),
        (&funct(5, "0.0 0.0\n"), &si, "line 4, columns 1-20: expected one number in each field of 20 columns"),
    ];
    cases.into_iter().for_each(|(text, options, expected)| wrong(text, options, expected));
    // What the deck makes of the points: scaled, then shifted; each time it says so.
    let moved = |id: u32, factors: &str| format!("/MOVE_FUNCT/{id}\nmoved\n# x y\n{factors}\n");
    let numbers = |of: [f64; 4]| of.map(|v| format!("{v:>20}")).concat();
    let half: String =
        POINTS.iter().map(|(d, f)| format!("{:>20}{:>20}\n", 2.0 * d + 2.0, 4.0 * f)).collect();
    let deck = funct(5, &half) + &moved(5, &numbers([0.5, 0.25, -1.0, 0.0])) + &moved(6, "");
    let note =
        "scale: /MOVE_FUNCT of line 9: abscissas times 0.5 plus -1, ordinates times 0.25 plus 0";
    t(&deck, &si, &[note]);
    let before = moved(5, "")
        + &moved(5, &numbers([0.0, 0.25, 0.0, 0.0]))
        + &funct(5, &{
            POINTS.iter().map(|(d, f)| format!("{d:>20}{:>20}\n", 4.0 * f)).collect::<String>()
        });
    t(&before, &si, &["line 1: abscissas times 1 plus 0", "line 5: abscissas times 1 plus 0"]);
    wrong(
        &deck.replace("                0.25", "                   x"),
        &si,
        "line 12, columns 21-40",
    );
    // What is not straight between points, has units of its own, or stands twice.
    let smooth = funct(5, &half).replace("/FUNCT", "# s\n/FUNCT_SMOOTH");
    wrong(
        &smooth,
        &si,
        "line 2: expected /FUNCT/5 with linear interpolation between its points, in the units of the deck, found /FUNCT_SMOOTH/5: write it as such points",
    );
    t(
        &(smooth + &one.replace("/5", "/7")),
        &ReadOptions { curve: Some("7".into()), ..given(Some("mm-t-s")) },
        &[],
    );
    wrong(
        &one.replace("FUNCT/5", "FUNCT/5/2"),
        &si,
        "line 1: expected /FUNCT/5 with linear interpolation between its points, in the units of the deck, found /FUNCT/5/2",
    );
    let five = ReadOptions { curve: Some("5".into()), ..si.clone() };
    wrong(&format!("{one}{one}"), &five, "the file has 2 curves \"5\": leave one of them in it");
}

/// What crumple wrote for Radioss and Modelica comes back with all that it says; other packages are refused.
#[test]
fn exported_decks_and_packages_come_back() {
    let folder = demo_folder();
    let here = folder.path();
    let curve = read_json(&here.join("lead50.json"));
    crumple_ok(here, "export lead50.json --to radioss --deck -o deck");
    crumple_ok(here, "export lead50.json -o x.mo");
    let deck = "deck/lead-car-wall-50kmh_0000.rad";
    for (file, bound) in [(deck, 1e-8), ("x.mo", 1e-3)] {
        let (read, _) = read(&here.join(file), &given(None)).unwrap();
        let facts = read.facts;
        assert_eq!(facts.speed_m_per_s, curve["speed_m_per_s"].as_f64());
        assert_eq!(facts.force, Some(crumple::curve::ForceKind::Body));
        let k = curve["body_unloading_stiffness_N_per_m"].as_f64().unwrap();
        assert!((facts.unloading_stiffness_n_per_m.unwrap() / k - 1.0).abs() < 1e-8);
        let end = curve["max_deflection_m"].as_f64().unwrap();
        assert!((read.deflection_m.last().unwrap() / end - 1.0).abs() < 1e-8, "{file}");
        let back = crumple::curve::Envelope::new(read.deflection_m, read.force_n).unwrap();
        let column =
            |key: &str| -> Vec<f64> { serde_json::from_value(curve[key].clone()).unwrap() };
        let own = crumple::curve::Envelope::new(column("deflection_m"), column("body_force_N"));
        assert!((back.work() / own.unwrap().work() - 1.0).abs() < bound, "{file}");
    }
    crumple_ok(here, &["db", "add", "back.h5", deck, "x.mo", "--group", "g"]);
    let mo = fs::read_to_string(here.join("x.mo")).unwrap();
    let wrong = |text: &str, expected: &str| {
        let error = refused("a.mo", text.as_bytes(), &given(None));
        assert!(error.contains(expected), "{expected}: {error}");
    };
    wrong(
        "model Spring\n  Real x;\nend Spring;\n",
        "expected a package that crumple export wrote (constant Real d[…], f[…]), found none: write other curves as a table text (#1, double name(n,2)), CSV or MAT file",
    );
    wrong(&mo[..mo.find("constant Real f").unwrap() + 200], "it may be truncated");
    wrong(&mo.replacen("0.00000000E+00", "zero", 1), "expected a number, found \"zero\"");
    wrong(&mo.replacen("constant Real d[", "constant Real d[1", 1), "constant d declares");
    wrong(
        &format!("{mo}\n{}", mo.replace("package x ", "package y ")),
        "choose one with --curve: x, y",
    );
}

/// Channels whose times are a channel of their own, or say no reference; folders of several tests; archives.
#[test]
fn iso_mme_times_and_folders() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let channels = here.join("T1/Channel");
    fs::create_dir_all(&channels).unwrap();
    fs::write(here.join("T1/T1.mme"), "Data format edition number :1.6\n").unwrap();
    let (d, f) = ([0.0, 5.0, 10.0, 15.0, 12.0], [0.0, 1.0, 2.0, 3.0, 0.0]);
    let (d, f) = (channel("11FRONT00000DSXP", "mm", &d), channel("11FRONT00000FOXP", "kN", &f));
    let put = |reference: &str| {
        for (name, text) in [("T1.001", &d), ("T1.002", &f)] {
            fs::write(
                channels.join(name),
                text.replace("Reference channel         :implicit", reference),
            )
            .unwrap();
        }
    };
    let times = channel("11FRONT00000TI00", "ms", &[-2.0, -1.0, 0.0, 1.5, 2.0]);
    let test = here.join("T1");
    let expected = [-2e-3, -1e-3, 0.0, 1.5e-3, 2e-3];
    fs::write(channels.join("T1.003"), &times).unwrap();
    let explicit =
        "Reference channel         :explicit\nReference channel name    :11FRONT00000TI00";
    for (reference, note) in [
        (explicit, "times: those of the channel 11FRONT00000TI00"),
        ("Reference channel         :11FRONT00000TI00", "times: those of the channel"),
        ("Reference channel         :explicit", "times: those of the channel"),
    ] {
        put(reference);
        let (curve, _) = read(&test, &given(None)).unwrap();
        assert_eq!(curve.time_s.unwrap(), expected, "{reference}");
        has(&curve.notes, note);
    }
    put("Reference channel         :NOVALUE");
    let (curve, _) = read(&test, &given(None)).unwrap();
    assert_eq!(curve.time_s.unwrap()[0], -0.002);
    has(&curve.notes, "the file names no reference channel");
    put(explicit);
    fs::write(channels.join("T1.003"), channel("11FRONT00000TI00", "ms", &[0.0, 1.0])).unwrap();
    let error = read(&test, &given(None)).unwrap_err().to_string();
    says(
        &error,
        "T1.001: line 5: the reference channel 11FRONT00000TI00 declares 2 times, but the file has 5 values",
    );
    fs::remove_file(channels.join("T1.003")).unwrap();
    let error = read(&test, &given(None)).unwrap_err().to_string();
    assert!(
        error.contains("T1.001: line 5: the times are those of another channel")
            && error.ends_with("there are none"),
        "{error}"
    );
    let archive = refused("T1.zip", b"PK\x03\x04....", &given(None));
    says(&archive, "found a ZIP archive: unpack it and give the files in it");
}

/// The tests of a whole group, as they are exported, are named; given each, they are added at once.
#[test]
fn a_folder_of_several_tests_names_them() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    let group = ["--group", "lead-car-wall"];
    crumple_ok(
        here,
        &[&["export", "curves.h5", "--to", "iso-mme", "-o", "tests"], &group[..]].concat(),
    );
    let add = |files: &[&'static str]| {
        [&["db", "add", "c.h5"][..], files, &["--group", "g", "--kind", "wall"]].concat()
    };
    let error = crumple_fails(here, 1, &add(&["tests"]));
    says(
        &error,
        "tests: the folder holds 7 ISO-MME tests: give each one you need separately: tests/12kmh tests/18kmh",
    );
    crumple_ok(here, &add(&["tests/36kmh", "tests/48kmh"]));
    // Several tests in one folder: each by its .mme file.
    fs::create_dir_all(here.join("flat/Channel")).unwrap();
    for test in ["36kmh", "48kmh"] {
        let stem = format!("lead-car-wall-{test}");
        let name = format!("{stem}.mme");
        fs::copy(here.join("tests").join(test).join(&name), here.join("flat").join(&name)).unwrap();
        for k in 1..=3 {
            let name = format!("{stem}.00{k}");
            fs::copy(
                here.join("tests").join(test).join("Channel").join(&name),
                here.join("flat/Channel").join(&name),
            )
            .unwrap();
        }
    }
    says(&crumple_fails(here, 1, &add(&["flat"])), "the folder holds 2 ISO-MME tests");
    let said =
        crumple_ok(here, &add(&["flat/lead-car-wall-36kmh.mme", "flat/lead-car-wall-48kmh.mme"]));
    says(&said, "lead-car-wall-48kmh");
}

/// A curve whose energy cannot be is refused with causes that a file can have.
#[test]
fn an_impossible_import_speaks_of_the_file() {
    let folder = file(&format!("d_m,force_N\n{}", rows(1.0, 1.0, ",", ".")), "nose.csv");
    let refused = |v: f64, more: &[&str]| {
        let v = format!("{v}m/s");
        let arguments = ["db", "add", "c.h5", "nose.csv", "--group", "g", "--speed", &v];
        crumple_fails(folder.path(), 1, &[&arguments[..], &WALL, more].concat())
    };
    let error = refused(speed() * 0.577, &[]);
    assert!(error.contains("absorbs 3.0") && error.contains("check units, speed and mass; whether the curve ends at the maximum crush of this impact, neither before nor after it; and whether its columns are deflection and force of the whole body. Correct speed, mass or units (--speed, --mass, and --units or in crumple export --input-units), or take the curve as it is with --accept-energy"), "{error}");
    let error = refused(speed() * 0.5_f64.sqrt(), &[]);
    says(&error, "likely the mass, half a structure taken for a whole one");
    let error = refused(speed() * 0.5, &[]);
    says(&error, "the speed of one body taken for the closing speed of two (--kind)");
    for v in [0.577, 0.5_f64.sqrt(), 0.5, 0.01] {
        let error = refused(speed() * v, &[]);
        assert!(
            !error.contains("recipe") && !error.contains("study") && !error.contains("half_model"),
            "{error}"
        );
    }
}

/// A slow test has times that are not those of the impact: its force over deflection is taken without them.
#[test]
fn a_slow_test_is_taken_without_its_times() {
    let rows: String = rows(1e-3, 1e3, ";", ",")
        .lines()
        .enumerate()
        .map(|(k, line)| format!("{};{line}\n", 60 * k))
        .collect();
    let folder = file(&format!("Zeit;Weg;Kraft\ns;mm;kN\n{rows}"), "slow.csv");
    let here = folder.path();
    let v = format!("{}m/s", speed());
    let impact = [&WALL[..], &["--speed", &v]].concat();
    let error = crumple_fails(
        here,
        1,
        &[&["db", "add", "new.h5", "slow.csv", "--group", "g"][..], &impact].concat(),
    );
    says(&error, "the test was slow, or the times are in another unit. --time-column none takes");
    let said = added(here, "slow.csv", &[&impact[..], &["--time-column", "none"]].concat());
    let ratio = said["cases"][0]["work_over_energy"].as_f64().unwrap();
    assert!((ratio - 1.0).abs() < 1e-6, "{said}");
}

/// A table without times is its own body force: a motion that its energy does not fit, and that is
/// made of the table itself, changes no force of an export.
#[test]
fn a_table_without_times_is_exported_as_it_is() {
    for factor in [0.83, 1.06] {
        let folder = file(&format!("Weg;Kraft\nmm;kN\n{}", rows(1e-3, 1e3, ";", ",")), "nose.csv");
        let here = folder.path();
        let v = format!("{}m/s", factor * speed());
        let impact = [&WALL[..], &["--speed", &v, "--accept-energy"]].concat();
        let said = added(here, "nose.csv", &impact);
        let ratio = said["cases"][0]["work_over_energy"].as_f64().unwrap();
        assert!((ratio * factor * factor - 1.0).abs() < 1e-6, "{said}");
        for arguments in
            ["train new.h5 --model nearest -o m.model", "export new.h5 --to json -o case.json"]
        {
            crumple_in(here, &arguments.split(' ').collect::<Vec<_>>());
        }
        crumple_in(here, &["predict", "m.model", "--speed", &v, "-o", "model.json"]);
        for name in ["case.json", "model.json"] {
            let text = fs::read_to_string(here.join(name)).unwrap();
            let curve: Value = serde_json::from_str(&text).unwrap();
            let column = |key: &str| -> Vec<f64> {
                let values = curve[key].as_array().unwrap_or_else(|| panic!("{key}: {text}"));
                values.iter().map(|v| v.as_f64().unwrap()).collect()
            };
            let (d, f) = (
                column("deflection_m"),
                column(if curve["body_force_N"].is_array() { "body_force_N" } else { "force_N" }),
            );
            for (at, force) in
                POINTS.iter().filter(|(at, _)| *at > 0.0 && *at < 0.9 * d[d.len() - 1])
            {
                let i = d.partition_point(|d| d < at).max(1);
                let found = f[i - 1] + (f[i] - f[i - 1]) * (at - d[i - 1]) / (d[i] - d[i - 1]);
                assert!(
                    (found / force - 1.0).abs() < 0.01,
                    "{name} at {at} m: {found} for {force}"
                );
            }
        }
    }
}

/// A motion that was made of its own force holds no momentum to take a stopped mass from, and is not a run of FE to
/// compare with: forces 4 % too large would be tonnes that came to rest.
#[test]
fn curves_without_times_have_no_stopped_mass() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let speeds: [f64; 4] = [7.0, 10.0, 13.0, 16.0];
    for v in speeds {
        let level_n = 2e6 * (1.0 + 0.02 * v);
        let crush_m = 1.04 * 0.5 * 24e3 * v * v / level_n + 0.025;
        let point = |i: i32| {
            let d = crush_m * f64::from(i) / 400.0;
            format!("{d},{}\n", level_n * (d / 0.05).min(1.0))
        };
        let rows: String = (0..=400).map(point).collect();
        fs::write(here.join(format!("c{v}.csv")), format!("d_m,F_N\n{rows}")).unwrap();
    }
    crumple_ok(
        here,
        "db add c.h5 c7.csv c10.csv c13.csv c16.csv --speed 7m/s,10m/s,13m/s,16m/s --kind wall --mass 24t --group g --unloading 80MN/m",
    );
    assert!(!crumple_ok(here, "db ls c.h5").contains("crush law"));
    let output = crumple_in(here, "validate c.h5 -v");
    let said = crate::common::said(&output);
    says(&said, "curves without times, 4 of 4: their motion is made of their force");
    assert!(!said.contains("FE contact (floor)") && !said.contains("crush-law  "), "{said}");
    crumple_ok(here, "plot c.h5 -o c.svg");
    says(&fs::read_to_string(here.join("c.svg")).unwrap(), "recorded at 25.2 km/h");
}

/// Of many curves a picture draws some, a report names each warning once, and the best model is chosen as in training.
#[test]
fn many_curves_stay_legible() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let names: Vec<String> = (0..25).map(|k| format!("c{k}.csv")).collect();
    let speeds: Vec<String> = (0..25).map(|k| format!("{}m/s", 5 + k)).collect();
    for (k, name) in names.iter().enumerate() {
        let v = 5.0 + k as f64;
        let level_n = 2e6 * (1.0 + 0.02 * v);
        let crush_m = 0.5 * 24e3 * v * v / level_n + 0.025;
        let points = [0.0, 0.05, 0.5 * (0.05 + crush_m), crush_m];
        let rows: String =
            points.iter().map(|d| format!("{d},{}\n", level_n * (d / 0.05).min(1.0))).collect();
        fs::write(here.join(name), format!("d_m,F_N\n{rows}")).unwrap();
    }
    let speeds = speeds.join(",");
    let add = [
        "db", "add", "c.h5", "--speed", &speeds, "--kind", "wall", "--mass", "24t", "--group", "g",
    ];
    let files: Vec<&str> = names.iter().map(String::as_str).collect();
    crumple_ok(here, &[&add[..], &files].concat());
    crumple_ok(here, "plot c.h5 -o c.svg");
    let drawn = fs::read_to_string(here.join("c.svg")).unwrap();
    says(&drawn, "20 of 25 runs, taken evenly in order of speed.");
    assert!(drawn.contains("recorded at 18 km/h") && drawn.contains("recorded at 104.4 km/h"));
    let chosen = crumple_ok(here, "train c.h5 -o m.model");
    let chosen = chosen.lines().next().unwrap();
    says(chosen, " on 25 cases from 18 km/h to 104.4 km/h");
    let compared = json(&crumple_ok(here, "compare c.h5 --speed 15m/s --nsdm-seeds 0 --json -q"));
    let rows = compared["rows"].as_array().unwrap();
    let best = rows.iter().find(|row| row["method"] == "best").unwrap();
    let made_from = format!("{} on 24 speeds", chosen.split(' ').next().unwrap());
    assert_eq!(best["curve"].as_str(), Some(made_from.as_str()), "{best}");
    assert!(rows.iter().all(|row| row["method"] != "fe" && row["method"] != "fe_body"));
    crumple_ok(here, "report c.h5 -o r.html");
    let page = fs::read_to_string(here.join("r.html")).unwrap();
    says(
        &page,
        "25 runs (c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, …; the numbers are those of the first)",
    );
}

/// A legacy curve is exported without a database, with what its file does not say.
#[test]
fn a_legacy_curve_is_exported_directly() {
    let text = format!("Test 12\nWeg;Kraft\nmm;kN\n{}", rows(1e-3, 1e3, ";", ","));
    let folder = file(&text, "nose.csv");
    let here = folder.path();
    let v = format!("{}m/s", speed());
    let said = [&WALL[..], &["--speed", &v, "--unloading", "80MN/m"]].concat();
    let export = |more: &[&'static str]| -> Vec<String> {
        let all = [&["export", "nose.csv"][..], &said, more].concat();
        all.into_iter().map(String::from).collect()
    };
    crumple_ok(here, &texts(&export(&["-o", "direct.k", "--units", "mm-t-s"])));
    // The same as by way of a database.
    crumple_ok(here, &[&["db", "add", "c.h5", "nose.csv", "--group", "nose"][..], &said].concat());
    crumple_ok(here, "export c.h5 -o database.k --units mm-t-s");
    let read_back = |name: &str| fs::read_to_string(here.join(name)).unwrap();
    let without_hash = |text: String| -> Vec<String> {
        text.lines().filter(|l| !l.contains("training_hash")).map(Into::into).collect()
    };
    assert_eq!(without_hash(read_back("direct.k")), without_hash(read_back("database.k")));
    // The points are those of the file, and no others.
    let (curve, _) = read(&here.join("direct.k"), &given(None)).unwrap();
    let points = curve.deflection_m.iter().zip(&curve.force_n);
    assert_eq!(curve.force_n.len(), POINTS.len(), "{points:?}");
    for ((d, f), (dp, fp)) in points.zip(POINTS) {
        assert!((d - dp).abs() < 1e-8 && (f - fp).abs() < 1e-8 * 3e6, "{d} {f} for {dp} {fp}");
    }
    // What was read how is in the notes.
    let output = crumple_in(here, &texts(&export(&["--to", "csv", "--json"])));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    let notes = said["notes"].to_string();
    for part in
        ["line 1 is a title", "columns: deflection of", "motion: reconstructed", "restitution"]
    {
        assert!(notes.contains(part) || part == "restitution", "{part}: {notes}");
    }
    let t = |code: i32, arguments: &[&str], expected: &str| {
        let error = crumple_fails(here, code, arguments);
        assert!(error.contains(expected), "{arguments:?} said:\n{error}");
    };
    #[rustfmt::skip]
    let cases = [
        (2, &["export", "nose.csv", "--to", "csv", "--kind", "wall"][..], "nose.csv: the file does not state its speed: give --speed"),
        (2, &["export", "nose.csv", "--to", "csv", "--speed", "10m/s", "--kind", "wall"][..], "the mass of the body: give --mass"),
        (2, &["export", "nose.csv", "--to", "csv", "--speed", "9m/s,10m/s"][..], "a file holds the curve of one impact"),
        (2, &["export", "nose.csv", "--to", "table"][..], "table is made of a whole model"),
        (2, &["export", "c.h5", "--to", "csv", "--kind", "wall"][..], "apply only to the file of a measured or legacy curve"),
    ];
    cases.into_iter().for_each(|(code, arguments, expected)| t(code, arguments, expected));
    let column = export(&["--to", "csv", "--force-column", "9"]);
    t(1, &texts(&column), "nose.csv: line 2: --force-column \"9\" is not a column");
    fs::write(here.join("bare.csv"), rows(1.0, 1.0, ",", ".")).unwrap();
    let bare = [&["export", "bare.csv", "--to", "csv", "--speed", &v][..], &WALL].concat();
    t(1, &bare, "--units (of crumple export: --input-units)");
    crumple_ok(here, &[&bare[..], &["--input-units", "SI"]].concat());
    fs::write(here.join("hello.xyz"), "hello\n").unwrap();
    t(1, &["export", "hello.xyz", "--to", "csv", "--speed", "1m/s"], "hello.xyz: ");
    t(1, &["export", ".", "--to", "csv"], ".: this is a folder");
}
