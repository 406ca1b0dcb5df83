"""Opens pages in headless Chromium, uses them as a person would, and says what is wrong.

    pip install playwright==1.56.0                 # the driver alone; the browser is the system's own Chromium
    python tests/report/browser.py report.html...  [--index] [--shots FOLDER] [--both] [--within SECONDS] [--picture FILE]

Each page is opened from its folder, without a network, at three sizes, light and dark. Checked: no error on the console,
no request to anywhere, no sideways scrolling, text readable against what is behind it (WCAG AA). At each size, light
and dark by turns or with --both in either: the links to the sections of a report, turning the robot, the filter by joint and
the zoom, by pointer and by key, and what plays. Of a report also that it says the same without JavaScript, and how it prints.
With --index the page is one that `gapscope report` wrote. Exit status 0 if all is well, 1 if not, 77 if there is no browser.
"""

import argparse
import pathlib
import shutil
import sys

SKIPPED = 77
SIZES = [(1440, 900), (768, 1024), (375, 812)]

# Contrast of every text that shows, against the nearest background that is not transparent.
CONTRAST = """() => {
  const luminance = (c) => {
    const [r, g, b] = c.map((v) => { v /= 255; return v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (text) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = text;
    canvas.fillRect(0, 0, 1, 1);
    const d = canvas.getImageData(0, 0, 1, 1).data;
    return [d[0], d[1], d[2], d[3] / 255];
  };
  const over = (top, below) => [0, 1, 2].map((i) => top[i] * top[3] + below[i] * (1 - top[3]));
  const behind = (element) => {
    const layers = [];
    for (let e = element; e; e = e.parentElement) layers.push(rgba(getComputedStyle(e).backgroundColor));
    return layers.reverse().reduce((below, top) => over(top, below), [255, 255, 255]);
  };
  const bad = new Set();
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    if (!walker.currentNode.data.trim() || element.closest("script,style,svg,.sr,option") || !element.checkVisibility()) continue;
    const style = getComputedStyle(element), ground = behind(element);
    const ink = luminance(over(rgba(style.color), ground)), paper = luminance(ground);
    const ratio = (Math.max(ink, paper) + 0.05) / (Math.min(ink, paper) + 0.05);
    const size = parseFloat(style.fontSize), large = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
    if (ratio < (large ? 3 : 4.5)) bad.add(`${ratio.toFixed(2)}: ${walker.currentNode.data.trim().slice(0, 40)}`);
  }
  return [...bad];
}"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("pages", nargs="+", type=pathlib.Path)
    parser.add_argument("--index", action="store_true")
    parser.add_argument("--both", action="store_true", help="use each page in light and in dark")
    parser.add_argument("--shots", type=pathlib.Path)
    parser.add_argument("--picture", type=pathlib.Path, help="the first screen of the first page, for the documents")
    parser.add_argument("--within", type=float, help="the longest that a page may take to open, s")
    args = parser.parse_args()
    patience = 120_000  # ms; a machine may be busy
    browser_file = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome"])), None)
    if browser_file is None:
        print("skipped: no Chromium on this machine (apt install chromium)")
        return SKIPPED
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        print("skipped: no playwright for this Python (pip install playwright)")
        return SKIPPED
    faults = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=browser_file, args=["--no-sandbox"], timeout=patience)
        for page, file in enumerate(args.pages):
            for place, size in enumerate(SIZES):
                for turn, scheme in enumerate(["light", "dark"]):
                    name = f"{file.parent.name or 'page'} {size[0]} {scheme}"
                    used = args.both or (page + place + turn) % 2 == 0
                    faults += [f"{name}: {fault}" for fault in check(browser, file, size, scheme, used, args)]
            if not args.index:
                faults += [f"{file}: {fault}" for fault in check_without_script(browser, file)]
                faults += [f"{file} on paper: {fault}" for fault in check_print(browser, file, args)]
        if args.picture:
            picture(browser, args.pages[0], args.picture)
        browser.close()
    for fault in faults:
        print(fault)
    print(f"{len(args.pages)} pages, {len(faults)} faults")
    return 1 if faults else 0


def picture(browser, file, out):
    page = browser.new_context(viewport={"width": 1280, "height": 1000}, offline=True).new_page()
    page.goto(file.resolve().as_uri())
    page.wait_for_timeout(150)
    page.screenshot(path=out)
    page.context.close()


def check(browser, file, size, scheme, used, args):
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]}, color_scheme=scheme, offline=True, has_touch=size[0] < 700
    )
    page = context.new_page()
    faults = []
    page.on("console", lambda m: faults.append(f"console: {m.text}") if m.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: faults.append(f"error: {error}"))
    page.on("request", lambda r: faults.append(f"asks for {r.url}") if r.url != file.resolve().as_uri() else None)
    page.goto(file.resolve().as_uri())
    page.wait_for_timeout(150)
    opened = page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd") / 1e3
    if args.within and opened > args.within:
        faults.append(f"opens in {opened:.2f} s")
    wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    if (beyond := page.evaluate(wide)) > 0:
        faults.append(f"scrolls sideways by {beyond} px")
    if args.shots:
        args.shots.mkdir(parents=True, exist_ok=True)
        stem = f"{file.resolve().parent.name}-{size[0]}-{scheme}"
        page.screenshot(path=args.shots / f"{stem}.png")
        page.screenshot(path=args.shots / f"{stem}-whole.png", full_page=True)
    page.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    page.wait_for_timeout(50)
    if (beyond := page.evaluate(wide)) > 0:
        faults.append(f"scrolls sideways by {beyond} px with everything unfolded")
    faults += [f"contrast {bad}" for bad in page.evaluate(CONTRAST)]
    if used:
        faults += use_index(page) if args.index else use_report(page)
    context.close()
    return faults


def becomes(page, holds):
    """Whether a state comes: looked for every 30 ms for up to 5 s, as a busy machine answers late."""
    for _ in range(167):
        if holds():
            return True
        page.wait_for_timeout(30)
    return False


def use_report(page):
    faults = use_contents(page)
    chart = page.locator("#live .chart")
    if chart.count():
        # Measured, model and corrected torque are what the page is opened for.
        top, screen = page.evaluate(f"{WHERE}('#live .chart') + scrollY"), page.viewport_size["height"]
        if top > 1.5 * screen:
            faults.append(f"the lines begin at {top:.0f} px, on a screen of {screen} px")
        chart.scroll_into_view_if_needed()
        span = "(() => { const b = document.querySelector('#live .chart'); return b.dataset.to - b.dataset.from; })()"
        chart.focus()
        page.keyboard.press("+")
        near = page.evaluate(span)
        page.keyboard.press("+")
        if not becomes(page, lambda: page.evaluate(span) < near):
            faults.append("the key + does not zoom")
        page.keyboard.press("0")
        page.keyboard.press("ArrowRight")
        if not becomes(page, lambda: "measured" in page.locator("#live output").inner_text()):
            faults.append("an arrow key reads nothing")
        page.locator("[data-zoom=in]").click()
        page.locator("[data-zoom=in]").click()
        if not becomes(page, lambda: page.evaluate(span) < near):
            faults.append("the button + does not zoom")
        page.locator("[data-zoom=all]").click()
        box = page.locator("#live .u-over").first.bounding_box()
        page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 50)
        if not becomes(page, lambda: "measured" in page.locator("#live output").inner_text()):
            faults.append("the pointer reads nothing")
        before = page.evaluate(ticks(page))
        page.mouse.down()
        page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 60, steps=4)
        page.mouse.up()
        if not becomes(page, lambda: page.evaluate(ticks(page)) != before):
            faults.append("dragging does not zoom")
        page.locator("[data-zoom=all]").click()
    for button in page.locator("[data-copy]").all()[:2]:
        button.scroll_into_view_if_needed()
        button.focus()
        page.keyboard.press("Enter")
        if not becomes(page, lambda: button.inner_text() != "Copy"):
            faults.append("nothing is copied or selected")
    chips = page.locator("[data-pick]")
    filtered = "[...document.querySelectorAll('[data-joints]')].filter((e) => e.classList.contains('filtered')).length"
    if chips.count() > 1 and page.locator("[data-joints]").count():
        chips.nth(1).click()
        if not becomes(page, lambda: page.evaluate(filtered) and page.locator("#filter").is_visible()):
            faults.append("a joint of the list filters nothing")
        page.locator("#filter button").click()
        if not becomes(page, lambda: not page.evaluate(filtered)):
            faults.append("the filter does not go away")
        chips.nth(0).focus()
        page.keyboard.press("Enter")
        if not becomes(page, lambda: page.evaluate(filtered)):
            faults.append("Enter on a joint of the list filters nothing")
        page.keyboard.press("Enter")
    if page.locator("#skeleton").count():
        drawn = "document.querySelector('#skeleton .barrel').getAttribute('x2') + document.querySelector('#skeleton .floor').getAttribute('points')"
        page.locator("#skeleton").scroll_into_view_if_needed()
        before = page.evaluate(drawn)
        page.locator("#skeleton").focus()
        page.keyboard.press("ArrowLeft")
        if not becomes(page, lambda: page.evaluate(drawn) != before):
            faults.append("an arrow key does not turn the robot")
        turned = page.evaluate(drawn)
        box = page.locator("#skeleton").bounding_box()
        page.mouse.move(box["x"] + 8, box["y"] + 20)
        page.mouse.down()
        page.mouse.move(box["x"] + 90, box["y"] + 30, steps=4)
        page.mouse.up()
        if not becomes(page, lambda: page.evaluate(drawn) != turned):
            faults.append("dragging does not turn the robot")
        if chips.count() > 1:
            page.locator("#skeleton .joint").nth(0).focus()
            page.keyboard.press("Enter")
            if not becomes(page, lambda: page.evaluate(filtered)):
                faults.append("Enter on a joint of the robot filters nothing")
            page.keyboard.press("Enter")
            if not becomes(page, lambda: not page.evaluate(filtered)):
                faults.append("Enter once more does not show all joints again")
            page.locator("#skeleton .joint .barrel").first.dispatch_event("click")
            if becomes(page, lambda: page.evaluate(filtered)):
                page.locator("#filter button").click()
            else:
                faults.append("a click on a joint of the robot filters nothing")
        stands = "[...document.querySelectorAll('#skeleton line')].map((l) => l.getAttribute('x2') + l.getAttribute('y2')).join()"
        for button in page.locator("[data-play]").all():
            name, still = button.inner_text(), page.evaluate(stands)
            button.click()
            if not becomes(page, lambda: button.inner_text() == "Stop"):
                faults.append(f"{name}: does not play")
            # A log may begin at rest.
            if not becomes(page, lambda: page.evaluate(stands) != still):
                faults.append(f"{name}: nothing moves")
            if not page.locator("#skeleton").is_visible() or not in_sight(page, "#skeleton"):
                faults.append(f"{name}: the robot that moves is out of sight")
            button.focus()
            # A short log may end by itself just before the key, which then plays it again.
            for _ in range(3):
                if button.inner_text() == "Stop":
                    page.keyboard.press("Enter")
            if not becomes(page, lambda: button.inner_text() == name):
                faults.append(f"{name}: Enter does not stop it")
    return faults


def use_contents(page):
    """Each link of the line of sections leads there, by pointer and by key, and the line stays in sight."""
    faults = []
    page.evaluate("scrollTo(0, 0)")
    goes_on = "(() => { const b = document.querySelector('.contents'); return b && b.scrollWidth > b.clientWidth + 2; })()"
    hint = "getComputedStyle(document.querySelector('.contents'), '::after').content"
    if page.evaluate(goes_on) and "→" not in page.evaluate(hint):
        faults.append("the line of links goes on without a hint")
    for i, link in enumerate(page.locator(".contents a").all()):
        place = link.get_attribute("href")
        if i % 2:
            link.focus()
            page.keyboard.press("Enter")
        else:
            link.click()
        height, ends = page.viewport_size["height"], "scrollY + innerHeight >= document.documentElement.scrollHeight - 2"

        def top():
            return page.evaluate(f"{WHERE}('{place}')")

        if not becomes(page, lambda: -2 <= top() < 0.2 * height or page.evaluate(ends) and top() < height):
            faults.append(f"the link {place} leads to {top():.0f} px")
        if place != "#top" and not in_sight(page, ".contents"):
            faults.append(f"at {place} the links are out of sight")
    page.evaluate("history.replaceState(null, '', location.pathname)")
    return faults


# How far below the upper edge of the screen an element begins, px.
WHERE = "((name) => document.querySelector(name).getBoundingClientRect().top)"


def in_sight(page, selector):
    box = page.locator(selector).bounding_box()
    return box["y"] + box["height"] > 0 and box["y"] < page.viewport_size["height"]


def ticks(_page):
    return "document.querySelector('#live canvas').toDataURL()"


def use_index(page):
    rows = "[...document.querySelectorAll('#diagnoses tbody tr')].filter((r) => !r.hidden).map((r) => r.dataset.name).join('|')"
    faults = []
    before = page.evaluate(rows)
    cut = "(() => { const h = document.querySelector('#diagnoses thead tr'); return h.scrollWidth > h.clientWidth + 1; })()"
    if page.evaluate(cut):
        faults.append("headings to sort by are cut")
    # On a screen all columns show; on a phone a row is a card, and all of it does.
    clipped = "[...document.querySelectorAll('#diagnoses tbody tr, main > .scroll')].some((e) => e.scrollWidth > e.clientWidth + 1)"
    if page.viewport_size["width"] != 768 and page.evaluate(clipped):
        faults.append("columns are cut")
    heads = page.locator("#diagnoses thead button")
    heads.nth(0).focus()
    page.keyboard.press("Enter")
    first = page.evaluate(rows)
    heads.nth(0).click()
    if page.evaluate(rows) == first and "|" in before:
        faults.append("a heading does not sort")
    page.locator("#find").fill("no robot has this name")
    if page.evaluate(rows):
        faults.append("the filter shows what it should not")
    page.locator("#find").fill("")
    boxes = page.locator("#diagnoses tbody input[type=checkbox]")
    if boxes.count() > 1:
        boxes.nth(0).check()
        boxes.nth(1).focus()
        page.keyboard.press("Space")
        if page.locator("#beside article").count() != 2:
            faults.append("two diagnoses are not shown side by side")
        if page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth"):
            faults.append("side by side scrolls sideways")
    return faults


def check_without_script(browser, file):
    faults = []
    texts = []
    for enabled in [True, False]:
        context = browser.new_context(java_script_enabled=enabled, offline=True)
        page = context.new_page()
        page.goto(file.resolve().as_uri())
        texts.append(page.locator(".said").inner_text())
        if not enabled and page.locator("#live").is_visible():
            faults.append("without JavaScript an empty chart shows")
        if not enabled and page.locator("#live").count() and not page.locator("[data-still] svg").first.is_visible():
            faults.append("without JavaScript no torque shows")
        context.close()
    if texts[0] != texts[1] or not texts[0].strip():
        faults.append("the answer is another without JavaScript")
    return faults


def check_print(browser, file, args):
    """A dark screen prints light, whole and without controls on A4 (703 px between its margins)."""
    context = browser.new_context(viewport={"width": 703, "height": 1000}, color_scheme="dark", offline=True)
    page = context.new_page()
    page.goto(file.resolve().as_uri())
    page.wait_for_timeout(150)
    page.emulate_media(media="print", color_scheme="dark")
    faults = []
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    if ground != "rgb(255, 255, 255)":
        faults.append(f"the ground is {ground}")
    controls = page.locator("button, select, .tools, #live, #filter").all()
    if any(control.is_visible() for control in controls):
        faults.append("controls show")
    folded = "[...document.querySelectorAll('details > :not(summary)')].filter((e) => !e.closest('.needs-script') && !e.checkVisibility({ contentVisibilityAuto: true })).length"
    if page.evaluate(folded):
        faults.append("something stays folded")
    cut = "[...document.querySelectorAll('.plot, .skeleton svg, .bars, .heat, table')].filter((e) => e.getBoundingClientRect().right > innerWidth + 1).map((e) => e.className.baseVal ?? e.className)"
    if cut := page.evaluate(cut):
        faults.append(f"cut at the edge: {cut}")
    if args.shots:
        page.pdf(path=args.shots / f"{file.resolve().parent.name}.pdf", format="A4", prefer_css_page_size=True)
    context.close()
    return faults


if __name__ == "__main__":
    sys.exit(main())
