//! FIT: whether the certificates that a master is started with are a master's, and of the lab that lets newcomers in.

use std::path::Path;

use protocol::tls::{self, Paths, Role};

/// Looks at the folder of `--certs`, and at that of `--lab`.
///
/// # Errors
/// What does not fit, and what to do.
pub fn check(certs: &Path, lab: Option<&Path>) -> Result<(), String> {
    let paths = Paths::in_folder(certs);
    let identity = tls::identity_of_file(&paths.certificate).map_err(|e| e.to_string())?;
    if identity.role != Role::Master {
        return Err(format!(
            "{} is the certificate of the {} {:?}, with which workers and clients take nobody for their master: make one with \
             `bolide certs host LAB master --role master --address ADDRESS` and give --certs LAB/master",
            paths.certificate.display(),
            identity.role,
            identity.name
        ));
    }
    let Some(lab) = lab else { return Ok(()) };
    let pins = |path: &Path| tls::pins_of_file(path).map_err(|e| e.to_string());
    let (own, of_lab) = (pins(&paths.ca)?, pins(&lab.join("ca.pem"))?);
    if own.iter().any(|pin| of_lab.contains(pin)) {
        return Ok(());
    }
    Err(format!(
        "--lab {} is another CA than that of {}: whom it gives a certificate this master would refuse; give the lab that made {}, or make the \
         master's certificate in {} with `bolide certs host`",
        lab.display(),
        paths.ca.display(),
        certs.display(),
        lab.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certs::{make_ca, make_host};

    #[test]
    fn a_master_has_its_own_role_and_the_ca_of_its_lab() {
        let folder = tempfile::tempdir().expect("room for a folder");
        let [lab, other] = ["lab", "other"].map(|name| folder.path().join(name));
        for (lab, name, role) in
            [(&lab, "master", Role::Master), (&lab, "me", Role::Client), (&other, "master", Role::Master)]
        {
            let _ = make_ca(lab, false);
            make_host(lab, name, &[], role, false).expect("a host");
        }
        assert_eq!(check(&lab.join("master"), None), Ok(()));
        assert_eq!(check(&lab.join("master"), Some(&lab)), Ok(()));
        let why = check(&lab.join("me"), None).expect_err("a client's");
        assert!(why.contains("of the client \"me\"") && why.contains("--role master"), "{why}");
        let why = check(&other.join("master"), Some(&lab)).expect_err("another CA");
        assert!(why.starts_with("--lab") && why.contains("another CA"), "{why}");
    }
}
