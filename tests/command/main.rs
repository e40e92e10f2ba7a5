//! What the command writes, how it answers whatever it is given, and the pages it draws.

#[path = "../common/mod.rs"]
mod common;

mod experiments;
mod fit;
mod folder;
mod hostile;
mod interrupt;
mod outputs;
mod report;
mod simulate;
mod study;
