"""The report in a browser: headless Chromium, from a server on this machine and from the disk."""

import http.server
import json
import re
import shutil
import subprocess
import threading
from functools import partial

import numpy as np
import pytest
from synthetic import sample, write_ensemble

from sgimp_post.cli import main

pytestmark = pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium")

PHONE, DESK = 390, 1200
#: Looks at the page it stands in and writes what it sees into the title of the page around it:
#: a window of headless Chromium is never as narrow as a phone, a frame may be.
PROBE = """
<script>
const errors = [];
addEventListener("error", e => errors.push(e.message || (e.target.src || "").slice(0, 80)), true);
addEventListener("securitypolicyviolation", e => errors.push(e.blockedURI));
addEventListener("load", async () => {
  document.querySelectorAll("details").forEach(d => d.open = true);
  await Promise.all([...document.images].map(i => i.decode().catch(() => errors.push(i.alt))));
  const links = [...document.links].map(a => a.getAttribute("href"));
  const dead = [];
  for (const link of links) {
    const found = link[0] === "#" ? document.getElementById(link.slice(1))
      : (await fetch(link)).ok && (await (await fetch(link)).text()).length > 0;
    if (!found) dead.push(link);
  }
  parent.document.title = JSON.stringify({
    errors, dead, links: links.length,
    images: document.images.length,
    empty: [...document.images].filter(i => !(i.naturalWidth > 100)).map(i => i.alt),
    wide: [...document.querySelectorAll("main, main *")].filter(e => !e.closest(".scroll, pre, svg")
      && e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML.slice(0, 60)),
    small: [...document.querySelectorAll("p, td")].filter(
      e => parseFloat(getComputedStyle(e).fontSize) < 12).map(e => e.outerHTML.slice(0, 60)),
    outside: performance.getEntriesByType("resource").map(e => e.name)
      .filter(n => !n.startsWith(location.origin) && !n.startsWith("data:")),
  });
});
</script>
"""


def chromium(tmp_path, *options, url):
    return subprocess.run(
        [
            "chromium",
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--virtual-time-budget=20000",
            f"--user-data-dir={tmp_path / 'profile'}",
            *options,
            url,
        ],
        capture_output=True,
        text=True,
        timeout=240,
        check=True,
    ).stdout


def look(tmp_path, directory, server, page, width):
    """What the probe in this page sees in a frame of this width."""
    frame = f'<iframe src="{page}" style="width: {width}px; height: 900px; border: 0"></iframe>'
    (directory / "frame.html").write_text(f"<!DOCTYPE html><title></title>{frame}")
    dump = chromium(tmp_path, "--dump-dom", url=f"{server}/frame.html")
    title = re.search(r"<title>(.*?)</title>", dump, re.DOTALL)[1]
    return json.loads(title.replace("&amp;", "&"))


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A report with every kind of section: three cases, one failed member, snapshots."""
    directory = tmp_path_factory.mktemp("study")
    cases = [{"label": "deterministic", "values": sample(2, 8)}]
    for k, acf in enumerate(("snx", "sqx", "bin")):
        values = sample(k, 60)
        more = {"acf": acf, "cov": 0.05 * (1 + k % 2), "failed": [3] if k == 1 else ()}
        cases.append({"label": f"{acf}_cov", "values": values, **more})
    write_ensemble(directory, cases, "complete", snapshots=[("deterministic", 1), ("snx_cov", 1)])
    assert main(["report", str(directory)]) == 0
    return directory / "report"


@pytest.fixture(scope="module")
def served(study):
    page = (study / "report.html").read_text()
    (study / "probe.html").write_text(page.replace("<head>", "<head>" + PROBE, 1))
    handler = partial(http.server.SimpleHTTPRequestHandler, directory=str(study))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_the_page_is_whole_at_this_width(width, study, served, tmp_path):
    """No error, every picture drawn, every link and download there, nothing from elsewhere, no
    sideways scrolling of the page, no text that a phone's reader must magnify."""
    seen = look(tmp_path, study, served, "probe.html", width)
    wrong = {key: seen[key] for key in ("errors", "dead", "empty", "outside", "wide", "small")}
    assert wrong == {key: [] for key in wrong}
    assert seen["images"] >= 6 and seen["links"] >= 10


def test_the_probe_sees_what_is_wrong(study, served, tmp_path):
    """Otherwise the test above shows nothing."""
    page = (study / "probe.html").read_text()
    broken = page.replace("<main>", '<main><a href="none.csv">x</a><img alt="torn" src="data:,x">')
    (study / "broken.html").write_text(broken)
    seen = look(tmp_path, study, served, "broken.html", DESK)
    assert seen["dead"] == ["none.csv"] and "torn" in seen["empty"] and seen["errors"]


def test_it_opens_from_the_disk_and_prints(study, tmp_path):
    """On more than one sheet of paper, none of them wider than A4 is high."""
    url = f"file://{study / 'report.html'}"
    assert "187 members ok, 1 failed" in chromium(tmp_path, "--dump-dom", url=url)
    paper = tmp_path / "paper.pdf"
    chromium(tmp_path, f"--print-to-pdf={paper}", url=url)
    boxes = re.findall(rb"/MediaBox\s*\[\s*([\d. ]+)\]", paper.read_bytes())
    sizes = np.array([[float(v) for v in box.split()] for box in boxes])
    assert len(sizes) > 1 and sizes.max() < 850.0
