// `parian compare`: how far one picture is from another, as a table, as JSON, and as a picture of the difference.
#include "truth/compare.hpp"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "cli/driver_guard.hpp"
#include "cli/terminal.hpp"
#include "io/image_file.hpp"

namespace parian {
namespace {

using Json = nlohmann::ordered_json;

constexpr int exit_exceeded = 1;

struct CompareOptions {
  std::string picture, reference, max_relmse, difference, scale;
  bool json = false;
};

/// JSON has no infinity; what isn't known or not finite is null.
Json known(double value) { return value >= 0 && std::isfinite(value) ? Json(value) : Json(nullptr); }

void print_json(const Comparison& c) {
  Json json;
  json["pixels"] = c.pixels;
  json["rmse"] = known(c.rmse);
  json["relmse"] = known(c.relmse);
  json["relmse_uncorrected"] = known(c.relmse_uncorrected);
  json["relmse_p99"] = known(c.relmse_p99);
  json["relmse_edge"] = known(c.relmse_edge);
  json["reference_relmse"] = known(c.reference_relmse);
  json["mean_ratio"] = {known(c.mean_ratio[0]), known(c.mean_ratio[1]), known(c.mean_ratio[2])};
  json["max_abs"] = known(c.max_abs);
  json["max_pixel"] = c.max_pixel;
  show_text(json.dump(2) + "\n");
}

void print_table(const Comparison& c) {
  const auto number = [](double value) { return value >= 0 ? fmt::format("{:.3g}", value) : std::string("unknown"); };
  show("pixels covered fully in both  {}\n", c.pixels);
  show("relMSE                        {}\n", number(c.relmse));
  show("  with the pictures' noise    {}\n", number(c.relmse_uncorrected));
  show("  without the worst 1 %       {}\n", number(c.relmse_p99));
  show("  at the object's edge        {}\n", number(c.relmse_edge));
  show("  of the reference itself     {}\n", number(c.reference_relmse));
  show("RMSE                          {}\n", number(c.rmse));
  show("ratio of means, R G B         {:.5f} {:.5f} {:.5f}\n", c.mean_ratio[0], c.mean_ratio[1], c.mean_ratio[2]);
  show("largest difference            {} at pixel {},{}\n", number(c.max_abs), c.max_pixel[0], c.max_pixel[1]);
}

int run_compare(const CompareOptions& options) {
  guard_drivers();  // modules are loaded after them
  const double scale = options.scale.empty() ? 0.1 : parse_in_range("--scale", options.scale, {1e-9, 1e9});
  const double most = options.max_relmse.empty() ? -1 : parse_in_range("--max-relmse", options.max_relmse, {0, 1e30});
  FileUses files;
  files.reads("the picture", options.picture);
  files.reads("the reference", options.reference);
  if (!options.difference.empty()) {
    check_output(options.difference);
    files.writes("--difference", options.difference);
  }
  if (!options.scale.empty() && options.difference.empty())
    throw Error(ErrorKind::usage, "--scale belongs to the picture of the difference; add --difference FILE");
  const Image picture = read_image(options.picture), reference = read_image(options.reference);
  const auto named = [&](const auto& work) {
    try {
      return work();
    } catch (const Error& error) {
      throw Error(error.kind(), fmt::format("{}, {}: {}", options.picture, options.reference, error.what()));
    }
  };
  const Comparison comparison = named([&] { return compare(picture, reference); });
  options.json ? print_json(comparison) : print_table(comparison);
  if (!options.difference.empty()) {
    PictureNotes notes;
    notes.settings = fmt::format("compare scale={}", scale);
    write_image(options.difference, named([&] { return signed_difference(picture, reference, scale); }), notes, {});
  }
  if (most < 0 || comparison.relmse <= most) return 0;
  say(fmt::format("relMSE {:.4g} exceeds {:.4g}", comparison.relmse, most));
  return exit_exceeded;
}

}  // namespace

void add_compare(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("compare", "how far a picture is from a reference");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("IMAGE", options->picture, "the picture, of floats, such as .exr")->option_text(" ")->required();
  command->add_option("REFERENCE", options->reference, "what it's compared with")->option_text(" ")->required();
  command->add_flag("--json", options->json, "as JSON; what isn't known is null");
  add_text(*command, "--max-relmse", options->max_relmse, "X", "exit with 1 if relMSE exceeds X");
  add_text(*command, "--difference", options->difference, "FILE",
           "write signed relative errors as colours: blue too dark, red too bright, white equal");
  add_text(*command, "--scale", options->scale, "S", "relative error of full colour (0.1)");
  command->footer(
      "relMSE is the mean of (I-R)^2 / (R^2 + eps^2) over pixels that both pictures cover fully and over RGB, with eps "
      "a\n"
      "hundredth of R's mean; the variance that 'parian reference' knows of its picture is subtracted.");
  command->callback([&run, options] { run = [options] { return run_compare(*options); }; });
}

}  // namespace parian
