"""What the documents show: blocks of shell commands, run as they stand, and links."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from command_line import Poro

from pipeline.exit_codes import ExitCode

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("**/*.md")])

#: Stands before a block that is not run, with the reason.
NOT_RUN = re.compile(r"<!-- not run: (\S.*) -->\n\Z")
BLOCK = re.compile(r"^```(sh|console)\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)

#: These compute, for which one thread is enough.
COMPUTING = ("run", "optimize", "simulate", "inflate")


@dataclass(frozen=True)
class Block:
    """A block of shell commands: its lines, those continued by a backslash as one, and why it is not run, if so."""

    lines: list[str]
    reason: str | None


def blocks(page: Path) -> list[Block]:
    """The blocks marked sh or console of a page; of the latter only what follows a prompt."""
    text = page.read_text(encoding="utf-8")
    found = []
    for block in BLOCK.finditer(text):
        lines = block[2].replace("\\\n", " ").splitlines()
        if block[1] == "console":
            lines = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
        reason = NOT_RUN.search(text[: block.start()])
        found.append(Block([line for line in lines if line.strip()], reason[1] if reason else None))
    return found


def commands(page: Path) -> list[str]:
    """The commands of a page that are run, in order."""
    return [line for block in blocks(page) if block.reason is None for line in block.lines]


def follow(page: Path, poro: Poro, folder: Path) -> int:
    """Run the commands of a page in order, in the working folder of ``poro``; returns how many there are.

    ``poro`` itself runs in this process, everything else in a shell.
    """
    lines = commands(page)
    for line in lines:
        # Redirections are the shell's.
        words = shlex.split(line, comments=True)
        if words[0] != "poro" or ">" in words:
            shown = re.sub(r"^poro\b", f"{shlex.quote(sys.executable)} -m poro", line)
            ended = subprocess.run(shown, shell=True, cwd=folder, capture_output=True, text=True, check=False)
            assert ended.returncode == 0, f"{page.name}: {line}\n{ended.stderr}"
            continue
        called = poro(*words[1:], *(["--threads", 1] if words[1] in COMPUTING else []))
        # Parts of coarse cases do not hold air, and their void folds; what matters here is that this is found.
        fine = [ExitCode.OK]
        if words[1] in ("check", "run", "inflate"):
            fine.append(ExitCode.BAD_SOLID)
        if words[1] in ("optimize", "run", "sweep"):
            fine.append(ExitCode.UNSTABLE)
        assert called.code in fine, f"{page.name}: {line}\n{called.err}"
    return len(lines)


def links(page: Path) -> list[str]:
    """Targets of the links and pictures of a page inside the project."""
    return [link for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")) if "://" not in link]


def anchors(page: Path) -> set[str]:
    """What GitHub makes of the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
