//! Text formats to values and back: CARMEN, g2o, TORO, TUM, relations. No files, only text.
