//! The binary that is shipped has no fault to order and no bug that was planted. `cluster` shows that these words are found in
//! a binary that has them.

use tests::cluster::{FAULTS, holds};

#[test]
fn the_shipped_binary_has_no_faults_to_order() {
    let bytes = std::fs::read(env!("CARGO_BIN_EXE_bolide")).expect("the binary of this build");
    for words in FAULTS {
        assert!(!holds(&bytes, words), "the shipped binary has {words:?} in it");
    }
}
