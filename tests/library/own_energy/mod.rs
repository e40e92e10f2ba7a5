//! Energies of one's own, attached to rods through the public API.

mod derivatives;
mod energies;
mod fits;
mod motion;
mod rest;
mod scenes;
mod uses;
