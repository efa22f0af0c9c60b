"""A user's repository and the server it is on, for tools/ci_check: a mechanism, commits, jobs, comments."""
import json, os, pathlib, shutil

from ci_check_outputs import fail, run
from ci_check_services import Event, GitHub

HOSTILE = "lift|`<img src=x>`\n# @here [x](http://evil.example) $1$ &lt; \"q\" ]]>"
STRANGERS = {"id": 100, "url": "https://api.example/comments/100", "user": {"login": "stranger"},
             "body": "<!-- loopbench -->"}
MATCH = "--match experiment,mechanism,formulation"


def mechanism(name, comment="of a feeder", mass=0.8):
    """A feeder's crank, rod and arm, which comes with no Loopbench."""
    body = lambda name, mass, inertia, com, length: {
        "name": name, "mass": mass, "inertia": inertia, "com": com,
        "points": {"A": [0.0, 0.0], "B": [length, 0.0]}}
    joint = lambda name, one, at, other, to, **more: {
        "name": name, "type": "revolute", "from": {"body": one, "at": at}, "to": {"body": other, "at": to}, **more}
    return json.dumps({
        "name": name, "comment": comment, "gravity": [0.0, -9.81],
        "ground": {"points": {"O": [0.0, 0.0], "C": [0.9, 0.1]}},
        "bodies": [body("crank", 0.4, 0.01, [0.15, 0.0], 0.3), body("rod", mass, 0.06, [0.4, 0.05], 0.8),
                   body("arm", 1.1, 0.05, [0.25, 0.0], 0.5)],
        "joints": [joint("O", "ground", "O", "crank", "A"), joint("A", "crank", "B", "rod", "A"),
                   joint("B", "rod", "B", "arm", "B"), joint("C", "ground", "C", "arm", "A", cut=True)],
        "initial": {"coordinates": {"O": 0.8, "A": -0.6, "B": 1.0}, "fixed": ["O"]}}, indent=1)


def experiment(**more):
    return json.dumps({
        "format": 1, "name": "feeder", "tolerances": [1e-9], "timing": {"repeats": 0},
        "problems": [{"mechanism": f"../{file}.json", "horizon": 2} for file in ("feeder", "hostile")],
        "methods": [{"formulation": ["odca", "lagrange"], "enforcement": "velocity", "coordinates": "absolute"}],
        **more}, indent=1)


class Repository:
    """The user's clone and the server's, with commits an hour apart."""

    def __init__(self, work):
        self.work, self.folder, self.remote = work, work / "clone", work / "remote.git"
        self.hours = 0
        run(["git", "init", "--quiet", "--bare", "--initial-branch=main", self.remote])
        run(["git", "init", "--quiet", "--initial-branch=main", self.folder])
        (self.folder / "bench").mkdir()
        for key, value in (("user.name", "user"), ("user.email", "user@localhost")):
            self.git("config", key, value)
        self.git("remote", "add", "origin", f"file://{self.remote}")

    def git(self, *words):
        date = f"2026-01-{1 + self.hours // 24:02}T{self.hours % 24:02}:00:00Z"
        return run(["git", "-C", self.folder, *words],
                   env={**os.environ, "GIT_AUTHOR_DATE": date, "GIT_COMMITTER_DATE": date}).strip()

    def commit(self, message, files):
        self.hours += 1
        for name, text in files.items():
            (self.folder / name).write_text(text)
        self.git("add", "--all")
        self.git("commit", "--quiet", "--allow-empty", "-m", message)
        return self.git("rev-parse", "HEAD")

    def history(self):
        """What the server's branch has: {commit: mark}, in the order of their lines."""
        found = {}
        for line in self.git("show", "FETCH_HEAD:history.jsonl").splitlines():
            record = json.loads(line)
            if record["kind"] == "mark" or found.get(record["commit"]) != "accepted":  # measured again: that stays
                found[record["commit"]] = record.get("mark", "")
        return found


class World:
    """A service with its server: jobs for pushes and pull requests, the comments that they left."""

    def __init__(self, kind, recipe, work, path, package, enter):
        shutil.rmtree(work, ignore_errors=True)
        self.server = work / "server"
        self.server.mkdir(parents=True)
        # somebody's comment that begins as the recipes' do
        (self.server / "comments.json").write_text(json.dumps([STRANGERS]))
        (self.server / "package.deb").write_bytes(package.read_bytes() if package else b"")
        self.kind, self.path = kind, path
        self.service = kind(recipe, work, path, enter)
        self.user = Repository(work)
        self.match = {"COMPARE": f"{recipe_variables(recipe)['COMPARE']} {MATCH}"}

    def commit(self, message, files):
        """A commit on main."""
        sha = self.user.commit(message, files)
        self.user.git("push", "--quiet", "origin", "main")
        return sha

    def push(self, message, files=None, **more):
        """The same with its job."""
        sha = self.commit(message, files or {})
        return sha, self.again(sha, **more)

    def again(self, sha, **more):
        return self.service.run(Event("push", sha, variables=more or self.match), "refs/heads/main")

    def pull(self, message, files, fork=False, token="secret", labels=(), **more):
        """A pull request with one commit; GitHub measures its merge with main, GitLab the commit."""
        user = self.user
        user.git("checkout", "--quiet", "-B", "change", "main")
        sha = user.commit(message, files)
        ref = "refs/pull/7/merge" if self.kind is GitHub else "refs/merge-requests/7/head"
        if self.kind is GitHub:
            user.git("checkout", "--quiet", "--detach", "main")
            user.git("merge", "--quiet", "--no-ff", "-m", "merge", "change")
            sha = user.git("rev-parse", "HEAD")
        user.git("push", "--quiet", "--force", "origin", f"HEAD:{ref}")
        user.git("checkout", "--quiet", "main")
        event = Event("pull_request", sha, "change", fork=fork, variables=more or self.match, token=token,
                      labels=labels)
        return self.service.run(event, ref)

    def history(self):
        self.user.git("fetch", "--quiet", "origin", "loopbench-history")
        return self.user.history()

    def calls(self):
        """What the stand-ins were asked for since the last look."""
        file = self.server / "calls.jsonl"
        found = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
        file.unlink(missing_ok=True)
        return found

    def comment(self, job, method, what):
        """The comment that a job wrote, by this method, is its summary."""
        written = [call for call in self.calls() if call.get("body")]
        if [call["method"] for call in written] != [method] or written[0]["token"] != "secret":
            fail(f"{what}: found the comments {written}, expected one by {method}\n{job.log}")
        if written[0]["body"] != "<!-- loopbench -->\n" + (job.folder / "summary.md").read_text():
            fail(f"{what}: the comment is not the summary: {written[0]['body']}")

    def no_comment(self, job, what):
        if any(call.get("body") for call in self.calls()):
            fail(f"{what}: a comment was tried\n{job.log}")


def recipe_variables(recipe):
    return recipe["env"] if "env" in recipe else next(iter(recipe.values()))["variables"]
