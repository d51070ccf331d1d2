//! Certificates of links that stand: one that expires or is revoked ends its link.

use std::{
    collections::BTreeSet,
    sync::Arc,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use tokio::sync::watch;

use super::Identity;
use crate::{Error, dial::leave, link::Sender};

/// How often the clock is looked at: by the time of day, which may be set.
const LOOK: Duration = Duration::from_secs(1);

/// Fingerprints of revoked certificates, as of now.
pub type Revoked = watch::Receiver<Arc<BTreeSet<String>>>;

impl Identity {
    /// Why a certificate is not good any more: revoked or expired.
    pub fn fault(&self, revoked: Option<&Revoked>, now: SystemTime) -> Option<String> {
        let Self { role, name, fingerprint, expires } = self;
        if revoked.is_some_and(|revoked| revoked.borrow().contains(fingerprint)) {
            return Some(format!("the certificate of {role} {name:?} was revoked"));
        }
        let now = now.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() as i64);
        (now > *expires).then(|| {
            format!("the certificate of {role} {name:?} has expired; make another with `bolide certs`, and start it again")
        })
    }
}

/// Ends the link with the reason when the other side's certificate expires or is revoked. Ends with the link. Called
/// within a runtime.
pub fn watch(sender: &Sender, identity: Identity, mut revoked: Option<Revoked>) {
    let sender = sender.clone();
    tokio::spawn(async move {
        let why = loop {
            let news = async {
                // The list is its owner's; without one, or when it is gone, the clock alone counts.
                let changed = match &mut revoked {
                    Some(revoked) => revoked.changed().await.is_ok(),
                    None => false,
                };
                if !changed {
                    std::future::pending::<()>().await;
                }
            };
            tokio::select! {
                () = sender.ended() => return,
                () = news => {}
                () = tokio::time::sleep(LOOK) => {}
            }
            if let Some(why) = identity.fault(revoked.as_ref(), SystemTime::now()) {
                break why;
            }
        };
        leave(&sender, &why).await;
        sender.abort(Error::Certificate(why));
    });
}
