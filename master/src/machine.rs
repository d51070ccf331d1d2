//! This machine.

pub fn host_name() -> String {
    let name = system::host::name();
    let plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let name: String = name.trim().chars().filter(plain).take(40).collect();
    if name.is_empty() { "localhost".to_owned() } else { name }
}
