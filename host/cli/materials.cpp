// `parian materials`: the measured materials, and how well a diffusion model suits them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/terminal.hpp"
#include "scene/medium.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;

struct Row {
  const MeasuredMaterial* measured;
  std::array<double, 3> free_path;  ///< 1/sigma_t', mm
  std::array<double, 3> albedo;     ///< reduced
  bool diffusive;
};

std::vector<Row> make_rows() {
  std::vector<Row> rows;
  for (const MeasuredMaterial& measured : measured_materials()) {
    Row row{&measured, {}, {}, true};
    const Optics optics = optics_of(measured.material);
    for (std::size_t c = 0; c < 3; ++c) {
      const ChannelConstants& channel = optics.channels[c];
      row.free_path[c] = 1 / channel.sigma_t_prime;
      row.albedo[c] = channel.alpha_prime;
      row.diffusive = row.diffusive && row.albedo[c] >= least_diffusive_albedo;
    }
    rows.push_back(row);
  }
  return rows;
}

Json list(const glm::dvec3& v) { return Json::array({v.x, v.y, v.z}); }

void print_json(const std::vector<Row>& rows) {
  Json all = Json::array();
  for (const Row& row : rows) {
    const Material& material = row.measured->material;
    all.push_back({{"name", material.name},
                   {"dataset", row.measured->dataset},
                   {"sigma_s", list(material.sigma_s)},
                   {"sigma_a", list(material.sigma_a)},
                   {"g", list(material.g)},
                   {"ior", material.ior},
                   {"mean_free_path_mm", row.free_path},
                   {"reduced_albedo", row.albedo},
                   {"diffusive", row.diffusive}});
  }
  show_text(all.dump(2, ' ', true) + "\n");
}

void print_table(const std::vector<Row>& rows) {
  std::size_t name = 8, dataset = 7;
  for (const Row& row : rows) {
    name = std::max(name, row.measured->material.name.size());
    dataset = std::max(dataset, row.measured->dataset.size());
  }
  show("{:<{}}    {:^29}   {:^20}   {:>5}  {}\n", "", name, "mean free path, mm", "reduced albedo", "", "");
  show("{:<{}}    {:>9} {:>9} {:>9}   {:>6} {:>6} {:>6}   {:>5}  {}\n", "material", name, "R", "G", "B", "R", "G", "B",
       "ior", "dataset");
  for (const Row& row : rows) {
    const auto& [x, y, z] = row.free_path;
    const auto& [r, g, b] = row.albedo;
    show("{:<{}}  {} {:>9.4g} {:>9.4g} {:>9.4g}   {:>6.4f} {:>6.4f} {:>6.4f}   {:>5.3g}  {}\n",
         row.measured->material.name, name, row.diffusive ? ' ' : '*', x, y, z, r, g, b, row.measured->material.ior,
         row.measured->dataset);
  }
  show(
      "\nThe mean free path is 1/sigma_t', sigma_t' = sigma_s (1 - g) + sigma_a; the albedo sigma_s (1 - g) / "
      "sigma_t'.\n");
  show(
      "* The reduced albedo of a channel is below {}: light is absorbed before it diffuses, and every dipole is "
      "a poor model.\n",
      least_diffusive_albedo);
}

}  // namespace

void add_materials(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("materials", "list measured materials");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "as JSON");
  command->callback([&run, json] {
    run = [json] {
      const std::vector<Row> rows = make_rows();
      *json ? print_json(rows) : print_table(rows);
      return 0;
    };
  });
}

}  // namespace parian
