"""GitHub Actions and GitLab as far as the recipes of docs/ci/ need them, for tools/ci_check: which steps run, in
which shell, with which environment, and what the service makes of their files. What a recipe uses and is not
here ends the check.

https://docs.github.com/en/actions/reference/workflow-syntax-for-github-actions and .../contexts,
https://docs.gitlab.com/ee/ci/yaml/ and .../ci/variables/predefined_variables.html"""
import dataclasses, json, os, pathlib, re, shutil, subprocess

SHELLS = {"bash": ["bash", "--noprofile", "--norc", "-eo", "pipefail"], "sh": ["sh", "-e"]}


@dataclasses.dataclass
class Event:
    """A push to main, or a pull request from `branch`, of a fork or not."""
    kind: str  # push or pull_request
    sha: str
    branch: str = "main"
    number: int = 7
    fork: bool = False
    variables: dict = dataclasses.field(default_factory=dict)  # of the recipe, as its user changes them
    token: str = "secret"
    labels: tuple = ()


@dataclasses.dataclass
class Job:
    """How it went, and what it left."""
    code: int = 0
    log: str = ""
    summary: str = ""
    folder: pathlib.Path = None  # the artefact
    steps: dict = dataclasses.field(default_factory=dict)  # name: success, failure or skipped


TOKEN = re.compile(r"\s*(?:'(?P<text>[^']*)'|\"(?P<text2>[^\"]*)\"|(?P<call>\w+)\(|(?P<name>\$?[A-Za-z_][\w.*-]*)|"
                   r"(?P<number>\d+)|(?P<sign>&&|\|\||==|!=|!|\(|\)|,))")


def evaluate(expression, lookup, calls):
    """The value of an expression of either service; lookup gives that of a name, "" where there is none; calls are
    its functions."""
    words, at = [], 0
    expression = expression.strip()
    while at < len(expression):
        found = TOKEN.match(expression, at)
        if not found:
            raise ValueError(f"cannot read {expression[at:]!r} of {expression!r}")
        words.append((found.lastgroup, found[found.lastgroup]))
        at = found.end()

    def primary():
        kind, value = words.pop(0)
        if (kind, value) == ("sign", "!"):
            return not primary()
        if (kind, value) == ("sign", "("):
            inner = either()
            words.pop(0)
            return inner
        if kind == "call":
            arguments = []
            while words[0][1] != ")":
                arguments.append(either())
                if words[0][1] == ",":
                    words.pop(0)
            words.pop(0)
            return calls[value](*arguments)
        return lookup(value) if kind == "name" else value

    def compared():
        left = primary()
        while words and words[0][1] in ("==", "!="):
            equal = words.pop(0)[1] == "=="
            left = (str(left) == str(primary())) == equal
        return left

    def both():
        left = compared()
        while words and words[0][1] == "&&":
            words.pop(0)
            right = compared()
            left = right if left else left
        return left

    def either():
        left = both()
        while words and words[0][1] == "||":
            words.pop(0)
            right = both()
            left = left if left else right
        return left

    value = either()
    if words:
        raise ValueError(f"cannot read {words} of {expression!r}")
    return value


class Service:
    """Jobs in folders of their own below `work`; `enter` is put before every command (chroot)."""

    def __init__(self, recipe, work, path, enter=()):
        self.recipe, self.work, self.path, self.enter, self.jobs = recipe, work, path, list(enter), 0

    def new_job(self, event, allowed):
        """A fresh home, in which the addresses of the server are the scratch remote; `allowed` may be pushed to."""
        self.jobs += 1
        place = self.work / f"job{self.jobs}-{event.kind}"
        shutil.rmtree(place, ignore_errors=True)
        (place / "home").mkdir(parents=True)
        remote = f"file://{self.work}/remote.git"
        lines = ["[init]\n  defaultBranch = main\n"]
        for url in self.urls(event):
            lines.append(f'[url "{remote}"]\n  insteadOf = {url}\n')
            if url not in allowed:
                lines.append(f'[url "file:///not/allowed/"]\n  pushInsteadOf = {url}\n')
        (place / "home/.gitconfig").write_text("".join(lines))
        return place

    def call(self, words, cwd, environment, place, inside=True):
        """Exit code and both streams, in the order of their lines; of a command in the job's container, or beside."""
        environment = {"PATH": self.path, "HOME": str(place / "home"), "LC_ALL": "C.UTF-8", "CI": "true",
                       "CI_CHECK": str(self.work / "server"), **environment}
        clean = ["env", "-i", "-C", str(cwd), *(f"{key}={value}" for key, value in environment.items())]
        done = subprocess.run([*(self.enter if inside else ()), *clean, *words], stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        return done.returncode, done.stdout

    def clone(self, url, ref, sha, depth, place, inside):
        """What is checked out: a detached commit of a shallow clone."""
        folder = place / "workspace"
        for words in (["init", "--quiet", str(folder)], ["-C", str(folder), "remote", "add", "origin", url],
                      ["-C", str(folder), "fetch", "--quiet", f"--depth={depth}", "origin", ref],
                      ["-C", str(folder), "checkout", "--quiet", "--detach", sha]):
            code, log = self.call(["git", *words], place, {}, place, inside)
            if code != 0:
                raise RuntimeError(f"git {' '.join(words)}: {log}")
        return folder


class GitHub(Service):
    URL = "https://github.example/owner/mechanisms"

    def urls(self, event):
        return [self.URL]

    def run(self, event, ref):
        if "pull_request" not in self.recipe[True] or self.recipe[True]["push"]["branches"] != ["main"]:  # YAML 1.1: on
            raise ValueError("expected pull requests and pushes to main to start the workflow")
        (job,) = self.recipe["jobs"].values()
        may_write = self.recipe["permissions"]["contents"] == "write" and not event.fork
        place = self.new_job(event, [self.URL] if may_write else [])
        repository = {"full_name": "stranger/mechanisms" if event.fork else "owner/mechanisms"}
        pull = event.kind == "pull_request"
        context = {"github": {
            "event_name": event.kind, "ref": ref, "sha": event.sha, "repository": "owner/mechanisms", "run_id": "1",
            "token": event.token, "event": {"pull_request": {"number": event.number, "head": {"repo": repository},
                                                                  "labels": [{"name": one} for one in event.labels]}}
            if pull else {}}, "steps": {}}
        files = {name: place / name for name in ("event.json", "output", "summary", "script")}
        files["event.json"].write_text(json.dumps(context["github"]["event"]))
        workspace = place / "workspace"
        environment = {
            "GITHUB_ACTIONS": "true", "GITHUB_WORKSPACE": str(workspace), "GITHUB_REPOSITORY": "owner/mechanisms",
            "GITHUB_EVENT_NAME": event.kind, "GITHUB_EVENT_PATH": str(files["event.json"]), "GITHUB_REF": ref,
            "GITHUB_REF_NAME": ref.split("/", 2)[-1], "GITHUB_SHA": event.sha, "GITHUB_RUN_ID": "1",
            "GITHUB_BASE_REF": "main" if pull else "", "GITHUB_HEAD_REF": event.branch if pull else "",
            "GITHUB_OUTPUT": str(files["output"]), "GITHUB_STEP_SUMMARY": str(files["summary"]),
            **self.recipe.get("env", {}), **event.variables}
        result = Job()
        workspace.mkdir()
        self.fill(self.recipe["concurrency"]["group"], context)
        for number, step in enumerate(job["steps"]):
            name = step.get("name", step.get("uses"))
            if not self.condition(step.get("if", ""), context, result):
                result.steps[name] = "skipped"
                continue
            own = {key: self.fill(value, context) for key, value in step.get("env", {}).items()}
            files["output"].write_text("")
            files["summary"].write_text("")
            code, log = 0, ""
            if "run" in step:
                shell = step.get("shell", job.get("defaults", {}).get("run", {}).get("shell", "sh"))  # in containers
                files["script"].write_text(self.fill(step["run"], context))
                code, log = self.call([*SHELLS[shell], str(files["script"])], workspace, {**environment, **own}, place)
            elif step["uses"] == "actions/checkout@v4":
                shutil.rmtree(workspace)
                if not self.enter and "git" not in (place / "home/packages").read_text().split():
                    raise ValueError("found no git before the checkout, which then makes no repository")
                # the commit itself, which need not be the last of its branch any more
                self.clone(self.URL, event.sha, event.sha, 1, place, inside=True)
                if os.getuid() == 0:  # the runner's user, which the container's is not
                    for path in (workspace, *workspace.rglob("*")):
                        os.chown(path, 1001, 1001)
            elif step["uses"] == "actions/upload-artifact@v4":
                result.folder = workspace / step["with"]["path"]
                code = 0 if any(result.folder.iterdir()) else 1
            else:
                raise ValueError(f"step {name}: found uses {step['uses']}, which the check does not know")
            result.log += f"--- {name}\n{log}"
            result.summary += files["summary"].read_text()
            result.steps[name] = "failure" if code else "success"
            result.code = result.code or code
            outputs = dict(line.split("=", 1) for line in files["output"].read_text().splitlines())
            context["steps"][step.get("id", f"step{number}")] = {"outcome": result.steps[name], "outputs": outputs}
        return result

    def condition(self, text, context, result):
        text = re.sub(r"^\$\{\{(.*)\}\}$", r"\1", str(text).strip(), flags=re.S)
        calls = {"always": lambda: True, "success": lambda: result.code == 0, "failure": lambda: result.code != 0}
        held = not text or bool(evaluate(text, self.lookup(context), calls))
        return held if re.search(r"\b(always|failure)\(\)", text) else held and result.code == 0

    @staticmethod
    def lookup(context):
        def value(name):
            found = context
            for part in name.split("."):
                if isinstance(found, list):
                    found = [one[part] for one in found if part != "*"] or found
                else:
                    found = found.get(part, "") if isinstance(found, dict) else ""
            return found
        return value

    def fill(self, text, context):
        calls = {"contains": lambda found, wanted: wanted in found}
        return re.sub(r"\$\{\{(.*?)\}\}", lambda m: str(evaluate(m[1], self.lookup(context), calls)), str(text))


class GitLab(Service):
    PROJECT = "https://gitlab.example/group/mechanisms"
    FORK = "https://gitlab.example/stranger/mechanisms"
    READ_ONLY = "https://gitlab-ci-token:job@gitlab.example/group/mechanisms.git"

    def urls(self, event):
        return [self.READ_ONLY, f"https://loopbench:{event.token}@gitlab.example/group/mechanisms.git",
                f"{self.PROJECT}.git"]

    def run(self, event, ref):
        (job,) = self.recipe.values()
        place = self.new_job(event, [f"https://loopbench:{event.token}@gitlab.example/group/mechanisms.git"])
        merge = event.kind == "pull_request"
        environment = {
            "GITLAB_CI": "true", "CI_COMMIT_SHA": event.sha, "CI_DEFAULT_BRANCH": "main",
            "CI_PIPELINE_SOURCE": "merge_request_event" if merge else "push", "CI_COMMIT_REF_NAME": event.branch,
            "CI_PROJECT_ID": "12" if event.fork else "5", "CI_PROJECT_URL": self.FORK if event.fork else self.PROJECT,
            "CI_PROJECT_DIR": str(place / "workspace"), "CI_API_V4_URL": "https://gitlab.example/api/v4",
            **({"LOOPBENCH_TOKEN": event.token} if event.token and not event.fork else {}),
            **({"CI_MERGE_REQUEST_IID": str(event.number), "CI_MERGE_REQUEST_PROJECT_ID": "5",
                "CI_MERGE_REQUEST_PROJECT_URL": self.PROJECT,
                "CI_MERGE_REQUEST_SOURCE_PROJECT_ID": "12" if event.fork else "5",
                "CI_MERGE_REQUEST_LABELS": ",".join(event.labels),
                "CI_MERGE_REQUEST_TARGET_BRANCH_NAME": "main"} if merge else {"CI_COMMIT_BRANCH": event.branch}),
            **job["variables"], **event.variables}
        lookup = lambda name: environment.get(name.removeprefix("$"), "")
        if not any(evaluate(rule["if"], lookup, {}) for rule in job["rules"]):
            raise ValueError(f"no rule starts the job for {event}")
        workspace = self.clone(self.READ_ONLY, ref, event.sha, 20, place, inside=False)
        script = place / "script"
        # as the runner's bash has it: all lines in one shell
        script.write_text("set -eo pipefail\nset +o noclobber\n" + "\n".join(job["before_script"] + job["script"]))
        code, log = self.call(["bash", str(script)], workspace, environment, place)
        kept = job["artifacts"]
        if kept["when"] != "always" or kept["reports"]["junit"] != "loopbench-ci/junit.xml":
            raise ValueError(f"found the artefacts {kept}, expected them always, with the JUnit file")
        return Job(code=code, log=log, summary=log, folder=workspace / kept["paths"][0])
