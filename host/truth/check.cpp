// Runs what a device is checked by, one result after the other.
#include "truth/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/words.hpp"
#include "plan/plan.hpp"
#include "render/self_test.hpp"
#include "session/program_folder.hpp"
#include "truth/extreme_cases.hpp"
#include "truth/stiff_scenes.hpp"

namespace parian {
namespace {

/// Adds results to a report, timed from the one before.
class Recorder {
 public:
  Recorder(CheckReport& report, const CheckSettings& settings) : report_(report), settings_(settings) {}
  void add(CheckResult result) {
    const auto now = std::chrono::steady_clock::now();
    result.seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    report_.results.push_back(std::move(result));
    settings_.progress(report_.results.back());
  }

 private:
  CheckReport& report_;
  const CheckSettings& settings_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// The device, and the lanes that a render with `model` has there.
struct Judged {
  Judged(const CheckSettings& settings, Model model) : compute(settings.device), program(settings.program) {
    Settings ordinary = ordinary_settings();
    ordinary.model = model;
    const Plan plan = make_plan(ordinary_scene(), ordinary, compute.info());
    keep_programs(compute);
    lanes = plan.lanes;
  }
  Compute compute;
  std::uint32_t lanes = 1;
  const std::string& program;
};

/// What a case comes to; an error that isn't documented is an infinite one that says so.
Finding run_finding(const std::function<Finding(Trial&)>& run, Trial& trial) {
  try {
    return run(trial);
  } catch (const std::exception& error) {
    return {INFINITY, 0, in_command_words(error.what())};
  }
}

/// Judges `cases` by the rule of vector files and adds what came of it.
void add_judgement(CheckReport& report, Recorder& recorder, Judged& judged, const std::vector<VectorCase>& cases,
                   Model model, const std::string& section) {
  const auto m = static_cast<std::size_t>(model);
  const Judgement j = judge(cases, device_bssrdf(judged.compute, cases, model, judged.lanes, judged.program), model);
  if (j.cases == 0) return;
  CheckResult result{section, model_names[m], "", "", j.worst_of_tol, 1, j.passed(), 0};
  result.outcome = fmt::format("{} pairs within tol, median {:.0e}, 99.9 % {:.0e}", j.cases, Judgement::median_limit,
                               Judgement::p999_limit);
  result.found =
      fmt::format("median {:.2g}, 99.9 % {:.2g}, worst {:.2g} of itself", j.median, j.p999, j.worst_relative);
  VectorCase worst = cases[j.worst];
  if (j.outside > 0)
    result.found +=
        fmt::format("; {} outside tol, {} of them not finite or negative, worst '{}'", j.outside, j.bad, worst.name);
  for (std::size_t i = 0; i < models.size(); ++i)
    if (!std::isnan(worst.S[i]) && std::isnan(worst.tol[i])) worst.tol[i] = tolerance(worst, models[i]);
  report.worst.push_back(worst);
  recorder.add(result);
}

}  // namespace

bool CheckReport::passed() const {
  return !results.empty() && std::all_of(results.begin(), results.end(), [](const auto& r) { return r.passed; });
}

CheckReport check_device(const CheckSettings& settings) {
  CheckReport report;
  report.seed = settings.seed;
  Recorder recorder(report, settings);
  const std::vector<VectorCase> cases = random_vectors(settings.random_cases, settings.seed);
  for (const Model model : models) {
    Judged judged(settings, model);
    if (model == models.front()) {
      report.device = judged.compute.info();
      for (const SelfTestAnswer& a : self_test(judged.compute, model, judged.lanes, settings.program))
        recorder.add({"self-test", a.name, "the known answer", a.found, 0, 0, a.passed, 0});
    }
    add_judgement(report, recorder, judged, cases, model, "random");
  }
  if (!settings.scenes) return report;
  Trial trial(settings.device);
  for (const ExtremeCase& c : extreme_cases()) {
    const Finding f = run_finding(c.run, trial);
    recorder.add({c.kind, c.name, c.outcome, f.what, f.error, f.allowed, f.passed(), 0});
  }
  for (const StiffScene& scene : stiff_scenes()) {
    const Finding f = run_finding(scene.run, trial);
    recorder.add({"scene", scene.name, scene.outcome, f.what, f.error, f.allowed, f.passed(), 0});
  }
  return report;
}

CheckReport check_vectors(const CheckSettings& settings, const std::vector<VectorCase>& cases) {
  CheckReport report;
  report.seed = settings.seed;
  Recorder recorder(report, settings);
  for (const Model model : models) {
    Judged judged(settings, model);
    report.device = judged.compute.info();
    add_judgement(report, recorder, judged, cases, model, "vectors");
  }
  return report;
}

}  // namespace parian
