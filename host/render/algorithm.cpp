// The algorithm: four passes, in order, for stills, live views and the estimate of bias alike.
#include <algorithm>

#include "passes/direct.hpp"
#include "passes/edges.hpp"
#include "passes/pyramids.hpp"
#include "passes/raster.hpp"
#include "render/renderer_state.hpp"

namespace parian {
namespace {

constexpr std::uint32_t interior_positions = POSITIONS_SIDE_BY_SIDE;  // of pixels without an edge near by
// Of an estimate that looks at one subpixel position, in 1/256: where a bilinear look-up averages noise away as much as
// a whole pixel's look-ups do if texels are pixels, (0.78^2 + 0.22^2)^2 = (0.125^2 + 0.75^2 + 0.125^2)^2.
constexpr int single_position = 200;

}  // namespace

void Renderer::State::run(const Due& due) {
  if (due.light_maps) {
    Timer timer(statistics.seconds.light_map);
    draw_light_maps(passes, epoch, settings.light_map_shift);
    settle();
  }
  if (due.samples) {
    Timer timer(statistics.seconds.layers);
    accumulate_layers(passes, frame);
    settle();
  }
  if (!due.picture) return;
  {
    Timer timer(statistics.seconds.pyramids);
    colour_layers(passes);
    build_pyramids(passes, levels_to_build(*due.picture));
    if (due.picture->waits) compute.finish();
  }
  gather_film(*due.picture);
}

void Renderer::State::settle() {
  if (settings.time_stages) compute.finish();
}

/// Levels of the pyramids up to the coarsest that a picture reads.
std::uint32_t Renderer::State::levels_to_build(const Gathering& picture) {
  if (!plan.pyramids || picture.chosen) return 0;
  const std::uint32_t all = passes.layers.levels - 1;
  const std::uint32_t read = *std::max_element(picture.levels.begin(), picture.levels.end());
  const std::uint32_t built = kept(settings, "pyramids") ? all : read;
  unbuilt += all - built;
  return built;
}

void Renderer::State::gather_film(const Gathering& picture) {
  double& seconds = picture.chosen ? statistics.seconds.bias : statistics.seconds.gather;
  for (const kernels::Window& w : tiles(scene.film, passes.film.side)) {
    std::vector<cl_uint> chosen;
    if (picture.chosen) chosen = picture.chosen(w);
    if (picture.chosen && chosen.empty()) continue;
    {
      Timer timer(seconds);
      compute.fill(passes.film.sums, 0, pixels(w) * 8 * picture.levels.size());
      compute.fill(passes.film.n_direct, 0, POSITIONS_SIDE_BY_SIDE + 1);
      gather_window(picture, w, chosen);
      if (picture.waits) compute.finish();
    }
    picture.take(w);
  }
}

bool Renderer::State::settles(std::uint32_t positions) const {
  return positions > interior_positions && !kept(settings, "interior-positions");
}

/// All subpixel positions of one window; those of edges alone after the first few, or those of `chosen` pixels alone.
void Renderer::State::gather_window(const Gathering& picture, kernels::Window w, const std::vector<cl_uint>& chosen) {
  const kernels::View& view = cameras[picture.camera];
  const std::uint32_t positions = picture.positions, rounds = rounds_of(positions);
  const Stage stage = picture.chosen ? Stage::bias : Stage::gather;
  const bool settling = settles(positions);
  if (picture.chosen) {
    std::vector<cl_uint> open(pixels(w), 0);
    for (const cl_uint i : chosen) open[i] = 1;
    compute.write(passes.film.open, open);
    restrict_film(passes, view, w);
  }
  for (std::uint32_t i = 0; i < positions;) {
    if (settling && i == interior_positions) {
      settle_film(passes, w, picture.levels.size(), i, positions);
      restrict_film(passes, view, w);
    }
    std::uint32_t count = 1;
    if (positions == 1)
      w.sample_x = w.sample_y = single_position;
    else
      count = set_positions(w, i, positions - i);
    undrawn += !draw_film(passes, view, w, !picture.chosen && kept(settings, "camera-redraws"), stage);
    if (settling && i == 0) find_edges(passes, view, w);
    gather(passes, view, w, layers_of(picture.camera), picture.levels, 1.0F / static_cast<float>(frame), i * rounds,
           rounds, stage);
    subtract_direct(passes, view, w, chosen, i * rounds, rounds, stage);
    i += count;
  }
  if (settling || picture.chosen) free_film(passes, w);
}

std::uint64_t Renderer::State::settled(const std::vector<kernels::float4>& sums, std::size_t n_pixels,
                                       std::uint32_t positions) {
  if (!settles(positions)) return 0;
  std::uint64_t spared = 0;
  const std::vector<cl_uint> open = compute.read<cl_uint>(passes.film.open, n_pixels);
  for (std::size_t i = 0; i < n_pixels; ++i)
    if (!open[i] && sums[2 * i].w > 0) spared += positions - interior_positions;
  return spared;
}

}  // namespace parian
