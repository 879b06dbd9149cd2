//! Keys of the format that no integrator has yet: they are refused by name, not as unknown.

/// Tables, as named in messages or by the beginning of that name, with their keys and the feature that is missing.
const UNBUILT: &[(&str, &[&str], &str)] = &[
    ("[render]", &["seed", "max_noise", "clamp_indirect"], "the path integrator"),
    ("[render]", &["exposure", "tone"], "tone mapping"),
    ("[camera]", &["aperture", "focus_distance"], "a lens with an aperture"),
    ("[camera]", &["shutter"], "motion blur"),
    (
        "[material.",
        &["metallic", "roughness", "transmission", "specular_factor"],
        "a metallic-roughness material",
    ),
    ("[[model]]", &["translate_end", "rotate_end"], "motion blur"),
    ("[[sphere]]", &["center_end"], "motion blur"),
    ("the scene file", &["volume"], "a volume"),
];

/// The message about a key that is not built yet.
pub(super) fn refusal(owner: &str, key: &str) -> Option<String> {
    let of_table = UNBUILT.iter().filter(|(table, ..)| owner.starts_with(table));
    let (.., what) = of_table.into_iter().find(|(_, keys, _)| keys.contains(&key))?;
    Some(format!("{what} (`{key}` in {owner}) is not supported yet; leave it out"))
}
