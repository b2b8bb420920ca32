"""Case files made to do harm: a sentence with the usage code, no code run, time and memory bounded."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import PROGRAM, TINY, Poro, environment
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.case.model import find_case, parse_case
from pipeline.case.text import MOST_BYTES
from pipeline.exit_codes import ExitCode, Fault

SHIPPED = [find_case(Path(f"{name}.yaml")).read_text(encoding="utf-8") for name in ("case14", "case11", "quick")]

LAUGHS = "a: &a [x, x]\n" + "".join(f"{b}: &{b} [*{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True))

HOSTILE = {
    "billion laughs": LAUGHS.encode(),
    "alias of itself": b"domain: &a *a\n",
    "anchor of itself": b"domain: &a [*a]\n",
    "merge": b"x: &x {radius: 1.0}\ndomain: {<<: *x}\n",
    "call": b"name: !!python/object/apply:os.system ['touch PWNED']\n",
    "new": b"name: !!python/object/new:os.system ['touch PWNED']\n",
    "module": b"name: !!python/module:antigravity\n",
    "name of python": b"domain: !!python/name:os.system\n",
    "tag of the document": b"!!python/object/apply:os.system ['touch PWNED']\n",
    "tag of a key": b"!!python/object/apply:os.system ['touch PWNED']: 1\n",
    "directive": b"%TAG ! tag:yaml.org,2002:python/object/apply:\n--- !os.system ['touch PWNED']\n",
    "deep brackets": b"domain: " + b"[" * 60_000,
    "deep braces": b"{a: " * 15_000,
    "deep indentation": b"".join(b" " * depth + b"a:\n" for depth in range(300)),
    "one long line": b"name: " + b"a" * 10_000_000,
    "one long word": b"name: " + b"a" * (MOST_BYTES - 10),
    "one long key": b"a" * (MOST_BYTES - 10) + b": 1\n",
    "long number": b"domain:\n  radius: " + b"9" * 60_000,
    "long count": b"domain:\n  layers: " + b"9" * 18,
    "many keys": b"".join(b"radiu%d: 1\n" % number for number in range(4_500)),
    "many keys of a section": b"domain:\n" + b"".join(b" l%d: 1\n" % number for number in range(5_000)),
    "long list": b"domain: [" + b"1," * 30_000 + b"]\n",
    "many documents": b"---\n" * 15_000,
    "many comments": b"#\n" * 30_000,
    "many question marks": b"? " * 30_000,
    "many quotes": b"'" * 60_001,
    "zeros": bytes(1000),
    "UTF-16": TINY.encode("utf-16"),
    "UTF-32": TINY.encode("utf-32"),
    "Latin-1": b"name: caf\xe9\n",
    "binary": bytes(range(256)) * 4,
    "escapes": b'name: "\\x00\\uD800"\n',
    "huge number": b"domain:\n  radius: 1.0e+300\n",
    "tiny number": b"domain:\n  length: 1.0e-300\n",
    "not a number": b"domain:\n  radius: .nan\n",
}


def fault_of(text: bytes) -> Fault | None:
    """The fault that a text ends in, if any; other exceptions pass."""
    try:
        parse_case(text, "case.yaml", "case")
    except Fault as fault:
        return fault
    return None


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_text_is_refused_in_bounded_time(kind: str, poro: Poro) -> None:
    Path("case.yaml").write_bytes(HOSTILE[kind])
    start = time.process_time()
    ended = poro("optimize", "case.yaml", "--updates", 0)
    taken = time.process_time() - start
    assert ended.code == ExitCode.USAGE
    assert ended.out == ""
    assert ended.err.startswith("poro: case.yaml:")
    assert ended.err.count("\n") <= 21
    assert len(ended.err) < 10_000
    # PyYAML takes a second or two for the worst text of the allowed length.
    assert taken < 15.0
    assert [path.name for path in Path().iterdir()] == ["case.yaml"]


#: Reads case files with no more memory than it has, and some.
READER = """
import resource, sys
from pathlib import Path
from pipeline.case.model import read_case
from pipeline.exit_codes import Fault
size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize() + 128 * 2**20
resource.setrlimit(resource.RLIMIT_AS, (size, size))
for path in sorted(Path().glob("*.yaml")):
    try:
        read_case(path)
    except Fault:
        print(path)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads the size of the process from /proc")
def test_hostile_text_takes_bounded_memory(tmp_path: Path) -> None:
    for number, text in enumerate(HOSTILE.values()):
        (tmp_path / f"{number:03d}.yaml").write_bytes(text)
    ended = subprocess.run(
        [sys.executable, "-c", READER], cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    assert len(ended.stdout.splitlines()) == len(HOSTILE)


NAMES = ["../../etc/x", "/etc/x", "..", ".", "a/b", "a\\b", "-rf", ".hidden", "a" * 101, "x:y", "x\x07", "", " ", "é"]


@pytest.mark.parametrize("name", NAMES)
def test_name_that_is_no_plain_file_name_is_refused(name: str, poro: Poro) -> None:
    Path("case.yaml").write_text(f"name: {name!r}\n" if name.isprintable() else 'name: "x\\0"\n', encoding="utf-8")
    ended = poro("run", "case.yaml")
    assert ended.code == ExitCode.USAGE
    assert ended.err.startswith("poro: case.yaml:1: name: ")
    assert ended.err.count("\n") == 1
    assert list(Path().iterdir()) == [Path("case.yaml")]


@pytest.mark.parametrize("name", ["con", "NUL", "aux.b", "com1", "LPT9.x"])
def test_name_of_a_device_of_windows_is_refused(name: str, poro: Poro) -> None:
    Path("case.yaml").write_text(f"name: {name}\n")
    ended = poro("run", "case.yaml")
    assert ended.code == ExitCode.USAGE
    assert "device" in ended.err


def test_file_whose_own_name_is_no_case_name_is_refused(poro: Poro) -> None:
    for name in ("-x.yaml", "a b.yaml", "a" * 120 + ".yaml", "é.yaml"):
        Path(name).write_text(TINY)
        ended = poro("status", "--", name)
        assert ended.code == ExitCode.USAGE
        assert ended.err.count("\n") == 1
        assert "name: " in ended.err


# ----------------------------------------------------------------------------------------------- mutations

MARKS = ["&a ", "*a", "!!python/object/apply:os.system ", "[", "]", "{", "}", "- ", "? ", ": ", "---\n", "...\n", "|\n"]
CHARACTERS = ["\t", "\0", "\x85", "\u2028", "\ufeff", "\U0010ffff", "'", '"', "\\", "#", "-", "~"]
WORDS = ["%YAML 9.9\n", "<<: ", "9" * 400, "1.0e+308", ".inf", "1e-3", "0x10", "1_0", "null", "[" * 50, "{a: " * 50]
INSERTED = st.sampled_from([*MARKS, *CHARACTERS, *WORDS, "&a [*a, *a]"]) | st.text(max_size=20)
EDITS = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 60), INSERTED, st.booleans()), min_size=1, max_size=6)


def mutated(text: str, edits: list[tuple[float, int, str, bool]]) -> str:
    """Replace some characters by others, or repeat the lines there."""
    for place, length, inserted, repeat in edits:
        at = int(place * len(text))
        piece = text[at : at + length]
        text = text[:at] + (piece + inserted + piece if repeat else inserted) + text[at + length :]
    return text


@given(st.sampled_from(SHIPPED), EDITS)
@settings(deadline=5000, max_examples=150)
def test_mutated_case_is_a_case_or_gives_sentences(text: str, edits: list[tuple[float, int, str, bool]]) -> None:
    fault = fault_of(mutated(text, edits).encode("utf-8", errors="surrogatepass"))
    if fault:
        assert fault.code == ExitCode.USAGE
        assert all(line.startswith("case.yaml:") for line in str(fault).splitlines())


LINES = sorted({line for text in SHIPPED for line in text.splitlines() if ": " in line.partition("#")[0]})
VALUES = st.one_of(
    st.floats().map(repr), st.integers().map(str), st.text(max_size=10), st.sampled_from(["[]", "{}", "{a: 1}", "''"])
)


@given(st.lists(st.tuples(st.sampled_from(LINES), VALUES), min_size=1, max_size=5))
@settings(deadline=5000, max_examples=150)
def test_any_value_of_any_key_is_a_case_or_gives_sentences(changes: list[tuple[str, str]]) -> None:
    text = SHIPPED[0]
    for line, value in changes:
        text = text.replace(line, f"{line.partition(':')[0]}: {value}")
    fault = fault_of(text.encode("utf-8", errors="surrogatepass"))
    assert fault is None or fault.code == ExitCode.USAGE


@pytest.mark.parametrize("seed", range(3))
def test_mutated_case_by_the_real_command_line(seed: int, tmp_path: Path) -> None:
    dice = random.Random(seed)
    pieces = [
        "&a ",
        "!!python/object/apply:os.system ['touch PWNED']",
        "[[[[",
        "\0",
        "1e999",
        "../..",
        "\t",
        "99999999",
    ]
    edits = [(dice.random(), dice.randrange(20), dice.choice(pieces), dice.random() < 0.5) for _ in range(3)]
    (tmp_path / "case.yaml").write_bytes(mutated(SHIPPED[seed % 3], edits).encode())
    command = [*PROGRAM, "run", "case.yaml", "--dry-run"]
    ended = subprocess.run(
        command, cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=120, check=False
    )
    assert ended.returncode in (ExitCode.OK, ExitCode.USAGE), ended.stderr
    assert "Traceback" not in ended.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["case.yaml"]


EXTREMES = [
    "domain: {radius: 1.0e-20, length: 1.0e+20, core_cells: 2, rings: 1, layers: 3}\n",
    TINY + "material: {youngs_modulus: 1.0e+20, poisson_ratio: 0.4999999999999, void_permeability_rate: 1.0e+20}\n",
    TINY + "material: {youngs_modulus: 1.0e-20, stiffness_contrast: 1.0e-20, permeability_contrast: 1.0e-20}\n",
    TINY + "load: {pressure_ratio: 1.0e+20, arm_ratio: 1.0e-20, spring_ratio: 1.0e+6}\n",
    TINY.replace(
        "objective:\n",
        "objective:\n  strain_limit: 1.0e-20\n  interface_width: 1.0e-20\n  diffusivity_length: 1.0e+20\n",
    ),
]


@pytest.mark.parametrize("text", EXTREMES)
def test_extreme_values_end_in_a_sentence(text: str, poro: Poro) -> None:
    """Whether they have a state or not: numbers that overflow must not come out as an error nobody foresaw."""
    Path("case.yaml").write_text(text)
    ended = poro("optimize", "case.yaml", "--updates", 0, "--threads", 1)
    assert ended.code in (ExitCode.OK, ExitCode.NOT_CONVERGED), ended.err
    assert "Traceback" not in ended.err
