"""What the artifacts of a case say, for people and for programs."""
