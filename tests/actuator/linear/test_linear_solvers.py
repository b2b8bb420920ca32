"""Sparse direct solvers: exact on known systems, honest on bad ones, and the same behind one interface."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementHexS2, ElementVector, MeshHex
from skfem.helpers import ddot, sym_grad, trace

from actuator.failure import SolveFailure
from actuator.linear import DirectSolver, available, make_solver

SOLVERS = available()


@dataclass(frozen=True)
class System:
    """A matrix in full, and the pattern and values that a solver is given for it."""

    full: sp.csr_array
    stored: sp.csr_array
    symmetric: bool
    positive_definite: bool = False

    def solver(self, name: str, **options: object) -> DirectSolver:
        return make_solver(
            self.stored.indptr,
            self.stored.indices,
            symmetric=self.symmetric,
            positive_definite=self.positive_definite,
            name=name,
            **options,
        )


def symmetric(full: sp.csr_array, *, positive_definite: bool = False) -> System:
    """The upper triangle with the whole diagonal, also where it is zero."""
    n = full.shape[0]
    mark = (sp.triu(abs(full)) + sp.eye_array(n)).tocsr()
    mark.sort_indices()
    rows = np.repeat(np.arange(n), np.diff(mark.indptr))
    values = full.toarray()[rows, mark.indices]
    return System(full, sp.csr_array((values, mark.indices, mark.indptr), shape=(n, n)), True, positive_definite)


def unsymmetric(full: sp.csr_array) -> System:
    stored = sp.csr_array(full)
    stored.sort_indices()
    return System(stored, stored, False)


def random_system(kind: str, n: int = 200, seed: int = 0) -> System:
    rng = np.random.default_rng(seed)
    noise = sp.csr_array(sp.random_array((n, n), density=0.03, rng=rng, data_sampler=rng.standard_normal))
    if kind == "unsymmetric":
        return unsymmetric(noise + sp.diags_array(rng.standard_normal(n)))
    if kind == "indefinite":
        return symmetric(sp.csr_array(noise + noise.T + sp.diags_array(2.0 * rng.standard_normal(n))))
    return symmetric(sp.csr_array(noise @ noise.T + sp.eye_array(n)), positive_definite=True)


def elasticity(contrast: float = 1.0) -> System:
    """A block of 20-node elements fixed at one end, every other layer softer by ``contrast``."""
    mesh = MeshHex.init_tensor(np.linspace(0, 2, 5), np.linspace(0, 1, 4), np.linspace(0, 1, 4))
    basis = Basis(mesh, ElementVector(ElementHexS2()), intorder=5)
    soft = np.floor(2.0 * mesh.p[0, mesh.t].mean(axis=0)) % 2 == 1

    @BilinearForm
    def stiffness(u, v, w):
        e, d = sym_grad(u), sym_grad(v)
        return w.E * (ddot(e, d) + 3.0 * trace(e) * trace(d))

    E = np.where(soft, contrast, 1.0)[:, None] * np.ones_like(basis.dx)
    full = stiffness.assemble(basis, E=E)
    free = np.setdiff1d(np.arange(basis.N), basis.get_dofs(lambda x: x[0] == 0.0).all())
    full = sp.csr_array(full[free][:, free])
    return symmetric(0.5 * (full + full.T), positive_definite=True)


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("kind", ["unsymmetric", "indefinite", "definite"])
def test_solution_agrees_with_dense_elimination(name: str, kind: str) -> None:
    system = random_system(kind)
    b = np.random.default_rng(1).standard_normal(system.full.shape[0])
    with system.solver(name) as solver:
        solver.factorise(system.stored.data)
        x = solver.solve(b)
    np.testing.assert_allclose(x, np.linalg.solve(system.full.toarray(), b), rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("precision", ["double", "single"])
def test_transposed_solve(name: str, precision: str) -> None:
    system = random_system("unsymmetric")
    b = np.random.default_rng(2).standard_normal((system.full.shape[0], 2))
    solver = system.solver(name, precision=precision)
    solver.factorise(system.stored.data)
    x = solver.solve(b, transposed=True)
    assert np.linalg.norm(system.full.T @ x - b) <= 2e-8 * np.linalg.norm(b)
    assert np.linalg.norm(system.full @ x - b) > 0.1 * np.linalg.norm(b)


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("kind", ["unsymmetric", "indefinite", "definite"])
def test_several_right_hand_sides_in_any_memory_order(name: str, kind: str) -> None:
    system = random_system(kind)
    n = system.full.shape[0]
    b = np.random.default_rng(3).standard_normal((n, 4))
    before = b.copy()
    solver = system.solver(name)
    solver.factorise(system.stored.data)
    x = solver.solve(b)
    assert x.shape == (n, 4)
    np.testing.assert_array_equal(b, before)
    np.testing.assert_allclose(solver.solve(np.asfortranarray(b)), x, rtol=1e-10, atol=1e-12)
    for column in range(4):
        np.testing.assert_allclose(solver.solve(b[:, column]), x[:, column], rtol=1e-8, atol=1e-10)
    assert solver.statistics.solves == 12


@pytest.mark.parametrize("name", SOLVERS)
def test_single_precision_factors_are_smaller_and_refined_to_double(name: str) -> None:
    system = elasticity()
    b = np.random.default_rng(4).standard_normal(system.full.shape[0])
    exact = np.linalg.solve(system.full.toarray(), b)
    solver = system.solver(name, precision="single")
    solver.factorise(system.stored.data)

    rough = solver.solve(b, check=None)
    error = np.linalg.norm(rough - exact) / np.linalg.norm(exact)
    assert 1e-9 < error < 1e-2
    assert solver.statistics.refinements == 0

    fine = solver.solve(b, check=1e-11)
    assert np.linalg.norm(fine - exact) < 1e-9 * np.linalg.norm(exact)
    assert solver.statistics.refinements >= 1

    double = system.solver(name)
    double.factorise(system.stored.data)
    assert solver.statistics.peak_memory < double.statistics.peak_memory


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("kind", ["unsymmetric", "indefinite", "definite"])
def test_new_values_on_the_same_pattern_need_no_new_analysis(name: str, kind: str) -> None:
    system = random_system(kind)
    b = np.ones(system.full.shape[0])
    solver = system.solver(name)
    for scale in (1.0, -3.0 if kind != "definite" else 3.0, 0.5):
        solver.factorise(scale * system.stored.data)
        np.testing.assert_allclose(system.full @ solver.solve(b), b / scale, rtol=1e-6, atol=1e-7)
    assert (solver.statistics.analyses, solver.statistics.factorisations) == (1, 3)


@pytest.mark.parametrize("name", SOLVERS)
@pytest.mark.parametrize("contrast", [1.0, 1e-6])
def test_elasticity_with_material_contrast(name: str, contrast: float) -> None:
    system = elasticity(contrast)
    x = np.random.default_rng(5).standard_normal((system.full.shape[0], 2))
    solver = system.solver(name)
    solver.factorise(system.stored.data)
    b = system.full @ x
    assert np.linalg.norm(system.full @ solver.solve(b) - b) <= 1e-8 * np.linalg.norm(b)
    assert solver.statistics.residual <= 1e-8


@pytest.mark.parametrize("name", SOLVERS)
def test_singular_symmetric_matrix_is_refused(name: str) -> None:
    """The graph Laplacian of a path, free at both ends: constants are in its kernel, b = 1 is not in its range."""
    n = 50
    full = sp.diags_array([np.r_[1.0, np.full(n - 2, 2.0), 1.0], *2 * [-np.ones(n - 1)]], offsets=[0, 1, -1]).tocsr()
    solver = symmetric(full).solver(name)
    with pytest.raises(SolveFailure, match="singular"):
        factorise_and_solve(solver, symmetric(full).stored.data, np.ones(n))


@pytest.mark.parametrize("name", SOLVERS)
def test_singular_unsymmetric_matrix_is_refused(name: str) -> None:
    system = random_system("unsymmetric")
    full = system.full.toarray()
    full[7] = full[3]
    bad = unsymmetric(sp.csr_array(full))
    with pytest.raises(SolveFailure, match="singular"):
        factorise_and_solve(bad.solver(name), bad.stored.data, np.arange(1.0, 201.0))


@pytest.mark.skipif("pardiso" not in SOLVERS, reason="only a Cholesky factorisation can tell")
def test_promised_definiteness_is_verified() -> None:
    indefinite = random_system("indefinite")
    solver = System(indefinite.full, indefinite.stored, True, positive_definite=True).solver("pardiso")
    with pytest.raises(SolveFailure, match="not positive definite"):
        solver.factorise(indefinite.stored.data)


@pytest.mark.parametrize("name", SOLVERS)
def test_matrix_without_diagonal_is_solved_or_refused_but_never_silently_wrong(name: str) -> None:
    """A saddle point without any diagonal: static pivoting perturbs most pivots and loses half the digits."""
    rng = np.random.default_rng(6)
    n = 150
    coupling = sp.random_array((n, n), density=0.02, rng=rng) + sp.eye_array(n).tocsr()[rng.permutation(n)]
    mixed = rng.permutation(2 * n)
    system = symmetric(sp.csr_array(sp.block_array([[None, coupling], [coupling.T, None]]).tocsr()[mixed][:, mixed]))
    b = rng.standard_normal(2 * n)
    solver = system.solver(name)
    solver.factorise(system.stored.data)
    x = solver.solve(b)
    assert np.linalg.norm(system.full @ x - b) <= 1e-8 * np.linalg.norm(b)
    if name == "pardiso":
        assert solver.statistics.perturbed_pivots > 0
        unchecked = solver.solve(b, check=None)
        assert np.linalg.norm(system.full @ unchecked - b) > 1e-10 * np.linalg.norm(b)


@pytest.mark.parametrize("name", SOLVERS)
def test_residual_check_catches_factors_of_another_matrix(name: str) -> None:
    """The values are overwritten after factorising, as a careless caller might: the check reads the new ones."""
    system = random_system("definite")
    data = system.stored.data.copy()
    solver = system.solver(name)
    solver.factorise(data)
    data *= -4.0
    with pytest.raises(SolveFailure, match="relative residual"):
        solver.solve(np.ones(system.full.shape[0]))


@pytest.mark.parametrize("name", SOLVERS)
def test_values_that_are_not_finite_are_refused(name: str) -> None:
    system = random_system("indefinite")
    data = system.stored.data.copy()
    data[3] = np.nan
    with pytest.raises(SolveFailure, match="not finite"):
        system.solver(name).factorise(data)


@pytest.mark.parametrize("name", SOLVERS)
def test_release_gives_a_clear_error_and_allows_a_new_start(name: str) -> None:
    system = random_system("indefinite")
    b = np.ones(system.full.shape[0])
    solver = system.solver(name)
    with pytest.raises(SolveFailure, match="factorise"):
        solver.solve(b)
    solver.factorise(system.stored.data)
    x = solver.solve(b)
    solver.release()
    solver.release()
    with pytest.raises(SolveFailure, match="factorise"):
        solver.solve(b)
    solver.factorise(system.stored.data)
    np.testing.assert_allclose(solver.solve(b), x, rtol=1e-9, atol=1e-12)
    assert solver.statistics.analyses == 2


@pytest.mark.skipif("pardiso" not in SOLVERS, reason="SuperLU reports no inertia")
def test_inertia_by_sylvester() -> None:
    """K - σ I of a chain of unit springs has as many negative eigenvalues as modes 4 sin²(kπ/2(n+1)) below σ."""
    n, shift = 40, 1.3
    chain = sp.diags_array([np.full(n, 2.0 - shift), *2 * [-np.ones(n - 1)]], offsets=[0, 1, -1]).tocsr()
    modes = 4.0 * np.sin(0.5 * np.pi * np.arange(1, n + 1) / (n + 1)) ** 2
    below = int(np.count_nonzero(modes < shift))
    system = symmetric(chain)
    solver = system.solver("pardiso")
    solver.factorise(system.stored.data)
    assert solver.statistics.negative_eigenvalues == below
    assert solver.statistics.positive_eigenvalues == n - below


@pytest.mark.skipif("pardiso" not in SOLVERS, reason="SuperLU has one thread")
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("columns", [1, 2, 5, 12, 44])
def test_any_number_of_threads_gives_the_same_solution_bit_by_bit(precision: str, columns: int) -> None:
    system = elasticity()
    b = np.random.default_rng(7).standard_normal((system.full.shape[0], columns))
    solutions = []
    for threads in (1, 2, 2, 3):
        with system.solver("pardiso", threads=threads, precision=precision) as solver:
            solver.factorise(system.stored.data)
            solutions.append(solver.solve(b, check=None))
    for solution in solutions[1:]:
        np.testing.assert_array_equal(solution, solutions[0])


@pytest.mark.parametrize("name", SOLVERS)
def test_two_solvers_live_side_by_side(name: str) -> None:
    first, second = random_system("indefinite", seed=8), random_system("unsymmetric", seed=9)
    b = np.ones(200)
    solvers = [system.solver(name) for system in (first, second)]
    for solver, system in zip(solvers, (first, second), strict=True):
        solver.factorise(system.stored.data)
    x = solvers[0].solve(b)
    solvers[1].release()
    np.testing.assert_allclose(solvers[0].solve(b), x, rtol=1e-12)


@pytest.mark.parametrize("name", SOLVERS)
def test_statistics_tell_what_was_done(name: str) -> None:
    system = elasticity()
    solver = system.solver(name)
    solver.factorise(system.stored.data)
    solver.solve(np.ones(system.full.shape[0]))
    seen = solver.statistics
    assert seen.factor_entries >= system.stored.nnz
    assert seen.peak_memory > 8 * seen.factor_entries
    assert min(seen.analysis_seconds, seen.factorisation_seconds, seen.solve_seconds) > 0.0
    if name == "pardiso":
        assert (seen.positive_eigenvalues, seen.negative_eigenvalues) == (system.full.shape[0], 0)
        assert seen.operations > 0.0


def test_automatic_choice_is_the_first_available() -> None:
    system = random_system("indefinite")
    assert system.solver("auto").name == available()[0]
    assert "superlu" in available()


def test_unknown_solver_is_refused_in_one_sentence() -> None:
    with pytest.raises(SolveFailure, match=r"no linear solver named 'mumps'.*choose"):
        random_system("indefinite").solver("mumps")


def test_without_mkl_the_choice_falls_back_and_pardiso_is_refused() -> None:
    """In a fresh interpreter whose search for MKL comes back empty, as on a machine that has none."""
    script = """
import ctypes.util, sys
from importlib import metadata
def absent(name): raise metadata.PackageNotFoundError(name)
metadata.files = absent
ctypes.util.find_library = lambda name: None
sys.prefix = "/nowhere"
from actuator.failure import SolveFailure
from actuator.linear import available, make_solver
assert available() == ("superlu",), available()
pattern = dict(indptr=[0, 1, 2], indices=[0, 1], symmetric=True)
assert make_solver(**pattern).name == "superlu"
try:
    make_solver(**pattern, name="pardiso")
except SolveFailure as failure:
    sys.stdout.write(str(failure))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "pip install mkl" in done.stdout
    assert "superlu" in done.stdout


@pytest.mark.parametrize(
    ("indptr", "indices", "options", "message"),
    [
        ([0, 2, 3], [0, 1, 0], {"symmetric": True}, "upper triangle"),
        ([0, 1, 2], [1, 1], {"symmetric": True}, "upper triangle"),
        ([0, 2, 3], [1, 0, 1], {"symmetric": False}, "ascending"),
        ([0, 2, 3], [1, 1, 1], {"symmetric": False}, "ascending"),
        ([0, 1, 2], [0, 2], {"symmetric": False}, "outside"),
        ([0, 1, 3], [0, 1], {"symmetric": False}, "indptr"),
        ([0, 1, 2], [0, 1], {"symmetric": False, "positive_definite": True}, "symmetric"),
        ([0, 1, 2], [0, 1], {"symmetric": False, "precision": "half"}, "precision"),
        ([0, 1, 2], [0, 1], {"symmetric": False, "threads": 0}, "threads"),
    ],
)
def test_malformed_patterns_and_options_are_refused(
    indptr: list[int], indices: list[int], options: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        make_solver(indptr, indices, **options)


@pytest.mark.parametrize("name", SOLVERS)
def test_wrong_sizes_are_refused(name: str) -> None:
    solver = make_solver([0, 1, 2], [0, 1], symmetric=True, name=name)
    with pytest.raises(ValueError, match="3"):
        solver.factorise(np.ones(3))
    solver.factorise(np.ones(2))
    with pytest.raises(ValueError, match="right-hand side"):
        solver.solve(np.ones(3))


def factorise_and_solve(solver: DirectSolver, data: np.ndarray, b: np.ndarray) -> None:
    solver.factorise(data)
    solver.solve(b)
