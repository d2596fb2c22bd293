//! MDF 4: asammdf reads what is written, and what it writes is read, in every way that tools pack it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crumple::database::Database;
use crumple::formats::{ReadOptions, read};

use crate::common::{
    build_fixture, crumple_fails, crumple_in, crumple_ok, demo_folder, python_of, run_python, says,
};

fn clients(arguments: &[&Path]) -> Value {
    let arguments: Vec<String> = arguments.iter().map(|a| a.display().to_string()).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    run_python(python_of("CRUMPLE_PYTHON_TABLES"), "mdf.py", &arguments)
}

const CASE: [&str; 5] = ["curves.h5", "--group", "lead-car-wall", "--case", "36kmh"];

/// The record of a case over time, as lines of a table.
fn record(here: &Path) -> (Vec<[f64; 3]>, String) {
    let database = Database::read(&here.join("curves.h5")).unwrap();
    let case = database.cases("lead-car-wall").iter().find(|c| c.id.name == "36kmh").unwrap();
    let curve = &case.curves.sampled;
    let rows: Vec<[f64; 3]> = (0..curve.time_s().len())
        .map(|k| [curve.time_s()[k], curve.deflection_m()[k], curve.force_n()[k]])
        .collect();
    let lines: String = rows.iter().map(|[t, d, f]| format!("{t:?},{d:?},{f:?}\n")).collect();
    (rows, format!("t_s,d_m,force_N\n{lines}"))
}

/// A result in MDF is rated as the same one in CSV.
#[test]
fn signals_of_mdf_files_are_rated() {
    let folder = demo_folder();
    let here = folder.path();
    for name in ["run.mf4", "run.csv"] {
        crumple_ok(here, &["simulate", "two-sets.toml", "-q", "-o", name]);
    }
    let rated = |a: &str, b: &str| -> Value {
        let shown = crumple_ok(here, &["rate", a, b, "--cfc", "60", "--json"]);
        serde_json::from_str(&shown).unwrap()
    };
    let (a, b) = ("a_m_per_s2[A1]", "a_m_per_s2[A2]");
    let of_csv = rated(&format!("run.csv:{a}"), &format!("run.csv:{b}"));
    let mut of_mdf = rated("run.mf4:a A1", "run.mf4:a A2 [m/s^2]");
    for side in ["reference", "prediction"] {
        let name = of_mdf[side]["name"].as_str().unwrap();
        assert!(name.contains("a A") && name.contains("[m/s^2]"), "{name}");
        of_mdf[side]["name"] = of_csv[side]["name"].clone();
    }
    assert_eq!(of_mdf, of_csv);
    let error = crumple_fails(here, 1, &["rate", "run.mf4:a A9", "run.csv:a_m_per_s2[A2]"]);
    says(&error, "run.mf4: there is no channel \"a A9\": name one of \"time [s]\", \"x A1 [m]\"");
    let error = crumple_fails(here, 1, &["rate", "run.mf4", "run.mf4", "--column", "a A9"]);
    says(&error, "run.mf4: there is no channel \"a A9\": name one of");
}

/// A result in MDF is drawn, and compared with another, as that in CSV; a file of another program is not taken for one.
#[test]
fn results_in_mdf_are_those_in_csv() {
    let folder = demo_folder();
    let here = folder.path();
    for name in ["mdf/run.mf4", "csv/run.csv"] {
        fs::create_dir_all(here.join(name).parent().unwrap()).unwrap();
        crumple_ok(here, &["simulate", "two-sets.toml", "-q", "-o", name]);
    }
    for quantity in ["velocity", "acceleration", "force", "crush"] {
        for (run, picture) in [("mdf/run.mf4", "mdf.svg"), ("csv/run.csv", "csv.svg")] {
            crumple_ok(here, &["plot", run, "--quantity", quantity, "-q", "-o", picture]);
        }
        let drawn = |name: &str| fs::read(here.join(name)).unwrap();
        assert!(drawn("mdf.svg") == drawn("csv.svg"), "{quantity}");
    }
    crumple_ok(here, &["simulate", "eight-on-eight.toml", "-q", "-o", "other.csv"]);
    let rated = |a: &str| crumple_in(here, &["rate", a, "other.csv", "--json"]).stdout;
    assert!(rated("mdf/run.mf4") == rated("csv/run.csv") && !rated("csv/run.csv").is_empty());
    let error = crumple_fails(here, 1, &["inspect", "mdf/run.mf4"]);
    says(
        &error,
        "a table over time, as crumple simulate writes it: crumple plot draws such results",
    );

    let whole = fs::read(here.join("mdf/run.mf4")).unwrap();
    fs::write(here.join("cut.mf4"), &whole[..whole.len() / 2]).unwrap();
    let error = crumple_fails(here, 1, "plot cut.mf4 -o cut.svg");
    says(&error, "cut.mf4: byte ");
    for bytes in (0..72).step_by(5) {
        fs::write(here.join("cut.mf4"), &whole[..bytes]).unwrap();
        crumple_fails(here, 1, "plot cut.mf4 -o cut.svg");
        crumple_fails(here, 1, "inspect cut.mf4");
    }
    crumple_ok(here, &[&["export"], &CASE[..], &["-q", "-o", "case.mf4"]].concat());
    let error = crumple_fails(here, 2, &["rate", "case.mf4", "mdf/run.mf4"]);
    says(&error, "case.mf4 is not the result of a run, as mdf/run.mf4 is");
    let error = crumple_fails(here, 1, &["rate", "case.mf4", "case.mf4"]);
    says(&error, "case.mf4: there are several columns: name one of");
}

/// Between the common times of a recipe a record may have peaks that they do not show: exports of those times say so.
#[test]
fn what_common_times_leave_out_is_said() {
    let folder = demo_folder();
    let here = folder.path();
    let said = |output: &str| {
        let more: Vec<&str> = output.split(' ').collect();
        let exported = crumple_in(here, &[&["export"], &CASE[..], &["-v", "-o"], &more].concat());
        String::from_utf8(exported.stderr).unwrap()
    };
    assert!(!said("case.mf4").contains("common times"));
    let study = here.join("fe/lead-car-wall/study.toml");
    let text = fs::read_to_string(&study).unwrap();
    let coarse =
        text.replace("states = 400, interval_ms = 0.75", "states = 100, interval_ms = 3.0");
    assert_ne!(text, coarse);
    fs::write(&study, coarse).unwrap();
    crumple_ok(here, "build fe/lead-car-wall/study.toml -o curves.h5 -q");
    for (to, output) in [("mdf", "coarse.mf4"), ("iso-mme", "coarse")] {
        let said = said(&format!("{output} --to {to}"));
        says(
            &said,
            "36kmh: the file has the force at the recipe's common times, which differs by up to",
        );
    }
}

/// asammdf finds every channel of a case and of a run, with its unit and values.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn asammdf_reads_what_is_written() {
    let folder = demo_folder();
    let here = folder.path();
    crumple_ok(here, &[&["export"], &CASE[..], &["-o", "case.mf4"]].concat());
    let found = clients(&[Path::new("read"), &here.join("case.mf4")]);
    assert_eq!(found["version"], "4.10");
    assert!(found["comment"].as_str().unwrap().contains("mass_kg: 24000"), "{found}");
    let (rows, _) = record(here);
    let (first, last) = (rows[0], rows[rows.len() - 1]);
    for (name, unit, column) in [("deflection", "m", 1), ("force", "N", 2)] {
        let peak = rows.iter().map(|row| row[column]).fold(f64::MIN, f64::max);
        let expected = serde_json::json!([
            unit,
            rows.len(),
            [first[0], last[0]],
            [first[column], last[column]],
            peak
        ]);
        assert_eq!(found["channels"][name], expected);
    }
    crumple_ok(here, "simulate two-sets.toml -q -o run.mf4");
    crumple_ok(here, "simulate two-sets.toml -q -o run.csv");
    let table = fs::read_to_string(here.join("run.csv")).unwrap();
    let columns = table.lines().next().unwrap().split(',').count();
    let found = clients(&[Path::new("read"), &here.join("run.mf4")]);
    let channels = found["channels"].as_object().unwrap();
    assert_eq!(channels.len(), columns);
    let last: Vec<f64> =
        table.lines().last().unwrap().split(',').map(|n| n.parse().unwrap()).collect();
    let speed =
        table.lines().next().unwrap().split(',').position(|n| n == "v_m_per_s[A1]").unwrap();
    assert_eq!(
        (&channels["v A1"][0], channels["v A1"][3][1].as_f64()),
        (&"m/s".into(), Some(last[speed]))
    );
}

/// What is exported comes back bit for bit, and so does what asammdf packs, to the digits of its numbers.
#[test]
#[ignore = "needs the Python clients (tests/run installs them)"]
fn what_asammdf_writes_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    let (rows, table) = record(here);
    fs::write(here.join("curve.csv"), table).unwrap();
    crumple_ok(here, &[&["export"], &CASE[..], &["-o", "case.mf4"]].concat());
    crumple_ok(here, "db add own.h5 case.mf4 --group own");
    let own = Database::read(&here.join("own.h5")).unwrap();
    let (own, case) = (&own.cases("own")[0], Database::read(&here.join("curves.h5")).unwrap());
    let case = case.cases("lead-car-wall").iter().find(|c| c.id.name == "36kmh").unwrap();
    assert!(own.curves.original.force_n() == case.curves.sampled.force_n());
    assert!(own.conditions == case.conditions && own.curves.force_kind == case.curves.force_kind);

    let ways = clients(&[Path::new("write"), here, &here.join("curve.csv")]);
    for (k, way) in ways.as_array().unwrap().iter().enumerate() {
        let (curve, format) =
            read(&here.join(format!("way{k}.mf4")), &ReadOptions::default()).unwrap();
        assert_eq!((format, curve.force_n.len()), ("mdf", rows.len()), "{way}");
        // Integers of 0.1 mm; single precision of 3 MN; whole newtons.
        for (k, [t, d, f]) in rows.iter().enumerate() {
            assert!((curve.time_s.as_ref().unwrap()[k] - t).abs() < 1e-12, "{way}");
            assert!(
                (curve.deflection_m[k] - d).abs() <= 0.5001e-4,
                "{way}: {} {d}",
                curve.deflection_m[k]
            );
            assert!((curve.force_n[k] - f).abs() <= 0.7, "{way}: {} {f}", curve.force_n[k]);
        }
    }
    let two = ReadOptions { curve: Some("2".into()), ..ReadOptions::default() };
    let (half, _) = read(&here.join("two.mf4"), &two).unwrap();
    assert!(rows.iter().zip(&half.force_n).all(|([_, _, f], half)| (half - f / 2.0).abs() <= 0.5));
    let (marked, _) = read(&here.join("marked.mf4"), &ReadOptions::default()).unwrap();
    let valid: Vec<f64> = (0..rows.len()).filter(|k| k % 10 != 5).map(|k| rows[k][2]).collect();
    assert_eq!(marked.force_n, valid);
    let noted = "left out: 40 records marked as invalid".to_string();
    assert!(marked.notes.contains(&noted), "{:?}", marked.notes);
    for (file, message) in [
        (
            "table.mf4",
            "; left out: channel \"load\": its conversion is not linear: save it with physical values",
        ),
        (
            "array.mf4",
            "; left out: channel \"load\": it is an array: save its elements as channels",
        ),
        (
            "two.mf4",
            "the file holds several curves: choose one with --curve: 1 (\"time [s], crush [m], load [N]\"), 2",
        ),
        ("apart.mf4", "; deflection and force are in different groups: resample them to"),
        ("none.mf4", "expected"),
        ("old.mdf", "expected MDF of version 4, found an earlier version: save it as MDF 4"),
    ] {
        says(
            &crumple_fails(
                here,
                1,
                &["db", "add", "x.h5", file, "--group", "g", "--speed", "36km/h"],
            ),
            message,
        );
    }
}

/// Blocks that refer to themselves or to each other many times cost no more than the file is long.
#[test]
fn circles_of_blocks_end() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    crumple_ok(here, &[&["export"], &CASE[..], &["-o", "case.mf4"]].concat());
    let whole = fs::read(here.join("case.mf4")).unwrap();
    let find = |name: &[u8]| whole.windows(4).position(|w| w == name).unwrap();
    let end = whole.len() as u64;
    let set = |at: usize, link: u64| {
        let mut bytes = whole.clone();
        bytes[at..at + 8].copy_from_slice(&link.to_le_bytes());
        bytes
    };
    // A list of data that goes on with itself and holds an empty block many times; groups and channels in circles.
    let mut list = set(find(b"##DG") + 24 + 16, end);
    let links = 100_000u64;
    let empty = end + 24 + 8 * (links + 1);
    list.extend_from_slice(b"##DL\0\0\0\0");
    let words = [24 + 8 * (links + 1), links + 1, end];
    let words = words.into_iter().chain((0..links).map(|_| empty));
    words.for_each(|word| list.extend_from_slice(&word.to_le_bytes()));
    list.extend_from_slice(b"##DT\0\0\0\0\x18\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0");
    let circle = |name: &[u8]| set(find(name) + 24, find(name) as u64);
    for bytes in [list, circle(b"##DG"), circle(b"##CG"), circle(b"##CN")] {
        fs::write(here.join("circle.mf4"), bytes).unwrap();
        let read = read(&here.join("circle.mf4"), &ReadOptions::default());
        let error = read.unwrap_err().to_string();
        assert!(error.contains("the blocks of the file refer to each other in a loop"), "{error}");
    }
}

/// Cut or altered anywhere it is a curve or an error that names the file, in little time and memory.
#[test]
fn damage_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    crumple_ok(here, &[&["export"], &CASE[..], &["-o", "case.mf4"]].concat());
    let whole = fs::read(here.join("case.mf4")).unwrap();
    let path = here.join("damaged.mf4");
    let look = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        match read(&path, &ReadOptions::default()) {
            Ok((curve, _)) => assert_eq!(curve.force_n.len(), curve.deflection_m.len()),
            Err(error) => assert!(error.to_string().contains("damaged.mf4"), "{error}"),
        }
    };
    (0..whole.len()).step_by(389).for_each(|end| look(&whole[..end]));
    // Everything but the records is in the first and the last bytes.
    let records = whole.windows(4).position(|w| w == b"##DT").unwrap();
    for at in (0..records + 24).chain(whole.len() - 64..whole.len()) {
        for value in [0, 1, 0x7f, 0xff] {
            let mut bytes = whole.clone();
            bytes[at] = value;
            look(&bytes);
        }
    }
}

/// Times that follow from the number of the record are read; a file that was not closed is refused, records beyond the counted ones are
/// named, and times that cannot be read are not left out silently.
#[test]
fn times_and_records_are_not_lost() {
    let folder = demo_folder();
    let here = folder.path();
    crumple_ok(here, &[&["export"], &CASE[..], &["-q", "-o", "case.mf4"]].concat());
    let whole = fs::read(here.join("case.mf4")).unwrap();
    let places = |kind: &[u8]| -> Vec<usize> {
        let at = whole.windows(4).enumerate().filter(|(_, bytes)| bytes == &kind);
        at.map(|(at, _)| at).collect()
    };
    let number = |at: usize| u64::from_le_bytes(whole[at..at + 8].try_into().unwrap());
    let data = |block: usize| block + 24 + 8 * number(block + 16) as usize;
    let channel = places(b"##CN").into_iter().find(|&block| whole[data(block)] == 2).unwrap();
    let write = |name: &str, change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = whole.clone();
        change(&mut bytes);
        fs::write(here.join(name), bytes).unwrap();
    };
    let add = |name: &str| crumple_in(here, &["db", "add", "x.h5", name, "--group", "x", "-v"]);
    let said = |name: &str| {
        let out = add(name);
        String::from_utf8([out.stdout, out.stderr].concat()).unwrap()
    };
    let own = read(&here.join("case.mf4"), &ReadOptions::default()).unwrap().0;
    // A virtual master: no bits, time = 0.75 ms × number.
    write("virtual.mf4", &|bytes| {
        let at = data(channel);
        bytes[at] = 3;
        bytes[at + 2] = 0;
        bytes[at + 8..at + 12].fill(0);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        let conversion = bytes.len() as u64;
        let link = channel + 24 + 8 * 4;
        bytes[link..link + 8].copy_from_slice(&conversion.to_le_bytes());
        bytes.extend(b"##CC\0\0\0\0");
        [24 + 32 + 40_u64, 4, 0, 0, 0, 0].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
        bytes.extend([1, 0, 0, 0, 0, 0, 2, 0]);
        [0.0, 0.0, 0.0, 0.75e-3_f64].iter().for_each(|n| bytes.extend(n.to_le_bytes()));
    });
    let virtual_times = read(&here.join("virtual.mf4"), &ReadOptions::default()).unwrap().0;
    assert_eq!(virtual_times.force_n, own.force_n);
    let times = [virtual_times.time_s.unwrap(), own.time_s.unwrap()];
    assert!(times[0].iter().zip(&times[1]).all(|(a, b)| (a - b).abs() < 1e-9));
    // Bits that are no whole bytes.
    write("odd.mf4", &|bytes| bytes[data(channel) + 8] = 63);
    says(
        &said("odd.mf4"),
        "its times are in channel \"time\": it does not hold numbers in whole bytes; choose another with --time-column, or none",
    );
    write("open.mf4", &|bytes| bytes[..8].copy_from_slice(b"UnFinMF "));
    says(
        &said("open.mf4"),
        "open.mf4: the file was never finalised, so that records may be missing",
    );
    let error = crumple_fails(here, 1, "rate open.mf4 open.mf4");
    says(&error, "the file was never finalised");
    let group = data(places(b"##CG")[0]);
    write("counted.mf4", &|bytes| {
        bytes[group + 8..group + 16].copy_from_slice(&300_u64.to_le_bytes())
    });
    says(&said("counted.mf4"), "left out: what follows the 300 records that the group counts");
}
