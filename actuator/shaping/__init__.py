"""Shape of the part as printed: how its figures change with its surface, and a flow that improves them."""
