//! Place labels: corridor, corner, bifurcation, dead-end, hall (thesis chapter 6).
