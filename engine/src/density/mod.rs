//! Free-space density and its frontiers, from one flood fill (thesis 3.2 and Algorithm 6.1).
