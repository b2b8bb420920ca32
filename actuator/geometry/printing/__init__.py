"""What printing asks of a solid: walls, gaps, cups, drains, overhangs, the chamber, layers."""
