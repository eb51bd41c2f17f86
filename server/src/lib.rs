//! The Locution server.
