//! Chains of matching words and what they are worth (thesis 4.2.3, 5.2.3, 5.2.4).
