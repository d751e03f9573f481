// Pixels with edges near by, which alone are drawn at all subpixel positions.
#include "passes/edges.hpp"

#include "passes/passes.hpp"
#include "passes/raster.hpp"

namespace parian {

void find_edges(Passes& p, const kernels::View& view, const kernels::Window& window) {
  const Geometry& g = p.geometry;
  const Film& f = p.film;
  p.compute.fill(f.edges, 0, pixels(window));
  p.compute.launch("edges_find", in_lanes(p, window), Stage::gather, view, window, f.ids, g.positions, g.triangles,
                   g.normals, f.edges);
}

void settle_film(Passes& p, const kernels::Window& window, std::size_t levels, std::uint32_t done,
                 std::uint32_t positions) {
  const Film& f = p.film;
  p.compute.launch("edges_settle", pixels(window), Stage::gather, window, f.edges,
                   static_cast<float>(positions) / static_cast<float>(done), static_cast<cl_uint>(levels), f.sums,
                   f.open);
}

void restrict_film(Passes& p, const kernels::View& view, kernels::Window& window) {
  Geometry& g = p.geometry;
  setup_view(p, view, Stage::gather);
  p.compute.launch("edges_cull", g.n_records, Stage::gather, window, p.film.open, g.n_records, g.records);
  g.set_up.reset();  // records are gone
  p.film.drawn.reset();
  window.restricted = 1;
}

void free_film(Passes& p, kernels::Window& window) {
  window.restricted = 0;
  p.film.drawn.reset();
}

}  // namespace parian
