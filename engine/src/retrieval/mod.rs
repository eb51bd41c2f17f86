//! Density profiles as a second way to retrieve places (SPEC section 4).
