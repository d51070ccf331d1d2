//! Programs that the service manager of Windows starts: on Unix systemd or another starts them, by a file of its own.

use std::path::{Path, PathBuf};

use crate::{Body, Service};

/// Where a service starts that names no folder.
///
/// # Errors
/// Always.
pub fn folder(name: &str) -> Result<PathBuf, String> {
    refuse(name)
}

/// Registers a service.
///
/// # Errors
/// Always.
pub fn install(service: &Service) -> Result<Vec<String>, String> {
    refuse(&service.name)
}

/// Stops a service and takes it out of the list.
///
/// # Errors
/// Always.
pub fn remove(name: &str) -> Result<(), String> {
    refuse(name)
}

/// Runs as a service.
///
/// # Errors
/// Always.
pub fn run(name: &str, _folder: &Path, _body: Body) -> Result<(), String> {
    refuse(name)
}

fn refuse<T>(name: &str) -> Result<T, String> {
    Err(format!(
        "service {name}: only Windows keeps services in this way; here systemd starts Bolide, by `systemctl enable --now bolide-worker@1`: deploy/systemd/README.md"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_wants_a_service_hears_of_systemd() {
        let why = folder("bolide-worker").unwrap_err();
        assert!(why.contains("bolide-worker: ") && why.contains("deploy/systemd"), "{why}");
        assert_eq!(remove("bolide-worker"), Err(why.clone()));
        assert_eq!(run("bolide-worker", Path::new("/"), Box::new(|| 0)), Err(why));
    }
}
