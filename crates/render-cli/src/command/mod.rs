//! One module for each subcommand.

pub mod bake;
pub mod draft;
mod error_log;
pub mod eval;
mod exposing;
pub mod image;
pub mod measure;
pub mod plan;
pub mod presets;
mod progress;
pub mod render;
pub mod schema;
pub mod studio;
pub mod swatch;
mod watch;
