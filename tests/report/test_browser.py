"""The page in a real browser: nothing overflows, nothing is requested, no complaint, light and dark."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
WIDTHS = (390, 768, 1400)

pytestmark = pytest.mark.skipif(BROWSER is None, reason="no chromium on the PATH")

_MEASURE = """
<!doctype html><meta charset="utf-8"><pre id="result"></pre>
<script>
const result = {};
function measure(frame, width) {
  const page = frame.contentDocument, root = page.documentElement;
  page.querySelectorAll("details").forEach(fold => { fold.open = true; });
  const inScroller = e => e.closest(".scroll, .frame, pre, .sr, figure h3") !== null;
  const wide = [...page.body.querySelectorAll("*")].filter(
    e => !inScroller(e) && e.getBoundingClientRect().right > width + 0.5);
  result[width] = {
    scroll: root.scrollWidth,
    wide: wide.map(e => e.tagName + " " + e.className).slice(0, 5),
    tables: [...page.querySelectorAll(".scroll")].filter(e => e.scrollWidth > e.clientWidth)
      .map(e => e.getAttribute("aria-label")),
    images: page.images.length,
    broken: [...page.images].filter(i => !i.complete || i.naturalWidth === 0).length,
    smallest: Math.min(...[...page.querySelectorAll("p, td, th, li, dd, figcaption")]
      .map(e => parseFloat(frame.contentWindow.getComputedStyle(e).fontSize))),
    requested: frame.contentWindow.performance.getEntriesByType("resource")
      .map(e => e.name).filter(name => !name.startsWith("data:")),
    readable: page.body.innerText.length,
  };
  document.getElementById("result").textContent = JSON.stringify(result);
}
</script>
"""


def browse(page: Path, scratch: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    assert BROWSER is not None
    return subprocess.run(
        [
            BROWSER,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--hide-scrollbars",
            "--host-resolver-rules=MAP * ~NOTFOUND",  # the browser's own wish to phone home
            f"--user-data-dir={scratch / 'profile'}",
            *flags,
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )


def test_nothing_overflows_and_nothing_is_requested(drawn: Path, tmp_path: Path) -> None:
    """The page in frames of each width: a browser window cannot be as narrow as a phone."""
    source = html.escape((drawn / "report.html").read_text(encoding="utf-8"), quote=True)
    frames = "".join(
        f'<iframe width="{width}" height="900" style="border:0" srcdoc="{source}" '
        f'onload="measure(this, {width})"></iframe>'
        for width in WIDTHS
    )
    wrapper = tmp_path / "frames.html"
    wrapper.write_text(_MEASURE + frames, encoding="utf-8")
    document = browse(
        wrapper, tmp_path, "--window-size=1600,1000", "--virtual-time-budget=20000", "--dump-dom"
    ).stdout
    found = re.search(r'<pre id="result">(.*?)</pre>', document, re.DOTALL)
    assert found is not None
    result = json.loads(html.unescape(found.group(1)))
    for width in WIDTHS:
        measured = result[str(width)]
        assert measured["scroll"] <= width, (width, measured["wide"])
        assert measured["wide"] == []
        assert measured["tables"] == [], width
        assert measured["images"] == 22  # 20 figures, and two pictures of the one effect
        assert measured["broken"] == 0
        assert measured["requested"] == []
        assert measured["smallest"] >= 13
        assert measured["readable"] > 4000


def test_no_complaint_in_light_and_in_dark(drawn: Path, tmp_path: Path) -> None:
    brightness = {}
    for look, scheme in (("light", 1), ("dark", 0)):
        shot = tmp_path / f"{look}.png"
        run = browse(
            drawn / "report.html",
            tmp_path,
            "--window-size=1400,4000",
            f"--blink-settings=preferredColorScheme={scheme}",
            "--enable-logging=stderr",
            f"--screenshot={shot}",
        )
        assert "CONSOLE" not in run.stderr
        with Image.open(shot) as image:
            brightness[look] = float(np.mean(np.asarray(image.convert("L"))))
    assert brightness["light"] > 200
    assert brightness["dark"] < 60
