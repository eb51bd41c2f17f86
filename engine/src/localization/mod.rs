//! Monte-Carlo localisation in a served map (thesis 3.3).
