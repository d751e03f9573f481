// Choosing, cutting out and encoding pictures.
#include "truth/report_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/image_file.hpp"
#include "truth/compare.hpp"
#include "truth/convergence.hpp"
#include "truth/plot.hpp"

namespace parian {
namespace {

constexpr double least_cover = 0.75;  // of a part's pixels

/// A square of the film.
struct Part {
  std::uint32_t x = 0, y = 0, side = 0;
  double error = 0;  ///< mean relative squared error inside
};

Image cut(const Image& image, const Part& part) {
  Image out{part.side, part.side, {}, -1.0, {}};
  for (std::uint32_t y = part.y; y < part.y + part.side; ++y) {
    const auto row = image.rgba.begin() + 4 * (static_cast<std::ptrdiff_t>(y) * image.width + part.x);
    out.rgba.insert(out.rgba.end(), row, row + 4 * static_cast<std::ptrdiff_t>(part.side));
  }
  return out;
}

/// The parts that the object fills, worst first.
std::vector<Part> parts_of(const Image& picture, const Image& reference) {
  const std::vector<double> errors = pixel_errors(picture, reference);
  const std::uint32_t side = std::max(8U, std::min(reference.width, reference.height) / 4);
  std::vector<Part> parts;
  for (std::uint32_t y = 0; y + side <= reference.height; y += side / 4)
    for (std::uint32_t x = 0; x + side <= reference.width; x += side / 4) {
      Part part{x, y, side, 0};
      double inside = 0;
      for (std::uint32_t v = y; v < y + side; ++v)
        for (std::uint32_t u = x; u < x + side; ++u) {
          const double error = errors[std::size_t{v} * reference.width + u];
          if (error < 0) continue;
          ++inside;
          part.error += error;
        }
      part.error /= std::max(1.0, inside);
      if (inside >= least_cover * side * side) parts.push_back(part);
    }
  std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.error > b.error; });
  return parts;
}

Picture encode(const std::string& caption, const Image& image, double stops) {
  return {caption, image.width, image.height, png_base64(image, stops)};
}

/// What a row shows of one method.
struct Column {
  std::string name, figures;  ///< time and error
  const Image* image;
  Image difference;
};

PictureRow row(const std::string& title, const Image& reference, const std::vector<Column>& columns, double stops,
               const Part* part) {
  const auto shown = [&](const Image& image) { return part ? cut(image, *part) : image; };
  PictureRow r{title, {encode("Reference", shown(reference), stops)}};
  for (const Column& c : columns) {
    r.pictures.push_back(encode(part ? c.name : c.name + ", " + c.figures, shown(*c.image), stops));
    r.pictures.push_back(encode("its signed error", shown(c.difference), 0));
  }
  return r;
}

}  // namespace

std::vector<PictureRow> picture_rows(const Image& reference, const std::vector<MethodShots>& methods) {
  const auto standard = std::find_if(methods.begin(), methods.end(), [](const MethodShots& m) { return m.standard; });
  if (standard == methods.end() || standard->shots.empty()) return {};
  const double time = standard->shots.back().seconds;
  std::vector<Column> columns;
  for (const MethodShots& method : methods) {
    const Shot* nearest = &method.shots.front();
    for (const Shot& shot : method.shots)
      if (std::abs(std::log(shot.seconds / time)) < std::abs(std::log(nearest->seconds / time))) nearest = &shot;
    Column column{method.name, fmt::format("{}, relMSE {}", time_text(nearest->seconds), power_text(nearest->relmse)),
                  &nearest->image, signed_difference(nearest->image, reference, difference_scale)};
    columns.insert(method.standard ? columns.begin() : columns.end(), std::move(column));
  }
  const double stops = automatic_stops(reference);
  std::vector<PictureRow> rows{row("The whole film", reference, columns, stops, nullptr)};
  const std::vector<Part> parts = parts_of(standard->shots.back().image, reference);
  if (parts.empty()) return rows;
  rows.push_back(row("Where Parian errs most", reference, columns, stops, &parts.front()));
  if (parts.size() > 2) rows.push_back(row("A typical part", reference, columns, stops, &parts[parts.size() / 2]));
  return rows;
}

}  // namespace parian
