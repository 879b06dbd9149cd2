//! Recorded transcripts: files that hold a script together with the actions that follow it.
//!
//! The first line of a file is `policy POLICY`. The lines that begin with `>` are the script, and the other lines are the
//! actions. A test fails when the actions differ from those of the file. With the environment variable `RAYFARM_UPDATE=1` it
//! writes the actual actions into the file instead.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::transcript;

/// Environment variable that makes tests rewrite their recorded transcripts when it is `1`.
const UPDATE: &str = "RAYFARM_UPDATE";

/// Replays the script of `transcripts/NAME.txt`, whose content is `recorded`, and compares the actions. With `RAYFARM_UPDATE=1`
/// the file is rewritten if they differ.
///
/// # Panics
/// If the actions differ, with the differing lines and the command that accepts them; or if the file cannot be written.
#[track_caller]
pub(crate) fn check(name: &str, recorded: &str) {
    let Err(changed) = compare(name, recorded) else { return };
    if std::env::var(UPDATE).is_ok_and(|value| value == "1") {
        let path = folder().join(format!("{name}.txt"));
        std::fs::write(&path, changed.actual).unwrap();
        println!("{}: rewritten", path.display());
    } else {
        panic!("{}", changed.message);
    }
}

/// A transcript that differs from the recorded one.
struct Changed {
    /// The content that the file should have.
    actual: String,
    /// The differing lines, and the command that accepts them.
    message: String,
}

/// Replays a recorded script and compares the actions.
fn compare(name: &str, recorded: &str) -> Result<(), Changed> {
    let recorded: Vec<_> = recorded.lines().collect();
    let Some(policy) = recorded.first().and_then(|line| line.strip_prefix("policy ")) else {
        panic!("the first line of transcripts/{name}.txt is not `policy POLICY`");
    };
    let script: Vec<_> = recorded.iter().filter_map(|line| line.strip_prefix("> ")).collect();
    let actual = format!("policy {policy}\n{}", transcript(policy, &script.join("\n")));
    let lines: Vec<_> = actual.lines().collect();
    if lines == recorded {
        return Ok(());
    }
    let message = format!(
        "the actions differ from transcripts/{name}.txt (-: recorded, +: actual):\n{}\nTo accept them: {UPDATE}=1 cargo test \
         --workspace {name}",
        difference(&recorded, &lines)
    );
    Err(Changed { actual, message })
}

/// The folder of the recorded transcripts.
pub(crate) fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("transcripts")
}

/// Lines of two texts in order: common ones after two spaces, those of the first only after `- `, of the second only after `+ `.
/// Common lines are a longest common subsequence.
fn difference(first: &[&str], second: &[&str]) -> String {
    // common[i][j]: length of the longest common subsequence of first[i..] and second[j..].
    let mut common = vec![vec![0_usize; second.len() + 1]; first.len() + 1];
    for i in (0..first.len()).rev() {
        for j in (0..second.len()).rev() {
            common[i][j] = if first[i] == second[j] {
                common[i + 1][j + 1] + 1
            } else {
                common[i + 1][j].max(common[i][j + 1])
            };
        }
    }
    let (mut i, mut j) = (0, 0);
    let mut lines = String::new();
    while i < first.len() || j < second.len() {
        let (mark, line) = if i < first.len() && j < second.len() && first[i] == second[j] {
            (i, j) = (i + 1, j + 1);
            (' ', first[i - 1])
        } else if j == second.len() || (i < first.len() && common[i + 1][j] >= common[i][j + 1]) {
            i += 1;
            ('-', first[i - 1])
        } else {
            j += 1;
            ('+', second[j - 1])
        };
        writeln!(lines, "{mark} {line}").unwrap();
    }
    lines
}

#[test]
fn a_difference_marks_removed_and_added_lines() {
    let first = ["begin 1", "1: ping 0", "finished 1"];
    let second = ["begin 1", "2: ping 0", "finished 1", "begin 2"];
    let expected = "  begin 1\n- 1: ping 0\n+ 2: ping 0\n  finished 1\n+ begin 2\n";
    assert_eq!(difference(&first, &second), expected);
    assert_eq!(difference(&[], &second[..1]), "+ begin 1\n");
    assert_eq!(difference(&first[..1], &[]), "- begin 1\n");
}

#[test]
fn a_changed_transcript_has_the_actual_actions_and_the_update_command() {
    let recorded = "policy static:10\n> 0 frame 1 10x10\nbegin 1\n";
    assert!(compare("begin", recorded).is_ok());
    assert!(compare("begin", &recorded.replace('\n', "\r\n")).is_ok(), "line ends do not count");
    let Err(changed) = compare("begin", &recorded.replace("begin 1", "begin 2")) else {
        panic!("another frame begins");
    };
    assert_eq!(changed.actual, recorded);
    for line in ["- begin 2", "+ begin 1", "RAYFARM_UPDATE=1 cargo test --workspace begin"] {
        assert!(changed.message.contains(line), "{}", changed.message);
    }
}
