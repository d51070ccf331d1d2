//! How faults of TLS are put into words.

/// The fault in plain words.
pub fn explain(error: &std::io::Error) -> String {
    error.to_string()
}
