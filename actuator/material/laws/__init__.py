"""Hyperelastic laws of the solid: isochoric energies w(b̄) per initial shear modulus G, one file each.

With b̄ = J^(-2/3) F Fᵀ the solid's strain energy is

    Ψ = K/2 (ln J)² + G w(b̄),

of which the volumetric part and the scaling by Eq. (2) are the same for all laws
(:mod:`actuator.material.elasticity`). Every law is normalised so that G is the initial shear modulus:
S(b̄) = 2 b̄ ∂w/∂b̄ has dS = 2 ε at b̄ = I for a small deviatoric strain ε.
Each file has three compiled functions for real and complex matrices:

* ``energy(law, b)``: w.
* ``stress(law, b, S)``: writes S = 2 b̄ ∂w/∂b̄ (3, 3). The isochoric Kirchhoff stress is G dev S.
* ``tangent(law, b, X, dS)``: writes the derivative of S along the symmetric directions X (m, 3, 3) of b̄.

All are dimensionless. ``law`` is a tuple of :mod:`actuator.material.laws.coefficients`, or any named tuple with the
same fields.
"""
