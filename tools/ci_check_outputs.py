"""What the jobs of docs/ci/ leave, for tools/ci_check: exit code, summary, JUnit file, report."""
import html.parser, re, subprocess, sys
import xml.etree.ElementTree


def say(text):
    print(text, flush=True)


def fail(text):
    say(f"ci_check: {text}")
    sys.exit(1)


def run(words, **more):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, **more)
    if done.returncode != 0:
        fail(f"{' '.join(map(str, words))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


class Rendered(html.parser.HTMLParser):
    """Rows of the tables of a page, items of its lists, its text but for code, and the tags it has."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.items, self.tags, self.at, self.text, self.in_code = [], [], set(), None, "", False
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self.in_code |= tag == "code"
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th", "li"):
            self.at = self.items if tag == "li" else self.rows[-1]
            self.at.append("")

    def handle_endtag(self, tag):
        self.in_code &= tag != "code"
        if tag in ("td", "th", "li"):
            self.at = None

    def handle_data(self, data):
        self.text += "" if self.in_code else data
        if self.at is not None:
            self.at[-1] += data.replace("\u200b", "")


def check_summary(text):
    """The table of a summary as another implementation renders it: no markup of names has become any."""
    page = Rendered(run(["cmark-gfm", "--unsafe", "--extension", "table", "--extension", "autolink"], input=text))
    strange = page.tags - set("h3 p table thead tbody tr th td ul li pre code".split())
    if strange or re.search(r"(^|\s)@\w", page.text) or any(len(row) != 7 for row in page.rows):
        fail(f"the summary has tags {strange}, a name that is called or a row of another length:\n{text}")
    return {(row[1], row[2]) for row in page.rows[1:]} | {(item, "case") for item in page.items if ": " not in item}


def check_junit(file):
    """What fails in it; it is well-formed and its counts are those of its cases."""
    suites = xml.etree.ElementTree.parse(file).getroot()
    (suite,) = suites
    cases = list(suite)
    count = lambda tag: sum(one.find(tag) is not None for one in cases)
    counts = {"tests": len(cases), "failures": count("failure"), "skipped": count("skipped"), "errors": count("error")}
    held = (suites.tag == "testsuites" and suite.tag == "testsuite" and cases
            and all(suite.get(key) == str(value) for key, value in counts.items())
            and all(one.tag == "testcase" and one.get("classname") and one.get("name") for one in cases)
            and all(len(one) <= 1 for one in cases)
            and all(child.tag in ("failure", "skipped", "error") and child.get("message") for one in cases for child in one))
    if not held:
        fail(f"{file} is not as expected: {suite.attrib}, counted {counts}")
    return {(one.get("classname"), one.get("name")) for one in cases if one.find("failure") is not None}


def expect(world, job, code, words, what, compared=True):
    """The verdict of a job, its artefact, and that summary and JUnit file name the same."""
    if job.code != code:
        fail(f"{what}: exit code {job.code}, expected {code}\n{job.log}")
    summary = (job.folder / "summary.md").read_text()
    if summary not in job.summary:
        fail(f"{what}: the summary is not that of the artefact\n{job.summary}")
    for word in words:
        if word not in summary:
            fail(f"{what}: no {word!r} in the summary\n{summary}\n{job.log}")
    named = check_summary(summary)
    if compared:
        if named != (junit := check_junit(job.folder / "junit.xml")):
            fail(f"{what}: the summary names {named}, the JUnit file {junit}")
        if "<html" not in (job.folder / "report.html").read_text()[:200]:
            fail(f"{what}: no report in the artefact")
    verdict = "green" if code == 0 else f"red, exit code {code}"
    say(f"{world.kind.__name__}: {what}: {verdict}: {summary.splitlines()[0].strip('# ')}")
    return named
