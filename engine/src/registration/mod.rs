//! Scan and submap registration: refined odometry and verification by geometry (SPEC section 4).
