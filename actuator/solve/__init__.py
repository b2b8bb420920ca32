"""Solving: the state, its linearisation, the adjoint, paths of states, and the check of the leak."""
