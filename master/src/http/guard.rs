//! GUARD: who may ask. A token always, a `Host` that no foreign name can stand for, an `Origin` that is our own.
//!
//! The token comes as `Authorization: Bearer TOKEN`, or in the cookie that the printed address sets. Browsers send cookies to every port of
//! an address, so that of another user's server on this machine too; therefore the page stands below a random name, and the cookie goes with
//! that name only. A page elsewhere can
//! make a browser call us, but not read the answer, not send the cookie (`SameSite=Strict`), and not under our own name
//! by a name server of its own, since only addresses, `localhost` and this machine's name pass as `Host`.

use std::{net::IpAddr, path::Path};

use axum::http::{HeaderMap, header};
use rustls::crypto::ring;

/// File with the token in the spool folder: a restarted master keeps it, and open pages go on.
const FILE: &str = "http-token";

/// The secret of this master's page.
#[derive(Clone)]
pub struct Guard {
    token: String,
    /// Name of the cookie: cookies do not know ports.
    cookie: String,
    /// Path of the page, `/NAME/`, with which alone the cookie goes. The token leads to the name, and the name not to the token.
    path: String,
    loopback: bool,
    scheme: &'static str,
    name: String,
}

/// Why a request is turned away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// No token, or a wrong one.
    Token,
    /// A `Host` that is not ours.
    Host,
    /// An `Origin` that is not ours.
    Origin,
}

impl Refusal {
    /// A sentence that says what to do.
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Token => {
                "this needs the token: open the address that `bolide master` printed, or send `Authorization: Bearer TOKEN`"
            }
            Self::Host => {
                "the Host header is neither an address, nor localhost, nor the name of this machine"
            }
            Self::Origin => "the Origin header is another page's",
        }
    }
}

impl Guard {
    /// With the token of this spool folder, which is made if there is none.
    ///
    /// # Errors
    /// If it cannot be read or written.
    pub fn new(spool: &Path, port: u16, loopback: bool, tls: bool, name: String) -> Result<Self, String> {
        let path = spool.join(FILE);
        let kept = std::fs::read_to_string(&path).ok().map(|text| text.trim().to_owned());
        let token = match kept.filter(|token| token.len() == 32) {
            Some(token) => token,
            None => make(&path)?,
        };
        Ok(Self::of(token, port, loopback, tls, name))
    }

    /// With a token that ends with this process, for a page on loopback.
    ///
    /// # Errors
    /// If the system has no random bytes.
    pub fn passing(port: u16, name: String) -> Result<Self, String> {
        Ok(Self::of(fresh()?, port, true, false, name))
    }

    fn of(token: String, port: u16, loopback: bool, tls: bool, name: String) -> Self {
        let scheme = if tls { "https" } else { "http" };
        let hash = blake3::derive_key("bolide 2026 name of the page's path", token.as_bytes());
        let path = format!("/{}/", protocol::token::hex(&hash[..16]));
        Self { token, cookie: format!("bolide-{port}"), path, loopback, scheme, name }
    }

    pub fn token(&self) -> &str {
        &self.token
    }

    /// Path of the page: `/NAME/`.
    pub fn path(&self) -> &str {
        &self.path
    }

    pub fn set_cookie(&self) -> String {
        let secure = if self.scheme == "https" { "; Secure" } else { "" };
        let Self { cookie, token, path, .. } = self;
        format!("{cookie}={token}; HttpOnly; SameSite=Strict; Path={path}; Max-Age=31536000{secure}")
    }

    /// Whether this is the token; takes as long for any guess.
    pub fn is_token(&self, guess: &str) -> bool {
        blake3::hash(guess.as_bytes()) == blake3::hash(self.token.as_bytes())
    }

    /// Checks the names in a request.
    ///
    /// # Errors
    /// [`Refusal::Host`], [`Refusal::Origin`].
    pub fn names(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(header::HOST).ok_or(Refusal::Host)?;
        if !self.is_ours(host) {
            return Err(Refusal::Host);
        }
        match headers.get(header::ORIGIN) {
            Some(origin) if origin.as_bytes() != format!("{}://{host}", self.scheme).as_bytes() => {
                Err(Refusal::Origin)
            }
            _ => Ok(()),
        }
    }

    /// Checks the whole of a request.
    ///
    /// # Errors
    /// The refusal.
    pub fn pass(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        self.names(headers)?;
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let bearer = text(header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
        let cookies = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut pairs =
            cookies.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
        let cookie = pairs.find(|(name, _)| *name == self.cookie).map(|(_, value)| value);
        match bearer.or(cookie) {
            Some(guess) if self.is_token(guess) => Ok(()),
            _ => Err(Refusal::Token),
        }
    }

    /// Whether a `Host` is this machine's, its port aside: a tunnel may have another.
    fn is_ours(&self, host: &str) -> bool {
        let bare = match host.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            Some((address, _)) => address,
            None => host.rsplit_once(':').map_or(host, |(name, _)| name),
        };
        match bare.parse::<IpAddr>() {
            Ok(address) => !self.loopback || address.is_loopback(),
            Err(_) => {
                bare.eq_ignore_ascii_case("localhost")
                    || (!self.loopback && bare.eq_ignore_ascii_case(&self.name))
            }
        }
    }
}

fn make(path: &Path) -> Result<String, String> {
    use std::io::Write;
    let token = fresh()?;
    let fault = |e: std::io::Error| format!("{}: {e}", path.display());
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create(true).truncate(true);
    let mut file = system::private::open(&options, path, system::Readers::Owner).map_err(fault)?;
    file.write_all(token.as_bytes()).map_err(fault)?;
    Ok(token)
}

/// A token that nobody knows.
fn fresh() -> Result<String, String> {
    let mut bytes = [0u8; 16];
    ring::default_provider()
        .secure_random
        .fill(&mut bytes)
        .map_err(|_| "the system has no random bytes".to_owned())?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(list: &[(&'static str, &str)]) -> HeaderMap {
        let entry = |&(name, value): &(&'static str, &str)| {
            (name.parse().expect("a name"), value.parse().expect("a value"))
        };
        list.iter().map(entry).collect()
    }

    #[test]
    fn the_cookie_goes_with_a_name_that_nobody_guesses() {
        let [folder, other] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let of = |folder: &Path| Guard::new(folder, 7, true, false, "lab".into()).expect("a token");
        let (guard, other) = (of(folder.path()), of(other.path()));
        let name = guard.path().trim_matches('/');
        assert!(name.len() == 32 && name.bytes().all(|byte| byte.is_ascii_hexdigit()), "{name}");
        assert_ne!(guard.path(), other.path());
        assert_ne!(name, guard.token());
        let cookie = guard.set_cookie();
        assert!(cookie.contains(&format!("; Path=/{name}/;")), "{cookie}");
    }

    #[test]
    fn a_request_needs_the_token_our_host_and_no_foreign_origin() {
        let folder = tempfile::tempdir().expect("a folder");
        let guard = Guard::new(folder.path(), 7, true, false, "lab".into()).expect("a token");
        let token = guard.token().to_owned();
        let bearer = format!("Bearer {token}");
        let cookie = format!("x=1; bolide-7={token}");
        let short = format!("bolide-7={}", &token[1..]);
        let ours = ("host", "127.0.0.1:7");
        for (list, expected) in [
            (vec![ours, ("authorization", bearer.as_str())], Ok(())),
            (vec![("host", "[::1]:9"), ("cookie", cookie.as_str())], Ok(())),
            (vec![ours, ("cookie", &cookie), ("origin", "http://127.0.0.1:7")], Ok(())),
            (vec![ours], Err(Refusal::Token)),
            (vec![ours, ("cookie", &short)], Err(Refusal::Token)),
            (vec![ours, ("cookie", &cookie), ("origin", "http://evil.example")], Err(Refusal::Origin)),
            (vec![ours, ("cookie", &cookie), ("origin", "null")], Err(Refusal::Origin)),
            (vec![("host", "evil.example"), ("cookie", &cookie)], Err(Refusal::Host)),
            (vec![("host", "10.0.0.1:7"), ("cookie", &cookie)], Err(Refusal::Host)),
            (vec![("cookie", &cookie)], Err(Refusal::Host)),
        ] {
            assert_eq!(guard.pass(&headers(&list)), expected, "{list:?}");
        }
        let again = Guard::new(folder.path(), 7, true, false, "lab".into()).expect("a token");
        assert!(again.is_token(&token), "a restarted master keeps its token");
        assert_eq!(again.path(), guard.path(), "and the address of its page");
    }
}
