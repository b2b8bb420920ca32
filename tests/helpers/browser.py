"""A real browser without a window, for what the report does on a screen; tests are skipped where there is none."""

from __future__ import annotations

import base64
import io
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
#: WebGL drawn by the processor.
OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--window-size=1000,900",
)


@contextmanager
def browser(*options: str) -> Iterator[Any]:
    """A driver of the first browser found, offline, that records what the page asks for and says."""
    pytest.importorskip("selenium", reason="selenium is not installed")
    from selenium import webdriver

    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    driver = shutil.which("chromedriver")
    if not found or not driver:
        pytest.skip(f"no browser ({', '.join(BROWSERS)}) with chromedriver is installed")
    chrome = webdriver.ChromeOptions()
    chrome.binary_location = found
    for option in (*OPTIONS, *options):
        chrome.add_argument(option)
    chrome.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    page = webdriver.Chrome(options=chrome, service=webdriver.ChromeService(driver))
    try:
        page.execute_cdp_cmd("Network.enable", {})
        offline = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
        page.execute_cdp_cmd("Network.emulateNetworkConditions", offline)
        yield page
    finally:
        page.quit()


def show(page: Any, path: Path) -> None:
    """Open a file, and forget what was recorded before."""
    for log in ("browser", "performance"):
        page.get_log(log)
    page.get(path.resolve().as_uri())


def requested(page: Any) -> list[str]:
    """Addresses that the page has asked for, but for those that hold their content themselves."""
    messages = [json.loads(entry["message"])["message"] for entry in page.get_log("performance")]
    sent = [each["params"]["request"]["url"] for each in messages if each["method"] == "Network.requestWillBeSent"]
    return [address for address in sent if not address.startswith("data:")]


def media(page: Any, *, width: int = 1000, scheme: str = "light") -> None:
    """Set the width of the page and the colour scheme that the user prefers."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    page.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    )
    # Two frames, so that observers of sizes have been called and what they drew is shown.
    page.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")


def pixels(element: Any) -> np.ndarray:
    """What an element looks like, (height, width, 3)."""
    with Image.open(io.BytesIO(base64.b64decode(element.screenshot_as_base64))) as image:
        return np.asarray(image.convert("RGB")).astype(int)
