//! Puts the module that computes a block again in browsers into the binary, where `deploy/wasm/build.sh` has built one: its file is
//! named by `BOLIDE_RECOMPUTE`. A binary without it does not offer that.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(has_recompute)");
    println!("cargo::rerun-if-env-changed=BOLIDE_RECOMPUTE");
    println!("cargo::rerun-if-changed=build.rs");
    if let Some(path) = std::env::var("BOLIDE_RECOMPUTE").ok().filter(|path| !path.is_empty()) {
        println!("cargo::rustc-cfg=has_recompute");
        println!("cargo::rerun-if-changed={path}");
    }
}
