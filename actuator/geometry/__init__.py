"""From a level-set field to a solid: tetrahedra, the zero set, reflection, and the proof of a 2-manifold."""
