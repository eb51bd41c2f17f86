//! Simulated robots in occupancy worlds, seeded and repeatable.
//!
//! ```text
//! World ─► Planner ─► Path ─► driven at a natural speed ─► true poses ─► odometry that drifts
//!   │                                                          │
//!   └───────────── people walking in it ──────────────► ray-cast scans with noise
//! ```
//!
//! [`simulate_run`] is the conductor. All randomness comes from one seed: the same world, task, configuration and
//! seed give the same bytes.

mod config;
mod drive;
mod gaussian;
mod odometry;
mod path;
mod people;
mod planner;
mod ray_cast;
mod run;
mod world;

pub use config::{DriveConfig, LaserConfig, OdometryNoise, PeopleConfig, SimulationConfig};
pub use planner::{PlanError, Planner};
pub use ray_cast::Disc;
pub use run::{SimulatedRun, SimulationError, Task, simulate_run};
pub use world::{World, WorldError};
