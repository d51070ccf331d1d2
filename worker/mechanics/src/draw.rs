//! DRAW: pseudo-random numbers that depend on a seed and a place alone, so that they are the same on every machine, however work is dealt out.

/// One step of splitmix64 (Steele, Lea and Flood 2014).
pub fn mixed(x: u64) -> u64 {
    let mut x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// The 53 upper bits of two such steps: a whole number below `2^53` of a seed and a place.
pub fn of_place(seed: u64, place: u64) -> u64 {
    mixed(mixed(seed).wrapping_add(place)) >> 11
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_number_of_splitmix64_is_the_published_one() {
        assert_eq!(mixed(0), 0xe220_a839_7b1d_cdaf);
        assert!(of_place(1, 2) < 1 << 53 && of_place(1, 2) != of_place(2, 1));
    }
}
