//! What comes out the same is there once, where the linker can see to that: the one that Rust brings along and takes by itself on
//! this target from 1.90 on.

use std::path::Path;
use std::process::Command;

const TARGET: &str = "x86_64-unknown-linux-gnu";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("TARGET").is_ok_and(|target| target == TARGET) && own_linker() == Some(true) {
        println!("cargo::rustc-cdylib-link-arg=-Wl,--icf=all");
    }
}

/// Whether the compiler has one, if it says so.
fn own_linker() -> Option<bool> {
    let minor: u32 = said("--version")?.split('.').nth(1)?.parse().ok()?;
    let linker = format!("lib/rustlib/{TARGET}/bin/gcc-ld/ld.lld");
    Some(minor >= 90 && Path::new(said("--print=sysroot")?.trim()).join(linker).exists())
}

/// What the compiler says.
fn said(option: &str) -> Option<String> {
    let said = Command::new(std::env::var_os("RUSTC")?).arg(option).output().ok()?;
    String::from_utf8(said.stdout).ok()
}
