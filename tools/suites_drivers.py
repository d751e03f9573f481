"""Jobs of tools/suites that hold implementations of OpenCL against one another."""
import pathlib
import re
import shutil
import subprocess

from suites_run import ROOT, Case, Job, Suite, in_environment, lacked, listed, skipped

OF_INTEL = "Intel(R) OpenCL"
# A picture on a driver ($1) that keeps no programs, compiled and from Parian's cache, beside another driver's ($2).
KEPT_PROGRAMS = """set -e
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for name in 1 2 3; do
  device=$1
  if ((name == 3)); then device=$2; fi
  PARIAN_CACHE=$work/programs "$0" render meshes/torus.ply --size 64x64 --layers 6 --layer-size 48 --error 0 --frames 2 \\
    --device "$device" --quiet -o "$work/$name.exr" --stats "$work/$name.json"
done
grep '"compile"' "$work"/[12].json
cmp "$work/1.exr" "$work/2.exr"
"$0" compare "$work/1.exr" "$work/3.exr" --max-relmse 0"""


class Oclgrind:
    """Runs under Oclgrind, whose exit code says nothing: what it has to say is in its log and among the output."""

    def __init__(self, work):
        self.work, self.count = work, 0

    def command(self):
        self.count += 1
        log = self.work / f"oclgrind-{self.count}.log"
        log.unlink(missing_ok=True)
        def check(output):
            said = log.read_text(errors="replace") if log.exists() else ""
            return said + "".join(re.findall(r"^(?:OCLGRIND |Oclgrind - ).*(?:\n.*){0,12}", output, re.M))
        return ["oclgrind", "--check-api", "--data-races", "--max-errors", "100", "--log", str(log)], check


def intel_runtime(build):
    """The folder that registers Intel's runtime, which PyPI packages; or why it can't be had."""
    got = subprocess.run([str(ROOT / "tools/intel-runtime"), str(build / "intel-runtime")], capture_output=True,
                         text=True)
    return (got.stdout.strip(), "") if got.returncode == 0 else ("", got.stderr.strip())


class Drivers:
    """What is registered for a run, in a folder of `work`, and why what isn't is not."""

    def __init__(self, build, work, mode):
        self.work = work
        vendors = work / "vendors"
        shutil.rmtree(vendors, ignore_errors=True)
        vendors.mkdir(parents=True)
        # As the ICD loader finds them, beside Mesa's platform without a device. Oclgrind comes without such a file.
        for name in ("pocl", "rusticl", "mesa"):
            shutil.copy(f"/etc/OpenCL/vendors/{name}.icd", vendors)
        self.no_oclgrind = lacked("oclgrind", shutil.which("oclgrind"))
        self.devices = ["Portable", "rusticl"]
        if not self.no_oclgrind:
            home = pathlib.Path(shutil.which("oclgrind")).parent.parent
            (vendors / "oclgrind.icd").write_text(f"{home}/lib/oclgrind/liboclgrind-rt-icd.so\n")
            self.devices += ["Oclgrind"]
        intel, self.no_intel = intel_runtime(build)
        if intel:
            shutil.copy(f"{intel}/intel.icd", vendors)
            self.devices += [OF_INTEL]
        self.on_intel = mode != "test" and intel
        self.all = {"OCL_ICD_VENDORS": str(vendors), "RUSTICL_ENABLE": "llvmpipe"}

    def env(self, device):
        return {**self.all, "PARIAN_DEVICE": device}


def kernel_jobs(tests, tool, drivers, oclgrind, mode):
    """The kernels' tests on each implementation, and all of them against one another."""
    kernels = in_environment('printf %s "$kernel_tests"').stdout
    jobs = []
    # The smallest light map alone; guides there are too coarse for what they gain, and the same as PoCL's by Drivers.
    for suite, cases in listed(tests, [kernels, "*LightMap.*/0", "*LightMap.*/1", "*GuidesOf.Strips*"]).items():
        if drivers.no_oclgrind:
            jobs.append(skipped(f"{suite}* on Oclgrind", drivers.no_oclgrind))
            continue
        command, check = oclgrind.command()
        jobs.append(Suite("Oclgrind", tests, cases, cases, command, {"PARIAN_DEVICE": "Oclgrind"}, check, limit=900))
    # Compiling takes llvmpipe longest, minutes with Debian 13's, of wide kernels above all: of each estimator, one narrow
    # and one wide form.
    narrow = [kernels, "*/nearest_4*", "*/nearest_16*", "*/disc_16*", "*/own_sums_16*"]
    for cases in listed(tests, narrow).values():
        jobs.append(Suite("rusticl", tests, cases, cases, (), drivers.env("rusticl"), limit=1800))
    for cases in listed(tests, [kernels]).values() if mode == "drivers" else ():
        jobs.append(Suite("PoCL", tests, cases, cases, (), drivers.env("Portable")))
    for cases in listed(tests, [kernels]).values() if drivers.on_intel else ():
        jobs.append(Suite("Intel's runtime", tests, cases, cases, (), drivers.env(OF_INTEL)))
    if drivers.on_intel:  # the reference, and so Embree, in one process with the runtime
        kept = {"PARIAN_CACHE": str(drivers.work / "intel-programs")}  # its renders would each compile for 15 s anew
        jobs.append(Job("parian check on Intel's runtime", [str(tool), "check", "--device", OF_INTEL],
                        {**drivers.all, **kept}))
        jobs.append(Job("kept programs of Intel's runtime", ["bash", "-c", KEPT_PROGRAMS, str(tool), OF_INTEL, "Portable"],
                        drivers.all))
    if drivers.no_intel:
        jobs.append(skipped("Intel's runtime", drivers.no_intel))
    for cases in listed(tests, ["Drivers.*"]).values():
        compared = [device for device in drivers.devices if drivers.on_intel or device != OF_INTEL]
        jobs.append(Suite("all drivers", tests, cases, cases, (),
                          {**drivers.all, "PARIAN_TEST_DEVICES": ",".join(compared)}, limit=1800))
    return jobs


def mistake_jobs(tests, drivers, oclgrind):
    """Oclgrind does report mistakes: otherwise its silence says nothing."""
    for mistake, says in (("WriteOutOfBounds", "Invalid write"), ("Race", "data race")):
        name = f"Mistakes.{mistake} is reported by Oclgrind"
        if drivers.no_oclgrind:
            yield skipped(name, drivers.no_oclgrind)
            continue
        command, check = oclgrind.command()
        def judged(code, output, check=check, says=says, name=name):
            return [Case(name, 0.0, "passed" if says in check(output) else "failed", output)]
        yield Job(f"mistake {mistake}", [*command, str(tests), "--gtest_also_run_disabled_tests",
                                        f"--gtest_filter=DISABLED_Mistakes.{mistake}"],
                  {"PARIAN_DEVICE": "Oclgrind"}, judged)


def sound(name, count):
    """Judges what `parian devices` says: so many devices whose self-test passed."""
    def judged(code, output):
        passed = code == 0 and output.count("\n    self-test passed") == count
        return [Case(name, 0.0, "passed" if passed else "failed", output)]
    return judged


def driver_jobs(build, work, mode):
    """The kernels' tests on each implementation, all of them against one another, and what the tool says of them. On
    Intel's runtime, which compiles anew in each process, the tool alone but for deep and drivers."""
    tests, tool = build / "parian-tests", build / "parian"
    drivers, oclgrind = Drivers(build, work, mode), Oclgrind(work)
    jobs = kernel_jobs(tests, tool, drivers, oclgrind, mode) + [*mistake_jobs(tests, drivers, oclgrind)]
    count = len(drivers.devices)
    jobs.append(Job("parian devices", [str(tool), "devices"], drivers.all,
                    sound(f"'parian devices' lists {count} sound ones", count)))
    alone = "a device that keeps no two work-items together is sound"
    jobs.append(skipped(alone, drivers.no_oclgrind) if drivers.no_oclgrind else
                Job("groups of one", ["oclgrind", "--max-wgsize", "1", str(tool), "devices"], {}, sound(alone, 1)))
    return jobs
