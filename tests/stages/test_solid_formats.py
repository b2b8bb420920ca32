"""STL and 3MF of other programs: what is read, and what is refused because it is not all there."""

from __future__ import annotations

import numpy as np
import pytest
from solid_files import PRODUCTION, ascii_stl, cube, mesh_object, model, stl, threemf

from actuator.failure import UnreadableSolid
from stages.formats import decode
from stages.inspection import inspect

TWO = ascii_stl(cube(), cube(5.0, 20.0, 0.0, 0.0))
ITEM = '<item objectid="1"/>'


def volumes(data: bytes, name: str) -> list[float]:
    """Of the bodies, largest first."""
    found = inspect(data, name)
    assert not found.cavities
    return [round(volume, 3) for volume in found.bodies]


# ------------------------------------------------------------------------------------------------ STL


@pytest.mark.parametrize(
    "text",
    [
        TWO,
        TWO.replace("\n", "\r\n"),
        TWO.replace("\n", "\r"),
        TWO.upper(),
        "\ufeff\n " + TWO,
        TWO.replace("endsolid", "end solid"),
        TWO.replace("normal 0 0 0", "normal nan nan nan"),
        TWO.replace("part 0", "vertex of a Größe, endsolid"),
    ],
)
def test_ascii_stl_is_read_as_programs_write_it(text: str) -> None:
    assert volumes(text.encode(), "stl") == [1000.0, 125.0]


def test_binary_stl_may_begin_with_solid() -> None:
    data = stl(cube())
    assert volumes(b"solid part".ljust(80) + data[80:], "stl") == [1000.0]
    with pytest.raises(UnreadableSolid, match="promises 12 triangles in 684 bytes, and there are 683 bytes"):
        decode(b"solid part".ljust(80) + data[80:-1], "stl")


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (stl(cube())[:-30], "is cut short: its header promises 12 triangles in 684 bytes, and there are 654 bytes"),
        (stl(cube())[:84], "is cut short"),
        (stl(cube()) + b"\0\0", "goes on after its end"),
        (TWO[: TWO.rindex("endsolid")], "is cut short: the solid of line 87 does not end with 'endsolid'"),
        (TWO[: TWO.rindex("endfacet") + 3], "is cut short: the solid of line 87 does not end"),
        (TWO[: TWO.index("endsolid")], "is cut short: the solid of line 1 does not end"),
        (TWO.replace("endsolid part 0\n", ""), "is cut short: the solid before line 86 does not end"),
        (
            TWO.replace("endloop\nendfacet\nendsolid part 1", "endsolid part 1"),
            "a facet of the solid of line 87 is not",
        ),
        (TWO.replace("vertex 10 ", "vertex 1O ", 1), "has '1O' for a coordinate"),
        (TWO.replace("vertex 10 ", "vertex nan ", 1), "has 'nan' for a coordinate"),
        (TWO.replace("vertex 10 ", "vertex 10,5 ", 1), "has '10,5' for a coordinate"),
        (TWO.replace("outer loop", "outer lop", 1), "Line 3 of the stl has 'lop' where 'loop' should stand"),
        ("part\n" + TWO, "Line 1 of the stl has 'part' where only 'solid' can stand"),
        (TWO.split("\n", 1)[1], "Line 1 of the stl has 'facet'"),
        (TWO + "facet", "Line 173 of the stl has 'facet'"),
        (b"rubbish", "are no stl"),
    ],
)
def test_stl_that_is_not_whole_is_refused_with_what_is_wrong(data: bytes | str, sentence: str) -> None:
    with pytest.raises(UnreadableSolid, match=sentence):
        decode(data if isinstance(data, bytes) else data.encode(), "stl")


def test_a_coordinate_of_a_binary_stl_that_is_not_finite_is_named() -> None:
    data = bytearray(stl(cube()))
    data[84 + 50 * 4 + 12 : 84 + 50 * 4 + 16] = np.float32("inf").tobytes()
    with pytest.raises(UnreadableSolid, match="Triangle 5 of the stl"):
        decode(bytes(data), "stl")


# ------------------------------------------------------------------------------------------------ 3MF


def component(number: int, transform: str = "1 0 0 0 1 0 0 0 1 0 0 0", path: str = "") -> str:
    where = f' p:path="{path}"' if path else ""
    return f'<component objectid="{number}" transform="{transform}"{where}/>'


def assembly(number: int, *components: str, kind: str = "model") -> str:
    return f'<object id="{number}" type="{kind}"><components>{"".join(components)}</components></object>'


def test_components_in_other_parts_are_found_by_part_and_number() -> None:
    """As slicers write them: the same number means another object in another part."""
    root = model(
        assembly(
            1, component(1, path="/3D/Objects/a.model"), component(2, "2 0 0 0 2 0 0 0 2 0 0 50", "/3D/Objects/a.model")
        ),
        '<item objectid="1"/><item objectid="1" p:path="/3D/objects/B.model" transform="1 0 0 0 1 0 0 0 1 0 0 -50"/>',
        'requiredextensions="p"',
    )
    inner = (
        mesh_object(1, cube(10.0))
        + mesh_object(3, cube(1.0))
        + assembly(2, component(3), component(3, "1 0 0 0 1 0 0 0 1 5 0 0"))
    )
    data = threemf(root, a=model(inner, ""), b=model(mesh_object(1, cube(3.0)), ""))
    assert volumes(data, "3mf") == [1000.0, 27.0, 8.0, 8.0]
    low, high = np.array(inspect(data, "3mf").bounding_box)
    np.testing.assert_allclose([low, high], [[0.0, 0.0, -50.0], [12.0, 10.0, 52.0]], atol=1e-5)


@pytest.mark.parametrize(
    ("unit", "factor"), [("micron", 1e-3), ("centimeter", 10.0), ("inch", 25.4), ("foot", 304.8), ("meter", 1e3)]
)
def test_units_count_for_points_and_shifts(unit: str, factor: float) -> None:
    item = '<item objectid="1" transform="1 0 0 0 1 0 0 0 1 7 0 0"/>'
    data = threemf(model(mesh_object(1, cube(2.0)), item, f'unit="{unit}"'))
    low, high = np.array(inspect(data, "3mf").bounding_box)
    np.testing.assert_allclose([low, high], factor * np.array([[7.0, 0.0, 0.0], [9.0, 2.0, 2.0]]), rtol=1e-6)


def test_a_mirrored_object_still_faces_outwards() -> None:
    item = '<item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>'
    assert volumes(threemf(model(mesh_object(1, cube()), item)), "3mf") == [1000.0]


def test_only_what_is_built_and_printed_as_a_part_counts() -> None:
    objects = (
        mesh_object(1, cube())
        + mesh_object(2, cube(5.0, 20.0, 0.0, 0.0), "support")
        + mesh_object(3, cube(3.0), "other")
    )
    objects += assembly(4, component(3), component(1, "1 0 0 0 1 0 0 0 1 40 0 0")) + mesh_object(5, cube(2.0))
    build = "".join(f'<item objectid="{number}"/>' for number in (1, 2, 4))
    assert volumes(threemf(model(objects, build)), "3mf") == [1000.0, 1000.0]
    assert not len(decode(threemf(model(objects, "")), "3mf").faces)


@pytest.mark.parametrize(
    ("attributes", "known"),
    [
        ('requiredextensions="p"', True),
        ('requiredextensions="m p" xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02"', True),
        ('xmlns:b="http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"', True),
        ('requiredextensions="b" xmlns:b="http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"', False),
        ('requiredextensions="p s" xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"', False),
        (
            'requiredextensions="sc" xmlns:sc="http://schemas.microsoft.com/3dmanufacturing/securecontent/2019/04"',
            False,
        ),
        ('requiredextensions="x"', False),
    ],
)
@pytest.mark.parametrize("inside", [False, True])
def test_a_required_extension_that_is_not_known_is_refused_by_name(attributes: str, known: bool, inside: bool) -> None:
    one = mesh_object(1, cube())
    if inside:
        build = '<item objectid="1" p:path="/3D/Objects/a.model"/>'
        data = threemf(model("", build), a=model(one, "", attributes))
    else:
        data = threemf(model(one, ITEM, attributes))
    if known:
        assert volumes(data, "3mf") == [1000.0]
    else:
        with pytest.raises(UnreadableSolid, match=r"requires the extension '(b|s|sc|x)'.*(http|not declare)"):
            decode(data, "3mf")


LINE = mesh_object(1, cube())
LOST = f'<component objectid="9" xmlns:q="{PRODUCTION}" q:path="/3D/Objects/a.model"/>'


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (threemf(model(LINE, ITEM))[:-200], "no whole zip archive"),
        (threemf(model(LINE, ITEM)[:-200]), "is no whole XML"),
        (threemf(model(assembly(1, LOST), ITEM)), "has no part /3D/Objects/a.model"),
        (threemf(model(assembly(1, LOST), ITEM), a=model(LINE, "")), "has no object 9 in /3D/Objects/a.model"),
        (threemf(model(LINE, '<item objectid="2"/>')), "has no object 2 in /3D/3dmodel.model"),
        (threemf(model(assembly(1, component(2)) + assembly(2, component(1)), ITEM)), "contains itself"),
        (threemf(model(LINE, '<item objectid="1" transform="1 0 0 0 1 0 0 0 0 0 0 0"/>')), "none that can be undone"),
        (threemf(model(LINE, '<item objectid="1" transform="1 0 0"/>')), "none that can be undone"),
        (threemf(model(LINE, ITEM, 'unit="furlong"')), "has the unit 'furlong'"),
        (threemf(model(LINE.replace('v3="7"', 'v3="8"').replace('v2="7"', 'v2="8"'), ITEM)), "lacks a vertex"),
        (threemf(model(LINE.replace("v3=", "v4="), ITEM)), "A triangle in .* lacks a number"),
        (threemf(model(LINE.replace('x="10"', 'x="nan"'), ITEM)), "A vertex in .* is not finite"),
        (threemf("<!DOCTYPE m [<!ENTITY a 'b'>]>" + model(LINE, ITEM)[21:]), "document type"),
        (threemf("<html/>"), "is no model"),
    ],
)
def test_3mf_that_is_not_whole_is_refused_with_what_is_wrong(data: bytes, sentence: str) -> None:
    with pytest.raises(UnreadableSolid, match=sentence):
        decode(data, "3mf")


def test_a_damaged_part_of_the_archive_is_refused() -> None:
    data = bytearray(threemf(model(LINE, ITEM)))
    place = data.index(b"3D/3dmodel.model") + 60
    data[place : place + 20] = bytes(20)
    with pytest.raises(UnreadableSolid, match=r"Part /3D/3dmodel\.model of the 3mf cannot be unpacked"):
        decode(bytes(data), "3mf")


def test_the_library_of_the_consortium_reads_the_same() -> None:
    lib3mf = pytest.importorskip("lib3mf")
    reader = (made := lib3mf.get_wrapper().CreateModel()).QueryReader("3mf")
    inner = (
        mesh_object(1, cube())
        + mesh_object(2, cube(4.0))
        + assembly(3, component(1), component(2, "0 2 0 -1 0 0 0 0 1 30 5 1"))
    )
    root = model(
        assembly(5, component(3, "1 0 0 0 1 0 0 1 1 2 3 4", "/3D/Objects/a.model")),
        '<item objectid="5"/>',
        'requiredextensions="p" unit="inch"',
    )
    data = threemf(root, a=model(inner, "", 'unit="inch"'))
    reader.ReadFromBuffer(data)
    low, high = (25.4 * np.array(corner) for corner in (made.GetOutbox().MinCoordinate, made.GetOutbox().MaxCoordinate))
    np.testing.assert_allclose(inspect(data, "3mf").bounding_box, [low, high], rtol=1e-6)
    assert volumes(data, "3mf") == pytest.approx([25.4**3 * 1000.0, 25.4**3 * 128.0], rel=1e-5)
