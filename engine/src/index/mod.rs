//! The occurrence index: where each word of a site occurs (thesis Algorithm 5.3).
