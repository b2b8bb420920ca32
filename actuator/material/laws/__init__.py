"""Hyperelastic laws of the solid: isochoric energies w(b̄) per initial shear modulus G, one file each.

With b̄ = J^(-2/3) F Fᵀ the solid's strain energy is

    Ψ = K/2 (ln J)² + G w(b̄),

of which the volumetric part and the scaling by Eq. (2) are the same for all laws
(:mod:`actuator.material.elasticity`). Every law is normalised so that G is the initial shear modulus:
S(b̄) = 2 b̄ ∂w/∂b̄ has dS = 2 ε at b̄ = I for a small deviatoric strain ε. A law's file has

* a ``NamedTuple`` of its coefficients, plain numbers, as ratios to G, under names that no constant of
  :class:`actuator.material.constants.Constants` has;
* ``EXAMPLE``: coefficients of an ordinary rubber, to compile the kernels with;
* ``energy(law, b)``: w;
* ``stress(law, b, S)``: writes S = 2 b̄ ∂w/∂b̄ (3, 3). The isochoric Kirchhoff stress is G dev S;
* ``tangent(law, b, X, dS)``: writes the derivative of S along the symmetric directions X (m, 3, 3) of b̄;
* if it has a faster way to what the element loops ask for, plain functions with the names and arguments of those that
  are decorated in :mod:`actuator.material.elasticity`, which takes them because they are there.

The three are dimensionless. All take real and complex matrices and are written in the part of Python that numba
compiles; ``law`` is the tuple of coefficients or any named tuple with the same fields. Nothing here has to be told of
a new file: the functions of a law are those of the module in which the class of its coefficients stands. Cases know it
by its section in :mod:`stages.laws`.
"""
