//! Measurements that take more than a look at a shader's values.

pub mod filaments;
