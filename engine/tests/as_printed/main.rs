//! What is computed fast agrees with the algorithms as the thesis prints them, on random input.

#![allow(clippy::unwrap_used)]

mod density;
mod literal;
mod local_map;
