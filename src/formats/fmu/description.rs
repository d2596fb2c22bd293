//! modelDescription.xml of FMI 2.0 and 3.0, and FMI 3's buildDescription.xml.

use super::{FmiVersion, Spring};
use crate::multibody::ForceLaw;
use crate::words::escaped;

/// What a variable is.
enum Role {
    Input,
    /// May be set at events.
    Parameter,
    /// The law's own until initialization sets another; only where the law has one.
    UnloadingStiffness,
    /// With the variables that it follows from in the initialization. Later the parameters are not among them, since
    /// they are set at events only.
    Output(&'static [u32]),
    /// Changes sign where a linear segment of the law ends.
    EventIndicator,
}

struct Variable {
    name: &'static str,
    /// As in c/spring.h. 2 is kept for a rate of deflection, should a law come to depend on it.
    reference: u32,
    role: Role,
    unit: Option<&'static str>,
    description: &'static str,
}

const DEFLECTION: u32 = 1;
const FORCE_SCALE: u32 = 7;
const UNLOADING_STIFFNESS: u32 = 10;

/// In this order FMI 2 counts them from 1.
const VARIABLES: [Variable; 9] = [
    Variable {
        name: "deflection",
        reference: DEFLECTION,
        role: Role::Input,
        unit: Some("m"),
        description: "Deflection, positive in compression",
    },
    Variable {
        name: "force",
        reference: 3,
        role: Role::Output(&[DEFLECTION, FORCE_SCALE]),
        unit: Some("N"),
        description: "Force, positive in compression",
    },
    Variable {
        name: "stored_energy",
        reference: 4,
        role: Role::Output(&[DEFLECTION, FORCE_SCALE, UNLOADING_STIFFNESS]),
        unit: Some("J"),
        description: "Energy that comes back in unloading",
    },
    Variable {
        name: "dissipated_energy",
        reference: 5,
        role: Role::Output(&[DEFLECTION, FORCE_SCALE, UNLOADING_STIFFNESS]),
        unit: Some("J"),
        description: "Energy that does not come back",
    },
    Variable {
        name: "max_deflection",
        reference: 6,
        role: Role::Output(&[DEFLECTION]),
        unit: Some("m"),
        description: "Maximum deflection so far",
    },
    Variable {
        name: "force_scale",
        reference: FORCE_SCALE,
        role: Role::Parameter,
        unit: None,
        description: "Factor of force and energies, above 0",
    },
    Variable {
        name: "unloading_stiffness",
        reference: UNLOADING_STIFFNESS,
        role: Role::UnloadingStiffness,
        unit: Some("N/m"),
        description: "Unloading stiffness: sets the energy returned in unloading; above 0",
    },
    Variable {
        name: "past_knot",
        reference: 8,
        role: Role::EventIndicator,
        unit: Some("m"),
        description: "Deflection beyond the lower end of its straight piece of the law, at most 1",
    },
    Variable {
        name: "before_knot",
        reference: 9,
        role: Role::EventIndicator,
        unit: Some("m"),
        description: "Deflection left to the upper end of its straight piece of the law, at most 1",
    },
];

const LOG_CATEGORIES: &str = r#"  <LogCategories>
    <Category name="logStatusError" description="Calls that were refused"/>
    <Category name="logStatusWarning" description="Warnings"/>
  </LogCategories>
  <DefaultExperiment startTime="0" stopTime="0.2" stepSize="0.00005"/>
"#;

pub(super) fn model_description(
    spring: &Spring<'_>,
    version: FmiVersion,
    name: &str,
    token: &str,
    sources: &[&str],
) -> String {
    let description = match (spring.name, spring.description) {
        (name, "") => escaped(name),
        (name, description) => escaped(&format!("{name}: {description}")),
    };
    let tool = concat!("crumple ", env!("CARGO_PKG_VERSION"));
    let head = r#"<?xml version="1.0" encoding="UTF-8"?>"#;
    let about = format!(
        r#"modelName="{name}" description="{description}" generationTool="{tool}" variableNamingConvention="flat""#
    );
    match version {
        FmiVersion::Fmi2 => format!(
            "{head}\n<fmiModelDescription fmiVersion=\"2.0\" guid=\"{token}\" {about} numberOfEventIndicators=\"{}\">\n{}{}{LOG_CATEGORIES}{}</fmiModelDescription>\n",
            VARIABLES.iter().filter(|v| matches!(v.role, Role::EventIndicator)).count(),
            interfaces_2(name, sources),
            units(false),
            variables_2(spring.law),
        ),
        FmiVersion::Fmi3 => format!(
            "{head}\n<fmiModelDescription fmiVersion=\"3.0\" instantiationToken=\"{token}\" {about}>\n{}{}{LOG_CATEGORIES}{}</fmiModelDescription>\n",
            interfaces_3(name),
            units(true),
            variables_3(spring.law),
        ),
    }
}

fn interfaces_2(name: &str, sources: &[&str]) -> String {
    let files: String =
        sources.iter().map(|file| format!("      <File name=\"{file}\"/>\n")).collect();
    let both = format!(
        r#"modelIdentifier="{name}" canNotUseMemoryManagementFunctions="true" canGetAndSetFMUstate="true" canSerializeFMUstate="true" providesDirectionalDerivative="true""#
    );
    let interface = |element: &str, own: &str| {
        format!(
            "  <{element} {both} {own}>\n    <SourceFiles>\n{files}    </SourceFiles>\n  </{element}>\n"
        )
    };
    interface("ModelExchange", r#"completedIntegratorStepNotNeeded="false""#)
        + &interface(
            "CoSimulation",
            r#"canHandleVariableCommunicationStepSize="true" canInterpolateInputs="true" maxOutputDerivativeOrder="0""#,
        )
}

fn interfaces_3(name: &str) -> String {
    let both = format!(
        r#"modelIdentifier="{name}" canGetAndSetFMUState="true" canSerializeFMUState="true" providesDirectionalDerivatives="true" providesAdjointDerivatives="true""#
    );
    format!(
        "  <ModelExchange {both} needsCompletedIntegratorStep=\"true\"/>\n  <CoSimulation {both} canHandleVariableCommunicationStepSize=\"true\" hasEventMode=\"true\"/>\n"
    )
}

fn units(with_time: bool) -> String {
    let mut all = vec![("m", r#"m="1""#), ("N", r#"kg="1" m="1" s="-2""#)];
    all.extend([("J", r#"kg="1" m="2" s="-2""#), ("N/m", r#"kg="1" s="-2""#)]);
    if with_time {
        all.push(("s", r#"s="1""#));
    }
    let each = all.iter().map(|(name, base)| {
        format!("    <Unit name=\"{name}\">\n      <BaseUnit {base}/>\n    </Unit>\n")
    });
    format!("  <UnitDefinitions>\n{}  </UnitDefinitions>\n", each.collect::<String>())
}

/// Unloading stiffness of a law in N/m; `None` if it is followed back.
fn stiffness(law: &ForceLaw) -> Option<f64> {
    law.memory.as_ref().map(|memory| memory.stiffness_n_per_m)
}

/// The variables of a law.
fn variables(law: &ForceLaw) -> impl Iterator<Item = &'static Variable> {
    let has_stiffness = stiffness(law).is_some();
    VARIABLES.iter().filter(move |v| has_stiffness || v.reference != UNLOADING_STIFFNESS)
}

/// Causality and the other attributes of a role, and the start value.
fn role(role: &Role, law: &ForceLaw) -> (&'static str, Option<String>) {
    match role {
        Role::Input => (r#"causality="input" variability="continuous""#, Some("0".into())),
        Role::Parameter => {
            (r#"causality="parameter" variability="tunable" initial="exact""#, Some("1".into()))
        }
        Role::UnloadingStiffness => (
            r#"causality="parameter" variability="fixed" initial="exact""#,
            stiffness(law).map(|stiffness| format!("{stiffness:?}")),
        ),
        Role::Output(_) => {
            (r#"causality="output" variability="continuous" initial="calculated""#, None)
        }
        Role::EventIndicator => {
            (r#"causality="local" variability="continuous" initial="calculated""#, None)
        }
    }
}

/// Unit and start value as attributes.
fn value(variable: &Variable, start: Option<String>) -> String {
    let unit = variable.unit.map_or(String::new(), |unit| format!(" unit=\"{unit}\""));
    unit + &start.map_or(String::new(), |start| format!(" start=\"{start}\""))
}

fn variables_2(law: &ForceLaw) -> String {
    let mut described = String::new();
    for variable in variables(law) {
        let Variable { name, reference, description, .. } = variable;
        let (attributes, start) = role(&variable.role, law);
        described += &format!(
            "    <ScalarVariable name=\"{name}\" valueReference=\"{reference}\" {attributes} description=\"{description}\">\n      <Real{}/>\n    </ScalarVariable>\n",
            value(variable, start)
        );
    }
    // FMI 2 names variables by their place.
    let place = |reference: u32| {
        variables(law).position(|v| v.reference == reference).map_or(0, |at| at + 1)
    };
    let unknown = |reference: u32, known: &[u32]| {
        let knowns: Vec<String> = known.iter().map(|r| place(*r).to_string()).collect();
        format!("      <Unknown index=\"{}\" {}/>\n", place(reference), dependencies(&knowns))
    };
    let (outputs, initial) = unknowns(law, unknown);
    format!(
        "  <ModelVariables>\n{described}  </ModelVariables>\n  <ModelStructure>\n    <Outputs>\n{outputs}    </Outputs>\n    <InitialUnknowns>\n{initial}    </InitialUnknowns>\n  </ModelStructure>\n"
    )
}

fn variables_3(law: &ForceLaw) -> String {
    let mut described = String::from(
        "    <Float64 name=\"time\" valueReference=\"0\" causality=\"independent\" variability=\"continuous\" description=\"Time\" unit=\"s\"/>\n",
    );
    for variable in variables(law) {
        let Variable { name, reference, description, .. } = variable;
        let (attributes, start) = role(&variable.role, law);
        described += &format!(
            "    <Float64 name=\"{name}\" valueReference=\"{reference}\" {attributes} description=\"{description}\"{}/>\n",
            value(variable, start)
        );
    }
    let unknown = |element: &str, reference: u32, known: &[u32]| {
        let knowns: Vec<String> = known.iter().map(u32::to_string).collect();
        format!("    <{element} valueReference=\"{reference}\" {}/>\n", dependencies(&knowns))
    };
    let (outputs, _) = unknowns(law, |reference, known| unknown("Output", reference, known));
    let (_, initial) =
        unknowns(law, |reference, known| unknown("InitialUnknown", reference, known));
    let indicators: String = (VARIABLES.iter())
        .filter(|variable| matches!(variable.role, Role::EventIndicator))
        .map(|variable| unknown("EventIndicator", variable.reference, &[DEFLECTION]))
        .collect();
    format!(
        "  <ModelVariables>\n{described}  </ModelVariables>\n  <ModelStructure>\n{outputs}{initial}{indicators}  </ModelStructure>\n"
    )
}

/// Every output, as written for the run and for the initialization.
fn unknowns(law: &ForceLaw, write: impl Fn(u32, &[u32]) -> String) -> (String, String) {
    let (mut outputs, mut initial) = (String::new(), String::new());
    let is_there = |known: &u32| variables(law).any(|variable| variable.reference == *known);
    for variable in variables(law) {
        if let Role::Output(known) = variable.role {
            let known: Vec<u32> = known.iter().copied().filter(is_there).collect();
            outputs += &write(variable.reference, &[DEFLECTION]);
            initial += &write(variable.reference, &known);
        }
    }
    (outputs, initial)
}

fn dependencies(known: &[String]) -> String {
    let kinds = vec!["dependent"; known.len()].join(" ");
    format!("dependencies=\"{}\" dependenciesKind=\"{kinds}\"", known.join(" "))
}

pub(super) fn build_description(name: &str, sources: &[&str]) -> String {
    let files: String =
        sources.iter().map(|file| format!("      <SourceFile name=\"{file}\"/>\n")).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n  <BuildConfiguration modelIdentifier=\"{name}\">\n    <SourceFileSet language=\"C99\">\n{files}    </SourceFileSet>\n  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )
}
