//! This machine, and now.

use time::OffsetDateTime;

pub fn host_name() -> String {
    let name = system::host::name();
    let plain = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let name: String = name.trim().chars().filter(plain).take(40).collect();
    if name.is_empty() { "localhost".to_owned() } else { name }
}

/// Name, kind of system and cores of this machine, as a reader of results is told.
pub fn words() -> String {
    let (system, kind) = (std::env::consts::OS, std::env::consts::ARCH);
    format!("{}, {system} {kind}, {} cores", host_name(), worker::processors::cores())
}

/// The present date and time in words, UTC: `2026-11-25 16:40 UTC`.
pub fn now() -> String {
    let now = OffsetDateTime::now_utc();
    let (year, month, day) = now.to_calendar_date();
    format!("{year}-{:02}-{day:02} {:02}:{:02} UTC", u8::from(month), now.hour(), now.minute())
}
