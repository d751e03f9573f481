// The sentences at a report's head, and its Markdown form.
#include "truth/report_summary.hpp"

#include <fmt/format.h>

#include <cmath>

#include "truth/convergence.hpp"
#include "truth/plot.hpp"
#include "truth/report_plots.hpp"

namespace parian {
namespace {

constexpr int last_target = 2;

/// Two digits.
std::string factor_text(double factor) {
  const double unit = std::pow(10.0, std::floor(std::log10(factor)) - 1);
  return fmt::format("{:.{}f}", std::round(factor / unit) * unit, factor < 9.95 ? 1 : 0);
}

/// As time_text, in words.
std::string in_words(const TimeTo& time) {
  const std::string text = time_text(time.seconds.median);
  return time.extrapolated ? "about " + text + " (extrapolated)" : time.at_first ? "at most " + text : text;
}

/// How often `other` takes as long as `own`.
std::string ratio_text(const TimeTo& other, const TimeTo& own) {
  return fmt::format("{} {} times as long", own.at_first ? "at least" : "about",
                     factor_text(other.seconds.median / own.seconds.median));
}

}  // namespace

std::vector<std::string> summary(const Report& report) {
  const auto at = [&](std::uint32_t c, int target, Against against) {
    return *time_to(report, c, target_errors[target], Timing::wall, against);
  };
  const std::uint32_t ours = report.standard, posters = report.comparisons.front().configurations[1];
  int target = 0;  // the first that tells more than what a gather costs
  while (target < last_target && at(ours, target, Against::sampling).at_first) ++target;
  const TimeTo own = at(ours, target, Against::sampling), other = at(posters, target, Against::sampling);
  std::vector<std::string> sentences;
  sentences.push_back(
      fmt::format("Parian reaches a sampling error of {} after {}. The poster’s method, a uniform disc without "
                  "pyramids, takes {}: {}.",
                  target_names[target], in_words(own), in_words(other), ratio_text(other, own)));
  const TimeTo total = at(ours, last_target, Against::reference);
  sentences.push_back(fmt::format(
      "Its resolution leaves a bias of {} (relMSE). {}", bias_text(report, ours),
      total.never ? std::string("So 0.1 % to the reference is out of reach without larger layers or light maps.")
                  : fmt::format("An error to the reference of 0.1 %, bias included, takes {}.", in_words(total))));
  return sentences;
}

std::string report_markdown(const Report& report) {
  std::string text = fmt::format("## Error against run time: {}\n\n", report.input);
  for (const std::string& sentence : summary(report)) text += sentence + "\n";
  text += fmt::format(
      "\nWall time to a relMSE, median of {} seeds on {} ({}). ≤: at the first checkpoint; ≈: extrapolated at slope "
      "−1.\n\n",
      report.seeds, report.machine.device, report.machine.platform);
  text +=
      "| configuration | sampling 10 % | 1 % | 0.1 % | to the reference 10 % | 1 % | 0.1 % | bias, relMSE |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|\n";
  for (std::uint32_t c = 0; c < report.configurations.size(); ++c) {
    text += "| " + report.configurations[c].name + " |";
    for (const Against against : {Against::sampling, Against::reference})
      for (const double target : target_errors) {
        const auto time = time_to(report, c, target, Timing::wall, against);
        text += fmt::format(" {} |", time ? time_text(*time) : "n/a");
      }
    text += fmt::format(" {} |\n", bias_text(report, c));
  }
  for (const std::string& warning : report.warnings) text += "\nWarning: " + warning + "\n";
  return text;
}

}  // namespace parian
