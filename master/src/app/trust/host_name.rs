//! The name of this machine.

/// Name of this machine, of letters, digits and hyphens; `None` where it is not known.
pub(super) fn host_name() -> Option<String> {
    let file = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let command = || {
        let output = std::process::Command::new("hostname").output().ok()?;
        String::from_utf8(output.stdout).ok()
    };
    let name = file.or_else(command)?;
    let name: String = name.trim().chars().filter(|it| it.is_ascii_alphanumeric() || *it == '-').collect();
    (!name.is_empty()).then_some(name)
}
