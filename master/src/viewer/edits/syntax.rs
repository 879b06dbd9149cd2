//! The syntax of edits: a line of text to a command.

use std::path::PathBuf;

use glam::DVec3;
use rayfarm_text::printable;

use super::edit::{Edit, EditCommand, ObjectEdit, SetKey};

/// Value that removes a key.
const DEFAULT: &str = "default";

/// Tables whose keys are set directly.
const SECTIONS: [&str; 2] = ["background", "render"];

impl EditCommand {
    /// Parses a line that begins with `word`, if that is a command of the editor.
    ///
    /// # Errors
    /// The mistake in the line, and the expected syntax.
    pub(crate) fn parse(word: &str, rest: &str) -> Option<Result<Self, String>> {
        let rest = rest.trim();
        Some(match word {
            "object" => object(rest),
            "material" => material(rest),
            "light" => light(rest),
            "background" if rest.starts_with('{') => {
                Ok(Self::Change(Edit::ReplaceBackground(rest.to_owned())))
            }
            "background" | "render" => section(word, rest),
            "ambient" => value(word, "VALUE", rest)
                .map(|value| Self::Change(Edit::Top(SetKey { key: word.to_owned(), value }))),
            "undo" => alone(word, rest, Self::Undo),
            "redo" => alone(word, rest, Self::Redo),
            "save" if rest.is_empty() => Err("save needs an argument: the file to write".to_owned()),
            "save" => Ok(Self::Save(PathBuf::from(unquoted(rest)))),
            _ => return None,
        })
    }
}

fn alone(word: &str, rest: &str, command: EditCommand) -> Result<EditCommand, String> {
    match rest {
        "" => Ok(command),
        more => Err(format!("{word} takes no argument, but \"{}\" follows it", printable(more))),
    }
}

fn object(rest: &str) -> Result<EditCommand, String> {
    let (word, rest) = split(rest);
    if word == "list" {
        return alone("object list", rest, EditCommand::ListObjects);
    }
    if word == "add" {
        let (kind, keys) = split(rest);
        return match keys {
            "" => Err("object add: expected KIND KEY = VALUE, ...; for example \
                       object add sphere center = [0, 1, 0], radius = 0.5"
                .to_owned()),
            keys => Ok(EditCommand::Change(Edit::AddObject { kind: kind.to_owned(), keys: keys.to_owned() })),
        };
    }
    if word.is_empty() {
        return Err("object: expected add, move, rotate, scale, set, remove or list".to_owned());
    }
    let name_needed = || format!("object {}: expected the name or number of an object", printable(word));
    let (name, rest) = name(rest).ok_or_else(name_needed)?;
    let edit = match word {
        "move" => ObjectEdit::Move(vector("object move", rest)?),
        "rotate" => ObjectEdit::Rotate(vector("object rotate", rest)?),
        "scale" => ObjectEdit::Scale(factors("object scale", rest)?),
        "remove" => match rest {
            "" => ObjectEdit::Remove,
            more => return Err(format!("object remove: \"{}\" follows the name", printable(more))),
        },
        "set" => ObjectEdit::Set(set_key("object set NAME", rest)?),
        other => {
            return Err(format!(
                "object: expected add, move, rotate, scale, set, remove or list, not \"{}\"",
                printable(other)
            ));
        }
    };
    Ok(EditCommand::Change(Edit::Object(name, edit)))
}

fn material(rest: &str) -> Result<EditCommand, String> {
    let (name, rest) = name(rest).ok_or("material: expected NAME KEY VALUE")?;
    Ok(EditCommand::Change(Edit::Material { name, set: set_key("material NAME", rest)? }))
}

fn light(rest: &str) -> Result<EditCommand, String> {
    let (word, rest) = split(rest);
    let number = |word: &str| {
        let expected = "light: expected a number from 1, add, or remove";
        word.parse().ok().filter(|number| *number > 0).ok_or(expected)
    };
    Ok(EditCommand::Change(match (word, rest) {
        ("add", "") => return Err("light add: expected KEY = VALUE, ...".to_owned()),
        ("add", keys) => Edit::AddLight(keys.to_owned()),
        ("remove", which) => Edit::RemoveLight(number(which)?),
        (word, rest) => Edit::Light { number: number(word)?, set: set_key("light N", rest)? },
    }))
}

fn section(word: &str, rest: &str) -> Result<EditCommand, String> {
    let set = set_key(word, rest)?;
    let name = SECTIONS.into_iter().find(|name| *name == word).unwrap_or(SECTIONS[0]);
    Ok(EditCommand::Change(Edit::Section { name, set }))
}

/// Parses `KEY VALUE`.
fn set_key(command: &str, rest: &str) -> Result<SetKey, String> {
    let (key, rest) = split(rest);
    if key.is_empty() {
        return Err(format!("{command}: expected KEY VALUE"));
    }
    Ok(SetKey { key: key.to_owned(), value: value(command, "KEY VALUE", rest)? })
}

/// Parses a value; `None` for the default.
fn value(command: &str, expected: &str, rest: &str) -> Result<Option<String>, String> {
    match rest {
        "" => Err(format!("{command}: expected {expected}; the value {DEFAULT} removes the key")),
        DEFAULT => Ok(None),
        value => Ok(Some(value.to_owned())),
    }
}

/// Splits off the first word.
fn split(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim())
}

/// Splits off a name, which is in double quotes if it has spaces.
fn name(text: &str) -> Option<(String, &str)> {
    let (name, rest) = match text.strip_prefix('"') {
        Some(quoted) => quoted.split_once('"').map(|(name, rest)| (name, rest.trim()))?,
        None => split(text),
    };
    (!name.is_empty()).then(|| (name.to_owned(), rest))
}

fn unquoted(text: &str) -> &str {
    text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text)
}

/// Parses numbers that are separated by spaces or commas.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let words = text.split([' ', '\t', ',']).filter(|word| !word.is_empty());
    words.map(|word| word.parse().ok().filter(|number: &f64| number.is_finite())).collect()
}

fn vector(command: &str, text: &str) -> Result<DVec3, String> {
    match numbers(text).as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("{command}: expected NAME X Y Z, with three numbers")),
    }
}

fn factors(command: &str, text: &str) -> Result<DVec3, String> {
    match numbers(text).as_deref() {
        Some(&[factor]) => Ok(DVec3::splat(factor)),
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("{command}: expected NAME FACTOR, or NAME X Y Z with three factors")),
    }
}
