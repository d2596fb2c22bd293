"""Shows a report in chromium and says as JSON what it did, with what axe-core finds: arguments are the page, the caption
of a chart, a series with the place and value of one of its samples, and where to write a screenshot."""

import json
import re
import shutil
import sys
import zlib
from pathlib import Path

import axe_playwright_python
from playwright.sync_api import sync_playwright

PAGE, CAPTION, SERIES, X, Y, PICTURE = sys.argv[1:]

# Where a sample is on the screen, by the picture's own data.
PLACE = """(figure, [name, x, y]) => {
  const { figures } = JSON.parse(document.getElementById('data').textContent);
  const panel = figures[figure.dataset.figure].panels[0], [left, top, right, bottom] = panel.area;
  const share = (v, [low, high]) => (v - low) / (high - low);
  const svg = figure.querySelector('.picture svg'), box = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
  const px = left + (right - left) * share(x, panel.x.span), py = bottom - (bottom - top) * share(y, panel.y.span);
  return [box.left + px * box.width / view.width, box.top + py * box.height / view.height];
}"""

# Pairs of texts of all pictures that overlap by more than the rounding of their boxes.
OVERLAPS = """() => [...document.querySelectorAll('.picture svg')].flatMap((svg) => {
  const boxes = [...svg.querySelectorAll('text')].filter((t) => t.getClientRects().length).map((t) => [t.textContent, t.getBoundingClientRect()]);
  return boxes.flatMap(([a, p], k) => boxes.slice(0, k).filter(([, q]) =>
    Math.min(p.right, q.right) - Math.max(p.left, q.left) > 1 && Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top) > 4).map(([b]) => `${a} | ${b}`));
})"""


def new_page(context):
    """A page that a busy machine may take its time for."""
    page = context.new_page()
    page.set_default_timeout(180_000)
    return page


def looked_at(browser, scheme):
    context = browser.new_context(color_scheme=scheme, viewport={"width": 1000, "height": 900})
    page = new_page(context)
    messages, requests = [], []
    page.on("console", lambda message: messages.append(message.text))
    page.on("pageerror", lambda error: messages.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(f"file://{PAGE}")
    figure = page.locator("figure", has_text=CAPTION).first
    svg = figure.locator(".wide-view .picture svg")
    svg.scroll_into_view_if_needed()
    x, y = figure.evaluate(PLACE, [SERIES, float(X), float(Y)])
    page.mouse.move(x, y)
    hover = [line for line in figure.locator(".wide-view .values").inner_text().split("\n") if line.startswith(f"{SERIES}:")]

    def axes():
        return svg.evaluate("(svg) => [...svg.querySelectorAll('text')].filter((t) => t.checkVisibility()).map((t) => t.textContent)")

    whole = axes()
    box = svg.bounding_box()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.3 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.6 * box["height"], steps=4)
    page.mouse.up()
    zoomed, zoomed_overlaps = axes(), page.evaluate(OVERLAPS)
    page.mouse.dblclick(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    reset = axes()
    svg.focus()
    page.keyboard.press("ArrowRight")
    keyboard = bool(figure.locator(".wide-view .values").inner_text())
    button = figure.locator(".wide-view .legend button").first
    button.focus()
    page.keyboard.press("Space")
    line = svg.locator('[data-series="0.0"]').first
    seen = {
        "messages": messages,
        "requests": len(requests),
        "hover": hover[0] if hover else "",
        "zoom_changes_axes": zoomed != whole,
        "double_click_resets": reset == whole,
        "keyboard_values": keyboard,
        "button_hides": button.get_attribute("aria-pressed") == "false" and not line.is_visible(),
        "texts_overlap": page.evaluate(OVERLAPS) + zoomed_overlaps,
        "background": page.evaluate("getComputedStyle(document.body).backgroundColor"),
    }
    if scheme == "light":
        button.click()
        page.mouse.move(0, 0)
        page.evaluate("window.scrollTo(0, 0)")
        page.screenshot(path=PICTURE, clip={"x": 0, "y": 0, "width": 1000, "height": 1150}, full_page=True, scale="css")
    else:
        # Print from a dark screen, with a series hidden.
        pdf = page.pdf(format="A4")
        page.emulate_media(media="print")
        printed = {
            "background": page.evaluate("getComputedStyle(document.body).backgroundColor"),
            "hidden_series": page.evaluate(
                "[...document.querySelectorAll('[data-series]')].filter((s) => getComputedStyle(s).display === 'none').length"
            ),
            "pages": pages(pdf),
            # Headings that a page may end with: those whose style does not hold them to what follows.
            "torn_headings": page.evaluate(
                "[...document.querySelectorAll('h2, h3, figcaption, caption')].filter((h) => getComputedStyle(h).breakAfter !== 'avoid').map((h) => h.textContent)"
            ),
        }
        seen["print"] = printed
    context.close()
    return seen


def pages(pdf):
    """Number of pages of a PDF: from its page tree, which may be compressed."""
    streams = re.findall(rb"stream\r?\n(.*?)endstream", pdf, re.S)
    plain = pdf
    for stream in streams:
        try:
            plain += zlib.decompress(stream)
        except zlib.error:
            pass
    return len(re.findall(rb"/Type\s*/Page\b(?!s)", plain))


# Height of the smallest text of all pictures that are shown, on the screen.
SMALLEST = """() => Math.min(...[...document.querySelectorAll('.picture svg text')].filter((t) => t.getClientRects().length).map((t) => {
  const svg = t.ownerSVGElement;
  return parseFloat(getComputedStyle(t).fontSize) * svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
}))"""


def of_sizes(browser):
    """What axe-core finds, and whether everything can be read, on a desk and on a telephone."""
    axe = (Path(axe_playwright_python.__file__).parent / "axe.min.js").read_text()
    seen = {}
    for width in (1280, 400):
        for scheme in ("light", "dark"):
            # The page's own policy lets no other script in.
            context = browser.new_context(color_scheme=scheme, viewport={"width": width, "height": 900}, bypass_csp=True)
            page = new_page(context)
            page.goto(f"file://{PAGE}")
            page.evaluate(axe)
            found = page.evaluate("axe.run({resultTypes: ['violations']})")["violations"]
            seen[f"{width} {scheme}"] = {
                "faults": [f"{v['id']}: {v['nodes'][0]['html']}" for v in found if v["impact"] in ("serious", "critical")],
                "smallest_text_px": page.evaluate(SMALLEST),
                "is_wider_than_screen": page.evaluate(f"document.documentElement.scrollWidth > {width}"),
                "texts_overlap": page.evaluate(OVERLAPS),
            }
            context.close()
    return seen


def without_script(browser):
    page = new_page(browser.new_context(java_script_enabled=False))
    page.goto(f"file://{PAGE}")
    return {
        "pictures": page.locator("figure .picture svg").count(),
        "legend_is_drawn": page.locator("figure text[data-legend]").first.is_visible(),
    }


with sync_playwright() as playwright:
    browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
    light, dark = looked_at(browser, "light"), looked_at(browser, "dark")
    printed = dark.pop("print")
    print(json.dumps({"light": light, "dark": dark, "print": printed, "without_script": without_script(browser), "sizes": of_sizes(browser)}))
