// What a renderer says of itself: its plan as text, and its figures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/words.hpp"
#include "render/renderer_state.hpp"

namespace parian {

namespace {

constexpr double fall_of_bias = 7.0;  // of its relMSE when layers are doubled in size: the least of what was measured

std::string bias_warning(double bias, const Settings& settings, Gather gather) {
  const double doublings = std::ceil(std::log(bias / settings.error) / std::log(fall_of_bias));
  const std::string remedy =
      gather == Gather::camera
          ? fmt::format("{}, or a larger {},", setting("gather_layers"), setting("film"))
          : fmt::format("{} {:.0f}", setting("layer_size"), settings.layer_size * std::exp2(doublings));
  return fmt::format(
      "looking light up in layers adds a relMSE of about {:.2g}, above {} {:g}, that more frames don't remove; {} "
      "would",
      bias, setting("error"), settings.error, remedy);
}

}  // namespace

void Renderer::State::leave_out(const std::string& what, const std::string& why, const std::string& unit,
                                double count) {
  if (count > 0.0) left_out.push_back({what, why, unit, count, false});
}

/// What depends on how rendering goes, with the saving so far.
std::vector<Omission> Renderer::State::left_out_while_rendering() const {
  const double lights = static_cast<double>(plan.lights.size());
  std::vector<Omission> all{
      {"light-map-redraws", "maps are redrawn only when a shift is due", "light maps",
       frame > redraws + 1 ? 2 * lights * (frame - 1 - redraws) : 0.0},
      {"camera-redraws", "a camera's view that has been drawn is read again", "draws", static_cast<double>(undrawn)},
      {"interior-positions", "pixels on one smooth surface need 8 of 64 subpixel positions", "look-ups",
       static_cast<double>(unasked)}};
  if (settings.error > 0)
    all.push_back({"checkpoints", "the error can't be below its target yet, going by the last estimate", "estimates",
                   static_cast<double>(unestimated)});
  if (plan.pyramids)
    all.push_back(
        {"pyramids", "no pixel reads levels coarser than the one shown", "levels", static_cast<double>(unbuilt)});
  std::erase_if(all, [&](const Omission& o) { return kept(settings, o.what); });
  return all;
}

std::uint32_t Renderer::State::rounds_of(std::uint32_t positions) const { return (frame + positions - 1) / positions; }

std::uint32_t Renderer::State::samples_per_frame() const {
  std::uint32_t samples = 0;
  for (const PlannedLight& light : plan.lights) samples += 2 * light.samples;
  return samples;
}

std::vector<std::string> Renderer::explanation() const {
  const State& s = *state_;
  const Statistics& t = statistics();
  std::vector<std::string> lines;
  lines.push_back(
      fmt::format("device    {} ({}), {} lanes", s.compute.info().name, s.compute.info().platform, s.plan.lanes));
  lines.push_back(fmt::format("mesh      {} triangles", s.passes.geometry.n_triangles));
  lines.push_back(fmt::format("material  {}: {} distinct scattering channel{}", s.scene.material.name,
                              s.plan.channels(), s.plan.channels() == 1 ? "" : "s"));
  lines.push_back(
      fmt::format("pass 1    {} light{}, two maps of {} x {} each, {}", s.plan.lights.size(),
                  s.plan.lights.size() == 1 ? "" : "s", s.settings.light_map_size, s.settings.light_map_size,
                  s.settings.light_map_shift ? fmt::format("redrawn every {} samples", redraw_samples) : "drawn once"));
  const kernels::View& layer = s.passes.layers.views.front();
  std::string guides;  // of samples
  if (s.plan.guides)
    guides = fmt::format("; guides of samples in up to {} tiles a light", s.passes.layers.n_tiles);
  else if (s.settings.estimator == Estimator::automatic)
    guides = fmt::format("; no guides of samples, which would take more than {} MiB or than the device has",
                         most_guides >> 20);
  lines.push_back(
      fmt::format("pass 2    {} of {} x {}, {} texels read of {} covered, {} samples each a frame{}{}{}",
                  s.plan.gather == Gather::camera ? "the cameras' own views" : fmt::format("{} layers", t.layers_count),
                  layer.width, layer.height, t.layers_texels_evaluated, t.layers_texels, s.samples_per_frame(),
                  s.plan.gather == Gather::camera
                      ? ""
                      : fmt::format("; {:.2f} % of the visible surface covered", 100.0 * t.layers_covered),
                  s.plan.sums() > 1 ? "; sums of each light, whose colours come last" : "", guides));
  lines.push_back(s.plan.pyramids ? fmt::format("pass 3    {} levels", s.passes.layers.levels - 1) : "pass 3    none");
  lines.push_back(fmt::format("pass 4    {} view{} of {} x {}, {} subpixel positions", s.cameras.size(),
                              s.cameras.size() == 1 ? "" : "s", s.scene.film.x, s.scene.film.y, subpixel_positions));
  lines.push_back(fmt::format("memory    {:.0f} MiB so far, {:.0f} MiB at most",
                              static_cast<double>(t.bytes_peak) / 1048576.0,
                              static_cast<double>(s.plan.bytes) / 1048576.0));
  lines.push_back("options   " + s.plan.options);
  for (const Omission& o : s.left_out)
    lines.push_back(fmt::format("left out  {}: {}; saves {:.0f} {}{}", o.what, o.why, o.count, o.unit,
                                o.unit == "evaluations" ? " a frame" : ""));
  for (const Omission& o : s.left_out_while_rendering())
    lines.push_back(fmt::format("left out  {}: {}; saves {}, counted while rendering", o.what, o.why, o.unit));
  return lines;
}

const Statistics& Renderer::statistics() const {
  State& s = *state_;
  Statistics& t = s.statistics;
  t.frames = s.frame;
  const double per_texel = static_cast<double>(s.samples_per_frame()) * s.frame;
  t.evaluations = static_cast<double>(t.layers_texels_evaluated) * per_texel * s.plan.channels() + s.direct_evaluations;
  t.warnings = s.plan.warnings;
  if (t.nonfinite > 0)
    t.warnings.push_back(
        "some values were not finite or negative and were set to 0: the device or its driver computes wrongly");
  t.warnings.insert(t.warnings.end(), s.doubts.begin(), s.doubts.end());
  if (s.outside.triangles > 0)
    t.warnings.push_back(fmt::format(
        "mesh: triangles lay outside its sphere, of radius {:.4g}, {} times, where light maps and layers cut "
        "them off, and beyond two radii nothing is drawn; give a radius of {:.4g} and plan again",
        s.plan.space.radius, s.outside.triangles, 1.001 * s.outside.reach * s.plan.space.radius));
  if (s.settings.error > 0 && t.estimated_bias_relmse > s.settings.error)
    t.warnings.push_back(bias_warning(t.estimated_bias_relmse, s.settings, s.plan.gather));
  t.left_out = s.left_out;
  for (Omission& o : t.left_out) {
    if (o.what == "equal-channels" || o.what == "black-channels")
      o.count = t.evaluations / s.plan.channels();
    else if (o.unit == "evaluations")
      o.count *= s.frame;
  }
  for (const Omission& o : s.left_out_while_rendering())
    if (o.count > 0) t.left_out.push_back(o);
  if (s.further_views > 0) t.further_view_seconds = s.further_seconds / s.further_views;
  t.bytes_peak = s.compute.bytes_peak();
  t.bytes_planned = s.plan.bytes;
  t.kernel_seconds = {};
  for (const auto& [stage, seconds] : s.compute.kernel_seconds()) {
    if (stage == Stage::plan) t.kernel_seconds.plan = seconds;
    if (stage == Stage::light_map) t.kernel_seconds.light_map = seconds;
    if (stage == Stage::layers) t.kernel_seconds.layers = seconds;
    if (stage == Stage::pyramids) t.kernel_seconds.pyramids = seconds;
    if (stage == Stage::gather) t.kernel_seconds.gather = seconds;
    if (stage == Stage::bias) t.kernel_seconds.bias = seconds;
    t.kernel_seconds.total += seconds;
  }
  return t;
}

}  // namespace parian
