"""An optimised design with its case, as its artifact holds it, and the printed shape that belongs to it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import stages.ended
import stages.mirror
import stages.optimize
import stages.refine
from actuator.arrays import Floats
from actuator.failure import InvalidField
from pipeline.case.model import Case, stored_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.simulation import is_current
from pipeline.results.wording import count
from pipeline.store import artifact, contents
from pipeline.store.artifact import CHECKPOINT
from pipeline.store.files import Files, folder_of
from stages.chain import STAGES, path_to
from stages.datasets import vtk_order
from stages.design import OtherState

if TYPE_CHECKING:
    from actuator.geometry.zero_set import Surface


@dataclass(frozen=True)
class OptimisedDesign(stages.optimize.Result):
    """What the optimisation of a case found; fields, units and shapes are those of the stage's result.

    Attributes:
        case: as it was optimised.
        source: the artifact it was read from, if any; what else was made of the design is looked for beside it.
        identity: of that artifact.
        unfinished: whether it is that of a checkpoint, of which nothing else has been made.
    """

    case: Case
    source: Path | None = None
    identity: str = ""
    unfinished: bool = False

    @property
    def label(self) -> str:
        """What everything that shows the design says of it; empty for one that is finished."""
        return f"after {count(self.summary['updates'], 'update')}, unfinished" if self.unfinished else ""

    @property
    def name(self) -> str:
        """The name of the case."""
        return self.case.name

    @property
    def relative_pressure(self) -> Floats:
        """p over the source pressure at the vertices, (n_vertices,), as it is drawn; p itself without a source."""
        pressure_in = self.case.optimize.parameters()[1].pressure
        return self.pressure / pressure_in if pressure_in > 0.0 else self.pressure

    @property
    def vertex_displacement(self) -> Floats:
        """The displacement u at the vertices, which are the first of the nodes, (n_vertices, 3), mm."""
        return self.displacement[: len(self.chi)]

    @property
    def simulation(self) -> Path | None:
        """The artifact of ``poro simulate`` beside the design's own, if there is one of this version."""
        path = self._files.artifact("simulate") if self.source and not self.unfinished else None
        return path if path and is_current(path) else None

    @property
    def _files(self) -> Files:
        """Of the case whose design this is, if that was read from an artifact."""
        assert self.source
        return Files(folder_of(self.source), self.name, "")

    @property
    def shape(self) -> Surface:
        """The closed surface that refining and mirroring make of the design, in the size of the computation.

        It is read from the artifacts beside the design's own if these were made from it, and computed otherwise.

        Raises:
            actuator.failure.EmptySolid: if nothing is solid.
        """
        return self._shape[0]

    @cached_property
    def _shape(self) -> tuple[Surface, int]:
        """The surface, and how many cells the mesh it was cut from has per cell of the design's."""
        from actuator.geometry.zero_set import Surface

        if stored := self._stored_shape():
            return stored
        fine = stages.refine.run(self.domain, self.chi, self.case.refine)
        whole = stages.mirror.run(fine.domain, fine.chi, self.case.mirror)
        return Surface(whole.vertices, whole.triangles), self.case.refine.factor

    def _stored_shape(self) -> tuple[Surface, int] | None:
        """The same from the artifacts of the stages up to ``mirror``; None unless all are of this design."""
        from actuator.geometry.zero_set import Surface

        if not self.source or self.unfinished:
            return None
        above = self.identity
        refined, *_, mirrored = after = [self._files.artifact(stage) for stage in path_to("mirror")[1:]]
        try:
            for path in after:
                header = artifact.read_header(path)
                current = header.stage_version == STAGES[header.stage].load().VERSION
                if not (current and header.upstream_identity == above):
                    return None
                above = header.identity
            factor = stored_case(artifact.read_header(refined).case_resolved, refined).refine.factor
            return Surface(*contents.surface(mirrored)), factor
        except Fault:  # missing or damaged: what is wrong with them is for the stages to say
            return None

    def fields_at(self, points: Floats) -> tuple[dict[str, Floats], Floats]:
        """The state of the design on its shape.

        The fields are first carried to the refined mesh, whose wall the shape lies on: beside the chords of the coarse
        mesh's wall there is nothing to interpolate in.

        Args:
            points: of the shape, (n, 3), mm.

        Returns:
            ``pressure`` over the source pressure and ``density``, (n,) each, and the displacement, (n, 3), mm.
        """
        from scipy.special import expit

        from actuator.geometry.sampling import sampled

        _, factor = self._shape
        fine, carry = self.domain.refined(factor), self.domain.prolongation(factor)
        fields = {"pressure": carry @ self.relative_pressure, "density": expit(carry @ self.chi)}
        corners, moved = fine.cells[:, vtk_order()[:8]], carry @ self.vertex_displacement
        return sampled(fine.points, corners, points, fields, moved, mirrored=fine.mirrored)


def read_design(path: Path) -> OptimisedDesign:
    """Read the artifact of ``optimize``, or the checkpoint of an optimisation that has not ended.

    Raises:
        Fault: if the file is missing, unreadable, or of another stage (ARTIFACT).
    """
    if not path.exists():
        remedy = "run the stage that makes it, `poro optimize`, or say with --output where it lies"
        raise Fault(ExitCode.ARTIFACT, f"{path}: there is no such file; {remedy}.")
    header = artifact.read_header(path)
    case = stored_case(header.case_resolved, path)
    if header.stage == CHECKPOINT:
        try:
            found = stages.ended.reached(case.optimize, contents.checkpoint(path, CHECKPOINT))
        except InvalidField as failure:
            raise Fault(ExitCode.ARTIFACT, f"{path}: {failure}") from None
        return OptimisedDesign(**vars(found), case=case, source=path, unfinished=True)
    domain, chi = contents.design(path, "optimize")
    stored = contents.Stored(path, "optimize")
    pressure, displacement, arm = stored.read("vertices/pressure", "nodes/displacement", "arm")
    shapes = [(len(domain.points),), (len(domain.nodes), 3), (3,)]
    if [values.shape for values in (pressure, displacement, arm)] != shapes:
        raise Fault(ExitCode.ARTIFACT, f"{path}: its state does not fit its mesh, {contents.OTHER_VERSION}.")
    summary = contents.summary(path, "optimize")
    return OptimisedDesign(
        domain=domain,
        chi=chi,
        displacement=displacement,
        pressure=pressure,
        arm=arm,
        history=artifact.read_group(path, "optimize", "history"),
        summary=summary,
        checkpoint=artifact.read_group(path, "optimize", "checkpoint"),
        converged=summary["converged"],
        reason=summary["reason"],
        others={each.name: OtherState.read(stored, each.name) for each in case.load.cases[1:]},
        case=case,
        source=path,
        identity=header.identity,
    )
