// `parian check --half-space`: how far each dipole model's total is from the truth, on a half-space.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "truth/half_space.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<double, 3> angles = {0, 45, 75};  // of the light to the normal, degrees
constexpr double wanted_error = 0.0025;                // of the random walk, relative
constexpr std::uint64_t pilot_photons = 8192;

/// One medium and one direction of the light.
struct Entry {
  double angle = 0;
  std::uint64_t photons = 0;
  RandomWalk truth;
  std::array<double, 3> model{};  ///< albedo, by the order of `models`

  [[nodiscard]] double ratio(std::size_t m) const { return model[m] / truth.albedo(); }
  [[nodiscard]] double relative_error() const { return truth.albedo_error() / truth.albedo(); }
};

struct Row {
  std::string name;
  HalfSpace medium;
  ChannelConstants channel;
  std::array<Entry, angles.size()> entries{};
};

std::vector<Row> make_rows() {
  std::vector<Row> rows;
  const auto add = [&](const std::string& name, const HalfSpace& m) {
    rows.push_back({name, m, channel_constants(m.sigma_s, m.sigma_a, m.g, m.eta)});
  };
  const auto add_albedo = [&](double alpha_prime, double g, double eta) {
    add("", {alpha_prime / (1 - g), 1 - alpha_prime, g, eta});
  };
  for (const double eta : {1.0, 1.3, 1.5})
    for (const double alpha_prime : {0.5, 0.9, 0.99, 0.999}) add_albedo(alpha_prime, 0, eta);
  for (const double alpha_prime : {0.5, 0.9, 0.99}) add_albedo(alpha_prime, 0.9, 1.3);
  for (const char* name : {"marble", "skin2"}) {
    const Material m = find_material(name);
    for (int c = 0; c < 3; ++c) add(fmt::format("{} {}", name, "RGB"[c]), {m.sigma_s[c], m.sigma_a[c], m.g[c], m.ior});
  }
  return rows;
}

/// The truth to `wanted_error`, with as many photons as a pilot run says, and the models beside it.
void fill(Row& row, std::uint64_t seed) {
  const HalfSpace& m = row.medium;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    Entry& entry = row.entries[k];
    const double cosine = std::cos(angles[k] * std::numbers::pi / 180);
    entry.angle = angles[k];
    entry.truth = random_walk(m, cosine, pilot_photons, seed + 2 * k);
    entry.photons = static_cast<std::uint64_t>(
        std::ceil(static_cast<double>(pilot_photons) * std::pow(entry.relative_error() / wanted_error, 2)));
    entry.photons = std::max(entry.photons, pilot_photons);
    entry.truth = random_walk(m, cosine, entry.photons, seed + 2 * k + 1);
    for (std::size_t i = 0; i < models.size(); ++i) entry.model[i] = dipole_albedo(row.channel, models[i], cosine);
  }
}

Json as_json(const Row& row) {
  const HalfSpace& m = row.medium;
  Json result = {{"name", row.name},      {"alpha_prime", row.channel.alpha_prime},
                 {"eta", m.eta},          {"g", m.g},
                 {"sigma_s", m.sigma_s},  {"sigma_a", m.sigma_a},
                 {"light", Json::array()}};
  for (const Entry& entry : row.entries) {
    Json light = {{"angle_degrees", entry.angle},
                  {"photons", entry.photons},
                  {"entered", entry.truth.entered},
                  {"albedo", entry.truth.albedo()},
                  {"albedo_standard_error", entry.truth.albedo_error()}};
    for (std::size_t i = 0; i < models.size(); ++i) light[model_names[i]] = entry.model[i];
    result["light"].push_back(light);
  }
  return result;
}

void print_table(const std::vector<Row>& rows) {
  show("Albedo of a half-space lit at 0, 45 and 75 degrees to its normal: the share of the arriving flux that\n");
  show("leaves again after scattering. Random walk: the truth; models: how many times brighter than that.\n\n");
  show("{:>52}", "random walk");
  for (const char* name : model_names) show("  {:>18}", name);
  show("\n{:<10} {:>7} {:>5} {:>4}  ", "medium", "alpha'", "eta", "g");
  for (const double angle : angles) show(" {:>5}°", angle);
  for (std::size_t i = 0; i < models.size(); ++i) {
    show("  ");
    for (const double angle : angles) show(" {:>4}°", angle);
  }
  double worst = 0;
  for (const Row& row : rows) {
    show("\n{:<10} {:>7.4f} {:>5.3g} {:>4.2g}  ", row.name, row.channel.alpha_prime, row.medium.eta, row.medium.g);
    for (const Entry& entry : row.entries) {
      show(" {:>6.4f}", entry.truth.albedo());
      worst = std::max(worst, entry.relative_error());
    }
    for (std::size_t i = 0; i < models.size(); ++i) {
      show("  ");
      for (const Entry& entry : row.entries) show(" {:>5.2f}", entry.ratio(i));
    }
  }
  show("\n\nThe random walk's standard error is at most {:.2f} % of the albedo.\n", 100 * worst);
}

}  // namespace

int print_half_space(bool json) {
  std::vector<Row> rows = make_rows();
  for (std::size_t k = 0; k < rows.size(); ++k) fill(rows[k], 2 * angles.size() * k);
  if (!json) {
    print_table(rows);
    return 0;
  }
  Json all = {{"schema", "parian-half-space-1"}, {"half_spaces", Json::array()}};
  for (const Row& row : rows) all["half_spaces"].push_back(as_json(row));
  show_text(all.dump(2) + "\n");
  return 0;
}

}  // namespace parian
