"""What ``poro check`` says: one finding for each check, with what was measured and one sentence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from actuator.geometry.bodies import Shell
    from actuator.geometry.crossings import Crossings
    from actuator.geometry.flaws import Flaws
    from actuator.geometry.printing.chamber import Leak, Sealing
    from actuator.geometry.printing.cups import Cup
    from actuator.geometry.printing.drains import Pocket
    from actuator.geometry.printing.overhangs import Overhangs
    from actuator.geometry.printing.thickness import Thickness
    from actuator.geometry.zero_set import Surface
    from stages.check.settings import Settings

Verdict = Literal["pass", "warn", "fail", "not applicable"]


class Check(StrEnum):
    """The checks, in the order in which they are listed."""

    CLOSED = "closed surface"
    CROSSINGS = "crossings"
    BODIES = "one body"
    CAVITIES = "closed cavities"
    CUPS = "cups"
    DRAINS = "drain holes"
    WALLS = "walls"
    GAPS = "gaps"
    OVERHANGS = "overhangs"
    VOLUME = "volume and mass"
    CHAMBER = "air chamber"


#: Places that a sentence describes one by one.
SHOWN = 3


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        name: the check.
        verdict: ``fail`` if the part cannot be printed or used, ``warn`` if that depends on more than the shape.
        text: one sentence.
        measured: names and values, in mm, mm², mm³ and g; empty if nothing was measured.
        threshold: what was compared with; None if nothing was.
        unit: of the threshold.
    """

    name: Check
    verdict: Verdict
    text: str
    measured: dict[str, Any] = field(default_factory=dict)
    threshold: float | None = None
    unit: str = ""


def not_applicable(name: Check, reason: str) -> Finding:
    """The finding of a check that was not made."""
    return Finding(name, "not applicable", reason)


def closed_surface(flaws: Flaws, surface: Surface, within: float, inverted: Sequence[Shell] = ()) -> Finding:
    """Whether the triangles bound a solid, once vertices within a distance, mm, of each other are merged."""
    triangles = len(surface.triangles)
    measured = asdict(flaws) | {"triangles": triangles, "merged_within": within, "inverted": _shells(inverted)}
    counts = (
        (flaws.open, "open edges"),
        (flaws.crowded, "edges of more than two triangles"),
        (flaws.turned, "edges whose triangles disagree on the outside"),
    )
    wrong = [f"{count} {what}" for count, what in counts if count]
    if wrong:
        text = f"The surface bounds no solid: {', '.join(wrong)}; the first is at {_at(flaws.first)}."
    elif flaws.pinched:
        text = "The surface bounds no solid: it touches itself at a vertex."
    elif inverted:
        listed = _listed(inverted, _body)
        text = f"{_count(len(inverted), 'body', 'bodies')} inside out, with triangles that face inwards: {listed}."
    else:
        how = f" when vertices within {within:.1g} mm are merged" if within else ""
        return Finding(Check.CLOSED, "pass", f"{triangles} triangles bound a solid{how}.", measured)
    return Finding(Check.CLOSED, "fail", text, measured)


def crossings(found: Crossings, doubled: Sequence[Shell]) -> Finding:
    """Whether the surface goes through itself, or bodies through each other."""
    measured = asdict(found) | {"doubled": _shells(doubled)}
    if found.pairs:
        crossed = _count(found.pairs, "pair")
        text = f"The surface goes through itself: {crossed} of triangles cross, one at {_at(found.first)}."
    elif doubled:
        text = f"Bodies overlap: {_listed(doubled, _body)}."
    else:
        return Finding(Check.CROSSINGS, "pass", "The surface does not go through itself.", measured)
    return Finding(Check.CROSSINGS, "fail", text, measured)


def one_body(bodies: list[Shell]) -> Finding:
    """Whether everything hangs together."""
    measured = _shells(bodies)
    if len(bodies) == 1:
        return Finding(Check.BODIES, "pass", "There is one body.", measured, 1, "bodies")
    listed = _listed(bodies[1:], _body)
    text = f"There are {len(bodies)} separate bodies; beside the largest: {listed}."
    return Finding(Check.BODIES, "fail", text, measured, 1, "bodies")


def closed_cavities(cavities: list[Shell], settings: Settings) -> Finding:
    """Whether resin is locked in; a bubble too small to count as a cup is no reason to refuse a part."""
    volumes = [-each.volume for each in cavities]
    measured = {"volumes": volumes, "centres": [each.centre for each in cavities]}
    if not cavities:
        return Finding(Check.CAVITIES, "pass", "There is no closed cavity.", measured, settings.cup, "mm³")
    listed = _listed(cavities, lambda cavity: f"{_volume(-cavity.volume)} at {_at(cavity.centre)}")
    text = f"Resin cannot leave {_count(len(cavities), 'closed cavity', 'closed cavities')}: {listed}."
    verdict: Verdict = "fail" if max(volumes) >= settings.cup else "warn"
    return Finding(Check.CAVITIES, verdict, text, measured, settings.cup, "mm³")


def cups(found: list[Cup], settings: Settings) -> Finding:
    """Whether the part holds resin, or sucks, while it is printed."""
    large = [cup for cup in found if cup.volume >= settings.cup]
    total = sum(cup.volume for cup in found)
    measured = {"cups": [asdict(cup) for cup in large], "volume": total, "direction": settings.direction}
    if not large:
        text = f"Printed along {settings.direction}, the part forms no cup of {_volume(settings.cup)} or more."
        return Finding(Check.CUPS, "pass", text, measured, settings.cup, "mm³")
    listed = _listed(large, _cup)
    text = f"Printed along {settings.direction}, the part holds resin in {_count(len(large), 'cup')}: {listed}."
    return Finding(Check.CUPS, "warn", text, measured, settings.cup, "mm³")


def drain_holes(found: list[Pocket], settings: Settings) -> Finding:
    """Whether wide pockets drain through narrow necks."""
    measured = {"pockets": [asdict(pocket) for pocket in found]}
    if not found:
        text = f"No pocket drains through a neck narrower than {settings.drain:g} mm."
        return Finding(Check.DRAINS, "pass", text, measured, settings.drain, "mm")
    listed = _listed(
        found, lambda pocket: f"{_volume(pocket.volume)} through {_length(pocket.neck)} at {_at(pocket.neck_at)}"
    )
    text = f"{_count(len(found), 'pocket')} with a neck narrower than {settings.drain:g} mm: {listed}."
    return Finding(Check.DRAINS, "warn", text, measured, settings.drain, "mm")


def walls(found: Thickness, settings: Settings) -> Finding:
    """Whether walls are thick enough to be printed."""
    return _sides(Check.WALLS, "wall", found, settings.wall)


def gaps(found: Thickness, settings: Settings) -> Finding:
    """Whether gaps are wide enough not to fuse."""
    return _sides(Check.GAPS, "gap", found, settings.gap)


def _sides(name: Check, what: str, found: Thickness, limit: float) -> Finding:
    measured = asdict(found)
    if found.minimum is None:
        return Finding(name, "pass", f"There is no {what}: no two sides face each other.", measured, limit, "mm")
    size = "thinnest" if what == "wall" else "narrowest"
    text = f"The {size} {what} has {_length(found.minimum)}, at {_at(found.at)}"
    if found.minimum >= limit:
        return Finding(name, "pass", f"{text}.", measured, limit, "mm")
    text += f"; {100.0 * found.share:.3g} % of the surface are below {limit:g} mm."
    return Finding(name, "warn", text, measured, limit, "mm")


def overhangs(found: Overhangs, settings: Settings) -> Finding:
    """Whether the part needs supports beside those below it."""
    measured = asdict(found) | {"direction": settings.direction}
    if not found.area:
        text = f"Printed along {settings.direction}, every facet carries itself."
        return Finding(Check.OVERHANGS, "pass", text, measured, settings.angle, "degrees")
    text = (
        f"Printed along {settings.direction}, {found.area:.1f} mm² ({100.0 * found.share:.3g} % of the surface) need "
        f"supports; the largest patch has {found.largest:.1f} mm², around {_at(found.centre)}."
    )
    return Finding(Check.OVERHANGS, "warn", text, measured, settings.angle, "degrees")


def volume_and_mass(volume: float, settings: Settings) -> Finding:
    """How much resin becomes the part."""
    mass = 1.0e-3 * settings.density * volume  # 1 cm³ is 1000 mm³
    text = f"{_volume(volume)} of resin weigh {mass:.2f} g when cured."
    return Finding(Check.VOLUME, "pass", text, {"volume": volume, "mass": mass, "density": settings.density})


def air_chamber(found: Sealing, leak: Callable[[], Leak | None]) -> Finding:
    """Whether the chamber is closed once plates are glued on; ``leak`` looks for the place if it is not."""
    measured = asdict(found)
    if found.chambers:
        reach = "both plates" if found.both_ends else "the middle of the axis"
        text = (
            f"With plates glued on both ends, a chamber of {_volume(found.chambers[0])} is closed and reaches {reach}."
        )
        return Finding(Check.CHAMBER, "pass", text, measured)
    if not any(found.openings) and found.bore:
        text = "The axis runs through void at both ends, but no opening there is closed: a chamber is open at its side."
        return Finding(Check.CHAMBER, "warn", text, measured)
    if not any(found.openings):
        return Finding(Check.CHAMBER, "not applicable", "The end faces have no opening.", measured)
    place = leak()
    if place is None:
        where = "the leak is narrower than the voxels, or no opening leads to the middle"
    else:
        where = f"air gets out through {_length(place.width)} at {_at(place.at)}"
    text = f"With plates glued on both ends, no chamber is closed; {where}."
    return Finding(Check.CHAMBER, "fail", text, measured | {"leak": asdict(place) if place else None})


def _shells(shells: Sequence[Shell]) -> dict[str, Any]:
    return {"volumes": [shell.volume for shell in shells], "centres": [shell.centre for shell in shells]}


def _body(body: Shell) -> str:
    return f"{_volume(body.volume)} at {_at(body.centre)}"


def _cup(cup: Cup) -> str:
    low, high = cup.heights
    return f"{_volume(cup.volume)} around {_at(cup.centre)}, from {low:.1f} to {high:.1f} mm above the platform"


def _listed(items: Sequence[Any], describe: Callable[[Any], str]) -> str:
    told = "; ".join(describe(item) for item in items[:SHOWN])
    return f"{told}; and {len(items) - SHOWN} more" if len(items) > SHOWN else told


def _count(number: int, one: str, several: str | None = None) -> str:
    return f"{number} {one if number == 1 else several or one + 's'}"


def _volume(volume: float) -> str:
    return f"{volume:.3g} mm³" if volume < 100.0 else f"{volume:.1f} mm³"


def _length(length: float) -> str:
    return f"{length:.1g} mm" if length < 0.1 else f"{length:.2f} mm"


def _at(place: tuple[float, float, float] | None) -> str:
    return "({:.2f}, {:.2f}, {:.2f})".format(*(round(x, 2) + 0.0 for x in place)) if place else "no place"
