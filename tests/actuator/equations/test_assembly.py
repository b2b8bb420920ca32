"""Gathering element entries into sparse matrices, and independence of the number of threads."""

from __future__ import annotations

from collections.abc import Iterator

import numba
import numpy as np
import pytest
import scipy.sparse as sp
from physics import Floats, half_cylinder, parameters, wavy

from actuator.equations.assembly import Gather, scatter_vector
from actuator.equations.kernels import lagrangian_gradient
from actuator.solve.equilibrium import Equilibrium


def random_targets(seed: int, n_rows: int, n_columns: int, entries: int) -> tuple[Floats, Floats, Floats]:
    """Rows and columns with repetitions, about a tenth of them dropped, and values."""
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(0, n_rows, entries), rng.integers(0, n_columns, entries)
    rows[rng.uniform(size=entries) < 0.05] = -1
    columns[rng.uniform(size=entries) < 0.05] = -1
    return rows, columns, rng.normal(size=entries)


@pytest.mark.parametrize(("n_rows", "n_columns", "entries"), [(1, 1, 5), (7, 4, 200), (300, 500, 4000)])
def test_gathered_matrix_is_the_sum_of_its_entries(n_rows: int, n_columns: int, entries: int) -> None:
    rows, columns, values = random_targets(entries, n_rows, n_columns, entries)
    gather = Gather(rows, columns, (n_rows, n_columns))
    kept = (rows >= 0) & (columns >= 0)
    expected = sp.coo_array((values[kept], (rows[kept], columns[kept])), (n_rows, n_columns)).tocsr()
    expected.sum_duplicates()
    matrix = gather.matrix(gather.data(values))
    assert gather.nonzeros == expected.nnz
    assert np.array_equal(matrix.indptr, expected.indptr)
    assert np.array_equal(matrix.indices, expected.indices)
    assert matrix.data == pytest.approx(expected.data, rel=1e-13, abs=1e-13)


def test_gather_reuses_an_output_array_and_leaves_empty_rows() -> None:
    gather = Gather(np.array([3, 3, -1]), np.array([0, 0, 2]), (5, 4))
    out = np.full(1, np.nan)
    assert gather.data(np.array([1.5, 2.0, 7.0]), out) is out
    assert out[0] == 3.5
    assert np.array_equal(gather.indptr, [0, 0, 0, 0, 1, 1])


@pytest.mark.parametrize("tail", [(), (3,)])
@pytest.mark.parametrize("kind", [float, complex])
def test_scattered_vector_is_the_sum_of_its_entries(tail: tuple[int, ...], kind: type) -> None:
    rng = np.random.default_rng(1)
    cells, elements = rng.integers(0, 9, (20, 4)), rng.normal(size=(20, 4, *tail)).astype(kind)
    if kind is complex:
        elements += 1j * rng.normal(size=elements.shape)
    expected = np.zeros((11, *tail), kind)
    np.add.at(expected, cells, elements)
    assert scatter_vector(elements, cells, 11) == pytest.approx(expected, rel=1e-13, abs=1e-13)


# -------------------------------------------------------------------------------------------------- threads


@pytest.fixture
def both_thread_counts() -> Iterator[tuple[int, int]]:
    if numba.config.NUMBA_NUM_THREADS < 2:
        pytest.skip("only one thread on this machine")
    before = numba.get_num_threads()
    yield 1, 2
    numba.set_num_threads(before)


def everything_compiled(equilibrium: Equilibrium, chi: Floats, x: Floats, p: Floats) -> list[Floats]:
    """Residual, all tangent blocks and the Lagrangian's gradient at a state."""
    rx, rp, nodal, _ = equilibrium.residual(chi, x, p)
    tangent, g = equilibrium.tangent, equilibrium.geometry
    tangent.assemble(equilibrium.source, equilibrium.coefficients, chi, x, p, nodal)
    blocks = [matrix.data.copy() for matrix in (tangent.xx, tangent.xp, tangent.px, tangent.pp)]
    n_cells, u = len(g.cells), equilibrium.kinematics.displacement(x)
    derivatives = [np.empty((n_cells, 8)), np.empty((n_cells, 20, 3)), np.empty((n_cells, 8))]
    adjoint = wavy(equilibrium.domain.nodes, 1.0, 7), p
    constants = equilibrium.source, equilibrium.coefficients
    lagrangian_gradient(g, *constants, chi, u, p, *adjoint, 1.0, True, *derivatives)
    return [rx, rp, *blocks, *derivatives]


def test_results_do_not_depend_on_the_number_of_threads(both_thread_counts: tuple[int, int]) -> None:
    domain = half_cylinder(2, 2, 3)
    equilibrium = Equilibrium(domain, *parameters(strain_limit=0.01), threads=1)
    chi, p = domain.initial_design(domain.points, 3.0), 0.05 * domain.points[:, 0] / 15.0
    x = equilibrium.kinematics.reduced(wavy(domain.nodes, 0.3, 2), np.array([0.2, -0.1, 0.05]))
    results = []
    for count in both_thread_counts:
        numba.set_num_threads(count)
        results.append(everything_compiled(equilibrium, chi, x, p))
    for one, two in zip(*results, strict=True):
        assert np.array_equal(one, two)
