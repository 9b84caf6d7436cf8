//! One module for each subcommand.

pub mod draft;
pub mod render;
pub mod swatch;
