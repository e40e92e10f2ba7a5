//! Merges identical functions of the library by the linker option `--icf=all` (identical code folding). The linker that
//! Rust uses by default on this target from 1.90 on has the option.

use std::path::Path;
use std::process::Command;

const TARGET: &str = "x86_64-unknown-linux-gnu";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("TARGET").is_ok_and(|target| target == TARGET) && own_linker() == Some(true) {
        println!("cargo::rustc-cdylib-link-arg=-Wl,--icf=all");
    }
}

/// Whether the compiler uses its own linker; none if it cannot be determined.
fn own_linker() -> Option<bool> {
    let minor: u32 = compiler_output("--version")?.split('.').nth(1)?.parse().ok()?;
    let linker = format!("lib/rustlib/{TARGET}/bin/gcc-ld/ld.lld");
    Some(minor >= 90 && Path::new(compiler_output("--print=sysroot")?.trim()).join(linker).exists())
}

/// The output of the compiler with an option.
fn compiler_output(option: &str) -> Option<String> {
    let output = Command::new(std::env::var_os("RUSTC")?).arg(option).output().ok()?;
    String::from_utf8(output.stdout).ok()
}
