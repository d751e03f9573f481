// The page: text around plots, tables and pictures.
#include <fmt/format.h>

#include <cmath>

#include "truth/plot.hpp"
#include "truth/report.hpp"
#include "truth/report_plots.hpp"
#include "truth/report_style.hpp"
#include "truth/report_summary.hpp"

namespace parian {
namespace {

std::string paragraph(const std::string& html, const char* of = "") {
  return fmt::format("<p{}>{}</p>\n", *of ? fmt::format(R"( class="{}")", of) : "", html);
}

std::string figure(const std::string& content, const std::string& caption) {
  return "<figure>\n" + content + "<figcaption>" + caption + "</figcaption></figure>\n";
}

std::string head(const Report& r) {
  std::string html =
      R"(<!DOCTYPE html><html xmlns="http://www.w3.org/1999/xhtml" lang="en"><head><meta charset="utf-8"/>)"
      R"(<meta name="viewport" content="width=device-width, initial-scale=1"/>)";
  html += fmt::format("<title>Error against run time: {}</title><style>{}</style></head>\n<body>\n", escaped(r.input),
                      report_style);
  html += fmt::format("<h1>Error against run time</h1>\n");
  html +=
      paragraph(fmt::format("{} · {} · {} triangles · {} light{} · {} × {} pixels, {} of them the object’s · {} · {}",
                            escaped(r.input), escaped(r.material), r.triangles, r.lights, r.lights == 1 ? "" : "s",
                            r.film[0], r.film[1], r.pixels, escaped(r.machine.device), escaped(r.date)),
                "sub");
  html += "<div class=\"lead\">";
  for (const std::string& sentence : summary(r)) html += paragraph(escaped(sentence));
  html += "</div>\n";
  for (const std::string& warning : r.warnings) html += paragraph("Warning: " + escaped(warning), "warning");
  return html;
}

std::string pictures(const Report& r) {
  if (r.pictures.empty()) return {};
  std::string html = "<h2>What it looks like</h2>\n";
  html += paragraph(fmt::format(
      "Every method at the checkpoint whose time is nearest to that of Parian’s last, under one exposure. The signed "
      R"(error is relative, over R, G and B: <span class="nobr">−{0:.0f} %<span class="scale"></span>+{0:.0f} %</span>, )"
      "blue where the picture is too dark.",
      100 * r.difference_scale));
  for (const PictureRow& row : r.pictures) {
    html += fmt::format("<figure><h3>{}</h3><div class=\"pictures\">\n", escaped(row.title));
    for (std::size_t i = 0; i < row.pictures.size(); ++i) {
      const Picture& p = row.pictures[i];
      html += fmt::format(R"(<div{}><img width="{}" height="{}" alt="{}" src="data:image/png;base64,{}"/>{}</div>)",
                          i > 0 && i % 2 == 0 ? R"( class="error")" : "", p.width, p.height,
                          escaped(row.title + ": " + p.caption), p.png, escaped(p.caption));
      html += "\n";
    }
    html += "</div></figure>\n";
  }
  return html;
}

std::string methods(const Report& r) {
  std::string html = "<h2>Sampling error</h2>\n";
  html += figure(
      report_plot(r, 0, Timing::wall, Against::sampling),
      "Distance of each method from its own limit, the picture that it tends to. Lines are medians over " +
          fmt::format("{} seeds, bands reach from the best to the worst seed; ", r.seeds) +
          "dashed lines and hollow marks are without pyramids. The slopes are of error against frames over the last "
          "half of the checkpoints (what a gather adds to every time would steepen them): independent samples "
          "give −1, well-spread ones a steeper one.");
  html += "<h2>Error to the reference</h2>\n";
  html += figure(report_plot(r, 0, Timing::wall, Against::reference),
                 "The same runs against the independent reference. More samples can’t get below the dotted floor: that "
                 "is the bias of the layers’ and the light map’s resolution, measured on the limit.");
  html += "<h2>Time to an error</h2>\n";
  html += paragraph(
      "Errors are relMSE: the mean of squared relative errors, so 10 %, 1 % and 0.1 % stand for 0.1, 0.01 and 0.001 "
      "(root mean squares of 32 %, 10 % and 3.2 %); the bias too is a relMSE.");
  html += time_table(r, 0, Timing::wall);
  html += paragraph(
      "Wall time, median over the seeds, with the fastest and the slowest below. ≤: the first checkpoint was already "
      "there. ≈, in italics: not reached within the run, extrapolated from its last checkpoint with the sampling error "
      "falling as one over the time (slope −1). never: the bias alone is larger. A bias after a &lt; is lost in what "
      "noise limit and reference still have.",
      "note");
  html += "<h2>By kernel time</h2>\n";
  html += paragraph("The same, by the device’s own clock: OpenCL events around every kernel.");
  if (curve(r, r.standard, Timing::kernel, Against::sampling).empty()) {
    return html + paragraph("This device gives no events, so kernel times are not known.");
  }
  html += figure(report_plot(r, 0, Timing::kernel, Against::sampling), "Sampling error against kernel time.");
  return html + time_table(r, 0, Timing::kernel);
}

std::string sweeps(const Report& r) {
  if (r.comparisons.size() < 2) return {};
  std::string html = "<h2>What resolution buys</h2>\n";
  html += paragraph(
      "Parian’s default with one number changed at a time. Solid lines are errors to the reference, dotted ones the "
      "floors that they tend to.");
  for (std::size_t i = 1; i < r.comparisons.size(); ++i) {
    html += fmt::format("<h3>{} (<code>--{}</code>)</h3>\n", escaped(r.comparisons[i].title),
                        escaped(r.comparisons[i].option));
    html += figure(report_plot(r, i, Timing::wall, Against::reference), "");
    html += time_table(r, i, Timing::wall);
  }
  return html;
}

std::string explanations(const Report& r) {
  std::string html = "<h2>Three kinds of error</h2>\n";
  html += paragraph(
      "<strong>Sampling error</strong> is noise, and blur where pyramids show coarse levels. It falls with time, and "
      "it is what Parian estimates and stops at. Here it’s measured against the configuration’s limit: the mean of two "
      "long renders with seeds of their own, whose difference gives the limit’s own variance, which is taken off.");
  html += paragraph(
      "<strong>Bias</strong> comes from the finite size of layers and light map. It stays however long one renders, "
      "and falls with resolution. It’s the limit’s distance from the reference, less both variances.");
  html += paragraph(
      "<strong>Model error</strong> is not on this page. The reference solves the same equations with the same dipole; "
      "how far the dipole is from real light transport, and that the directional one does not conserve energy, is "
      "told in <code>docs/method.md</code>.");
  html += paragraph(
      "relMSE is the mean, over the pixels that the object covers fully and over R, G and B, of (I − R)² / (R² + ε²); "
      "R is the reference and ε a hundredth of its mean.");
  std::string noise = "The reference doesn’t say how noisy it is itself, so nothing is taken off for it.";
  if (r.reference_relmse)
    noise = fmt::format(
        "The reference’s own noise is a relMSE of {}, and is taken off; biases below a tenth "
        "of that and of the limit’s own noise count as not resolved.",
        power_text(*r.reference_relmse));
  return html + paragraph(fmt::format("Reference: {}. {}", escaped(r.reference_name), noise));
}

std::string costs(const Report& r) {
  std::string html = "<h2>What is counted</h2>\n";
  html += paragraph(
      "The time at a checkpoint is that of all frames so far (samples, and light maps drawn again) and of one gather: "
      "the checkpoint’s own, with 64 positions per pixel, reading back and, with pyramids, building them and "
      "choosing "
      "the level. The first choice of a level tries them all, and stays counted. Gathers for earlier checkpoints, "
      "comparing, estimating the bias, loading and writing are not counted; neither are set-up "
      "and compiling, which are told here. Seeds take turns, so that a busy spell hits all configurations alike.");
  html += cost_table(r);
  return html + paragraph(
                    "Set-up is everything between the loaded mesh and the first frame but compiling, which finds the "
                    "driver’s cache warm. The last column holds the renderer’s own estimate of its relMSE at the last "
                    "checkpoint against the sampling error measured there: 1 is a perfect estimate.",
                    "note");
}

std::string machine(const Report& r) {
  const Machine& m = r.machine;
  const auto load = [](const std::array<double, 3>& l) {
    return l[0] < 0 ? std::string("unknown") : fmt::format("{:.2f}, {:.2f}, {:.2f}", l[0], l[1], l[2]);
  };
  std::string html = "<h2>Where and how</h2>\n<dl>";
  const auto row = [&](const char* name, const std::string& value) {
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", name, escaped(value));
  };
  row("Processor", fmt::format("{}, {} cores", m.cpu, m.cores));
  row("Load average", fmt::format("{} before, {} after (1, 5, 15 min)", load(m.load_before), load(m.load_after)));
  row("System", m.system);
  row("Device", fmt::format("{}, {} compute units, {} lanes", m.device, m.compute_units, m.lanes));
  row("Platform", fmt::format("{}, {}", m.platform, m.opencl));
  row("Driver", m.driver);
  row("Version", m.version);
  row("Model", r.model);
  row("This report took", time_text(r.total_seconds));
  html += "</dl>\n<p>To make it again:</p>\n<pre>" + escaped(r.command) + "</pre>\n";
  html += "<p>To render one configuration, with as many frames and as much time as wanted:</p>\n<pre>";
  for (const Configuration& c : r.configurations)
    html += escaped(fmt::format("parian render {} {}{}--error 0 --frames 16 -o picture.exr  # {}", r.scene, c.options,
                                c.options.empty() ? "" : " ", c.name)) +
            "\n";
  html += "parian compare picture.exr reference.exr</pre>\n";
  return html + paragraph(
                    "Beside this page, with the same name, lie <code>.json</code> with all that it’s made of, "
                    "<code>.csv</code> with one row for every seed and checkpoint, and <code>.md</code>, a summary.");
}

}  // namespace

std::string report_html(const Report& report) {
  return head(report) + pictures(report) + methods(report) + sweeps(report) + costs(report) + explanations(report) +
         machine(report) + "</body></html>\n";
}

}  // namespace parian
