//! Harness of the tests through the front door.
