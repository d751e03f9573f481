// Pass 4: the camera's film, drawn and gathered from the layers.
#include "passes/gather.hpp"

#include "core/same_bits.hpp"
#include "passes/direct.hpp"
#include "passes/passes.hpp"
#include "passes/raster.hpp"

namespace parian {

bool draw_film(Passes& p, const kernels::View& view, const kernels::Window& window, bool again, Stage stage) {
  Film& f = p.film;
  const bool same_view = f.drawn && same_bits(*f.drawn, view);
  if (!again && same_view && same_bits(f.window, window)) return false;
  if (!window.restricted) setup_view(p, view, stage);
  draw(p, window, f.depth, &f.ids, stage);
  f.drawn = view;
  f.window = window;
  return true;
}

void gather(Passes& p, const kernels::View& view, const kernels::Window& window, const LayerRange& layers,
            const std::vector<cl_uint>& levels, float scale, std::uint32_t round, std::uint32_t rounds, Stage stage) {
  const Geometry& g = p.geometry;
  const Layers& k = p.layers;
  const Film& f = p.film;
  cl_uint4 level{};
  for (std::size_t s = 0; s < levels.size(); ++s) level.s[s] = levels[s];
  const cl_uint sets = static_cast<cl_uint>(levels.size()), positions = 1U << window.log_positions;
  p.compute.fill(f.n_direct, 0, positions);
  for (cl_uint i = 0; i < launches(p, window); ++i)
    p.compute.launch("gather_pixels", in_lanes(p, window), stage, view, window, f.ids, g.positions, g.triangles,
                     g.normals, k.views_buffer, k.level_first_buffer, k.geometry, k.slots, layers.first, layers.count,
                     k.values, scale, p.plan.boundary, level, sets, i, f.sums, f.n_direct, f.direct, f.edges);
  for (cl_uint i = 0; i < positions; ++i)
    add_direct(p, view, window, i, i, round + i * rounds, rounds, 1.0F, sets, stage);
}

}  // namespace parian
