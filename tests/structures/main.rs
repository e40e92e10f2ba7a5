//! Structures: assemblies of rods, bodies and joints against closed forms, the dynamic stiffness method and dual
//! numbers.

mod assembly;
mod contact_loss_derivatives;
mod contact_losses;
mod contact_scenes;
mod contacts;
mod damping;
mod derivative_checks;
mod derivatives;
mod files;
mod fits;
mod frames;
mod given_meshes;
mod joints;
mod motion;
#[cfg(feature = "page")]
mod page;
mod recorded;
mod recorded_checks;
mod rod_contacts;
mod rod_friction;
mod rod_loss_derivatives;
mod scenes;
mod space;
mod spatial_motion;
mod validity;
