// From the data to curves and rows.
#include "truth/report_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "truth/plot.hpp"

namespace parian {
namespace {

/// Colours that stay apart for the colour-blind (Okabe and Ito), dark enough for text on white: one for each method,
/// and for sizes from small to large.
constexpr const char* method_colours[] = {"#c04a00", "#a8437f", "#0072b2"};
constexpr const char* size_colours[] = {"#a06a00", "#0072b2", "#4b2a85", "#111111"};
constexpr Marker markers[] = {Marker::square, Marker::triangle, Marker::circle, Marker::diamond};

/// A method's name, or a size.
std::string short_name(const Report& report, const Comparing& comparing, std::size_t place) {
  const std::uint32_t c = comparing.configurations[place];
  if (comparing.values.empty()) return report.configurations[c].name;
  return fmt::format("{}{}", comparing.values[place], c == report.standard ? " (default)" : "");
}

PlotSeries series_of(const Report& report, const Comparing& comparing, std::size_t place, Timing clock,
                     Against against) {
  const std::uint32_t configuration = comparing.configurations[place];
  const bool methods = comparing.option.empty();
  PlotSeries s;
  s.name = short_name(report, comparing, place);
  s.colour = methods ? method_colours[place / 2 % 3] : size_colours[place % 4];
  s.marker = markers[(methods ? place / 2 : place) % 4];
  s.dashed = methods && place % 2 == 1;
  s.bold = configuration == report.standard;
  const auto points = curve(report, configuration, clock, against);
  for (const CurvePoint& p : points)
    s.points.push_back({p.seconds.median, p.error.low, p.error.median, p.error.high,
                        fmt::format("{}: {} frames, {}, relMSE {} ({} to {})",
                                    report.configurations[configuration].name, p.frames, time_text(p.seconds.median),
                                    power_text(p.error.median), power_text(p.error.low), power_text(p.error.high))});
  if (against == Against::sampling) {
    if (const auto k = slope(points)) s.note = fmt::format("slope {}{:.2f}", *k < 0 ? "−" : "", std::abs(*k));
  } else if (const double bias = resolved_bias(report, configuration); bias > 0 && (!methods || s.bold)) {
    s.floor = bias;  // of the methods only Parian's own: the others' share it
    s.note = fmt::format("floor {}", power_text(bias));
  }
  return s;
}

std::string cell(const std::optional<TimeTo>& time, bool first) {
  const char* open = first ? R"(<td class="first">)" : "<td>";
  if (!time) return fmt::format("{}n/a</td>", open);
  std::string text = time_text(*time);
  if (time->never || time->extrapolated) text = fmt::format(R"(<span class="far">{}</span>)", text);
  const std::string low = time_text(time->seconds.low), high = time_text(time->seconds.high);
  if (!time->never && low != high) text += fmt::format("<small>{} – {}</small>", low, high);
  return open + text + "</td>";
}

std::string spread_cell(std::vector<double> seconds) {
  const Spread s = spread(std::move(seconds));
  return fmt::format("<td>{}<small>{} – {}</small></td>", time_text(s.median), time_text(s.low), time_text(s.high));
}

}  // namespace

std::string report_plot(const Report& report, std::size_t comparison, Timing clock, Against against) {
  const Comparing& comparing = report.comparisons[comparison];
  Plot plot;
  plot.x_label = clock == Timing::wall ? "wall time, s" : "kernel time, s";
  plot.y_label = against == Against::reference ? "relMSE to the reference" : "sampling error, relMSE";
  plot.title = fmt::format("{}: {} against {}", comparing.title, plot.y_label, plot.x_label);
  if (!comparing.option.empty()) plot.height = 330;
  for (std::size_t i = 0; i < comparing.configurations.size(); ++i)
    plot.series.push_back(series_of(report, comparing, i, clock, against));
  // What matters most is drawn last.
  std::stable_sort(plot.series.begin(), plot.series.end(),
                   [](const PlotSeries& a, const PlotSeries& b) { return a.bold < b.bold; });
  return plot_svg(plot);
}

std::string time_table(const Report& report, std::size_t comparison, Timing clock) {
  const Comparing& comparing = report.comparisons[comparison];
  std::string html = fmt::format(
      R"(<div class="scroll"><table><thead><tr class="group"><th></th><th colspan="3" class="first">to a sampling )"
      R"(error of</th><th colspan="3" class="first">to an error to the reference of</th><th class="first"></th></tr>)"
      R"(<tr><th>{}</th>)",
      escaped(comparing.option.empty() ? "method" : comparing.title));
  for (int group = 0; group < 2; ++group)
    for (int i = 0; i < 3; ++i) html += fmt::format(R"(<th{}>{}</th>)", i ? "" : R"( class="first")", target_names[i]);
  html += R"(<th class="first">bias</th></tr></thead><tbody>)";
  for (std::size_t place = 0; place < comparing.configurations.size(); ++place) {
    const std::uint32_t c = comparing.configurations[place];
    html += fmt::format(R"(<tr{}><td>{}</td>)", c == report.standard ? R"( class="ours")" : "",
                        escaped(short_name(report, comparing, place)));
    for (const Against against : {Against::sampling, Against::reference})
      for (int i = 0; i < 3; ++i) html += cell(time_to(report, c, target_errors[i], clock, against), i == 0);
    html += fmt::format(R"(<td class="first">{}</td></tr>)", escaped(bias_text(report, c)));
  }
  return html + "</tbody></table></div>";
}

std::optional<FrameCost> frame_cost(const Report& report, std::uint32_t configuration) {
  const auto points = curve(report, configuration, Timing::wall, Against::sampling);
  if (points.size() < 2) return std::nullopt;
  const CurvePoint &first = points.front(), &last = points.back();
  FrameCost cost;
  cost.frame = std::max(0.0, (last.seconds.median - first.seconds.median) / (last.frames - first.frames));
  cost.gather = std::max(0.0, first.seconds.median - cost.frame * first.frames);
  return cost;
}

std::string cost_table(const Report& report) {
  std::string html =
      R"(<div class="scroll"><table><thead><tr><th>configuration</th><th>set-up</th><th>compiling</th><th>a frame</th>)"
      R"(<th>a gather</th><th>evaluations a frame</th><th>kernel share</th><th>own estimate / measured</th></tr></thead><tbody>)";
  for (std::uint32_t c = 0; c < report.configurations.size(); ++c) {
    std::vector<double> setup, compile, ratio, share;
    double evaluations = 0;
    for (const ReportRun& run : report.runs) {
      if (run.configuration != c || run.checkpoints.empty()) continue;
      setup.push_back(run.setup_seconds);
      compile.push_back(run.compile_seconds);
      const Checkpoint& last = run.checkpoints.back();
      evaluations = last.evaluations / last.frames;
      if (last.estimated_relmse && last.sampling_relmse > 0)
        ratio.push_back(*last.estimated_relmse / last.sampling_relmse);
      if (last.kernel_seconds) share.push_back(*last.kernel_seconds / last.seconds);
    }
    if (setup.empty()) continue;
    const auto cost = frame_cost(report, c);
    html += fmt::format(R"(<tr{}><td>{}</td>{}{}<td>{}</td><td>{}</td><td>{:.3g} M</td><td>{}</td><td>{}</td></tr>)",
                        c == report.standard ? R"( class="ours")" : "", escaped(report.configurations[c].name),
                        spread_cell(setup), spread_cell(compile), cost ? time_text(cost->frame) : "n/a",
                        cost ? time_text(cost->gather) : "n/a", 1e-6 * evaluations,
                        share.empty() ? "n/a" : fmt::format("{:.0f} %", 100 * spread(share).median),
                        ratio.empty() ? "n/a"
                                      : fmt::format("{:.2f}<small>{:.2f} – {:.2f}</small>", spread(ratio).median,
                                                    spread(ratio).low, spread(ratio).high));
  }
  return html + "</tbody></table></div>";
}

}  // namespace parian
