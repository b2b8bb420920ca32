"""Design domains: mesh, boundaries by name, inlet, passive bound and first design."""
