// Pass 2's own function at pixels' points: where no layer sees them, and where layers are judged.
#include "passes/direct.hpp"

#include <algorithm>

#include "passes/layers.hpp"
#include "passes/passes.hpp"
#include "passes/raster.hpp"

namespace parian {

static constexpr cl_uint short_list = 1 << 14;  // work-items for lists of pixels, which are mostly empty

// `direct_points` at a time, as often as there might be pixels, since only the device knows how many there are.
void add_direct(Passes& p, const kernels::View& view, const kernels::Window& window, cl_uint position, cl_uint list,
                std::uint32_t round, std::uint32_t rounds, float sign, cl_uint sets, Stage stage) {
  const Geometry& g = p.geometry;
  const LightMaps& m = p.light_maps;
  const Film& f = p.film;
  const auto all = static_cast<cl_uint>(pixels(window));
  for (cl_uint first = 0; first < all; first += direct_points) {
    const cl_uint most = std::min(all - first, direct_points);
    const std::size_t items = p.plan.lanes == 1 ? most : std::min(most, short_list);
    p.compute.launch("direct_points", items, stage, view, f.ids, window, g.positions, g.triangles, g.normals,
                     m.lights_buffer, m.map, p.plan.boundary, p.plan.density.parameters, p.rho, m.extent, m.level_first,
                     m.levels, n_lights(p), position, list, first, most, f.direct, f.n_direct, f.n_held, f.points,
                     f.centres);
    for (cl_uint l = 0; l < n_lights(p); ++l)
      accumulate(p, {f.n_held, f.points, f.centres}, items_of(p, most), l, round, rounds, l > 0, colour_of(p, l), 0,
                 f.values, stage);
    p.compute.launch("direct_add", items, stage, f.n_held, list, first, f.direct, f.points, f.values,
                     sign / static_cast<float>(rounds), sets, all, f.sums);
  }
}

void subtract_direct(Passes& p, const kernels::View& view, const kernels::Window& window,
                     const std::vector<cl_uint>& chosen, std::uint32_t round, std::uint32_t rounds, Stage stage) {
  if (chosen.empty()) return;
  p.compute.write(p.film.direct, chosen);
  p.compute.fill(p.film.n_direct, static_cast<cl_uint>(chosen.size()), 1);
  for (cl_uint i = 0; i < 1U << window.log_positions; ++i)
    add_direct(p, view, window, i, 0, round + i * rounds, rounds, -1.0F, 1, stage);
}

}  // namespace parian
