//! The algorithms as the thesis prints them, slow and plain; what the fast ones must agree with and are timed beside.

pub mod density;
pub mod local_map;
