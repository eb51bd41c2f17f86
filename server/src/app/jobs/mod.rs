//! Long work in the background: maps are built, texts are written anew when a site has outgrown its partition.

mod build;
mod founded;
mod regenerate;
mod turns;
mod worker;

pub use turns::Turns;
