// Pass 2: what the layers see, which of their texels are needed, and frames of samples at these.
#include "passes/layers.hpp"

#include <algorithm>

#include "kernels/raster.h"
#include "passes/guide.hpp"
#include "passes/passes.hpp"
#include "passes/raster.hpp"

namespace parian {

void make_layers(Passes& p, const std::vector<kernels::View>& views, bool pyramids) {
  Layers& k = p.layers;
  k.views = views;
  const glm::uvec2 film(views.front().width, views.front().height);
  k.level_first = mip_offsets(film, k.count());
  if (!pyramids) k.level_first.resize(2);
  k.levels = static_cast<cl_uint>(k.level_first.size() - 1);
  const cl_uint texels = film.x * film.y;
  k.views_buffer = p.compute.upload(views);
  k.level_first_buffer = p.compute.upload(k.level_first);
  k.depth = p.compute.buffer<cl_uint>(texels);
  k.ids = p.compute.buffer<cl_uint>(std::size_t{texels} * views.size());
  k.geometry = p.compute.buffer<kernels::float4>(k.level_first.back());
  k.slots = p.compute.buffer<cl_uint>(k.level_first.back());
  k.view_ids = p.compute.buffer<cl_uint>(texels);
  draw_layers(p);
}

void draw_layers(Passes& p) {
  const Geometry& g = p.geometry;
  Layers& k = p.layers;
  const cl_uint texels = k.views.front().width * k.views.front().height;
  for (cl_uint layer = 0; layer < k.count(); ++layer) {
    setup_view(p, k.views[layer], Stage::layers);
    const kernels::Window window = whole(k.views[layer]);
    draw(p, window, k.depth, &k.view_ids, Stage::layers);
    p.compute.launch("layers_resolve", in_lanes(p, texels), Stage::layers, k.views[layer], window, k.view_ids,
                     g.positions, g.triangles, g.normals, layer * texels, k.ids, k.geometry, k.slots);
  }
}

void release_layers(Passes& p) {
  Layers& k = p.layers;
  p.compute.finish();
  for (cl::Buffer* b : {&k.views_buffer, &k.level_first_buffer, &k.depth, &k.view_ids, &k.ids, &k.geometry, &k.slots})
    p.compute.release(*b);
  k = {};
}

void allocate_points(Passes& p, std::size_t count) {
  Layers& k = p.layers;
  const std::size_t lights = p.light_maps.lights.size(), coarse = k.level_first.back() - k.level_first[1];
  k.n_points = static_cast<cl_uint>(count);
  k.n_needed = p.compute.buffer<cl_uint>(1);
  k.needed = p.compute.buffer<cl_uint>(count);
  k.points = p.compute.buffer<kernels::float4>(2 * count);
  k.centres = p.compute.buffer<kernels::float4>(lights * count);
  k.values = p.compute.buffer<kernels::float4>(2 * (count + coarse));
  k.n_tiles = p.plan.guides ? guide_tiles({k.views[0].width, k.views[0].height}) * k.count() : 0;
  const std::size_t maps = k.n_tiles > 0 ? 2 * lights : 0, map = std::size_t{p.light_maps.size} * p.light_maps.size;
  const auto buffer = [&](std::size_t n) { return p.compute.buffer<cl_uint>(std::max<std::size_t>(n, 1)); };
  k.stands = buffer(lights * k.n_tiles * 4);
  k.guides = buffer(maps * (1 + 2 * map + k.n_tiles * std::size_t{GUIDE_SIZE}));
  k.counts = buffer(maps > 0 ? GUIDE_CUBES : 0);
  k.cubes = buffer(maps > 0 ? GUIDE_CUBES : 0);
  k.places = buffer(maps > 0 ? 8 * GUIDE_RANGES * (1 + PARTS_OF_RANGE) : 0);
  if (p.plan.sums() == 1) return;
  k.sums = p.compute.buffer<kernels::float4>(2 * count * lights);
  k.colours = p.compute.buffer<kernels::float4>(lights);
}

void set_needed(Passes& p, const std::vector<cl_uint>& needed) {
  Layers& k = p.layers;
  allocate_points(p, needed.size());
  std::vector<cl_uint> slots(k.level_first[1], NO_SLOT);
  for (cl_uint i = 0; i < k.n_points; ++i) slots[needed[i]] = i;
  p.compute.write(k.slots, slots);
  p.compute.write(k.needed, needed);
  p.compute.fill(k.n_needed, k.n_points, 1);
  find_centres(p);
  p.compute.finish();
  for (cl::Buffer* b : {&k.needed, &k.ids, &k.view_ids}) p.compute.release(*b);
}

void list_covered(Passes& p) {
  const Layers& k = p.layers;
  p.compute.fill(k.n_needed, 0, 1);
  p.compute.launch("layers_list", k.level_first[1], Stage::layers, k.level_first[1], k.slots, k.n_needed, k.needed);
}

void find_centres(Passes& p) {
  const Layers& k = p.layers;
  const Geometry& g = p.geometry;
  const LightMaps& m = p.light_maps;
  p.compute.launch("layers_points", k.n_points, Stage::layers, k.views_buffer, k.n_needed, k.needed, k.ids, g.positions,
                   g.triangles, g.normals, m.lights_buffer, m.map, p.plan.boundary, p.plan.density.parameters, p.rho,
                   m.extent, m.level_first, m.levels, n_lights(p), k.points, k.centres);
  find_stands(p);
  make_guides(p);
}

std::size_t items_of(const Passes& p, std::size_t points) {
  return p.plan.lanes == 1 ? 2 * points : (points + POINTS_SIDE_BY_SIDE - 1) / POINTS_SIDE_BY_SIDE;
}

kernels::float4 colour_of(const Passes& p, std::size_t l) {
  return to_float4(p.plan.sums() > 1 ? p.light_maps.given[l].irradiance : glm::dvec3(1.0));
}

void accumulate(Passes& p, const Points& at, std::size_t items, cl_uint l, std::uint32_t round, std::uint32_t rounds,
                bool add, const kernels::float4& colour, cl_uint first_value, const cl::Buffer& values, Stage stage) {
  p.compute.launch("layers_accumulate", items, stage, at.count, at.points, at.centres, l, p.light_maps.lights_buffer,
                   p.light_maps.map, p.media, p.plan.boundary, p.plan.density.parameters, p.rho, p.layers.guides,
                   at.n_tiles > 0 ? first_guide(p, l) : 0U, p.seed, round, rounds, add ? 1U : 0U, colour, first_value,
                   values);
}

namespace {

/// The round number `frame` of the layers' texels, of each light, to its own sums or to those of all.
void accumulate_texels(Passes& p, std::size_t items, std::uint32_t frame, Stage stage) {
  const Layers& k = p.layers;
  const bool own = p.plan.sums() > 1;
  for (cl_uint l = 0; l < n_lights(p); ++l)
    accumulate(p, {k.n_needed, k.points, k.centres, k.n_tiles}, items, l, frame, 1, frame > 0 || (l > 0 && !own),
               to_float4(glm::dvec3(1.0)), own ? l * k.n_points : 0, own ? k.sums : k.values, stage);
}

}  // namespace

std::size_t accumulate_items(const Passes& p) { return items_of(p, p.layers.n_points); }

void try_accumulate(Passes& p, std::size_t items) { accumulate_texels(p, items, 0, Stage::plan); }

void accumulate_layers(Passes& p, std::uint32_t frame) {
  if (!p.layers.guided) make_guides(p);
  accumulate_texels(p, accumulate_items(p), frame, Stage::layers);
}

void colour_layers(Passes& p) {
  const Layers& k = p.layers;
  if (p.plan.sums() == 1) return;
  std::vector<kernels::float4> colours;
  for (std::size_t l = 0; l < p.plan.lights.size(); ++l) colours.push_back(colour_of(p, l));
  p.compute.assign(k.colours, colours);
  p.compute.launch("layers_colour", std::size_t{2} * k.n_points, Stage::layers, k.n_needed, k.sums, k.n_points,
                   n_lights(p), k.colours, k.values);
}

}  // namespace parian
