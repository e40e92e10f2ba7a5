//! What the command writes, how it answers whatever it is given, and the pages it draws.

#[path = "../common/mod.rs"]
mod common;

<<<<<<< HEAD
mod campaign;
=======
#[cfg(unix)]
mod documents;
>>>>>>> bd0d033 (simulate --report draws the rod in motion; rodfit schema and rodfit man; the documents are a book, whose files, commands and links are tested)
mod experiments;
mod explain;
mod fit;
mod folder;
mod hostile;
mod hostile_fits;
mod hostile_scenes;
mod inspect;
mod interrupt;
mod motion;
mod outputs;
mod recordings;
mod refusals;
mod report;
mod results;
<<<<<<< HEAD
mod slurm;
=======
mod schema;
>>>>>>> bd0d033 (simulate --report draws the rod in motion; rodfit schema and rodfit man; the documents are a book, whose files, commands and links are tested)
mod study;
