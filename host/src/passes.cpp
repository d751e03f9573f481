// Launches of the four passes, in their order.
#include "passes.hpp"

#include <algorithm>

#include "kernels/raster.h"
#include "kernels/sampling.h"
#include "same_bits.hpp"

namespace parian {
namespace {

constexpr std::size_t large_items = 1024;  // work-items that draw large triangles
constexpr cl_uint short_list = 1 << 14;    // work-items for lists of pixels that no layer sees, which are mostly empty

cl_uint n_lights(const Passes& p) { return static_cast<cl_uint>(p.light_maps.lights.size()); }
std::size_t pixels(const kernels::Window& w) { return std::size_t{w.width} * w.height; }
std::size_t samples(const kernels::Window& w) { return pixels(w) << w.log_positions; }

/// Work-items of a kernel that takes samples side by side, of one pixel or as many as the plan has lanes.
std::size_t in_lanes(const Passes& p, std::size_t samples, std::uint32_t log_positions = 0) {
  const std::size_t of_item = std::max(std::size_t{p.plan.lanes}, std::size_t{1} << log_positions);
  return (samples + of_item - 1) / of_item;
}
std::size_t in_lanes(const Passes& p, const kernels::Window& w) { return in_lanes(p, samples(w), w.log_positions); }
/// Launches that take a window's subpixel positions: with one lane, one for each.
cl_uint launches(const Passes& p, const kernels::Window& w) { return p.plan.lanes == 1 ? 1U << w.log_positions : 1U; }

kernels::float4 rgb(glm::dvec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0.0F};
}

/// What a light's samples are still to be multiplied with where lights are added up.
kernels::float4 colour_of(const Passes& p, std::size_t l) {
  return rgb(p.plan.sums() > 1 ? p.plan.lights[l].light.irradiance : glm::dvec3(1.0));
}

kernels::Window whole(const kernels::View& v, glm::ivec2 sample = {128, 128}) {
  kernels::Window w{};
  w.width = v.width;
  w.height = v.height;
  w.sample_x = sample.x;
  w.sample_y = sample.y;
  return w;
}

}  // namespace

glm::ivec2 subpixel_position(std::uint32_t i, std::uint32_t start) {
  const std::uint32_t k = i / 2;
  const std::uint32_t u = k * R2_STEP_U + kernels::hash(start), v = k * R2_STEP_V + kernels::hash(start ^ 0x68bc21ebU);
  const glm::ivec2 position(std::max(u >> 24, 1U), std::max(v >> 24, 1U));
  return i % 2 == 0 ? position : 256 - position;
}

std::uint32_t set_positions(kernels::Window& w, std::uint32_t first, std::uint32_t left) {
  w.log_positions = 0;
  while (2U << w.log_positions <= std::min(left, POSITIONS_SIDE_BY_SIDE)) ++w.log_positions;
  const std::uint32_t count = 1U << w.log_positions;
  std::fill(std::begin(w.subpixels), std::end(w.subpixels), 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::uvec2 s(subpixel_position(first + i, 0));
    w.subpixels[i / 2] |= (s.x | s.y << 8) << 16 * (i % 2);
  }
  const glm::ivec2 s = subpixel_position(first, 0);
  w.sample_x = s.x;
  w.sample_y = s.y;
  return count;
}

void setup_view(Passes& p, const kernels::View& view, Stage stage) {
  Geometry& g = p.geometry;
  if (g.set_up && same_bits(*g.set_up, view)) return;  // the records are this view's
  g.set_up = view;
  p.compute.launch("raster_setup", g.n_triangles, stage, view, g.positions, g.triangles, g.n_triangles, g.records);
}

void draw(Passes& p, const kernels::Window& window, const cl::Buffer& depth, const cl::Buffer* ids, Stage stage) {
  const Geometry& g = p.geometry;
  const Film& f = p.film;
  const cl::Buffer& open = window.restricted ? f.open : depth;
  if (window.restricted) {
    const bool first = !f.drawn || f.window.log_positions != window.log_positions;
    p.compute.launch("raster_clear", pixels(window), stage, window, open, first ? 1U : 0U, depth, *ids);
  } else {
    p.compute.fill(depth, NO_DEPTH, samples(window));
    if (ids) p.compute.fill(*ids, NO_TRIANGLE, samples(window));
  }
  p.compute.fill(g.n_large, 0, 1);
  p.compute.launch("raster_depth", g.n_records, stage, window, open, g.records, g.n_records, g.n_large, g.large, depth);
  p.compute.launch("raster_depth_large", large_items, stage, window, open, g.records, g.n_large, g.large, depth);
  if (!ids) return;
  p.compute.launch("raster_ids", g.n_records, stage, window, open, g.records, g.n_records, depth, *ids);
  p.compute.launch("raster_ids_large", large_items, stage, window, open, g.records, g.n_large, g.large, depth, *ids);
}

void make_light_maps(Passes& p, const std::vector<glm::dvec3>& points, std::uint32_t size) {
  LightMaps& m = p.light_maps;
  m.size = size;
  const std::size_t texels = std::size_t{size} * size;
  const std::vector<std::uint32_t> first = mip_offsets(glm::uvec2(size), 1);
  m.levels = static_cast<cl_uint>(first.size() - 1);
  for (std::size_t l = 0; l < p.plan.lights.size(); ++l) {
    const PlannedLight& planned = p.plan.lights[l];
    kernels::Light light{};
    light.view = orthographic_view(points, planned.light.towards, size);
    light.irradiance = rgb(p.plan.summed_irradiance(l) / static_cast<double>(planned.samples));
    light.samples = planned.samples;
    light.number = planned.number;
    light.map = static_cast<cl_uint>(2 * l * texels);
    light.extent = static_cast<cl_uint>(l * first.back());
    m.lights.push_back(light);
  }
  m.lights_buffer = p.compute.upload(m.lights);
  m.map = p.compute.buffer<kernels::float4>(2 * texels * m.lights.size());
  m.extent = p.compute.buffer<cl_float2>(p.plan.height_pyramids ? first.back() * m.lights.size() : 1);
  m.level_first = p.compute.upload(first);
  m.depth = p.compute.buffer<cl_uint>(texels);
  m.ids = p.compute.buffer<cl_uint>(texels);
}

void draw_light_maps(Passes& p, std::uint32_t epoch, bool shift) {
  LightMaps& m = p.light_maps;
  const Geometry& g = p.geometry;
  const cl_uint texels = m.size * m.size;
  for (std::size_t l = 0; l < m.lights.size(); ++l) {
    kernels::Light& light = m.lights[l];
    setup_view(p, light.view, Stage::light_map);
    for (std::uint32_t half = 0; half < 2; ++half) {
      const std::uint32_t start = kernels::hash_combine(p.seed, 2 * light.number + half);
      const kernels::Window window = whole(light.view, shift ? subpixel_position(epoch, start) : glm::ivec2(128));
      light.sample_x[half] = static_cast<float>(window.sample_x) / SUBPIXELS;
      light.sample_y[half] = static_cast<float>(window.sample_y) / SUBPIXELS;
      draw(p, window, m.depth, &m.ids, Stage::light_map);
      p.compute.launch("light_map_resolve", in_lanes(p, texels), Stage::light_map, light.view, window, m.ids,
                       g.positions, g.triangles, g.normals, light.map + half * texels, m.map);
    }
    if (!p.plan.height_pyramids) continue;
    p.compute.launch("light_map_extent", texels, Stage::light_map, texels, light.view.scale, m.map, light.map, m.extent,
                     light.extent);
    const std::vector<std::uint32_t> first = mip_offsets(glm::uvec2(m.size), 1);
    for (cl_uint level = 1, size = m.size; level < m.levels; ++level, size = (size + 1) / 2)
      p.compute.launch("light_map_extent_up", std::size_t{(size + 1) / 2} * ((size + 1) / 2), Stage::light_map, size,
                       light.extent + first[level - 1], light.extent + first[level], m.extent);
  }
  p.compute.assign(m.lights_buffer, m.lights);
}

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

void mark_needed(Passes& p, const kernels::View& view, const kernels::Window& window, const cl::Buffer& marks) {
  const Geometry& g = p.geometry;
  const Layers& k = p.layers;
  draw_film(p, view, window, false, Stage::plan);
  for (cl_uint i = 0; i < launches(p, window); ++i)
    p.compute.launch("gather_mark", in_lanes(p, window), Stage::plan, view, window, p.film.ids, g.positions,
                     g.triangles, g.normals, k.views_buffer, k.level_first_buffer, k.geometry, k.slots, 0U, k.count(),
                     i, marks);
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
  std::vector<cl_uint> slots(k.level_first[1], NO_TRIANGLE);
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

/// Where the guides of a light begin, after all maps' lists.
static cl_uint first_guide(const Passes& p, cl_uint l) {
  const cl_uint texels = p.light_maps.size * p.light_maps.size;
  return 2 * n_lights(p) * (1 + 2 * texels) + 2 * l * p.layers.n_tiles * GUIDE_SIZE;
}

void find_centres(Passes& p) {
  const Layers& k = p.layers;
  const Geometry& g = p.geometry;
  const LightMaps& m = p.light_maps;
  p.compute.launch("layers_points", k.n_points, Stage::layers, k.views_buffer, k.n_needed, k.needed, k.ids, g.positions,
                   g.triangles, g.normals, m.lights_buffer, m.map, p.plan.boundary, p.plan.density.parameters, p.rho,
                   m.extent, m.level_first, m.levels, n_lights(p), k.points, k.centres);
  if (k.n_tiles == 0) return;
  for (cl_uint l = 0; l < n_lights(p); ++l)
    p.compute.launch("guide_stands", k.n_tiles, Stage::layers, l, p.plan.density.parameters.h_min, k.views_buffer,
                     k.n_tiles, k.ids, g.positions, g.triangles, g.normals, k.n_needed, k.slots, k.centres, k.stands);
  make_guides(p);
}

void make_guides(Passes& p) {
  const Layers& k = p.layers;
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

namespace {

std::size_t items_of(const Passes& p, std::size_t points) {
  return p.plan.lanes == 1 ? 2 * points : (points + POINTS_SIDE_BY_SIDE - 1) / POINTS_SIDE_BY_SIDE;
}

/// At points of which the device knows how many there are, going by `items` for no more.
void launch_accumulate(Passes& p, const cl::Buffer& n, std::size_t items, const cl::Buffer& points,
                       const cl::Buffer& centres, cl_uint n_tiles, cl_uint l, std::uint32_t round, std::uint32_t rounds,
                       cl_uint add, const kernels::float4& colour, cl_uint first_value, const cl::Buffer& values,
                       Stage stage) {
  p.compute.launch("layers_accumulate", items, stage, n, points, centres, l, p.light_maps.lights_buffer,
                   p.light_maps.map, p.media, p.plan.boundary, p.plan.density.parameters, p.rho, p.layers.guides,
                   n_tiles > 0 ? first_guide(p, l) : 0U, p.seed, round, rounds, add, colour, first_value, values);
}

/// The round number `frame` of the layers' texels, of each light, to its own sums or to those of all.
void accumulate_texels(Passes& p, std::size_t items, std::uint32_t frame, Stage stage) {
  const Layers& k = p.layers;
  const bool own = p.plan.sums() > 1;
  for (cl_uint l = 0; l < n_lights(p); ++l)
    launch_accumulate(p, k.n_needed, items, k.points, k.centres, k.n_tiles, l, frame, 1,
                      frame > 0 || (l > 0 && !own) ? 1 : 0, rgb(glm::dvec3(1.0)), own ? l * k.n_points : 0,
                      own ? k.sums : k.values, stage);
}

}  // namespace

std::size_t accumulate_items(const Passes& p) { return items_of(p, p.layers.n_points); }

void try_accumulate(Passes& p, std::size_t items) { accumulate_texels(p, items, 0, Stage::plan); }

void accumulate_layers(Passes& p, std::uint32_t frame) {
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

void build_pyramids(Passes& p, std::uint32_t level) {
  const Layers& k = p.layers;
  for (cl_uint l = 1; l <= level && l < k.levels; ++l)
    p.compute.launch("pyramids_level", k.level_first[l + 1] - k.level_first[l], Stage::pyramids, k.views_buffer,
                     k.count(), l, k.level_first_buffer, k.n_points, k.geometry, k.slots, k.values);
}

namespace {

/// Adds pass 2's own function at one of a window's subpixel positions of the pixels in one of the film's lists, times
/// `sign`: `direct_points` at a time, as often as there might be pixels, since only the device knows how many there
/// are.
void launch_direct(Passes& p, const kernels::View& view, const kernels::Window& window, cl_uint position, cl_uint list,
                   std::uint32_t round, std::uint32_t rounds, float sign, cl_uint sets, Stage stage) {
  const Geometry& g = p.geometry;
  const LightMaps& m = p.light_maps;
  const Film& f = p.film;
  const auto all = static_cast<cl_uint>(pixels(window));
  for (cl_uint first = 0; first < all; first += direct_points) {
    const cl_uint most = std::min(all - first, direct_points);
    const std::size_t items = p.plan.lanes == 1 ? most : std::min(most, short_list);
    p.compute.launch("gather_points", items, stage, view, f.ids, window, g.positions, g.triangles, g.normals,
                     m.lights_buffer, m.map, p.plan.boundary, p.plan.density.parameters, p.rho, m.extent, m.level_first,
                     m.levels, n_lights(p), position, list, first, most, f.direct, f.n_direct, f.n_held, f.points,
                     f.centres);
    for (cl_uint l = 0; l < n_lights(p); ++l)
      launch_accumulate(p, f.n_held, items_of(p, most), f.points, f.centres, 0, l, round, rounds, l > 0 ? 1 : 0,
                        colour_of(p, l), 0, f.values, stage);
    p.compute.launch("gather_direct", items, stage, f.n_held, list, first, f.direct, f.points, f.values,
                     sign / static_cast<float>(rounds), sets, all, f.sums);
  }
}

}  // namespace

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
    launch_direct(p, view, window, i, i, round + i * rounds, rounds, 1.0F, sets, stage);
}

void find_edges(Passes& p, const kernels::View& view, const kernels::Window& window) {
  const Geometry& g = p.geometry;
  const Film& f = p.film;
  p.compute.fill(f.edges, 0, pixels(window));
  p.compute.launch("gather_edges", in_lanes(p, window), Stage::gather, view, window, f.ids, g.positions, g.triangles,
                   g.normals, f.edges);
}

void settle_film(Passes& p, const kernels::Window& window, std::size_t levels, std::uint32_t done,
                 std::uint32_t positions) {
  const Film& f = p.film;
  p.compute.launch("gather_settle", pixels(window), Stage::gather, window, f.edges,
                   static_cast<float>(positions) / static_cast<float>(done), static_cast<cl_uint>(levels), f.sums,
                   f.open);
}

void restrict_film(Passes& p, const kernels::View& view, kernels::Window& window) {
  Geometry& g = p.geometry;
  setup_view(p, view, Stage::gather);
  p.compute.launch("gather_cull", g.n_records, Stage::gather, window, p.film.open, g.n_records, g.records);
  g.set_up.reset();  // records are gone
  p.film.drawn.reset();
  window.restricted = 1;
}

void free_film(Passes& p, kernels::Window& window) {
  window.restricted = 0;
  p.film.drawn.reset();
}

void subtract_direct(Passes& p, const kernels::View& view, const kernels::Window& window,
                     const std::vector<cl_uint>& chosen, std::uint32_t round, std::uint32_t rounds, Stage stage) {
  if (chosen.empty()) return;
  p.compute.write(p.film.direct, chosen);
  p.compute.fill(p.film.n_direct, static_cast<cl_uint>(chosen.size()), 1);
  for (cl_uint i = 0; i < 1U << window.log_positions; ++i)
    launch_direct(p, view, window, i, 0, round + i * rounds, rounds, -1.0F, 1, stage);
}

}  // namespace parian
