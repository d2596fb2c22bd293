//! Pages that are made: the command line from `--help`, exit codes and error codes from the types.
//!
//! CRUMPLE_WRITE_DOCS=1 cargo test --locked --release --test all pages

use std::fmt::Write;

use crate::common::{crumple_ok, root};
use crumple::failure::EXIT_CODES;
use serde_json::Value;

fn hold(name: &str, made: &str) {
    let path = root().join("docs").join(name);
    if std::env::var_os("CRUMPLE_WRITE_DOCS").is_some() {
        std::fs::write(&path, made).unwrap();
    }
    let there = std::fs::read_to_string(&path).unwrap();
    assert!(there == made, "docs/{name} is not what the program says; see tests/pages.rs");
}

/// The names below `Commands:` of a help text.
fn subcommands(help: &str) -> Vec<String> {
    let below = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = below.take_while(|line| !line.is_empty()).filter_map(|line| {
        let name = line.strip_prefix("  ").filter(|l| !l.starts_with(' '))?.split(' ').next()?;
        (name != "help").then(|| name.to_string())
    });
    names.collect()
}

fn describe(page: &mut String, command: &[String]) {
    let arguments: Vec<&str> = command.iter().map(String::as_str).chain(["--help"]).collect();
    let help = crumple_ok(root(), &arguments);
    let name = [&["crumple".to_string()], command].concat().join(" ");
    writeln!(
        page,
        "\n{} {name}\n\n```text\n{}\n```",
        "#".repeat(2 + command.len().min(2)),
        help.trim_end()
    )
    .unwrap();
    for inner in subcommands(&help) {
        describe(page, &[command, &[inner]].concat());
    }
}

#[test]
fn the_command_line_is_described() {
    let mut page = String::from(
        "# Command line\n\nThe output of `crumple COMMAND --help` for every command.\n",
    );
    describe(&mut page, &[]);
    assert!(
        page.matches("\n### crumple ").count() >= 18 && page.contains("\n#### crumple db copy\n")
    );
    hold("command-line.md", &page);
}

#[test]
fn exit_codes_and_error_codes_are_described() {
    let mut page = String::from(
        "# Exit codes and error codes\n\nScripts can rely on both: codes never change their meaning.\n\n| exit code | meaning |\n|---|---|\n",
    );
    for (code, meaning) in EXIT_CODES {
        writeln!(page, "| {code} | {meaning} |").unwrap();
    }
    page += "\nWith `--json` an error is a document on standard output ([its schema](../schemas/error.schema.json)): its code, the\nmessage, the causes that the message does not contain, and the file, line and column where they are known.\n\n| error code | meaning |\n|---|---|\n";
    let schema = std::fs::read_to_string(root().join("schemas/error.schema.json")).unwrap();
    let schema: Value = serde_json::from_str(&schema).unwrap();
    for code in schema["$defs"]["ErrorCode"]["oneOf"].as_array().unwrap() {
        let (name, meaning) =
            (code["const"].as_str().unwrap(), code["description"].as_str().unwrap());
        writeln!(page, "| `{name}` | {} |", meaning.replace('\n', " ")).unwrap();
    }
    hold("error-codes.md", &page);
}

/// How a value is written, by its type.
const WRITTEN: [(&str, &str); 7] = [
    ("ForceText", "force, `\"2.5MN\"`"),
    ("ImpactSpeedText", "speed, `\"36km/h\"`"),
    ("LengthText", "length, `\"30mm\"`"),
    ("MassText", "mass, `\"24t\"`"),
    ("SignedSpeedText", "speed, `\"36km/h\"` or `\"-10m/s\"`"),
    ("StiffnessText", "stiffness, `\"80MN/m\"`"),
    ("TimeText", "time, `\"0.75ms\"`"),
];

/// The value of a key in words.
fn value(schema: &Value, of: &Value) -> String {
    if let Some(name) = of["$ref"].as_str().and_then(|path| path.strip_prefix("#/$defs/")) {
        let there = &schema["$defs"][name];
        if let Some((_, written)) = WRITTEN.iter().find(|(of, _)| *of == name) {
            return (*written).into();
        }
        if there["properties"].is_object() {
            return format!("table [{}](#{})", title(name), title(name).replace(' ', "-"));
        }
        if let Some(names) = there["oneOf"].as_array() {
            let names = names.iter().filter_map(|of| of["const"].as_str());
            return names.map(|name| format!("`\"{name}\"`")).collect::<Vec<_>>().join(", ");
        }
        return value(schema, there);
    }
    if let Some(any) = of["anyOf"].as_array() {
        let any = any.iter().filter(|of| of["type"] != "null");
        return any.map(|of| value(schema, of)).collect::<Vec<_>>().join(" or ");
    }
    let kinds = match &of["type"] {
        Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).collect(),
        kind => kind.as_str().into_iter().collect::<Vec<_>>(),
    };
    let kinds = kinds.into_iter().filter(|kind| *kind != "null").map(|kind| match kind {
        "array" => format!("list of: {}", value(schema, &of["items"])),
        "object" => format!("table of: {}", value(schema, &of["additionalProperties"])),
        "string" => "text".into(),
        "boolean" => "`true`, `false`".into(),
        other => other.into(),
    });
    kinds.collect::<Vec<_>>().join(" or ")
}

/// The heading of a table, from its type's name.
fn title(name: &str) -> String {
    let name = name.strip_suffix("Table").unwrap_or(name);
    let mut title = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !title.is_empty() {
            title.push(' ');
        }
        title.extend(letter.to_lowercase());
    }
    title
}

fn in_a_line(text: &Value) -> String {
    text.as_str().unwrap_or_default().replace('\n', " ").replace('|', "\\|")
}

/// The keys of a table, and what its named values mean.
fn describe_table(page: &mut String, schema: &Value, name: &str) {
    let table = &schema["$defs"][name];
    writeln!(page, "\n### {}\n\n{}\n", title(name), in_a_line(&table["description"])).unwrap();
    page.push_str("| key | value | meaning |\n|---|---|---|\n");
    let required: Vec<&str> =
        table["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let keys = table["properties"].as_object().unwrap();
    let (first, rest): (Vec<_>, Vec<_>) =
        keys.iter().partition(|(key, _)| required.contains(&key.as_str()));
    let mut meanings = String::new();
    for (key, of) in first.into_iter().chain(rest) {
        let needed = if required.contains(&key.as_str()) { " (needed)" } else { "" };
        let meaning = in_a_line(&of["description"]);
        writeln!(page, "| `{key}`{needed} | {} | {meaning} |", value(schema, of)).unwrap();
        let named = of["$ref"].as_str().or_else(|| of["anyOf"][0]["$ref"].as_str());
        let named = named.or_else(|| of["items"]["$ref"].as_str());
        let named = named.and_then(|path| path.strip_prefix("#/$defs/")).unwrap_or_default();
        for one in schema["$defs"][named]["oneOf"].as_array().into_iter().flatten() {
            let Some(name) = one["const"].as_str() else { continue };
            writeln!(meanings, "- `{key} = \"{name}\"`: {}", in_a_line(&one["description"]))
                .unwrap();
        }
    }
    if !meanings.is_empty() {
        writeln!(page, "\n{meanings}").unwrap();
        page.truncate(page.trim_end().len());
        page.push('\n');
    }
}

/// Parts of a scenario: heading, tables, and a whole scenario that uses them.
#[rustfmt::skip]
const PARTS: [(&str, &[&str], &str); 6] = [
    ("Times and curves", &["RunTable", "CurveTable", "StageTable", "DampingTable"], "\
[run]
duration = \"250ms\"

[curves.coupler]   # a draft gear, then a deformation tube; the pull of the coupler has a slack
stages = [
    { name = \"draft gear\", stroke = \"60mm\", from = \"50kN\", to = \"0.6MN\" },
    { name = \"deformation tube\", stroke = \"400mm\", from = \"1MN\" },
]
unloading = \"20MN/m\"
damping = { speed_m_per_s = [0.0, 5.0], coefficient_N_s_per_m = [20e3, 60e3] }
tension = \"pull\"

[curves.pull]
stages = [ { stroke = \"50mm\", from = \"0.4MN\" } ]
gap = \"4mm\"
unloading = \"40MN/m\"

[curves.nose]
stages = [ { stroke = \"0.8m\", from = \"2MN\" } ]
unloading = \"80MN/m\"

[[train]]
name = \"A\"
speed = \"10km/h\"
inner = \"coupler\"
vehicles = [ { name = \"A1\", mass = \"24t\" }, { name = \"A2\", mass = \"20t\" } ]

[wall]

[contact]
curve = \"nose\"
"),
    ("Trains", &["TrainTable", "VehicleTable", "CrushZoneTable", "Resistance"], "\
[run]
duration = \"300ms\"

[curves]
nose = { stages = [ { stroke = \"1m\", from = \"2MN\" } ], unloading = \"80MN/m\" }
pads = { stages = [ { stroke = \"0.2m\", from = \"1MN\", to = \"8MN\" } ], unloading = \"80MN/m\", gap = \"50mm\" }
end = { stages = [ { stroke = \"0.5m\", from = \"1.5MN\" } ], unloading = \"80MN/m\" }

[[train]]
name = \"A\"
speed = \"36km/h\"
inner = \"end\"
gap = \"32mm\"
resistance = { constant_m_per_s2 = 0.02, braking = 0.1 }
vehicles = [
    { name = \"A1\", mass = \"24t\", front = { mass = \"0.8t\", curve = \"nose\" } },
    { name = \"A2\", mass = \"20t\", gap = \"100mm\" },
    { name = \"A3\", mass = \"20t\" },
]

[[train]]          # it stands
name = \"B\"
speed = \"0km/h\"
vehicles = [ { name = \"B1\", mass = \"90t\" } ]

[contact]
curve = \"pads\"
"),
    ("First contact", &["ContactTable", "WallTable"], "\
[run]
duration = \"200ms\"

[curves]
nose = { stages = [ { stroke = \"1m\", from = \"2MN\" } ], unloading = \"80MN/m\" }

[[train]]
name = \"A\"
speed = \"18km/h\"   # half of the closing speed of two equal trains: the wall is their plane of symmetry
vehicles = [ { name = \"A1\", mass = \"24t\" } ]

[wall]
name = \"plane\"

[contact]
curve = \"nose\"
gap = \"20mm\"
"),
    ("Limits", &["LimitsTable"], "\
[run]
duration = \"400ms\"

[curves]
nose = { stages = [ { stroke = \"1m\", from = \"1MN\" } ], unloading = \"80MN/m\" }

[[train]]
name = \"A\"
speed = \"25km/h\"
vehicles = [ { name = \"A1\", mass = \"24t\" } ]

[wall]

[contact]
curve = \"nose\"

[limits]
standard = \"EN 15227\"
edition = \"2020+A1:2024\"
mean_deceleration_g = 5.0
secondary_impact = \"8m/s\"
occupant_load_g = 8.0
"),
    ("FE's run", &["ReferenceTable"], ""),
    ("Sweeps", &["Plan", "Vary"], "\
[sweep]
samples = 200
results = [\"max_deflection\", \"mean_deceleration\", \"over_limits\"]
vary = [
    { what = \"speed\", train = \"A\", distribution = \"uniform\", from = \"15km/h\", to = \"30km/h\" },
    { what = \"force\", curve = \"nose\", distribution = \"normal\", mean = 1.0, sd = 0.1 },
]
"),
];

/// Every table of a scenario has its section, and every example runs without a warning.
#[test]
fn scenarios_are_described() {
    let schema = std::fs::read_to_string(root().join("schemas/scenario.schema.json")).unwrap();
    let schema: Value = serde_json::from_str(&schema).unwrap();
    let mut page = String::from(
        "# Scenarios: every key\n\nA scenario is a TOML file. This page is made from its [schema](../schemas/scenario.schema.json); [multi-body\nruns](multi-body.md) say what the parts do. An end of a vehicle that comes from a model needs no curves of its\nown: [ends from a model](multi-body.md#ends-from-a-model).\n\n![Speeds of three vehicles that hit three others](../examples/train_set.svg)\n",
    );
    let folder = tempfile::tempdir().unwrap();
    let mut described = Vec::new();
    let mut before = "";
    for (heading, tables, own) in PARTS {
        // A sweep is of the scenario above it.
        let example =
            if heading == "Sweeps" { format!("{before}\n{own}") } else { own.to_string() };
        before = if own.is_empty() { before } else { own };
        writeln!(page, "\n## {heading}").unwrap();
        if !example.is_empty() {
            writeln!(page, "\n```toml\n{example}```").unwrap();
            std::fs::write(folder.path().join("a.toml"), &example).unwrap();
            let run = crumple_ok(folder.path(), "simulate a.toml --json --strict");
            let run: Value = serde_json::from_str(&run).unwrap();
            assert!(run["summary"]["interfaces"][0]["peak_force_N"].as_f64().unwrap() > 0.0);
            if heading == "Sweeps" {
                crumple_ok(folder.path(), "sweep a.toml -o a.csv --strict");
            }
        }
        for name in tables {
            describe_table(&mut page, &schema, name);
            described.push(*name);
        }
    }
    for (name, table) in schema["$defs"].as_object().unwrap() {
        let is_described = described.contains(&name.as_str()) || !table["properties"].is_object();
        assert!(is_described, "{name} has no section");
    }
    hold("scenario.md", &page);
}
