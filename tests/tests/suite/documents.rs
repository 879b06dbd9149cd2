//! Documents compared with the programs and the tree of files: commands, options, scene keys, and paths.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use rayfarm_tests::{Running, Scenes, master, project_root, worker};
use rayfarm_tracer::scene::RenderSettings;
use rayfarm_tracer::scene::knobs::{KNOBS, Knob, KnobForm};

/// Documents that describe the options of both programs.
const OPTION_DOCUMENTS: [&str; 2] = ["docs/guide.md", "docs/quality.md"];
const SCENE_DOCUMENT: &str = "docs/scene-format.md";
/// Documents that name files and folders of the project, seen from its root.
const MAPS: [&str; 2] = ["ARCHITECTURE.md", "CONTRIBUTING.md"];

/// Paths in these documents that are no files of the project: a pattern for the names of records.
const NOT_A_PATH: &str = "PROCESSOR/DATE-NAME.csv";

/// Document with the table of knobs, and the heading above it.
const KNOBS_DOCUMENT: &str = "docs/quality.md";
const KNOBS_HEADING: &str = "\n## Knobs\n";

/// Options in these documents that `--help` does not list: hidden aliases, and options of cargo.
const NOT_IN_HELP: [&str; 2] = ["trace", "release"];

/// A scene that ends where an unknown key is refused, for each table.
const TABLES: [&str; 22] = [
    "",
    "[render]\n",
    "[camera]\n",
    "[background]\n",
    "[[light]]\n",
    "[material.a]\n",
    "[material.a.diffuse]\n",
    "[material.a.diffuse]\nchecker = []\n",
    "[material.a.normal_map]\n",
    "[[model]]\n",
    "[[sphere]]\n",
    "[[plane]]\n",
    "[[disk]]\n",
    "[[triangle]]\n",
    "[[rectangle]]\n",
    "[[box]]\n",
    "[[group]]\n",
    "[[camera_key]]\ntime = 0\n[[camera_key]]\n",
    "[[model]]\nfile = \"a.obj\"\n[[model.key]]\ntime = 0\n[[model.key]]\n",
    "[[sphere]]\n[[sphere.key]]\ntime = 0\n[[sphere.key]]\n",
    "[[light]]\n[[light.key]]\ntime = 0\n[[light.key]]\n",
    "[[group]]\n[[group.key]]\ntime = 0\n[[group.key]]\n",
];

fn document(name: &str) -> String {
    std::fs::read_to_string(project_root().join(name)).expect(name)
}

fn help(mut program: Command, command: Option<&str>) -> String {
    program.args(command).arg("--help");
    Running::start(&mut program).finish().expect_success().stdout
}

/// The commands that the master's help lists.
fn commands() -> Vec<String> {
    let help = help(master(), None);
    let listed =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = listed.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}

/// The help of each command of the master, and of the worker, by name.
fn all_help() -> Vec<(String, String)> {
    let of_command = |name: String| (name.clone(), help(master(), Some(&name)));
    let mut all: Vec<_> = commands().into_iter().map(of_command).collect();
    all.push(("worker".to_owned(), help(worker(), None)));
    all
}

/// The name at the beginning of a text, as options have it.
fn name(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(text.len());
    text[..end].trim_end_matches('-')
}

/// Options that a text names anywhere, without their dashes.
fn mentioned(text: &str) -> BTreeSet<String> {
    let names = text.match_indices("--").map(|(at, dashes)| name(&text[at + dashes.len()..]));
    names.filter(|name| !name.is_empty() && !name.starts_with('-')).map(str::to_owned).collect()
}

/// Options that a help text defines, one a line.
fn defined(help: &str) -> BTreeSet<String> {
    let definitions = help.lines().map(str::trim_start).filter(|line| line.starts_with('-'));
    let options = definitions.filter_map(|line| Some(name(&line[line.find("--")? + 2..]).to_owned()));
    options.filter(|name| !name.is_empty()).collect()
}

/// What is in code spans and code blocks of a document.
fn code(document: &str) -> String {
    document.split('`').skip(1).step_by(2).collect::<Vec<_>>().join("\n")
}

/// Code spans of a document that consist of letters, digits and what else paths consist of. Fenced blocks do not count.
fn spans(document: &str) -> impl Iterator<Item = &str> {
    let outside_fences = document.split("```").step_by(2);
    let spans = outside_fences.flat_map(|text| text.split('`').skip(1).step_by(2));
    spans.filter(|span| span.chars().all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c)))
}

/// Adds the names of all files below a folder. Hidden folders and build products do not count.
fn add_file_names(folder: &Path, names: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if !entry.file_type().unwrap().is_dir() {
            names.insert(name);
        } else if !name.starts_with('.') && name != "target" {
            add_file_names(&entry.path(), names);
        }
    }
}

/// Cells of the first table after a heading, without its head. An escaped bar does not end a cell.
fn table_after(document: &str, heading: &str) -> Vec<Vec<String>> {
    const BAR: &str = "\u{1}";
    let document = document.replace("\\|", BAR);
    let (_, text) = document.split_once(heading).expect(heading);
    let is_row = |line: &&str| line.starts_with('|');
    let rows = text.lines().skip_while(|line| !is_row(line)).take_while(is_row).skip(2);
    let cells = |row: &str| row.split('|').map(|cell| cell.trim().replace(BAR, "|")).collect::<Vec<_>>();
    rows.map(|row| cells(row.trim_matches('|'))).collect()
}

/// A knob's option as documents write it.
fn documented_option(knob: &Knob) -> String {
    let (option, words) = (knob.option, knob.words().collect::<Vec<_>>().join("|"));
    match (knob.form, knob.best().word) {
        (KnobForm::Switch, Some("off")) => format!("`--{option}[=on|off]`"),
        (KnobForm::Switch, _) => format!("`--{option} on|off`"),
        (KnobForm::Count(_), _) => format!("`--{option} N`"),
        (KnobForm::Number(range), _) => format!("`--{option} {}`", if range.whole { "N" } else { "X" }),
        (KnobForm::Word | KnobForm::Fraction, _) => format!("`--{option} {words}`"),
    }
}

/// A knob's scene key with its default as documents write them.
fn documented_key(knob: &Knob) -> String {
    let key = knob.key;
    match (knob.form, knob.value_of(&RenderSettings::default().setting()).word) {
        (_, None) => format!("`{key}`"),
        (KnobForm::Switch, Some(word)) => format!("`{key} = {}`", word == "on"),
        (KnobForm::Word, Some(word)) => format!("`{key} = \"{word}\"`"),
        (KnobForm::Count(_) | KnobForm::Fraction | KnobForm::Number(_), Some(word)) => {
            format!("`{key} = {word}`")
        }
    }
}

#[test]
fn code_spans_with_paths_are_found() {
    let document = "`a/b.rs`, `--x y`\n```sh\n`c/d`\n```\n`e.rs`";
    assert_eq!(spans(document).collect::<Vec<_>>(), ["a/b.rs", "e.rs"]);
}

#[test]
fn files_that_the_maps_name_exist() {
    let root = project_root();
    let mut names = BTreeSet::new();
    add_file_names(root, &mut names);
    for map in MAPS {
        let document = document(map);
        let missing: Vec<&str> = spans(&document)
            .filter(|span| *span != NOT_A_PATH)
            .filter(|span| match span.contains('/') {
                true => !root.join(span).exists(),
                false => span.ends_with(".rs") && !names.contains(*span),
            })
            .collect();
        assert!(missing.is_empty(), "{map} names files that do not exist: {missing:?}");
    }
}

#[test]
fn the_documented_knobs_are_those_of_the_table() {
    let rows = table_after(&document(KNOBS_DOCUMENT), KNOBS_HEADING);
    for knob in KNOBS {
        let (option, key) = (documented_option(knob), documented_key(knob));
        let row = rows.iter().find(|row| row.first() == Some(&option));
        let row = row.unwrap_or_else(|| panic!("{KNOBS_DOCUMENT} has no {option} among {rows:?}"));
        assert!(row.get(1).is_some_and(|cell| cell.starts_with(&key)), "{key} of {row:?}");
        assert!(row.get(2).is_some_and(|effect| !effect.is_empty()), "{row:?}");
    }
    assert_eq!(rows.len(), KNOBS.len(), "{KNOBS_DOCUMENT} has other rows among {rows:?}");
}

#[test]
fn options_are_read_from_help_and_documents() {
    let help =
        "Options:\n  -o, --output <FILE>  As in --size\n      --adaptive[=<on|off>]\n          - no option\n";
    let names = |set: BTreeSet<String>| set.into_iter().collect::<Vec<_>>();
    assert_eq!(names(defined(help)), ["adaptive", "output"]);
    assert_eq!(names(mentioned("| --- | `--up y` --- and `--no-cache`,--x")), ["no-cache", "up", "x"]);
}

#[test]
fn every_command_is_in_the_guide() {
    let guide = document("docs/guide.md");
    for command in commands() {
        let usages =
            ["{} ", "{}`", "[{}] "].map(|form| format!("`rayfarm-master {}", form.replace("{}", &command)));
        assert!(usages.iter().any(|usage| guide.contains(usage)), "docs/guide.md has no command {command}");
    }
}

#[test]
fn options_of_documents_and_programs_are_the_same() {
    let documents = OPTION_DOCUMENTS.map(document).join("\n");
    let documented = mentioned(&documents);
    let mut known: BTreeSet<String> = NOT_IN_HELP.map(str::to_owned).into();
    for (command, help) in all_help() {
        for option in defined(&help) {
            assert!(documented.contains(&option), "{OPTION_DOCUMENTS:?} have no --{option} of {command}");
        }
        known.extend(mentioned(&help));
    }
    let unknown: Vec<&String> = documented.difference(&known).collect();
    assert!(unknown.is_empty(), "{OPTION_DOCUMENTS:?} name options that no program has: {unknown:?}");
}

#[test]
fn every_scene_key_is_documented() {
    let scenes = Scenes::new();
    let documented = code(&document(SCENE_DOCUMENT));
    let words: BTreeSet<&str> = documented.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').collect();
    for table in TABLES {
        scenes.write("unknown.toml", format!("{table}qqqqqqqqq = 1\n"));
        let mut explain = master();
        explain.arg("explain").arg(scenes.path("unknown.toml"));
        let message = Running::start(&mut explain).finish().expect_failure(2, &["known here: "]).stderr;
        let (_, known) = message.split_once("known here: ").unwrap();
        for key in known.split('`').skip(1).step_by(2) {
            assert!(words.contains(key), "{SCENE_DOCUMENT} has no key {key} of {table}");
        }
    }
}

#[test]
fn the_example_with_all_scene_keys_loads() {
    let scenes = Scenes::new();
    let document = document(SCENE_DOCUMENT);
    let (_, example) = document.split_once("```toml\n").unwrap();
    let (example, _) = example.split_once("```").unwrap();
    scenes.write("example.toml", example);
    scenes.write("wood.png", b"P6\n1 1\n255\n\xff\xff\xff");
    scenes.write("table.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
    let mut explain = master();
    explain.arg("explain").arg(scenes.path("example.toml"));
    Running::start(&mut explain).finish().expect_success();
}
