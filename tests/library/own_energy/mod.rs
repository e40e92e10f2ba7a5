//! Tests of user-defined energies, attached to rods by the public interface.

mod derivatives;
mod energies;
mod fits;
mod motion;
mod rest;
mod scenes;
mod uses;
