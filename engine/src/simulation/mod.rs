//! Simulated robots in occupancy worlds, seeded and repeatable.
