"""The discrete equations: spaces, kinematics of the arm, element loops, assembly."""
