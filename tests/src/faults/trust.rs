//! Peers that are refused: certificates and tokens have their cases here.

use super::Case;

/// The list.
pub fn cases() -> Vec<Case> {
    Vec::new()
}
