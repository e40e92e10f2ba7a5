//! The library as somebody uses it who has not read its source.

#[path = "../common/mod.rs"]
mod common;

mod calls;
mod direction;
mod energies;
mod files;
mod hostile_bytes;
mod measurements;
mod own_energy;
mod runs;
