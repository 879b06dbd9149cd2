//! `check-numerics`: checks of the numerics on a scene, as a table. The checks are in [`rayfarm_tracer::numerics`].

use std::io::{self, Write};
use std::path::Path;

use rayfarm_tracer::numerics::{self, Effort, Outcome, Subject};
use rayfarm_tracer::simd_level;
use serde::Serialize;

use super::source::Source;
use crate::app::cli::{CheckNumericsArgs, ModelArgs};
use crate::app::reports::print_json;
use crate::display::numbers::grouped;
use crate::error::CommandError;

/// Report of a scene; `--json` prints it as one line.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Report {
    scene: String,
    /// SIMD level with which all others are compared.
    simd_level: &'static str,
    holds: bool,
    checks: Vec<Row>,
}

/// A case of a check.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Row {
    check: String,
    case: String,
    /// Unit of the counts: rays, pixels or bytes.
    unit: &'static str,
    tested: u64,
    at_edges: u64,
    wrong: u64,
    /// First of `failures`.
    #[serde(skip_serializing_if = "Option::is_none")]
    first_wrong: Option<String>,
    /// A line for each of the first failures.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    failures: Vec<String>,
}

/// Checks a scene, or the built-in ones, and prints the counts on standard output.
///
/// # Errors
/// A wrong scene, or one with a failed check.
pub(super) fn run(args: &CheckNumericsArgs) -> Result<(), CommandError> {
    let default = Effort::default();
    let effort = Effort { rays: args.rays.unwrap_or(default.rays), pixels: args.pixels, ..default };
    if let Some(number) = args.ray {
        return replay(args.scene.as_deref(), args.models, &effort, number);
    }
    let mut broken = Vec::new();
    for subject in subjects(args.scene.as_deref(), args.models)? {
        let outcomes = numerics::run(&subject, &effort).map_err(CommandError::wrong_input)?;
        let report = report(&subject, &outcomes);
        if args.json {
            print_json(&report)?;
        } else {
            print(&table(&report))?;
        }
        if !report.holds {
            broken.push(report.scene);
        }
    }
    if broken.is_empty() {
        return Ok(());
    }
    Err(CommandError::Failed(format!("the numbers do not hold: {}", broken.join(", "))))
}

/// Traces one ray of the check for leaks again and prints everything about it.
fn replay(scene: Option<&Path>, models: ModelArgs, effort: &Effort, number: u64) -> Result<(), CommandError> {
    let mut found = false;
    for subject in subjects(scene, models)? {
        if let Some(text) = numerics::replay(&subject, effort, number).map_err(CommandError::wrong_input)? {
            print(&format!("{}, {}: {text}", subject.name, simd_level()))?;
            found = true;
        }
    }
    if found {
        return Ok(());
    }
    let message = "--ray: the scene has no models; rays are aimed at the edges and vertices of models only";
    Err(CommandError::WrongInput(message.into()))
}

fn subjects(scene: Option<&Path>, models: ModelArgs) -> Result<Vec<Subject>, CommandError> {
    let Some(path) = scene else {
        if let Some(option) = models.of_a_model() {
            return Err(CommandError::WrongInput(format!("{option} is for a bare model: name one")));
        }
        return numerics::built_in().map_err(CommandError::failed);
    };
    let Source { name, scene, meshes, textures, .. } = Source::load(path, models, None)?;
    Ok(vec![Subject { name, scene, meshes, textures }])
}

fn report(subject: &Subject, outcomes: &[Outcome]) -> Report {
    let row = |outcome: &Outcome| Row {
        check: outcome.check.to_string(),
        case: outcome.case.clone(),
        unit: outcome.unit,
        tested: outcome.tested,
        at_edges: outcome.at_edges,
        wrong: outcome.wrong,
        first_wrong: outcome.failures.first().cloned(),
        failures: outcome.failures.clone(),
    };
    Report {
        scene: subject.name.clone(),
        simd_level: simd_level(),
        holds: outcomes.iter().all(Outcome::holds),
        checks: outcomes.iter().map(row).collect(),
    }
}

/// A line for each case, under the scene's name.
fn table(report: &Report) -> String {
    let outcome = if report.holds { "holds" } else { "DOES NOT HOLD" };
    let mut text = format!("{}, {}: {outcome}\n", report.scene, report.simd_level);
    let line = |check: &str, case: &str, tested: &str, edges: &str, wrong: &str| {
        format!("  {check:<7} {case:<34} {tested:>18} {edges:>12} {wrong:>10}\n")
    };
    text += &line("check", "case", "tested", "at edges", "wrong");
    for row in &report.checks {
        let tested = format!("{} {}", grouped(row.tested), row.unit);
        text += &line(&row.check, &row.case, &tested, &grouped(row.at_edges), &grouped(row.wrong));
        text.extend(row.failures.iter().map(|what| format!("          {what}\n")));
        let named = row.failures.len() as u64;
        if named > 0 && row.wrong > named {
            text += &format!("          and {} more\n", grouped(row.wrong - named));
        }
    }
    text
}

fn print(text: &str) -> Result<(), CommandError> {
    io::stdout()
        .lock()
        .write_all(text.as_bytes())
        .map_err(|error| CommandError::Failed(format!("standard output: {error}")))
}

#[cfg(test)]
mod tests {
    use rayfarm_tracer::numerics::Check;

    use super::*;

    fn outcome(check: Check, wrong: u64) -> Outcome {
        let failures = vec!["pixel (1, 2)".to_owned(); usize::from(wrong > 0)];
        Outcome { check, case: "a case".into(), unit: "rays", tested: 12_345, at_edges: 6, wrong, failures }
    }

    #[test]
    fn one_wrong_count_fails_the_scene_and_is_in_the_table() {
        let subject = numerics::built_in().unwrap().remove(0);
        let fine = report(&subject, &[outcome(Check::Leaks, 0), outcome(Check::Acne, 0)]);
        assert!(fine.holds && table(&fine).starts_with("a plane, ") && table(&fine).contains(": holds\n"));
        let broken = report(&subject, &[outcome(Check::Leaks, 0), outcome(Check::Acne, 7)]);
        let text = table(&broken);
        assert!(!broken.holds && text.contains("DOES NOT HOLD"), "{text}");
        let line = text.lines().find(|line| line.contains("acne")).unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(words, ["acne", "a", "case", "12,345", "rays", "6", "7"]);
        assert!(text.ends_with("\n          pixel (1, 2)\n          and 6 more\n"), "{text}");
    }

    #[test]
    fn single_rays_need_a_scene_with_models() {
        let effort = Effort::default();
        assert!(replay(None, ModelArgs::default(), &effort, 7_001).is_ok());
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("plane.toml");
        let text = "[camera]\nposition = [0, 1, 3]\nlook_at = [0, 0, 0]\n[material.m]\n\
                    [[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nmaterial = \"m\"\n";
        std::fs::write(&scene, text).unwrap();
        let message = replay(Some(&scene), ModelArgs::default(), &effort, 7).unwrap_err().to_string();
        assert!(message.contains("no models"), "{message}");
    }

    #[test]
    fn without_a_scene_the_built_in_ones_are_checked() {
        assert!(subjects(None, ModelArgs::default()).unwrap().len() > 1);
        let message =
            subjects(Some(Path::new("nowhere.toml")), ModelArgs::default()).unwrap_err().to_string();
        assert!(message.contains("nowhere.toml"), "{message}");
    }
}
