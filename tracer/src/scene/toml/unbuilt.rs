//! Keys of the format that no integrator has yet: they are refused by name, not as unknown.

/// Tables, as named in messages or by the beginning of that name, with their keys and the feature that is missing.
const UNBUILT: &[(&str, &[&str], &str)] = &[
    ("[camera]", &["shutter"], "motion blur"),
    ("[[model]]", &["translate_end", "rotate_end"], "motion blur"),
    ("[[sphere]]", &["center_end"], "motion blur"),
];

/// The message about a key that is not built yet.
pub(super) fn refusal(owner: &str, key: &str) -> Option<String> {
    let of_table = UNBUILT.iter().filter(|(table, ..)| owner.starts_with(table));
    let (.., what) = of_table.into_iter().find(|(_, keys, _)| keys.contains(&key))?;
    Some(format!("{what} (`{key}` in {owner}) is not supported yet; leave it out"))
}
