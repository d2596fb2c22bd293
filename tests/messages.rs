//! Messages: places with carets, guesses, errors as JSON, help, man pages, narrow terminals.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::common::{build_fixture, crumple_fails, crumple_in, crumple_ok, fixture};

const STUDY: &str = "[study]
name  = \"s\"
units = \"mm-t-s\"
group = \"g\"
kind  = \"wall\"

[recipe]
deflection = { file = \"nodout\", node = 900001, component = \"x_displacement\" }
force      = { file = \"rwforc\", id = 1, component = \"normal_force\" }
filter     = \"none\"
sampling   = { states = 400, interval_ms = 0.75 }

[[run]]
path  = \"25kmh\"
speed = \"25km/h\"
mass  = \"24t\"

[[run]]
path  = \"other\"
speed = \"36km/h\"
mass  = \"24t\"
";

const SCENARIO: &str = "[run]
duration = \"100ms\"

[curves]
c = { file = \"c.csv\" }
k = { stages = [ { stroke = \"0.5m\", to = \"1MN\" } ], unloading = \"9MN/m\" }

[[train]]
name = \"A\"
speed = \"10m/s\"
inner = \"c\"
vehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"20t\" } ]

[wall]

[contact]
curve = \"c\"
";

/// What the text between the carets is, and the message.
struct Shown {
    message: String,
    place: String,
    marked: String,
}

/// Reads a message of the form `error: FILE:LINE:COLUMN: …`, the line and the carets, and holds
/// each against the file.
fn shown(error: &str, file: &str, text: &str) -> Shown {
    let lines: Vec<&str> = error.lines().collect();
    let at = lines.iter().position(|line| {
        line.trim_start().starts_with("| ^")
            || line.contains("| ")
                && line.split("| ").nth(1).is_some_and(|rest| rest.trim_start().starts_with('^'))
    });
    let at = at.unwrap_or_else(|| panic!("no carets in:\n{error}"));
    let (number, line) = lines[at - 1].split_once(" | ").unwrap();
    let carets = lines[at].split_once("| ").unwrap().1;
    let column = carets.find('^').unwrap();
    let number: usize = number.trim().parse().unwrap();
    assert_eq!(text.lines().nth(number - 1).unwrap(), line, "{error}");
    let place = format!("{number}:{}", column + 1);
    assert!(error.contains(&format!("{file}:{place}: ")), "{file}:{place} is not in\n{error}");
    let marked = line.chars().skip(column).take(carets.trim().len()).collect();
    Shown { message: error.into(), place, marked }
}

/// A study with one replacement, built: place, marked text and a part of the message.
fn study(from: &str, to: &str, place: &str, marked: &str, expected: &str) {
    assert!(STUDY.contains(from), "{from}");
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let text = STUDY.replacen(from, to, 1);
    fs::write(here.join("study.toml"), &text).unwrap();
    for run in ["25kmh", "other"] {
        fs::create_dir(here.join(run)).unwrap();
        for file in ["nodout", "rwforc"] {
            let source = fixture(&format!("fe/lead-car-wall/25kmh/{file}"));
            fs::copy(source, here.join(run).join(file)).unwrap();
        }
    }
    let error = crumple_fails(here, 1, &["build", "study.toml", "-o", "c.h5"]);
    let found = shown(&error, "study.toml", &text);
    assert_eq!((found.place.as_str(), found.marked.as_str()), (place, marked), "{error}");
    assert!(found.message.contains(expected), "{expected} is not in\n{error}");
}

/// What the values of a study say together, and what its runs do not have.
#[test]
fn errors_of_a_study_show_their_place() {
    let wall = "kind  = \"wall\"";
    let speed = "speed = \"25km/h\"";
    study("name  = \"s\"", "nam   = \"s\"", "2:1", "nam", "did you mean \"name\"?");
    study("\"mm-t-s\"", "\"mm-t-sec\"", "3:9", "\"mm-t-sec\"", "did you mean \"mm-t-s\"?");
    study("name  = \"s\"", "name  = \" \"", "2:9", "\" \"", "is not a name");
    study("group = \"g\"", "group = \"a/b\"", "4:9", "\"a/b\"", "may not contain");
    study("name  = \"s\"", "name  = \"imported\"", "2:9", "\"imported\"", "the name of the curves");
    study(wall, "kind  = \"pair\"", "5:9", "\"pair\"", "a pair needs the other body");
    study(wall, "kind  = \"wal\"", "5:9", "\"wal\"", "did you mean \"wall\"?");
    let half = "kind  = \"wall\"\nhalf_model = true";
    study(wall, half, "6:14", "true", "half_model = true needs kind");
    let two = "speed = \"25km/h\"\ncontact_time = \"1ms\"\ngap = \"1mm\"";
    study(speed, two, "17:1", "gap", "contact_time and gap");
    let other = "speed = \"25km/h\"\nother_mass = \"2t\"";
    study(speed, other, "16:1", "other_mass", "needs kind = \"pair\"");
    let parameter = |text: &str| format!("speed = \"25km/h\"\nparameters = {{ {text} }}");
    study(speed, &parameter("\" \" = 1"), "16:16", "\" \"", "is not a name");
    study(speed, &parameter("mass_kg = 1"), "16:16", "mass_kg", "has a key of its own");
    study(speed, &parameter("a = inf"), "16:20", "inf", "is not finite");
    study("path  = \"25kmh\"", "path  = \"\"", "14:9", "\"\"", "an empty path");
    study("path  = \"25kmh\"", "path  = \".\"", "14:9", "\".\"", "gives no name for its case");
    study("path  = \"other\"", "path  = \"./25kmh\"", "19:9", "\"./25kmh\"", "two runs are named");
    let contact = "filter     = \"none\"\ncontact = { file = \"rwforc\", id = 1, component = \"normal_force\" }";
    study(
        "filter     = \"none\"",
        contact,
        "11:11",
        contact.split_once("contact = ").unwrap().1,
        "found in recipe.force itself",
    );
    let mut lines = STUDY.split("\n[[run]]");
    let no_run = format!("run = []\n{}", lines.next().unwrap());
    let error = study_text(&no_run);
    assert_eq!(shown(&error, "study.toml", &no_run).marked, "[]", "{error}");
}

fn study_text(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("study.toml"), text).unwrap();
    crumple_fails(folder.path(), 1, &["build", "study.toml", "-o", "c.h5"])
}

#[test]
fn errors_of_runs_show_their_place_in_the_study() {
    study("path  = \"other\"", "path  = \"othre\"", "19:9", "\"othre\"", "does not exist");
    study("\"rwforc\"", "\"rwforce\"", "9:23", "\"rwforce\"", "did you mean \"rwforc\"?");
    study("900001", "900011", "8:40", "900011", "did you mean 900001?");
    study("id = 1", "id = 2", "9:38", "2", "has no rigid wall 2");
    study("normal_force", "norm_force", "9:53", "\"norm_force\"", "did you mean \"normal_force\"?");
    study("units = \"mm-t-s\"\n", "", "1:1", "[study]", "gives no units");
    study("\"25km/h\"", "\"90km/h\"", "14:9", "\"25kmh\"", "speed");
}

/// A scenario with one replacement, run: place, marked text and a part of the message.
fn scenario(from: &str, to: &str, place: &str, marked: &str, expected: &str) {
    assert!(SCENARIO.contains(from), "{from}");
    let folder = tempfile::tempdir().unwrap();
    let text = SCENARIO.replacen(from, to, 1);
    fs::write(folder.path().join("s.toml"), &text).unwrap();
    fs::write(folder.path().join("c.csv"), "d_m,force_N\n0,0\n0.5,2e6\n1,3e6\n").unwrap();
    let command = if to.contains("[sweep]") { "sweep" } else { "simulate" };
    let mut arguments = vec![command, "s.toml"];
    arguments.extend((command == "sweep").then_some(["-o", "r.csv"]).into_iter().flatten());
    let error = crumple_fails(folder.path(), 1, &arguments);
    let found = shown(&error, "s.toml", &text);
    assert_eq!((found.place.as_str(), found.marked.as_str()), (place, marked), "{error}");
    assert!(found.message.contains(expected), "{expected} is not in\n{error}");
}

#[test]
fn errors_of_a_scenario_show_their_place() {
    let wall = "[wall]\n";
    let second =
        |text: &str| format!("[[train]]\nname = \"B\"\nspeed = \"0m/s\"\nvehicles = [ {text} ]\n");
    let b1 = "{ name = \"B1\", mass = \"9t\" }";
    let vehicle = "{ name = \"A2\", mass = \"20t\" }";
    let c = "{ file = \"c.csv\" }";
    scenario(wall, &format!("{}{wall}", second(b1)), "14:1", "[[train]]", "exactly one [[train]]");
    scenario(wall, "", "8:1", "[[train]]", "expected two [[train]]");
    let limits = |text: &str| {
        format!(
            "{wall}[limits]\nstandard = \"EN\"\nedition = \"1\"\nmean_deceleration_g = {text}\n"
        )
    };
    scenario(wall, &limits("0.0"), "18:23", "0.0", "expected more than 0");
    scenario(wall, &limits("5.0\ntrains = []"), "19:10", "[]", "trains is empty");
    scenario(wall, &limits("5.0\ntrains = [ \"A\", \"C\" ]"), "19:17", "\"C\"", "no train \"C\"");
    let same = second(b1).replace("\"B\"", "\"A\"");
    scenario(wall, &same, "15:8", "\"A\"", "two trains are named");
    scenario("\"A2\"", "\"A1\"", "12:54", "\"A1\"", "two bodies are named");
    scenario("\"A2\"", "\"A|2\"", "12:54", "\"A|2\"", "may not be empty or contain");
    scenario(wall, "[wall]\nname = \"\"\n", "15:8", "\"\"", "may not be empty");
    let empty = "vehicles = []";
    let vehicles =
        "vehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"20t\" } ]";
    scenario(vehicles, empty, "12:12", "[]", "has no vehicles");
    scenario("inner = \"c\"\n", "", "8:1", "[[train]]", "no inner");
    let behind = "{ name = \"A2\", mass = \"20t\", behind = \"c\" }";
    scenario(vehicle, behind, "12:74", "behind", "nothing behind the last");
    let zone = "{ name = \"A2\", mass = \"20t\", front = { mass = \"20t\", curve = \"k\" } }";
    scenario(vehicle, zone, "12:67", "\"20t\"", "have all of its mass");
    scenario("curve = \"c\"", "curve = \"d\"", "17:9", "\"d\"", "no curve \"d\" in [curves]");
    scenario("inner = \"c\"", "inner = \"cc\"", "11:9", "\"cc\"", "did you mean \"c\"?");
    let c_is = |text: &str| format!("{{ file = \"c.csv\", {text} }}");
    scenario(c, "{ stages = [] }", "5:16", "[]", "stages is empty");
    scenario(c, &c_is("case = \"a/b\""), "5:23", "case", "case belongs to a database");
    scenario(c, &c_is("tension = \"kk\""), "5:33", "\"kk\"", "did you mean \"k\"?");
    scenario(c, &c_is("tension = \"c\""), "5:33", "\"c\"", "no tension or damping of its own");
    scenario("\"10m/s\"", "\"-10m/s\"", "10:9", "\"-10m/s\"", "never meets");
    scenario(c, "{ law = \"elastic\" }", "5:5", "{ law = \"elastic\" }", "needs exactly one of");
    scenario(c, "{ database = \"d.h5\" }", "5:18", "\"d.h5\"", "write case =");
    scenario(c, "{ database = \"d.h5\", case = \"x\" }", "5:33", "\"x\"", "write case =");
    let short = "{ stroke = \"0.5m\", to = \"1MN\" }, { stroke = \"0.1mm\" }";
    scenario("{ stroke = \"0.5m\", to = \"1MN\" }", short, "6:62", "\"0.1mm\"", "stroke of");
    scenario(c, "{ file = \"d.csv\" }", "5:14", "\"d.csv\"", "No such file");
    scenario(c, "{ model = \"d.model\" }", "5:15", "\"d.model\"", "No such file");
    scenario(c, &c_is("band = 0.5"), "5:30", "0.5", "band needs a model");
    scenario(c, &c_is("scale = -1.0"), "5:31", "-1.0", "expected more than 0");
    scenario(
        c,
        &c_is("damping = { coefficient_N_s_per_m = [ -1.0 ] }"),
        "5:33",
        "{ coefficient_N_s_per_m = [ -1.0 ] }",
        "coefficient",
    );
    scenario("\"100ms\"", "\"1000000000s\"", "2:12", "\"1000000000s\"", "shorten the duration");
    let interval = "\"100ms\"\noutput_interval = \"1s\"";
    scenario("\"100ms\"", interval, "3:19", "\"1s\"", "longer than the duration");
    let short = "\"100ms\"\n\n[curves]\nc = { file = \"c.csv\" }";
    let long = "\"300ms\"\n\n[curves]\nc = { file = \"c.csv\", end = \"error\", scale = 0.3 }";
    scenario(short, long, "5:29", "\"error\"", "beyond the end of its curve");
    let resisting = "inner = \"c\"\nresistance = { braking = -1.0 }";
    scenario("inner = \"c\"", resisting, "12:14", "{ braking = -1.0 }", "expected 0 or more");
    scenario("duration", "duratoin", "2:1", "duratoin", "did you mean \"duration\"?");
    scenario(
        "speed = \"10m/s\"",
        "speed = \"10m/sec\"",
        "10:9",
        "\"10m/sec\"",
        "did you mean \"m/s\"?",
    );
}

#[test]
fn errors_of_a_plan_show_their_place() {
    let plan = |text: &str| format!("[contact]\ncurve = \"c\"\n\n[sweep]\n{text}");
    let t = |text: &str, place: &str, marked: &str, expected: &str| {
        scenario("[contact]\ncurve = \"c\"\n", &plan(text), place, marked, expected);
    };
    let speed = "[[sweep.vary]]\nwhat = \"speed\"\ntrain = \"A\"\n";
    let even = "from = \"5m/s\"\nto = \"9m/s\"\nsteps = 3\n";
    t("vary = []\n", "19:1", "[sweep]", "varies nothing");
    t(&format!("samples = 3\n{speed}{even}"), "20:11", "3", "no variable has a distribution");
    t(
        &format!("sampling = \"latin_hypercube\"\n{speed}{even}"),
        "20:12",
        "\"latin_hypercube\"",
        "no variable",
    );
    t(&format!("results = []\n{speed}{even}"), "20:11", "[]", "name each result once");
    t(&format!("{speed}values = []\n"), "23:10", "[]", "values is empty");
    t(&format!("{speed}from = \"5m/s\"\nto = \"9m/s\"\nsteps = 1\n"), "25:9", "1", "steps is 1");
    t(&format!("{speed}values = [\"5\"]\n"), "23:10", "[\"5\"]", "has no unit");
    t(speed, "20:1", "[[sweep.vary]]", "give values");
    let other = speed.replace("\"A\"", "\"C\"");
    t(&format!("{other}{even}"), "22:9", "\"C\"", "there is no train \"C\"");
    let mass =
        "[[sweep.vary]]\nwhat = \"mass\"\nvehicle = \"A11\"\nfactor = true\nvalues = [1.0]\n";
    t(mass, "22:11", "\"A11\"", "did you mean \"A1\"?");
    let band = "[[sweep.vary]]\nwhat = \"band\"\ncurve = \"c\"\nvalues = [0.0]\n";
    t(band, "22:9", "\"c\"", "has no band");
    t(&format!("{speed}interface = \"contact\"\n{even}"), "23:1", "interface", "does not go with");
}

/// With `--json` an error is one document on standard output, and nothing else is said.
#[test]
fn errors_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    fs::write(here.join("study.toml"), STUDY.replace("\"wall\"", "\"pair\"")).unwrap();
    fs::write(here.join("s.toml"), SCENARIO.replace("\"c.csv\"", "\"none.csv\"")).unwrap();
    fs::write(here.join("text.h5"), "hello\n").unwrap();
    let nodout = fixture("fe/lead-car-wall/25kmh/nodout");
    let nodout = nodout.to_str().unwrap();
    let t = |arguments: &[&str], status: i32, code: &str| -> Value {
        let output = crumple_in(here, &[arguments, &["--json"]].concat());
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(status), "{arguments:?}: {text}");
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{arguments:?}");
        let document: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(document["error"]["code"], code, "{arguments:?}: {document}");
        assert!(!document["error"]["message"].as_str().unwrap().contains('\n'), "{document}");
        document["error"].clone()
    };
    let study = t(&["build", "study.toml", "-o", "c.h5"], 1, "study");
    assert_eq!(
        (&study["file"], &study["line"], &study["column"]),
        (&"study.toml".into(), &5.into(), &9.into())
    );
    let scenario = t(&["simulate", "s.toml"], 1, "io");
    assert_eq!((&scenario["line"], &scenario["column"]), (&5.into(), &14.into()));
    t(&["build", "none.toml", "-o", "c.h5"], 1, "io");
    t(&["db", "ls", "text.h5"], 1, "database");
    t(&["inspect", "text.h5"], 1, "solver_file");
    let guess = t(&["histories", nodout, "--component", "x_velocty"], 1, "solver_file");
    assert_eq!(guess["hint"], "did you mean \"x_velocity\"?");
    let group = t(&["train", "curves.h5", "--group", "lead-car-wal", "-o", "m"], 1, "database");
    assert_eq!(group["hint"], "did you mean \"lead-car-wall\"?");
    let command = t(&["bild"], 2, "usage");
    assert_eq!(command["hint"], "a similar subcommand exists: 'build'");
    let option = t(&["db", "ls", "--qiet"], 2, "usage");
    assert!(option["hint"].as_str().unwrap().contains("--quiet"), "{option}");
    t(&["predict", "m", "--speed", "36"], 2, "usage");
    t(&["histories", nodout, "-o", "a.parquet"], 2, "usage");
}

#[test]
fn without_arguments_the_order_of_work() {
    let help = crumple_fails(Path::new("."), 2, &[]);
    let at =
        |word: &str| help.find(&format!("crumple {word} ")).unwrap_or_else(|| panic!("{help}"));
    let order = ["inspect", "build", "validate", "train", "predict", "simulate", "report"];
    assert!(order.windows(2).all(|pair| at(pair[0]) < at(pair[1])), "{help}");
}

/// The commands of a help text.
fn commands(help: &str) -> Vec<String> {
    let listed = help.split("\nCommands:\n").nth(1).map(|rest| rest.split("\n\n").next().unwrap());
    let names = listed
        .into_iter()
        .flat_map(str::lines)
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names
        .map(|line| line.split_whitespace().next().unwrap().to_string())
        .filter(|name| name != "help")
        .collect()
}

#[test]
fn global_options_have_their_heading_and_every_command_its_page() {
    let folder = tempfile::tempdir().unwrap();
    crumple_ok(folder.path(), &["man", "-o", "man/man1"]);
    let pages = folder.path().join("man/man1");
    let mut expected = 0;
    let mut left: Vec<Vec<String>> = vec![Vec::new()];
    while let Some(command) = left.pop() {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let help = crumple_ok(folder.path(), &[&words[..], &["--help"]].concat());
        assert!(!help.contains('\\'), "quotes of the source are not part of the help: {help}");
        let global = help.split("\nGlobal options:\n").nth(1).unwrap_or_else(|| panic!("{help}"));
        for option in ["--json", "--quiet", "--strict", "--help", "--version"] {
            assert!(global.contains(option), "{words:?} {option}: {help}");
            let before = help.split("\nGlobal options:\n").next().unwrap();
            assert!(!before.contains(&format!("  {option}")), "{words:?} {option}: {help}");
        }
        let name = [&["crumple"], &words[..]].concat().join("-");
        let page = fs::read_to_string(pages.join(format!("{name}.1"))).unwrap();
        assert!(page.contains(&format!(".TH {name} ")), "{page}");
        expected += 1;
        left.extend(commands(&help).into_iter().map(|sub| [&command[..], &[sub]].concat()));
    }
    assert_eq!(pages.read_dir().unwrap().count(), expected);
    assert!(expected > 20, "{expected}");
}

/// A file of one long line, such as a model where a scenario is meant, does not fill the log.
#[test]
fn a_long_line_is_shown_in_part() {
    let folder = tempfile::tempdir().unwrap();
    let text =
        format!("{{\"format\":\"crumple model\",\"forces\":[{}0]}}\n", "1.5,".repeat(10_000));
    fs::write(folder.path().join("m.model"), text).unwrap();
    let error = crumple_fails(folder.path(), 1, &["simulate", "m.model"]);
    assert!(error.contains("1 | {\"format\":\"crumple model\""), "{error}");
    assert!(error.lines().all(|line| line.chars().count() <= 200), "{error}");
}

/// What crumple prints on a terminal of so many columns, without the terminal's line ends.
#[cfg(target_os = "linux")]
fn on_a_terminal(folder: &Path, columns: usize, arguments: &str) -> String {
    let program = env!("CARGO_BIN_EXE_crumple");
    let output = Command::new("script")
        .args([
            "-qec",
            &format!("stty rows 40 cols {columns}; '{program}' {arguments}"),
            "/dev/null",
        ])
        .current_dir(folder)
        .env_remove("COLUMNS")
        .env("NO_COLOR", "1")
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap();
    String::from_utf8_lossy(&output.stdout).replace("\r\n", "\n")
}

/// Whether a text sets a colour or style; progress moves the cursor, which is neither.
#[cfg(target_os = "linux")]
fn has_colour(text: &str) -> bool {
    let mut sequences = text.split("\x1b[").skip(1);
    sequences.any(|rest| {
        rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';').starts_with('m')
    })
}

/// Tables and plots fit 60 columns, a pipe gets them whole, and NO_COLOR leaves no escape sequence.
#[cfg(target_os = "linux")]
#[test]
fn sixty_columns_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    build_fixture(here, "lead-car-wall");
    let piped = crumple_ok(here, &["db", "ls", "curves.h5"]);
    assert!(piped.lines().any(|line| line.chars().count() > 60), "{piped}");
    for arguments in ["db ls curves.h5", "db show curves.h5 --group lead-car-wall --case 36kmh"] {
        for columns in [60, 72] {
            let text = on_a_terminal(here, columns, arguments);
            assert!(!has_colour(&text), "{text}");
            // Sentences and paths are as long as they are.
            let is_table = |line: &&str| !line.contains(": ") && !line.starts_with("from ");
            for line in text.lines().filter(is_table) {
                assert!(line.chars().count() <= columns, "{columns}: {line}\n{text}");
            }
        }
    }
    let whole = crumple_ok(here, &["db", "ls", "curves.h5"]);
    assert_eq!(on_a_terminal(here, 300, "db ls curves.h5"), whole);
    // Every cell is in the narrow one too.
    let narrow = on_a_terminal(here, 60, "db ls curves.h5");
    for word in whole.split_whitespace() {
        assert!(narrow.contains(word), "{word} is not in\n{narrow}");
    }
    let help = on_a_terminal(here, 60, "");
    assert!(help.contains("The usual order of work"), "{help}");
    assert!(help.lines().all(|line| line.chars().count() <= 60), "{help}");
    fs::write(here.join("study.toml"), STUDY.replace("\"wall\"", "\"pair\"")).unwrap();
    let error = on_a_terminal(here, 60, "build study.toml -o c.h5");
    assert!(error.contains("5 | kind  = \"pair\"\n  |         ^^^^^^\n"), "{error}");
    assert!(!has_colour(&error), "{error:?}");
}
