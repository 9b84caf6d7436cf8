//! What is rendered: meshes and the built-in scene.

pub mod drape;
pub mod mesh;
