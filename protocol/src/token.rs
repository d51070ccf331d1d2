//! The token with which a bare PC joins a lab: what to trust, and a secret that is good once.
//!
//! `bolide-PIN-SECRET`, both 32 hexadecimal digits. The pin is a hash of the lab's CA, so that the newcomer knows the
//! master before it has any certificate, and nobody between them can pass for it; the secret is exchanged for a
//! certificate. Whoever issues tokens keeps [`Token::id`] of each, which does not tell the secret.

use std::{fmt, str::FromStr};

use crate::Error;

/// What every token starts with.
pub const PREFIX: &str = "bolide-";

/// A token, as it is pasted.
#[derive(Clone, PartialEq, Eq)]
pub struct Token {
    /// [`pin_of`] the CA.
    pub pin: [u8; 16],
    /// Known to the issuer's one customer.
    pub secret: [u8; 16],
}

/// The pin of a CA's certificate in DER.
pub fn pin_of(certificate: &[u8]) -> [u8; 16] {
    first(&blake3::hash(certificate))
}

fn first(hash: &blake3::Hash) -> [u8; 16] {
    let mut bytes = [0; 16];
    bytes.copy_from_slice(&hash.as_bytes()[..16]);
    bytes
}

impl Token {
    /// What its issuer knows it by: a hash of the secret, in hexadecimal digits.
    pub fn id(&self) -> String {
        hex(&first(&blake3::hash(&self.secret)))
    }
}

/// Hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn from_hex(text: &str) -> Option<[u8; 16]> {
    if text.len() != 32 || !text.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'a'..=b'f')) {
        return None;
    }
    u128::from_str_radix(text, 16).ok().map(u128::to_be_bytes)
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{PREFIX}{}-{}", hex(&self.pin), hex(&self.secret))
    }
}

impl fmt::Debug for Token {
    /// Without the secret: this may reach a log.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{PREFIX}{}-(secret)", hex(&self.pin))
    }
}

impl FromStr for Token {
    type Err = Error;

    /// # Errors
    /// [`Error::Message`], which does not repeat the text: it may be most of a secret.
    fn from_str(text: &str) -> Result<Self, Error> {
        let digits = text.trim().strip_prefix(PREFIX).and_then(|rest| rest.split_once('-'));
        let both = digits.and_then(|(pin, secret)| Some((from_hex(pin)?, from_hex(secret)?)));
        both.map(|(pin, secret)| Self { pin, secret }).ok_or_else(|| {
            Error::Message(format!(
                "token of {} characters, expected {PREFIX} and twice 32 hexadecimal digits with a hyphen between; paste \
                 the whole line that `bolide certs token` prints",
                text.len()
            ))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_read_as_it_is_shown_and_nothing_else_is_one() {
        let token = Token { pin: [0xab; 16], secret: [7; 16] };
        let text = token.to_string();
        assert_eq!(text.len(), PREFIX.len() + 65);
        assert_eq!(format!(" {text}\n").parse::<Token>(), Ok(token.clone()));
        assert!(!format!("{token:?}").contains("0707"), "a log does not tell the secret");
        assert_eq!(token.id().len(), 32);
        for wrong in
            ["", "bolide-", &text[1..], &text[..text.len() - 1], &text.to_uppercase(), &format!("{text}0")]
        {
            let error = wrong.parse::<Token>().expect_err("no token").to_string();
            assert!(error.contains("32 hexadecimal digits") && !error.contains("0707"), "{error}");
        }
        let signed = format!("{PREFIX}{}-+{}", hex(&[1; 16]), &hex(&[1; 16])[1..]);
        assert!(signed.parse::<Token>().is_err());
    }
}
