// Log-log plots as SVG: curves with their spread, names beside their ends, floors, and a guide of slope -1.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace parian {

struct PlotPoint {
  double x = 0, low = 0, y = 0, high = 0;  ///< all positive, or the point is left out
  std::string title;                       ///< shown when the pointer rests on it
};

enum class Marker { circle, square, triangle, diamond };

struct PlotSeries {
  std::string name;  ///< beside its end
  std::string note;  ///< after the name, lighter
  std::string colour;
  Marker marker = Marker::circle;
  bool dashed = false;  ///< dashed line, hollow markers
  bool bold = false;
  std::vector<PlotPoint> points;
  std::optional<double> floor;  ///< dotted level line in the series' colour, for what it can't get below
};

struct Plot {
  std::string title;  ///< for readers that don't see it
  std::string x_label, y_label;
  std::vector<PlotSeries> series;
  int width = 980, height = 470;  ///< CSS pixels
};

/// One SVG element that stands alone: no script, no font, nothing to load. Well-formed XML; all text is escaped.
[[nodiscard]] std::string plot_svg(const Plot& plot);

/// Text as XML has it, in elements and in attributes; what XML can't hold becomes U+FFFD.
[[nodiscard]] std::string escaped(const std::string& text);

/// A power of ten or a number with two digits: "10⁻³", "2.1 × 10⁻³".
[[nodiscard]] std::string power_text(double value);

}  // namespace parian
