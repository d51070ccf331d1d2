//! The CA's folder as a running master uses it: tokens, and certificates that are revoked.
//!
//! `tokens/ID` is a token that was issued, `tokens/ID.used` one that was exchanged: the one is renamed to the other, so
//! that a token is good once, whoever else issues or takes tokens at the same time and whatever dies in between. ID is a
//! hash; the secret is in nobody's file. `issued/` has every certificate, `revoked` the fingerprints that count no more.

use std::{
    collections::BTreeSet,
    fs,
    io::ErrorKind,
    net::IpAddr,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use protocol::{
    tls::{self, Revoked, Role},
    token::Token,
};
use serde::{Deserialize, Serialize};
use system::Readers;
use tokio::sync::watch;

use crate::certs::{self, Error};

/// How often the list of revoked certificates is looked at.
const LOOK: Duration = Duration::from_secs(1);
/// Most tokens that wait to be used.
pub const TOKENS_LIMIT: usize = 10_000;
/// Most bytes of the list of revoked certificates.
const REVOKED_LIMIT: u64 = 16 << 20;

/// Held while a token is exchanged, so that a name is given once.
static ISSUING: Mutex<()> = Mutex::new(());

/// What a token is good for.
#[derive(Debug, Serialize, Deserialize)]
struct Grant {
    role: Role,
    /// Last second (s since 1970).
    expires: u64,
}

#[derive(Clone, Debug)]
pub struct CaFolder {
    folder: PathBuf,
}

impl CaFolder {
    /// Takes the folder of a CA that stands there, key and all.
    ///
    /// # Errors
    /// [`Error::NoAuthority`].
    pub fn open(folder: &Path) -> Result<Self, Error> {
        for name in ["ca.pem", "ca-key.pem"] {
            let path = folder.join(name);
            if !path.is_file() {
                return Err(Error::NoAuthority(path));
            }
        }
        Ok(Self { folder: folder.to_owned() })
    }

    /// Issues a token for a host of this role, good once within so many hours.
    ///
    /// # Errors
    /// If the disk refuses, or too many wait to be used.
    pub fn issue(&self, role: Role, hours: u64) -> Result<Token, Error> {
        let tokens = self.folder.join("tokens");
        certs::create_folder(&tokens)?;
        let fault = |error| Error::Io { path: tokens.clone(), error };
        let waiting = fs::read_dir(&tokens).map_err(fault)?.filter_map(Result::ok);
        let waiting = waiting.filter(|entry| entry.path().extension().is_none()).count();
        if waiting >= TOKENS_LIMIT {
            let path = tokens.display();
            return Err(Error::Rule(format!(
                "{waiting} tokens wait in {path}, at most {TOKENS_LIMIT}; remove some"
            )));
        }
        let pins = tls::pins_of_file(&self.folder.join("ca.pem")).map_err(|e| Error::Rule(e.to_string()))?;
        let pin = *pins.first().ok_or_else(|| Error::NoAuthority(self.folder.join("ca.pem")))?;
        let token = Token { pin, secret: tls::secret().map_err(|e| Error::Rule(e.to_string()))? };
        let grant = Grant { role, expires: now().saturating_add(hours.saturating_mul(3600)) };
        let text = serde_json::to_string(&grant).map_err(|e| Error::Rule(e.to_string()))?;
        certs::write(&tokens.join(token.id()), &text, Readers::Owner)?;
        Ok(token)
    }

    /// Exchanges a token for a certificate of the host `name`, which calls from `address`: certificate and CA in PEM.
    ///
    /// # Errors
    /// [`Error::Rule`] for a token that is unknown, used or out of date; a request that is none.
    pub fn redeem(
        &self,
        token: &str,
        name: &str,
        address: Option<IpAddr>,
        request: &[u8],
    ) -> Result<(String, String), Error> {
        let token: Token = token.parse().map_err(|e: protocol::Error| Error::Rule(e.to_string()))?;
        let (path, used) = self.token(&token);
        let refuse = |why: &str| Error::Rule(format!("{why}; ask for another with `bolide certs token`"));
        let text = fs::read_to_string(&path).map_err(|error| match error.kind() {
            ErrorKind::NotFound if used.exists() => refuse("the token was used before"),
            ErrorKind::NotFound => refuse("this lab did not issue the token"),
            _ => Error::Io { path: path.clone(), error },
        })?;
        let grant: Grant =
            serde_json::from_str(&text).map_err(|_| refuse("the token's record is damaged"))?;
        if now() > grant.expires {
            return Err(refuse("the token is out of date"));
        }
        let _issuing = ISSUING.lock().unwrap_or_else(PoisonError::into_inner);
        certs::check_host(name, grant.role)?;
        if let Some(standing) = self.standing(name, grant.role)? {
            if used.exists() {
                return Err(refuse("the token was used before"));
            }
            return Err(Error::Rule(format!(
                "a certificate of {name:?} stands ({standing}); join under another name, or `bolide certs revoke` that one first"
            )));
        }
        // Whoever renames it has it; then it is used up, even if nothing comes of it.
        fs::rename(&path, &used).map_err(|error| match error.kind() {
            ErrorKind::NotFound => refuse("the token was used before"),
            _ => Error::Io { path: path.clone(), error },
        })?;
        let tokens = self.folder.join("tokens");
        system::folders::sync(&tokens).map_err(|error| Error::Io { path: tokens, error })?;
        let addresses: Vec<String> = address.iter().map(ToString::to_string).collect();
        certs::sign_request(&self.folder, request, name, &addresses, grant.role)
    }

    /// The fingerprint of a certificate of this name and role that was issued, counts still and is not out of date.
    fn standing(&self, name: &str, role: Role) -> Result<Option<String>, Error> {
        let (issued, revoked) = (self.folder.join("issued"), self.revoked()?);
        let fault = |error| Error::Io { path: issued.clone(), error };
        let entries = match fs::read_dir(&issued) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            entries => entries.map_err(fault)?,
        };
        for entry in entries {
            let path = entry.map_err(fault)?.path();
            if path.extension().is_none_or(|extension| extension != "pem") {
                continue;
            }
            let identity = tls::identity_of_file(&path).map_err(|e| Error::Rule(e.to_string()))?;
            let counts = !revoked.contains(&identity.fingerprint) && identity.expires > now() as i64;
            if identity.role == role && identity.name.eq_ignore_ascii_case(name) && counts {
                return Ok(Some(identity.fingerprint));
            }
        }
        Ok(None)
    }

    /// The files of a token, before and after its use.
    fn token(&self, token: &Token) -> (PathBuf, PathBuf) {
        let path = self.folder.join("tokens").join(token.id());
        let used = path.with_extension("used");
        (path, used)
    }

    /// Whether a certificate of a master was issued for `name`.
    ///
    /// # Errors
    /// If the disk refuses.
    pub fn has_master(&self, name: &str) -> Result<bool, Error> {
        let issued = self.folder.join("issued");
        let fault = |error| Error::Io { path: issued.clone(), error };
        for entry in fs::read_dir(&issued).map_err(fault)? {
            let path = entry.map_err(fault)?.path();
            let identity = tls::identity_of_file(&path).map_err(|e| Error::Rule(e.to_string()))?;
            if identity.role == Role::Master && identity.name == name {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Revokes every certificate that was issued for `name`; gives their number.
    ///
    /// # Errors
    /// If there is none, or the disk refuses.
    pub fn revoke(&self, name: &str) -> Result<usize, Error> {
        let issued = self.folder.join("issued");
        let fault = |error| Error::Io { path: issued.clone(), error };
        let mut list = self.revoked()?;
        let mut found = 0;
        for entry in fs::read_dir(&issued).map_err(fault)? {
            let path = entry.map_err(fault)?.path();
            let identity = tls::identity_of_file(&path).map_err(|e| Error::Rule(e.to_string()))?;
            if identity.name == name {
                found += 1;
                list.insert(identity.fingerprint);
            }
        }
        if found == 0 {
            let why = format!("no certificate was issued for {name:?}; {} has them all", issued.display());
            return Err(Error::Rule(why));
        }
        let text: String = list.iter().map(|fingerprint| format!("{fingerprint}\n")).collect();
        let (path, temporary) = (self.folder.join("revoked"), self.folder.join(".revoked.tmp"));
        certs::write(&temporary, &text, Readers::All)?;
        fs::rename(&temporary, &path).map_err(|error| Error::Io { path, error })?;
        Ok(found)
    }

    /// Fingerprints of the certificates that count no more.
    ///
    /// # Errors
    /// If the list is there and cannot be read.
    pub fn revoked(&self) -> Result<BTreeSet<String>, Error> {
        Ok(self.list()?.unwrap_or_default())
    }

    /// The same; none where there is no list.
    fn list(&self) -> Result<Option<BTreeSet<String>>, Error> {
        let path = self.folder.join("revoked");
        let fault = |error| Error::Io { path: path.clone(), error };
        match fs::metadata(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(fault(error)),
            Ok(meta) if meta.len() > REVOKED_LIMIT => {
                let (path, length) = (path.display(), meta.len());
                return Err(Error::Rule(format!("{path} has {length} bytes, at most {REVOKED_LIMIT}")));
            }
            Ok(_) => {}
        }
        let text = fs::read_to_string(&path).map_err(fault)?;
        Ok(Some(text.split_whitespace().map(str::to_owned).collect()))
    }

    /// The list of revoked certificates, looked at again and again. A list that cannot be read any more, or is
    /// gone, stays what it was. Called within a runtime.
    ///
    /// # Errors
    /// If it cannot be read at first.
    pub fn follow(&self) -> Result<Revoked, Error> {
        let (news, revoked) = watch::channel(Arc::new(self.revoked()?));
        let ca_folder = self.clone();
        tokio::spawn(async move {
            let mut told = false;
            loop {
                tokio::time::sleep(LOOK).await;
                let ca_folder = ca_folder.clone();
                let read =
                    tokio::task::spawn_blocking(move || ca_folder.list().map(|list| (list, ca_folder))).await;
                let known = news.borrow().clone();
                match read {
                    // None is there before the first certificate is revoked.
                    Ok(Ok((None, _))) if known.is_empty() => told = false,
                    Ok(Ok((None, ca_folder))) if !told => {
                        told = true;
                        let path = ca_folder.folder.join("revoked");
                        let (path, count) = (path.display(), known.len());
                        tracing::warn!(
                            "{path} is gone, which named {count} certificates; they stay revoked until this master ends: put it back, or \
                             `bolide certs revoke` them again"
                        );
                    }
                    Ok(Ok((Some(list), _))) => {
                        told = false;
                        let again = known.difference(&list).count();
                        if again > 0 {
                            tracing::warn!(
                                "the list of revoked certificates has lost {again}, which count again"
                            );
                        }
                        news.send_if_modified(|known| {
                            let changed = **known != list;
                            *known = Arc::new(list);
                            changed
                        });
                    }
                    Ok(Err(error)) if !told => {
                        told = true;
                        tracing::warn!("revoked certificates: {error}; those known stay");
                    }
                    _ => {}
                }
                if news.is_closed() {
                    return;
                }
            }
        });
        Ok(revoked)
    }
}

fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ca_folder() -> (tempfile::TempDir, CaFolder) {
        let folder = tempfile::tempdir().expect("room for a folder");
        certs::make_ca(folder.path(), false).expect("a new CA");
        let ca_folder = CaFolder::open(folder.path()).expect("a CA");
        (folder, ca_folder)
    }

    fn redeem(ca_folder: &CaFolder, token: &str) -> Result<(String, String), Error> {
        let (_, request) = certs::make_request().expect("a key");
        ca_folder.redeem(token, "pc-1", Some([127, 0, 0, 1].into()), &request)
    }

    #[test]
    fn a_token_is_exchanged_once_by_whichever_of_many_comes_first() {
        let (folder, ca_folder) = ca_folder();
        let token = ca_folder.issue(Role::Worker, 1).expect("a token").to_string();
        let all: Vec<_> = std::thread::scope(|scope| {
            let tries: Vec<_> = (0..8).map(|_| scope.spawn(|| redeem(&ca_folder, &token))).collect();
            tries.into_iter().map(|one| one.join().expect("no panic")).collect()
        });
        let good: Vec<_> = all.iter().filter_map(|result| result.as_ref().ok()).collect();
        let [(certificate, ca)] = good[..] else { panic!("{} of 8", good.len()) };
        assert_eq!(*ca, fs::read_to_string(folder.path().join("ca.pem")).expect("the CA"));
        let path = folder.path().join("joined.pem");
        fs::write(&path, certificate).expect("room");
        let identity = tls::identity_of_file(&path).expect("one role");
        assert_eq!((identity.role, identity.name.as_str()), (Role::Worker, "pc-1"));
        for error in all.iter().filter_map(|result| result.as_ref().err()) {
            assert!(error.to_string().starts_with("the token was used before; ask for"), "{error}");
        }
        // A master that starts anew knows as much.
        let again = redeem(&CaFolder::open(folder.path()).expect("a CA"), &token).expect_err("used");
        assert!(again.to_string().contains("used before"), "{again}");
    }

    #[test]
    fn tokens_of_others_and_those_out_of_date_are_refused_and_not_used_up() {
        let (folder, ca_folder) = ca_folder();
        let (_kept, other) = self::ca_folder();
        let error = redeem(&ca_folder, &other.issue(Role::Worker, 1).expect("a token").to_string())
            .expect_err("theirs");
        assert!(error.to_string().contains("did not issue"), "{error}");
        let token = ca_folder.issue(Role::Client, 1).expect("a token");
        let path = folder.path().join("tokens").join(token.id());
        let record = fs::read_to_string(&path).expect("a record");
        assert!(!record.contains(&protocol::token::hex(&token.secret)), "{record}");
        fs::write(&path, r#"{"role":"Client","expires":7}"#).expect("room");
        let error = redeem(&ca_folder, &token.to_string()).expect_err("of 1970");
        assert!(error.to_string().contains("out of date"), "{error}");
        fs::write(&path, "{").expect("room");
        let error = redeem(&ca_folder, &token.to_string()).expect_err("damaged");
        assert!(error.to_string().contains("damaged"), "{error}");
        fs::write(&path, record).expect("room");
        assert!(redeem(&ca_folder, &token.to_string()).is_ok());
    }

    #[test]
    fn a_newcomer_takes_no_reserved_name_and_none_that_stands_and_keeps_its_token() {
        let (_folder, ca_folder) = ca_folder();
        redeem(&ca_folder, &ca_folder.issue(Role::Worker, 1).expect("a token").to_string()).expect("pc-1");
        let token = ca_folder.issue(Role::Worker, 1).expect("a token").to_string();
        let (_, request) = certs::make_request().expect("a key");
        for (name, words) in [
            ("master", "it is reserved"),
            ("Issued", "it is reserved"),
            ("PC-1", "a certificate of \"PC-1\" stands"),
        ] {
            let error = ca_folder.redeem(&token, name, None, &request).expect_err(name).to_string();
            assert!(error.contains(words), "{error}");
        }
        ca_folder.revoke("pc-1").expect("there is one");
        ca_folder.redeem(&token, "pc-1", None, &request).expect("the name is free, the token not used");
    }

    #[tokio::test]
    async fn a_host_is_revoked_by_its_name_and_those_who_follow_the_list_hear_of_it() {
        let (folder, ca_folder) = ca_folder();
        certs::make_host(folder.path(), "pc-2", &[], Role::Worker, false).expect("a host");
        redeem(&ca_folder, &ca_folder.issue(Role::Worker, 1).expect("a token").to_string()).expect("pc-1");
        let mut news = ca_folder.follow().expect("no list yet");
        assert!(news.borrow().is_empty());
        assert_eq!(ca_folder.revoke("pc-1").expect("there is one"), 1);
        tokio::time::timeout(Duration::from_secs(20), news.changed())
            .await
            .expect("in time")
            .expect("it follows");
        assert_eq!(news.borrow().len(), 1);
        assert_eq!(ca_folder.revoke("pc-2").expect("there is one"), 1);
        assert_eq!(ca_folder.revoked().expect("a list").len(), 2);
        assert!(
            ca_folder.revoke("pc-3").expect_err("nobody").to_string().contains("no certificate was issued")
        );
    }

    #[tokio::test]
    async fn a_list_that_goes_missing_leaves_nobody_unrevoked() {
        let (folder, ca_folder) = ca_folder();
        certs::make_host(folder.path(), "pc-1", &[], Role::Worker, false).expect("a host");
        certs::make_host(folder.path(), "pc-2", &[], Role::Worker, false).expect("a host");
        let mut revoked = ca_folder.follow().expect("no list yet");
        assert!(revoked.borrow().is_empty());
        ca_folder.revoke("pc-1").expect("it was issued");
        revoked.wait_for(|list| list.len() == 1).await.expect("followed");
        fs::remove_file(folder.path().join("revoked")).expect("there");
        tokio::time::sleep(2 * LOOK).await;
        assert_eq!(revoked.borrow().len(), 1);
        ca_folder.revoke("pc-2").expect("it was issued");
        revoked.changed().await.expect("followed");
        assert_eq!(**revoked.borrow(), ca_folder.revoked().expect("readable"));
    }
}
