//! Robust least squares over poses in the plane (thesis 2.1.3 and Appendix B).
