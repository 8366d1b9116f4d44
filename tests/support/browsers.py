"""A real browser for tests: Debian's chromium, driven by selenium; where either is missing, tests say so and skip."""

import base64
import shutil
from contextlib import contextmanager
from pathlib import Path

import pytest

WAYS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--disable-dev-shm-usage")
HIGH = 900


class Browser:
    """One browser; width, pixels, and whether it is dark are set for each page."""

    def __init__(self, driver):
        self.driver = driver

    def open(self, path, width=1400, scheme="light"):
        size = {"width": width, "height": HIGH, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
        for kind in ("browser", "performance"):
            self.driver.get_log(kind)  # what was before
        self.driver.get(Path(path).resolve().as_uri())
        return self

    def run(self, script, *given):
        return self.driver.execute_script(script, *given)

    def all(self, selector):
        return self.driver.find_elements("css selector", selector)

    def one(self, selector):
        return self.driver.find_element("css selector", selector)

    @property
    def errors(self):
        return [item["message"] for item in self.driver.get_log("browser")]

    @property
    def requests(self):
        """The addresses that were asked for since the page was opened."""
        import json

        report = (json.loads(item["message"])["message"] for item in self.driver.get_log("performance"))
        return [item["params"]["request"]["url"] for item in report if item["method"] == "Network.requestWillBeSent"]

    def printed(self):
        """Return the page as PDF on A4."""
        self.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        report = self.driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})
        return base64.b64decode(report["data"])


@contextmanager
def browser():
    """Yield a browser; skip where there is none."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    binary, driver = next(filter(None, map(shutil.which, WAYS)), None), shutil.which("chromedriver")
    if not binary or not driver:
        pytest.skip("no browser: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for flag in FLAGS:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    made = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    try:
        yield Browser(made)
    finally:
        made.quit()
