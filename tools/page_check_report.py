"""What pages of `loopbench report` promise, held against a page in a browser (tools/page_check)."""
import json
import time

VIEW = "loopbenchReport"
MOST_PAINT_MS = 2000  # from the start of loading to the first words, also of 10^4 cases and 10^6 points


def load(browser, page, **how):
    browser.open(page, ready=f"!!window.{VIEW} && {VIEW}.ready", **how)


def settle(browser, seconds=0.3):
    browser.value(f"new Promise((done) => setTimeout(done, {1000 * seconds}))")


def first_paint(browser):
    """[ms]; the largest of those that Chromium tells."""
    browser.until("performance.getEntriesByType('paint').length > 0")
    return browser.value("(() => { const p = performance.getEntriesByType('paint'); "
                         "return p.length ? Math.max(...p.map((one) => one.startTime)) : -1; })()")


def drag(browser, x, y, dx, dy=0, **more):
    browser.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1, **more)
    browser.mouse("mouseMoved", x + 0.5 * dx, y + 0.5 * dy, button="left", buttons=1, **more)
    browser.mouse("mouseMoved", x + dx, y + dy, button="left", buttons=1, **more)
    browser.mouse("mouseReleased", x + dx, y + dy, button="left", clickCount=1, **more)


def centre(browser, element):
    """Of an element that is brought into view."""
    return browser.value(f"(() => {{ const e = {element}; e.scrollIntoView({{block: 'center'}}); "
                         "const b = e.getBoundingClientRect(); "
                         "return [b.left + 0.4 * b.width, b.top + 0.5 * b.height]; })()")


def check(browser, page):
    """What does not hold of a page, as sentences."""
    wrong = []

    def hold(what, is_so):
        if not is_so:
            wrong.append(what)

    load(browser, page)
    paint = first_paint(browser)
    hold(f"first words after {paint:.0f} ms, at most {MOST_PAINT_MS}", 0 <= paint <= MOST_PAINT_MS)
    value = browser.value
    runs = value(f"{VIEW}.tables.length > 0 && {VIEW}.runs ? {VIEW}.runs.ids.length : 0")
    if runs:
        hold("the table has all rows", value(f"{VIEW}.tables[0].rows.length") == runs)
        hold("only rows that are seen are elements", value(f"{VIEW}.tables[0].body.children.length") < 80)
        check_table(browser, hold)
        if value(f"{VIEW}.plots.some((plot) => plot.u)"):
            check_curves(browser, hold)
    if value(f"!!{VIEW}.map"):
        check_map(browser, hold)
    if value(f"!!{VIEW}.costs && !!{VIEW}.costs.u"):
        check_costs(browser, hold)
    # complaints, which are looked at last, are of figures without anything to draw too
    value("document.querySelectorAll('[aria-label=\"Zoom in\"], [aria-label=\"Zoom out\"]').forEach((one) => one.click())")
    theme = value(f"{VIEW}.state().theme")
    value("document.body.focus()")
    browser.key("t", "t")
    hold("t switches light and dark", value(f"{VIEW}.state().theme") != theme)
    hold("controls have names", value(
        "[...document.querySelectorAll('button, select, input')].every((e) => "
        "(e.textContent.trim() || e.getAttribute('aria-label') || (e.labels && e.labels.length)))"))
    hold("no text is fainter than 4.5 to 1", value(CONTRAST) >= 4.5)
    browser.key("t", "t")
    hold("no text is fainter than 4.5 to 1", value(CONTRAST) >= 4.5)
    for width in (1100, 390):
        load(browser, page, width=width, mobile=width < 500)
        settle(browser)
        hold(f"nothing is wider than a page of {width} px",
             value("document.documentElement.scrollWidth <= document.documentElement.clientWidth"))
    wrong += ["console: " + one for one in browser.complaints()]
    return wrong


def check_table(browser, hold):
    value = browser.value
    columns = value(f"{VIEW}.tables[0].data.columns.filter((one) => one.numbers).length")
    if columns:
        key = value(f"{VIEW}.tables[0].columns().find((one) => one.numbers).key")
        header = f"document.querySelector('#tables thead button[title={json.dumps(key)}]')"
        values = lambda: value(f"(() => {{ const t = {VIEW}.tables[0], x = t.data.columns.find((one) => one.key === "
                               f"{json.dumps(key)}).numbers; return t.rows.map((row) => x[row]).filter((v) => v !== null); }})()")
        value(f"{header}.click()")
        hold("a header sorts", values() == sorted(values()))
        value(f"{header}.click()")
        hold("and again, downwards", values() == sorted(values(), reverse=True))
        value(f"{header}.click()")
    word = value(f"{VIEW}.runs.formulations[0]")
    value(f"{VIEW}.tables[0].input.value = {json.dumps(word)}; {VIEW}.tables[0].input.dispatchEvent(new Event('input'))")
    shown = value(f"{VIEW}.tables[0].rows.length")
    hold("a word filters", 0 < shown <= value(f"{VIEW}.runs.ids.length"))
    hold("rows that are shown have the word", value(
        f"{VIEW}.tables[0].rows.every((row) => {VIEW}.tables[0].data.columns.some((one) => "
        f"one.words[one.at[row]].toLowerCase().includes({json.dumps(word)})))")
        or value(f"{VIEW}.tables[0].data.alike.join().includes({json.dumps(word)})"))
    value(f"{VIEW}.tables[0].filter('')")
    value("document.querySelector('#tables .rows').focus()")
    browser.key("ArrowDown")
    hold("an arrow key chooses a row", value(f"{VIEW}.tables[0].chosen >= 0"))
    hold("a row says all that is known of it", value("document.querySelector('#tables .detail dl').children.length") > 5)
    hold("and the command that prints it", "loopbench table" in value("document.querySelector('#tables .detail code').textContent"))
    show = value("!!document.querySelector('button.show')")
    if show:
        value("document.querySelector('button.show').click()")
        hold("a finding shows its runs", 0 < value(f"{VIEW}.tables[0].rows.length"))
        value(f"{VIEW}.tables[0].filter('')")


def check_curves(browser, hold):
    value = browser.value
    plot = f"{VIEW}.plots.find((plot) => plot.u)"
    moves = value(f"!!{VIEW}.motion.first")
    poses = lambda: value(f"Array.from({VIEW}.motion.drawing.poses).join()") if moves else None
    value(f"{VIEW}.clock.set(0)")
    before, t = poses(), value(f"{VIEW}.clock.t")
    x, y = centre(browser, f"{plot}.u.over")
    browser.mouse("mouseMoved", x, y)
    drag(browser, x, y, 60)
    hold("dragging in a curve moves the time", value(f"{VIEW}.clock.t") != t)
    if moves:
        hold("the linkage moves with it", poses() != before)
    lines = value(f"{VIEW}.plots.filter((plot) => plot.u).map((plot) => parseFloat(plot.line.style.left))")
    pixels = value(f"{VIEW}.plots.filter((plot) => plot.u).map((plot) => plot.u.valToPos({VIEW}.clock.t, 'x'))")
    now = value(f"{VIEW}.clock.t")
    hold("all curves show one time", lines and all(abs(a - b) <= 1 for a, b in zip(lines, pixels)))
    value(f"{plot}.stage.focus()")
    browser.key("ArrowRight")
    hold("an arrow key moves the time", value(f"{VIEW}.clock.t") != now)
    scale = lambda: value(f"[{plot}.u.scales.x.min, {plot}.u.scales.x.max].join()")
    before = scale()
    drag(browser, x - 40, y - 30, 120, 60, modifiers=8)
    settle(browser, 0.1)
    hold("Shift and drag zooms", scale() != before)
    browser.key("0", "0")
    settle(browser, 0.1)
    hold("0 shows the whole", scale() == before)
    for name in ("x", "y"):
        was = value(f"{plot}.u.scales.{name}.distr")
        value(f"{plot}.boxes.{name}.click()")
        hold(f"the {name} axis turns logarithmic or linear", not value(f"!!{plot}.u") or value(f"{plot}.u.scales.{name}.distr") != was)
        value(f"{plot}.boxes.{name}.click()")
    x, y = centre(browser, f"{plot}.u.over")
    seen = False
    for dy in range(-110, 110, 6):
        browser.mouse("mouseMoved", x, y + dy)
        seen = seen or value(f"!{plot}.tip.hidden")
    hold("a curve under the pointer is named", seen)
    if moves and value(f"{VIEW}.motion.scene.paths.length") > 1:
        value(f"(() => {{ const m = {VIEW}.motion; m.other.list.value = '2'; m.other.list.dispatchEvent(new Event('change')); "
              "m.part.disabled || m.part.click(); })()")
        hold("a second motion lies over the first", value(f"{VIEW}.motion.drawing.ghosts.length") == 1)
        hold("and how far they are apart is said", " m apart" in value(f"{VIEW}.motion.said.textContent"))
    if moves:
        value(f"{VIEW}.motion.player.click()")
        t = value(f"{VIEW}.clock.t")
        time.sleep(0.4)
        hold("the motion plays", value(f"{VIEW}.clock.t") != t)
        value(f"{VIEW}.motion.player.click()")
    else:
        hold("what there is instead of a motion is said", value(f"{VIEW}.motion.missing.textContent") != "")


def check_map(browser, hold):
    value = browser.value
    cell = "document.querySelector('#map td button[data-state]')"
    value(f"{cell}.click()")
    hold("a cell explains itself", value("document.querySelector('#map .detail dl').textContent.length") > 20)
    rows = lambda: value("document.querySelectorAll('#map tr').length")
    before = rows()
    value("document.querySelector('#map tr.group button').click()")
    hold("an extreme folds", rows() < before)
    value("document.querySelector('#map tr.group button').click()")
    wide = value("document.querySelector('#map tr:first-child th:nth-child(2)').className")
    value("document.querySelector('#map tr:first-child th:nth-child(2) button').click()")
    hold("a method folds", value("document.querySelector('#map tr:first-child th:nth-child(2)').className") != wide)


def check_costs(browser, hold):
    value = browser.value
    place = value(f"(() => {{ const c = {VIEW}.costs; c.u.over.scrollIntoView({{block: 'center'}}); "
                  "const b = c.u.over.getBoundingClientRect(), row = c.rows[0]; "
                  "return [b.left + c.u.valToPos(row.x, 'x'), b.top + c.u.valToPos(row.y, 'y')]; })()")
    browser.mouse("mouseMoved", *place)
    hold("a point under the pointer is named", value(f"!{VIEW}.costs.tip.hidden"))
    browser.mouse("mousePressed", *place, button="left", buttons=1, clickCount=1)
    browser.mouse("mouseReleased", *place, button="left", clickCount=1)
    hold("a point that is chosen says its numbers", value(f"{VIEW}.costs.said.textContent.length") > 10)


def pictures(browser, page, folder):
    """Light, dark, phone, paper."""
    folder.mkdir(parents=True, exist_ok=True)

    def shot(name):
        settle(browser, 0.5)
        browser.picture(folder / f"{page.stem}-{name}.png")

    for name, dark, how in (("light", False, {"width": 1300, "height": 1000}), ("dark", True, {"width": 1300, "height": 1000}),
                            ("phone", False, {"width": 390, "height": 844, "mobile": True})):
        browser.call("Emulation.setEmulatedMedia",
                     features=[{"name": "prefers-color-scheme", "value": "dark"}] if dark else [])
        load(browser, page, **how)
        shot(f"{name}-top")
        for section in ("motion", "tables", "costs", "map"):
            if browser.value(f"!!document.getElementById('{section}')"):
                browser.value(f"document.getElementById('{section}').scrollIntoView()")
                if section == "motion":
                    browser.value(f"{VIEW}.clock.set(0.4 * {VIEW}.clock.end)")
                if section == "tables" and browser.value(f"!!{VIEW}.runs"):
                    browser.value(f"{VIEW}.tables[0].pick({VIEW}.tables[0].rows[0])")
                if section == "map":
                    browser.value("document.querySelector('#map td button[data-state]').click()")
                shot(f"{name}-{section}")
    browser.call("Emulation.setEmulatedMedia", features=[])
    load(browser, page)
    settle(browser)
    browser.print_to(folder / f"{page.stem}-paper.pdf")


# The least contrast of a text with what is behind it, of all that is seen.
CONTRAST = r"""(() => {
  const numbers = (text) => (text.match(/[\d.]+/g) || []).map(Number);
  const light = (c) => c.slice(0, 3).map((v) => v / 255).map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
      .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (e) => { for (; e; e = e.parentElement) { const c = numbers(getComputedStyle(e).backgroundColor);
      if (c.length === 3 || c[3] > 0) return c; } return [255, 255, 255]; };
  let least = 21;
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let i = 0; walk.nextNode() && i < 4000; ++i) {
    const e = walk.currentNode.parentElement;
    if (!walk.currentNode.textContent.trim() || !e.getClientRects().length || e.closest('script, style, .hidden, :disabled')) continue;
    const a = light(numbers(getComputedStyle(e).color)), b = light(behind(e));
    least = Math.min(least, (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05));
  }
  return least;
})()"""
