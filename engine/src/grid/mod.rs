//! The rolling HIMM local map around the robot (thesis 2.1.2 and 3.2.1).
