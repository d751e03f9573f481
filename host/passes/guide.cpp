// Guides of samples: which lit places give light to tiles of texels that lie away from them.
#include "passes/guide.hpp"

#include "passes/passes.hpp"

namespace parian {

cl_uint first_guide(const Passes& p, cl_uint l) {
  const cl_uint texels = p.light_maps.size * p.light_maps.size;
  return 2 * n_lights(p) * (1 + 2 * texels) + 2 * l * p.layers.n_tiles * GUIDE_SIZE;
}

void find_stands(Passes& p) {
  const Layers& k = p.layers;
  const Geometry& g = p.geometry;
  for (cl_uint l = 0; k.n_tiles > 0 && l < n_lights(p); ++l)
    p.compute.launch("guide_stands", k.n_tiles, Stage::layers, l, p.plan.density.parameters.h_min, k.views_buffer,
                     k.n_tiles, k.ids, g.positions, g.triangles, g.normals, k.n_needed, k.slots, k.centres, k.stands);
}

void make_guides(Passes& p) {
  Layers& k = p.layers;
  k.guided = true;
  const LightMaps& m = p.light_maps;
  if (k.n_tiles == 0) return;
  const cl_uint texels = m.size * m.size;
  for (cl_uint l = 0; l < n_lights(p); ++l)
    for (cl_uint half = 0; half < 2; ++half) {
      const kernels::View& view = m.lights[l].view;
      const cl_uint map = m.lights[l].map + half * texels, number = 2 * l + half;
      p.compute.launch("guide_list", GUIDE_SIDE * GUIDE_SIDE, Stage::layers, view, m.map, map, number, 0U, k.counts,
                       k.guides);
      p.compute.launch("guide_starts", GUIDE_ITEMS, Stage::layers, k.counts, number, texels, k.cubes, k.guides);
      p.compute.launch("guide_list", GUIDE_SIDE * GUIDE_SIDE, Stage::layers, view, m.map, map, number, 1U, k.cubes,
                       k.guides);
      p.compute.launch("guide_places", GUIDE_RANGES, Stage::layers, view, m.map, map, number, k.guides, k.places);
      p.compute.launch("guide_tiles", k.n_tiles, Stage::layers, view, number, k.places, p.media, k.n_tiles, k.stands,
                       first_guide(p, l), k.guides);
      p.compute.launch("guide_densities", k.n_tiles, Stage::layers, view, number, k.n_tiles, first_guide(p, l),
                       k.guides);
    }
}

}  // namespace parian
