"""Jobs of tools/suites: a command each, or some cases of a program made with GoogleTest; how they are run side by side,
and what is told of them."""
import os
import pathlib
import re
import shutil
import subprocess
import threading
import time
from xml.etree import ElementTree

ROOT = pathlib.Path(__file__).resolve().parent.parent
ANSI = re.compile(r"\x1b\[[0-9;]*m")


class Case:
    def __init__(self, name, seconds, outcome, why=""):
        self.name, self.seconds, self.outcome, self.why = name, seconds, outcome, why


class Job:
    """A command, and what its output says of its cases: by itself it is one."""

    def __init__(self, name, command, env=None, cases=None, after=None, lock=None, limit=600):
        self.name, self.command, self.env, self.limit = name, command, env or {}, limit
        self.after, self.lock = after, lock
        self.cases = cases or self.one
        self.started = self.seconds = 0.0
        self.found, self.output = None, ""

    def one(self, code, output):
        skipped = re.search(r"^skipped: (.*)", output, re.M) if code == 0 else None
        outcome = "skipped" if skipped else "passed" if code == 0 else "failed"
        return [Case(self.name, self.seconds, outcome, skipped.group(1) if skipped else "")]

    def run(self, env):
        self.started = time.monotonic()
        if not shutil.which(self.command[0]):
            self.found = self.cases(127, f"{self.command[0]} isn't there")
            return
        process = subprocess.Popen(self.command, env={**env, **self.env}, cwd=ROOT, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
        timer = threading.Timer(self.limit, lambda: os.killpg(process.pid, 9))
        timer.start()
        self.output = ANSI.sub("", process.stdout.read().decode(errors="replace"))
        code = process.wait()
        timer.cancel()
        self.seconds = time.monotonic() - self.started
        self.found = self.cases(code, self.output)


class Suite(Job):
    """Cases of a program made with GoogleTest, told from what it prints, so that one that dies in the middle counts."""

    def __init__(self, device, program, filters, wanted, command=(), env=None, check=None, name=None, **more):
        super().__init__(name or f"{filters[0].split('.')[0].strip('*')} on {device}",
                         [*command, str(program), "--gtest_filter=" + ":".join(filters)], env, self.read, **more)
        self.device, self.program, self.filters, self.wanted, self.check = device, program, filters, wanted, check

    def read(self, code, output):
        found = []
        if self.wanted is None:  # what was built by a job before
            try:
                self.wanted = sum(listed(self.program, self.filters).values(), [])
            except (OSError, subprocess.CalledProcessError):
                self.wanted = [self.name]
        ended = r"^\[ *(OK|FAILED|SKIPPED) *\] ([^\s,]+).*\((\d+) ms\)$"
        started = {m.group(1): m.start() for m in re.finditer(r"^\[ RUN +\] (\S+)", output, re.M)}
        for m in re.finditer(ended, output, re.M):
            outcome = {"OK": "passed", "FAILED": "failed", "SKIPPED": "skipped"}[m.group(1)]
            said = output[started[m.group(2)]:m.start()]
            why = re.search(r": Skipped\n(.*)", said)
            found.append(Case(f"{m.group(2)} on {self.device}", int(m.group(3)) / 1000, outcome,
                              why.group(1) if outcome == "skipped" and why else said))
        told = {case.name for case in found}
        for name in self.wanted:
            if f"{name} on {self.device}" not in told:
                found.append(Case(f"{name} on {self.device}", 0.0, "failed",
                                  output[started[name]:] if name in started else f"didn't run: {output[-2000:]}"))
        if code != 0 and not any(case.outcome == "failed" for case in found):
            found.append(Case(f"{self.name}, its end", 0.0, "failed", f"exit code {code}\n{output[-2000:]}"))
        if self.check and (said := self.check(output)):
            found.append(Case(f"{self.name}, its log", 0.0, "failed", said))
        return found


def listed(program, filters):
    """Names of cases by suite."""
    text = subprocess.run([str(program), "--gtest_list_tests", "--gtest_filter=" + ":".join(filters)],
                          capture_output=True, text=True, check=True).stdout
    suites, suite = {}, ""
    for line in text.splitlines():
        name = line.split("#")[0].strip()
        if not line.startswith(" "):
            suite = name
        elif not suite.startswith("DISABLED") and not name.startswith("DISABLED"):
            suites.setdefault(suite, []).append(suite + name)
    return suites


def in_environment(script, *arguments):
    """Runs a line of bash that knows what tools/environment.sh does."""
    return subprocess.run(["bash", "-c", '. "$0"; ' + script, str(ROOT / "tools/environment.sh"), *arguments],
                          capture_output=True, text=True)


def lacked(package, there):
    """Why what needs a package is skipped: nothing where it is there, or could be and isn't."""
    return "" if there or in_environment('lacks "$1"', package).returncode else f"this system has no {package}"


def skipped(name, why):
    return Job(name, ["echo", f"skipped: {why}"])


def run_all(jobs, build):
    """As many at once as there are processors; of jobs with the same lock one at a time: those that fill PoCL's cache
    of kernels, which processes can't share while it is cold. Others have caches of their own."""
    workers = os.cpu_count() or 1
    left, held, lock = list(jobs), set(), threading.Condition()

    def next_job():
        with lock:
            while left:
                for i, job in enumerate(left):
                    if (job.after is None or job.after.found is not None) and job.lock not in held:
                        if job.lock:
                            held.add(job.lock)
                        return left.pop(i)
                lock.wait()
        return None

    def work(slot):
        while job := next_job():
            cache = str(build / "pocl-cache" / (job.lock or str(slot)))
            job.run({**os.environ, "PARIAN_CACHE": "0", "POCL_CACHE_DIR": cache})
            with lock:
                held.discard(job.lock)
                lock.notify_all()
                bad = [case for case in job.found if case.outcome == "failed"]
                print(f"{job.seconds:7.1f} s  {job.name}: {len(job.found)} run, {len(bad)} failed", flush=True)
                for case in bad:
                    print(f"--- {case.name} failed\n{(case.why or job.output)[-6000:]}\n---", flush=True)

    threads = [threading.Thread(target=work, args=(slot,)) for slot in range(workers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def report(cases, build):
    """The slowest, what was skipped and why, and how many ran; all cases in tests.xml."""
    top = ElementTree.Element("testsuite", name="parian", tests=str(len(cases)))
    for case in cases:
        element = ElementTree.SubElement(top, "testcase", name=case.name, time=f"{case.seconds:.3f}")
        if case.outcome != "passed":
            text = "".join(c if c.isprintable() or c in "\n\t" else "?" for c in case.why)
            ElementTree.SubElement(element, {"failed": "failure"}.get(case.outcome, case.outcome), message=text[:4000])
    ElementTree.ElementTree(top).write(build / "tests.xml")

    print("\nThe ten slowest cases:")
    for case in sorted(cases, key=lambda case: -case.seconds)[:10]:
        print(f"{case.seconds:7.1f} s  {case.name}")
    for title in ("skipped", "failed"):
        some = [case for case in cases if case.outcome == title]
        if some:
            print(f"\n{title.capitalize()}:")
        for case in some:
            print(f"  {case.name}" + (f": {case.why}" if title == "skipped" else ""))
    return [sum(case.outcome == outcome for case in cases) for outcome in ("passed", "failed", "skipped")]
