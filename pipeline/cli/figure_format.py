"""The formats of figures, as options have them."""

from enum import StrEnum


class FigureFormat(StrEnum):
    """Formats of figures."""

    PNG = "png"
    SVG = "svg"
