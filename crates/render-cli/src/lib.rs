//! Under construction.

pub mod render;
pub mod scene;
