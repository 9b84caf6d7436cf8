//! One module for each subcommand.

pub mod draft;
pub mod image;
pub mod presets;
pub mod render;
pub mod swatch;
