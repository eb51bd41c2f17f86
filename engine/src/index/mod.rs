//! The occurrence index: where each word of a site occurs (thesis Algorithm 5.3).

mod lattice;
mod tolerance;

pub use lattice::{Lattice, LatticeError, LevelColumns, num_nodes_covered};
pub use tolerance::{Syllables, WordTolerance, WordWindow, binary_angle};
