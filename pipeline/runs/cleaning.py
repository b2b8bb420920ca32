"""What can be removed of a case, and of the compiled kernels: which files, how large, and doing so."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pipeline.case.model import find_case, mistakes, read_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.json_output import result_json
from pipeline.results.wording import byte_size
from pipeline.runs.adopted import is_solid
from pipeline.runs.checkpoint import STAGE as CHECKPOINT
from pipeline.runs.claim import claimed
from pipeline.runs.job import default_folder
from pipeline.store import artifact, atomic, vtkhdf
from pipeline.store.files import Files, folder_of
from pipeline.terminal import told
from stages.chain import STAGES, followers


@dataclass(frozen=True)
class Removable:
    """A file or folder that can be removed.

    Attributes:
        path: of it.
        kind: what it is, in a word or two.
        remark: what is lost with it, if anything.
    """

    path: Path
    kind: str
    remark: str = ""

    @property
    def size(self) -> int:
        """Bytes, of a folder those of all its files."""
        files = self.path.rglob("*") if self.path.is_dir() else (self.path,)
        return sum(file.stat().st_size for file in files if file.is_file())

    def remove(self) -> None:
        """Remove it.

        Raises:
            OSError: if it cannot be removed.
        """
        if self.path.is_dir():
            shutil.rmtree(self.path)
        else:
            self.path.unlink(missing_ok=True)


def files_of(argument: Path, output: Path | None) -> Files:
    """The files of a case that is named by its file, by its name alone, or by one of its artifacts.

    Raises:
        Fault: if the argument is none of these (USAGE), or the artifact cannot be read (ARTIFACT).
    """
    if is_solid(argument):
        raise Fault(ExitCode.USAGE, f"{argument}: this is a part, which stays; give the case it belongs to.")
    if argument.suffix == ".h5":
        name = str(artifact.read_header(argument).case_resolved["name"])
        return Files(output / name if output else folder_of(argument), name, "")
    if argument.suffix in (".yaml", ".yml"):
        return _files(output, read_case(find_case(argument))[0].name)
    name = str(argument)
    if wrong := mistakes({"name": name}):
        raise Fault(ExitCode.USAGE, f"{wrong[0][1]}, or give the case file.")
    files = _files(output, name)
    if not of_case(files, everything=True):
        raise Fault(ExitCode.USAGE, f"{name}: no case of this name left anything in {files.folder}; see --output.")
    return files


def _files(output: Path | None, name: str) -> Files:
    return Files((output or default_folder()) / name, name, "")


def of_case(files: Files, *, everything: bool) -> list[Removable]:
    """What can be removed of a case.

    Args:
        files: of the case.
        everything: whether design, parts and all that was made of them go too.
    """
    found = {each.path: each for each in _on_the_way(files) if each.path.exists()}
    if everything:
        own = [path for path in _in(files.folder) if files.owns(path.name) or path == files.report]
        for path in (*own, *(path for path in _in(files.details) if path.name.startswith(f"{files.name}."))):
            found.setdefault(path, Removable(path, "result"))
    return list(found.values())


def _on_the_way(files: Files) -> Iterator[Removable]:
    """What is left on the way to a part, and is not needed once that is there."""
    for row in STAGES.values():
        if row.after and followers(row.name) and not row.makes_part:
            path = files.artifact(row.name)
            yield Removable(path, "intermediate")
            yield Removable(vtkhdf.sidecar(path), "intermediate")
    yield Removable(files.checkpoint, "checkpoint", _progress(files.checkpoint))
    yield Removable(files.updates, "checkpoint")
    yield Removable(files.holder, "left over")
    for folder in (files.folder, files.details):
        left = atomic.temporaries(folder) if folder.is_dir() else []
        yield from (Removable(path, "left over") for path, target in left if files.owns(target))


def _in(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []


def _progress(checkpoint: Path) -> str:
    if not checkpoint.exists():
        return ""
    try:
        updates = int(artifact.read(checkpoint, CHECKPOINT, "progress/updates")[0])
    except Fault:
        return "unreadable"
    return f"{updates} design updates, from which a run would go on"


def of_kernels() -> list[Removable]:
    """Compiled kernels, of this version of the program and of others."""
    mine = kernels()
    folders = sorted(mine.parent.glob(f"{_KERNELS}*")) if _is_ours(mine) else []
    return [Removable(folder, "kernels", "compiled again by the next run") for folder in folders]


def foreign_kernels() -> Path | None:
    """The folder that the user chose for compiled kernels, perhaps of other programs too; None if he chose none."""
    return None if _is_ours(kernels()) else kernels()


def kernels() -> Path:
    """The folder of compiled kernels, as the science has chosen it, or the user."""
    return Path(os.environ["NUMBA_CACHE_DIR"])


#: How the science begins the names of such folders, one for each text that they were compiled from.
_KERNELS = "kernels-"


def _is_ours(folder: Path) -> bool:
    return folder.name.startswith(_KERNELS)


def cleaned(files: Files | None, found: list[Removable], *, remove: bool, as_json: bool) -> str:
    """Remove what was found, or say what would be removed.

    Args:
        files: of the case, which no other process may be working on meanwhile; None if there is none.
        found: what to remove.
        remove: whether to remove it.
        as_json: whether to say so as JSON.

    Raises:
        Fault: if another process works on the case (BUSY).
        OSError: if something cannot be removed.
    """
    sizes = [each.size for each in found]
    if remove and found:
        with claimed(files) if files else contextlib.nullcontext():
            for each in found:
                each.remove()
        if files:
            _remove_empty(files)
    if as_json:
        listed = [
            {"path": str(each.path), "kind": each.kind, "bytes": size} for each, size in zip(found, sizes, strict=True)
        ]
        return result_json("clean", {"removed": remove, "found": listed}, [])
    return told("\n".join(_lines(found, sizes, remove)), [each.path for each in found])


def _remove_empty(files: Files) -> None:
    """Remove the folders of a case in which nothing but its lock is left."""
    if _in(files.details) == [files.lock]:
        files.lock.unlink()
        files.details.rmdir()
        if not _in(files.folder):
            files.folder.rmdir()


def _lines(found: list[Removable], sizes: Iterable[int], removed: bool) -> Iterator[str]:
    if not found:
        yield "Nothing to remove."
        return
    width = max(len(str(each.path)) for each in found)
    total = 0
    for each, size in zip(found, sizes, strict=True):
        total += size
        yield f"  {each.kind:<13} {each.path!s:<{width}}  {byte_size(size):>9}  {each.remark}".rstrip()
    count = f"{len(found)} {'entry' if len(found) == 1 else 'entries'}, {byte_size(total)}"
    yield f"Removed {count}." if removed else f"{count} would be removed; add --yes to do so."
