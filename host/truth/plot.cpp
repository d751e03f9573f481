// Drawing with logarithmic axes.
#include "truth/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace parian {
namespace {

constexpr double left = 66, top = 14, bottom = 48;  // margins, CSS pixels
constexpr double label_gap = 14;                    // between the frame and the names on its right
constexpr double letter_width = 6.7;                // of a name, at most on average
constexpr double line_height = 15.5;                // between names
constexpr double most_decades = 7;                  // of the error axis; what lies below is cut

/// A logarithmic axis over [low, high], from pixel `begin` to `end`.
struct Axis {
  double low = 0, high = 0, begin = 0, end = 0;
  [[nodiscard]] double at(double value) const {
    const double share = std::log(std::clamp(value, low, high) / low) / std::log(high / low);
    return begin + share * (end - begin);
  }
};

bool drawable(const PlotPoint& p) { return p.x > 0 && p.y > 0 && std::isfinite(p.x) && std::isfinite(p.y); }

/// Widens a range to multiples of 1, 2, 5 (times) or 1 (errors) times powers of ten.
double rounded(double value, bool up, bool decades) {
  const double power = std::pow(10.0, std::floor(std::log10(value) + (up ? -1e-9 : 1e-9)));
  const double digits = value / power;
  if (decades) return up ? 10 * power : power;
  if (up) return power * (digits <= 2 ? 2 : digits <= 5 ? 5 : 10);
  return power * (digits >= 5 ? 5 : digits >= 2 ? 2 : 1);
}

struct Frame {
  Axis x, y;
};

/// Letters of UTF-8 text.
std::size_t letters(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0U) != 0x80U; }));
}

double label_width(const Plot& plot) {
  std::size_t longest = 0;
  for (const PlotSeries& s : plot.series) longest = std::max(longest, letters(s.name) + letters(s.note) + 1);
  return letter_width * static_cast<double>(longest);
}

Frame frame_of(const Plot& plot) {
  double x0 = INFINITY, x1 = 0, y0 = INFINITY, y1 = 0;
  for (const PlotSeries& s : plot.series) {
    for (const PlotPoint& p : s.points) {
      if (!drawable(p)) continue;
      x0 = std::min(x0, p.x), x1 = std::max(x1, p.x);
      y0 = std::min(y0, p.low > 0 ? p.low : p.y), y1 = std::max(y1, p.high);
    }
    if (s.floor && *s.floor > 0) y0 = std::min(y0, *s.floor), y1 = std::max(y1, *s.floor);
  }
  if (!(x0 < INFINITY)) x0 = x1 = y0 = y1 = 1;
  y0 = std::max(y0, y1 * std::pow(10.0, -most_decades));
  Frame f;
  f.x = {rounded(x0 / 1.1, false, false), rounded(x1 * 1.1, true, false), left,
         plot.width - label_gap - label_width(plot)};
  f.y = {rounded(y0 / 1.2, false, true), rounded(y1, true, true), plot.height - bottom, top};
  return f;
}

std::string number_text(double value) { return fmt::format("{:.6g}", value); }

/// `from`, ten times that, and so on up to `to`.
std::vector<double> decades_of(double from, double to) {
  std::vector<double> decades;
  while (from <= to) {
    decades.push_back(from);
    from *= 10;
  }
  return decades;
}

std::string grid(const Plot& plot, const Frame& f) {
  std::string svg = R"(<g class="grid" stroke="#e2e2e2" stroke-width="1">)";
  std::string labels = R"(<g class="ticks" font-size="12" fill="#333">)";
  for (const double decade : decades_of(f.y.low, f.y.high * 1.001)) {
    const double y = f.y.at(decade);
    svg += fmt::format(R"(<path d="M{:.1f} {:.1f}H{:.1f}"/>)", f.x.begin, y, f.x.end);
    labels += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>)", f.x.begin - 8, y + 4,
                          power_text(decade));
  }
  const double decades = std::log10(f.x.high / f.x.low);
  for (const double decade : decades_of(std::pow(10.0, std::floor(std::log10(f.x.low) + 1e-9)), f.x.high))
    for (const int digit : {1, 2, 5}) {
      const double value = digit * decade;
      if (value < f.x.low * 0.999 || value > f.x.high * 1.001) continue;
      const double x = f.x.at(value);
      svg += fmt::format(R"(<path d="M{:.1f} {:.1f}V{:.1f}"/>)", x, f.y.begin, f.y.end);
      if (digit == 1 || decades < 3.5)
        labels += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)", x, f.y.begin + 18,
                              number_text(value));
    }
  svg += "</g>" + labels + "</g>";
  svg += fmt::format(R"(<path d="M{0:.1f} {1:.1f}V{2:.1f}H{3:.1f}" fill="none" stroke="#555"/>)", f.x.begin, f.y.end,
                     f.y.begin, f.x.end);
  svg += fmt::format(R"(<text x="{:.1f}" y="{}" text-anchor="middle">{}</text>)", 0.5 * (f.x.begin + f.x.end),
                     plot.height - 10, escaped(plot.x_label));
  const double middle = 0.5 * (f.y.begin + f.y.end);
  svg += fmt::format(
      R"svg(<text x="16" y="{0:.1f}" text-anchor="middle" transform="rotate(-90 16 {0:.1f})">{1}</text>)svg", middle,
      escaped(plot.y_label));
  return svg;
}

/// A right triangle whose long side falls by one decade of error per decade of time.
std::string guide(const Frame& f) {
  const double width = std::min(1.0, 0.2 * std::log10(f.x.high / f.x.low)), factor = std::pow(10.0, width);
  const double x0 = f.x.at(f.x.low * 1.15), x1 = f.x.at(f.x.low * 1.15 * factor);
  const double y1 = f.y.at(f.y.low * 1.6), y0 = f.y.at(f.y.low * 1.6 * factor);
  return fmt::format(R"(<path d="M{0:.1f} {1:.1f}L{2:.1f} {3:.1f}H{0:.1f}Z" fill="#f1f1f1" stroke="#888"/>)", x0, y0,
                     x1, y1) +
         fmt::format(R"(<text x="{:.1f}" y="{:.1f}" font-size="12" fill="#555">slope −1</text>)", x1 + 5, y1);
}

std::string marker(Marker kind, double x, double y, double size) {
  switch (kind) {
    case Marker::circle:
      return fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}">)", x, y, size);
    case Marker::square:
      return fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}">)", x - 0.9 * size,
                         y - 0.9 * size, 1.8 * size, 1.8 * size);
    case Marker::triangle:
      return fmt::format(R"(<path d="M{:.1f} {:.1f}l{:.1f} {:.1f}h{:.1f}Z">)", x, y - 1.2 * size, 1.15 * size,
                         2.0 * size, -2.3 * size);
    case Marker::diamond:
      return fmt::format(R"(<path d="M{0:.1f} {1:.1f}l{2:.1f} {2:.1f}l-{2:.1f} {2:.1f}l-{2:.1f} -{2:.1f}Z">)", x,
                         y - 1.3 * size, 1.3 * size);
  }
  return {};
}

const char* marker_end(Marker kind) {
  return kind == Marker::circle ? "</circle>" : kind == Marker::square ? "</rect>" : "</path>";
}

std::string curve_svg(const PlotSeries& s, const Frame& f) {
  std::string line, above, below, marks;
  for (const PlotPoint& p : s.points) {
    if (!drawable(p)) continue;
    const double x = f.x.at(p.x), y = f.y.at(p.y);
    line += fmt::format("{}{:.1f} {:.1f}", line.empty() ? "M" : "L", x, y);
    above += fmt::format("{}{:.1f} {:.1f}", above.empty() ? "M" : "L", x, f.y.at(p.high));
    below.insert(0, fmt::format("L{:.1f} {:.1f}", x, f.y.at(std::max(p.low, f.y.low))));
    marks +=
        marker(s.marker, x, y, s.bold ? 4.2 : 3.4) + "<title>" + escaped(p.title) + "</title>" + marker_end(s.marker);
  }
  std::string svg = fmt::format("<g><title>{}</title>", escaped(s.name));
  if (s.floor && *s.floor > 0)
    svg += fmt::format(R"(<path d="M{:.1f} {:.1f}H{:.1f}" stroke="{}" stroke-width="1.2" stroke-dasharray="1.5 3"/>)",
                       f.x.begin, f.y.at(*s.floor), f.x.end, s.colour);
  if (!line.empty()) {
    svg += fmt::format(R"(<path d="{}{}Z" fill="{}" fill-opacity="0.14"/>)", above, below, s.colour);
    svg += fmt::format(R"(<path d="{}" fill="none" stroke="{}" stroke-width="{}"{}/>)", line, s.colour,
                       s.bold ? 2.6 : 1.7, s.dashed ? R"( stroke-dasharray="6 3.5")" : "");
    svg += fmt::format(R"(<g fill="{}" stroke="{}" stroke-width="1.4">{}</g>)", s.dashed ? "#fff" : s.colour, s.colour,
                       marks);
  }
  return svg + "</g>";
}

/// A name, where its curve ends and where it's written.
struct Label {
  const PlotSeries* series;
  double x, y, written;
};

/// Moves names apart, each as little as the others allow, and keeps them within the plot.
void spread_labels(std::vector<Label>& labels, double highest, double lowest) {
  std::stable_sort(labels.begin(), labels.end(), [](const Label& a, const Label& b) { return a.y < b.y; });
  for (int round = 0; round < 100; ++round) {
    for (std::size_t i = 1; i < labels.size(); ++i) {
      const double overlap = labels[i - 1].written + line_height - labels[i].written;
      if (overlap <= 0) continue;
      labels[i - 1].written -= 0.5 * overlap;
      labels[i].written += 0.5 * overlap;
    }
    for (Label& label : labels) label.written = std::clamp(label.written, highest, lowest);
  }
}

std::string names(const Plot& plot, const Frame& f) {
  std::vector<Label> labels;
  for (const PlotSeries& s : plot.series)
    for (std::size_t i = s.points.size(); i-- > 0;)
      if (drawable(s.points[i])) {
        const double y = f.y.at(s.points[i].y);
        labels.push_back({&s, f.x.at(s.points[i].x), y, y});
        break;
      }
  spread_labels(labels, top + 6, f.y.begin - 4);
  std::string svg = R"(<g class="names" font-size="12.5">)";
  for (const Label& label : labels) {
    const double x = f.x.end + label_gap;
    svg += fmt::format(R"(<path d="M{:.1f} {:.1f}L{:.1f} {:.1f}" stroke="{}" stroke-width="0.8" opacity="0.55"/>)",
                       label.x + 6, label.y, x - 3, label.written, label.series->colour);
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" fill="{}"{}>{})", x, label.written + 4, label.series->colour,
                       label.series->bold ? R"( font-weight="600")" : "", escaped(label.series->name));
    if (!label.series->note.empty())
      svg += fmt::format(R"(<tspan dx="4" fill="#555" font-weight="400">{}</tspan>)", escaped(label.series->note));
    svg += "</text>";
  }
  return svg + "</g>";
}

std::string superscript(int n) {
  static constexpr std::string_view digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = n < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(n))) text += digits[c - '0'];
  return text;
}

}  // namespace

std::string plot_svg(const Plot& plot) {
  const Frame f = frame_of(plot);
  std::string svg = fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1}" width="{0}" height="{1}" role="img" )"
      R"(font-family="system-ui, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif" font-size="13" fill="#1a1a1a">)",
      plot.width, plot.height);
  svg += "<title>" + escaped(plot.title) + "</title>";
  svg += grid(plot, f) + guide(f);
  for (const PlotSeries& s : plot.series) svg += curve_svg(s, f);
  return svg + names(plot, f) + "</svg>\n";
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      case '\t':
      case '\n':
        out += c;
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 ? std::string("\uFFFD") : std::string(1, c);
    }
  }
  return out;
}

std::string power_text(double value) {
  if (!(value > 0) || !std::isfinite(value)) return fmt::format("{}", value);
  int power = static_cast<int>(std::floor(std::log10(value) + 1e-12));
  double digits = value / std::pow(10.0, power);
  if (digits >= 9.95) digits = 1, ++power;
  const std::string ten = "10" + superscript(power);
  return std::abs(digits - 1) < 0.05 ? ten : fmt::format("{:.1f}\u00a0×\u00a0{}", digits, ten);
}

}  // namespace parian
