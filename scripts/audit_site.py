"""Looks at every page of the site in a browser: what hinders somebody, and what is too wide.

    python scripts/audit_site.py                    build/site, which `make docs` builds
    python scripts/audit_site.py FOLDER --axe FILE  another one; axe.min.js from elsewhere

It needs Chromium with its driver, Selenium (`pip install selenium`) and axe-core (`npm install
--prefix build/axe axe-core`), and asks no other host. Pages are laid out 400 pixels wide, light and
dark. A violation that axe calls serious or critical, or a page that is wider than the window, ends
it with code 1.
"""

import argparse
import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
AXE = ROOT / "build" / "axe" / "node_modules" / "axe-core" / "axe.min.js"
WIDTH = 400
# All rules in one theme; in the other those of colours, which alone can differ.
THEMES: dict[str, dict[str, Any]] = {"light": {}, "dark": {"runOnly": ["color-contrast"]}}
GRAVE = ("serious", "critical")
LOOK = """
const [theme, rules, done] = arguments;
document.body.dataset.theme = theme;
axe.run(document, rules).then(found => done({
    violations: found.violations.map(each => ({
        id: each.id, impact: each.impact, nodes: each.nodes.map(node => node.target.join(" ")),
    })),
    passes: found.passes.length,
    width: document.scrollingElement.scrollWidth,
}), error => done({error: String(error)}));
"""


def look(pages: list[Path], axe: str) -> Iterator[tuple[Path, str, dict[str, Any]]]:
    """What axe finds on each page in each theme: violations, rules that hold, width in pixels."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    for each in ("headless=new", "no-sandbox", "disable-dev-shm-usage", "hide-scrollbars"):
        options.add_argument(f"--{each}")
    options.add_argument("--allow-file-access-from-files")
    options.binary_location = shutil.which("chromium") or shutil.which("google-chrome") or ""
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    with webdriver.Chrome(options, service) as browser:
        phone = {"width": WIDTH, "height": 800, "deviceScaleFactor": 1, "mobile": True}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", phone)
        browser.set_script_timeout(120)
        for page in pages:
            browser.get(page.as_uri())
            browser.execute_script(axe)
            for theme, rules in THEMES.items():
                yield page, theme, browser.execute_async_script(LOOK, theme, rules)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("site", type=Path, nargs="?", default=ROOT / "build" / "site")
    parser.add_argument("--axe", type=Path, default=AXE)
    asked = parser.parse_args()
    site = asked.site.resolve()
    pages = sorted(site.rglob("*.html"))
    if not pages:
        parser.error(f"{site} has no page: make docs")
    grave, held, broken = 0, 0, 0
    for page, theme, found in look(pages, asked.axe.read_text(encoding="utf-8")):
        name = f"{page.relative_to(site)}, {theme}"
        print(name, file=sys.stderr)  # how far it is
        if "error" in found:
            print(f"{name}: {found['error']}")
            grave += 1
            continue
        held, broken = held + found["passes"], broken + len(found["violations"])
        if found["width"] > WIDTH:
            print(f"{name}: {found['width']} pixels wide")
            grave += 1
        for each in found["violations"]:
            grave += each["impact"] in GRAVE
            where = json.dumps(each["nodes"][:3])
            print(f"{name}: {each['impact']}, {each['id']}: {where}", flush=True)
    print(f"{len(pages)} pages, light and dark, {WIDTH} pixels wide: {held} rules held, "
          f"{broken} broken; {grave} grave")  # fmt: skip
    return 1 if grave else 0


if __name__ == "__main__":
    sys.exit(main())
