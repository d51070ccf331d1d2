//! Limits of what a deck may ask for: each is looked at before anything of that size is made.

/// Longest deck (bytes).
pub const MAX_TEXT: usize = 64 << 20;
/// Most nodes of a mesh before joins.
pub const MAX_NODES: u64 = 64_000_000;
/// Most elements of a mesh.
pub const MAX_ELEMENTS: u64 = 64_000_000;
/// Longest title (characters).
pub const MAX_TITLE: usize = 200;
/// Most parts of a deck with contact, whose settings hold a matrix of parts.
pub const MAX_CONTACT_PARTS: usize = 2_000;
pub const MAX_PARTS: usize = 10_000;
/// Most entries of any other array of tables.
pub const MAX_ENTRIES: usize = 10_000;
/// Most entries of stress at the start: a formed sheet has one for each element.
pub(crate) const MAX_STRESSES: usize = 1_000_000;
/// Most pairs of parts whose contact force is written: each has four columns.
pub(crate) const MAX_CONTACT_FORCES: usize = 64;
/// Most cross-sections: each has nine columns.
pub(crate) const MAX_SECTIONS: usize = 64;
/// Greatest node or element number a deck may give; generated numbers go on above.
pub(crate) const MAX_ID: u32 = 2_000_000_000;
pub(crate) const MAX_CURVE_POINTS: usize = 100_000;

/// What bounds the reading of a deck that somebody else brings.
pub struct Bounds<'a> {
    /// Most elements that it may ask for: who reads it has no memory for more.
    pub elements: u64,
    /// Whether nobody waits for the deck any more. It is asked between the stages of reading, for each part, mesh file and block of cards.
    pub is_given_up: &'a dyn Fn() -> bool,
}
