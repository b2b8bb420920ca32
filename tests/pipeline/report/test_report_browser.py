"""The report in a real browser: what a reader sees, can turn and can switch, without any network."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import browser, media, pixels, requested, show

ORANGE = np.array([232, 163, 61])


@pytest.fixture(scope="module")
def page() -> Iterator[Any]:
    with browser() as found:
        yield found


@pytest.fixture
def shown(page: Any, report: Path) -> Any:
    """The report, freshly opened."""
    media(page)
    show(page, report)
    media(page)
    return page


def canvas(page: Any) -> Any:
    return page.find_element("css selector", "#viewer canvas")


def press(page: Any, selector: str) -> None:
    page.find_element("css selector", selector).click()
    media(page)


def drawn(picture: np.ndarray) -> np.ndarray:
    """Where a picture differs from its corner."""
    return np.abs(picture - picture[0, 0]).max(axis=2) > 12


def differing(one: np.ndarray, other: np.ndarray) -> float:
    assert one.shape == other.shape
    return float((np.abs(one - other).max(axis=2) > 12).mean())


def test_page_asks_for_nothing_and_complains_of_nothing(shown: Any, report: Path) -> None:
    assert requested(shown) == [report.resolve().as_uri()]
    assert shown.get_log("browser") == []
    assert shown.find_element("id", "viewer").get_attribute("data-state") == "rest"


def test_policy_forbids_what_the_page_does_not_hold(shown: Any) -> None:
    violated = shown.execute_async_script(
        "const done = arguments[0], found = [];"
        "document.addEventListener('securitypolicyviolation', event => {"
        "  found.push(event.effectiveDirective); if (found.length === 3) done(found.sort()); });"
        "const image = new Image(); image.src = 'http://127.0.0.1:9/a.png'; document.body.append(image);"
        "const script = document.createElement('script'); script.textContent = 'window.foreign = 1';"
        "document.body.append(script);"
        "fetch('http://127.0.0.1:9/').catch(() => {});"
    )
    assert violated == ["connect-src", "img-src", "script-src-elem"]
    assert shown.execute_script("return typeof window.foreign") == "undefined"


def test_part_is_drawn_and_turns(shown: Any) -> None:
    from selenium.webdriver import ActionChains

    still = pixels(canvas(shown))
    assert 0.03 < drawn(still).mean() < 0.8
    assert len(np.unique(still[drawn(still)].sum(axis=1))) > 20  # shaded, not flat
    ActionChains(shown).click_and_hold(canvas(shown)).move_by_offset(120, 40).release().perform()
    media(shown)
    turned = pixels(canvas(shown))
    assert drawn(turned).mean() > 0.03
    assert differing(still, turned) > 0.02
    press(shown, "#viewer-home")
    assert differing(still, pixels(canvas(shown))) < 0.001


def test_keyboard_turns_and_zooms(shown: Any) -> None:
    still = pixels(canvas(shown))
    canvas(shown).send_keys("\ue014\ue014\ue014")  # arrow to the right
    media(shown)
    turned = pixels(canvas(shown))
    assert differing(still, turned) > 0.01
    canvas(shown).send_keys("++")
    media(shown)
    assert drawn(pixels(canvas(shown))).mean() > 1.2 * drawn(turned).mean()


def test_toggles_show_the_state_under_pressure_and_the_inside(shown: Any) -> None:
    rest = pixels(canvas(shown))
    legend = shown.find_element("id", "viewer-legend")
    assert not legend.is_displayed()
    press(shown, "input[value=moved]")
    moved = pixels(canvas(shown))
    assert legend.is_displayed()
    assert differing(rest, moved) > 0.02
    violet = (moved[..., 2] > 1.4 * moved[..., 1]) & (moved[..., 0] > 1.1 * moved[..., 1])
    assert violet.mean() > 0.01  # no pressure on the outside: the first colour of viridis
    press(shown, "#viewer-cut")
    cut = pixels(canvas(shown))
    orange = np.abs(cut - ORANGE).max(axis=2) < 6
    assert orange.mean() > 0.005
    assert (np.abs(moved - ORANGE).max(axis=2) < 6).mean() < 1e-4
    press(shown, "input[value=rest]")
    assert (np.abs(pixels(canvas(shown)) - ORANGE).max(axis=2) < 6).mean() > 0.005
    assert shown.get_log("browser") == []


def test_numbers_are_those_of_the_run(shown: Any, summary: dict[str, Any]) -> None:
    cells = shown.find_elements("css selector", "#performance tbody td:nth-of-type(2) data")
    found = [float(cell.get_attribute("value")) for cell in cells]
    turned = np.degrees(summary["theta2"])
    assert found[:2] == [summary["terms"]["C0"], summary["T3"]]
    assert found[2] == pytest.approx(turned, rel=1e-14)
    assert found[3:] == [summary["spring_elongation"], summary["T1"], summary["C"]]
    assert [cell.text for cell in cells][2] == f"{turned:.3f}"


def test_all_pictures_are_whole(shown: Any) -> None:
    sizes = shown.execute_script("return [...document.images].map(image => image.complete && image.naturalWidth)")
    assert len(sizes) == 6
    assert min(sizes) > 400


@pytest.mark.parametrize("width", [400, 1000])
def test_nothing_sticks_out_sideways(shown: Any, width: int) -> None:
    for folded in shown.find_elements("css selector", "summary"):
        folded.click()
    media(shown, width=width)
    assert shown.execute_script("return document.documentElement.scrollWidth") <= width
    assert drawn(pixels(canvas(shown))).mean() > 0.03


def test_dark_scheme_is_dark_and_readable(shown: Any) -> None:
    def contrast() -> float:
        """Least contrast of any text with the page, WCAG 2.2, 1.4.3."""
        colours = shown.execute_script(
            "const of = element => getComputedStyle(element).color.match(/[\\d.]+/g).slice(0, 3).map(Number);"
            "return [getComputedStyle(document.body).backgroundColor.match(/[\\d.]+/g).slice(0, 3).map(Number),"
            " ...[...document.querySelectorAll('p, h1, h2, th, td, dt, dd, a, figcaption')].map(of)]"
        )
        luminance = [np.dot([0.2126, 0.7152, 0.0722], linear(np.array(colour) / 255.0)) for colour in colours]
        return min((max(each, luminance[0]) + 0.05) / (min(each, luminance[0]) + 0.05) for each in luminance[1:])

    def linear(value: np.ndarray) -> np.ndarray:
        return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)

    body = shown.find_element("tag name", "h1")
    assert pixels(body)[-1, -1].mean() > 240
    assert contrast() > 4.5
    media(shown, scheme="dark")
    assert pixels(body)[-1, -1].mean() < 40
    assert contrast() > 4.5


def test_printing_unfolds_everything_and_takes_the_still_picture(shown: Any) -> None:
    shown.execute_script("window.dispatchEvent(new Event('beforeprint'))")
    shown.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    try:
        assert all(each.get_attribute("open") for each in shown.find_elements("tag name", "details"))
        assert shown.find_element("css selector", "#viewer img").is_displayed()
        assert not canvas(shown).is_displayed()
    finally:
        shown.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def test_without_webgl_there_is_a_still_picture(report: Path) -> None:
    with browser("--disable-3d-apis") as page:
        show(page, report)
        still = page.find_element("css selector", "#viewer img")
        assert still.is_displayed()
        assert 0.03 < drawn(pixels(still)).mean() < 0.9
        assert "no WebGL. This is a still picture." in page.find_element("id", "viewer-note").text
        assert not page.find_element("id", "viewer-controls").is_displayed()


def test_without_javascript_there_is_a_still_picture(page: Any, report: Path) -> None:
    page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        show(page, report)
        assert page.find_element("css selector", "#viewer img").is_displayed()
        assert "JavaScript is off" in page.find_element("tag name", "noscript").text
    finally:
        page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
