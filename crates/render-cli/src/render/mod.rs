//! From a scene to a picture.

pub mod intersect;
