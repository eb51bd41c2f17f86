//! What the evaluation reports measure (SPEC section 9), as pure functions.
