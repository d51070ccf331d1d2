//! ENDING: warns of a certificate of this host that ends soon. It is read when a daemon starts; one that is renewed on disk is used from
//! the next start on.

use std::{
    path::PathBuf,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use protocol::tls::{self, Identity};
use tracing::warn;

/// How long before its end (s) it is warned of.
const SOON: i64 = 30 * DAY;
const DAY: i64 = 24 * 3600;

/// Warns at once and once a day. Called within a runtime.
pub fn watch(certificate: PathBuf) {
    let Ok(identity) = tls::identity_of_file(&certificate) else { return };
    tokio::spawn(async move {
        loop {
            let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() as i64);
            if let Some(words) = words(&identity, now) {
                warn!("{} {words}", certificate.display());
            }
            tokio::time::sleep(Duration::from_secs(DAY as u64)).await;
        }
    });
}

/// What is said of a certificate at this time (s since 1970), if anything.
fn words(identity: &Identity, now: i64) -> Option<String> {
    let Identity { role, name, expires, .. } = identity;
    let left = expires.saturating_sub(now);
    (left <= SOON).then(|| {
        let when = match left {
            ..0 => "has expired".to_owned(),
            0..DAY => format!("ends within {} h", left / 3600 + 1),
            _ => format!("ends in {} days", left / DAY),
        };
        format!(
            "{when}, and all links of {name} with it: make another with `bolide certs host LAB {name} --role {role} --force`, put it there and \
             start this {role} again"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_is_told_a_month_before() {
        let identity = Identity {
            role: tls::Role::Worker,
            name: "pc-1".into(),
            fingerprint: String::new(),
            expires: 100 * DAY,
        };
        let at = |day: i64| words(&identity, day * DAY);
        assert_eq!(at(69), None);
        assert!(at(70).is_some_and(|words| words.starts_with("ends in 30 days, and all links of pc-1")));
        assert!(words(&identity, 100 * DAY - 1).is_some_and(|words| words.starts_with("ends within 1 h")));
        assert!(at(101).is_some_and(|words| words.starts_with("has expired")));
    }
}
