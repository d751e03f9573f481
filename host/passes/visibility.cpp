// Candidate directions are tried on small films; the texels that cameras read are marked by the gather's own test.
#include "passes/visibility.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/raster.h"
#include "passes/raster.hpp"

namespace parian {
namespace {

constexpr float seen_cosine = 0.1F;  // more edge-on than that counts as unseen

/// The cosine at which each view and, after it, the one opposite sees each point of the surface; 0 where it doesn't.
std::vector<std::vector<float>> sight_of(Passes& p, const std::vector<kernels::View>& views, const SurfaceSight& s) {
  Geometry& g = p.geometry;
  g.set_up.reset();  // corners take the records' place
  using Buffer = Compute::Temporary;
  Buffer points(p.compute, p.compute.upload(s.points));
  const cl_uint n = static_cast<cl_uint>(s.points.size() / 2);
  constexpr std::size_t pixels = std::size_t{candidate_size} * candidate_size;
  Buffer quality(p.compute, p.compute.buffer<float>(2 * views.size() * n));
  Buffer nearest(p.compute, p.compute.buffer<cl_uint>(pixels)), farthest(p.compute, p.compute.buffer<cl_uint>(pixels));
  cl_uint first = 0;
  for (const kernels::View& view : views) {
    p.compute.fill(nearest, NO_DEPTH, pixels);
    p.compute.fill(farthest, 0, pixels);
    p.compute.launch("visibility_corners", g.n_positions, Stage::plan, view, g.positions, g.n_positions, g.records);
    p.compute.launch("visibility_sight", g.n_triangles, Stage::plan,
                     tiles({view.width, view.height}, candidate_size).front(), g.records, g.triangles, g.n_triangles,
                     nearest, farthest);
    p.compute.launch("visibility_cosines", n, Stage::plan, view, nearest, farthest, n, points, first, quality);
    first += 2 * n;
  }
  const std::vector<float> all = p.compute.read<float>(quality, 2 * views.size() * n);
  for (cl::Buffer* b : {&points, &quality, &nearest, &farthest}) p.compute.release(*b);
  std::vector<std::vector<float>> seen;
  for (auto at = all.begin(); at != all.end(); at += n) seen.emplace_back(at, at + n);
  return seen;
}

}  // namespace

std::vector<kernels::Window> tiles(glm::uvec2 film, std::uint32_t side) {
  std::vector<kernels::Window> all;
  for (std::uint32_t y = 0; y < film.y; y += side)
    for (std::uint32_t x = 0; x < film.x; x += side) {
      kernels::Window w{};
      w.x = x;
      w.y = y;
      w.width = std::min(side, film.x - x);
      w.height = std::min(side, film.y - y);
      w.sample_x = w.sample_y = SUBPIXELS / 2;
      all.push_back(w);
    }
  return all;
}

std::vector<kernels::View> place_layers(Passes& p, const std::vector<glm::dvec3>& positions,
                                        const std::vector<glm::uvec3>& triangles, std::uint32_t count,
                                        std::uint32_t size, SurfaceSight& sight, bool complete) {
  const SurfacePoints surface = surface_points(positions, triangles, surface_samples);
  for (std::size_t i = 0; i < surface.x.size(); ++i) {
    const glm::vec3 x(surface.x[i]), n(surface.n[i]);
    sight.points.push_back({x.x, x.y, x.z, 0.0F});
    sight.points.push_back({n.x, n.y, n.z, 0.0F});
  }
  std::vector<glm::dvec3> directions = even_directions(count);  // and, as candidates, their opposites
  const std::vector<glm::dvec3> more = even_directions(candidate_directions);
  directions.insert(directions.end(), more.begin(), more.begin() + candidate_directions / 2);
  std::vector<kernels::View> candidates;
  for (const glm::dvec3& d : directions) candidates.push_back(orthographic_view(positions, d, candidate_size));
  const std::vector<std::vector<float>> seen = sight_of(p, candidates, sight);

  sight.outside.assign(surface_samples, false);
  for (const auto& candidate : seen)
    for (std::size_t i = 0; i < surface_samples; ++i) sight.outside[i] = sight.outside[i] || candidate[i] > seen_cosine;
  const auto covered = [&](const std::vector<std::size_t>& chosen) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < surface_samples; ++i)
      n += std::any_of(chosen.begin(), chosen.end(), [&](std::size_t c) { return seen[c][i] > seen_cosine; });
    return n;
  };
  std::vector<std::size_t> even(count);
  for (std::size_t i = 0; i < even.size(); ++i) even[i] = 2 * i;
  const std::vector<std::size_t> greedy = choose_directions(seen, count, complete);
  std::vector<kernels::View> views;
  for (const std::size_t c : covered(greedy) >= covered(even) ? greedy : even)
    views.push_back(orthographic_view(positions, c % 2 == 0 ? directions[c / 2] : -directions[c / 2], size));
  return views;
}

double layer_coverage(Passes& p, const SurfaceSight& sight) {
  const Layers& k = p.layers;
  const cl_uint n = static_cast<cl_uint>(sight.outside.size());
  using Buffer = Compute::Temporary;
  Buffer points(p.compute, p.compute.upload(sight.points)), weights(p.compute, p.compute.buffer<float>(n));
  p.compute.launch("visibility_weight", (n + p.plan.lanes - 1) / p.plan.lanes, Stage::plan, n, points, k.views_buffer,
                   k.level_first_buffer, k.geometry, k.slots, 0U, k.count(), weights);
  const std::vector<float> weight = p.compute.read<float>(weights, n);
  for (cl::Buffer* b : {&points, &weights}) p.compute.release(*b);
  std::size_t visible = 0, covered = 0;
  for (std::size_t i = 0; i < n; ++i) {
    visible += sight.outside[i];
    covered += sight.outside[i] && weight[i] >= 1e-3F;
  }
  return visible ? static_cast<double>(covered) / static_cast<double>(visible) : 0.0;
}

double texels_per_pixel(const Layers& layers, const kernels::View& camera) {
  if (layers.views.empty()) return 0.0;
  const auto pixels_per_unit = [](const kernels::View& v) {
    return v.near_distance > 0 ? v.scale / std::max(std::hypot(v.origin.x, v.origin.y, v.origin.z), 1e-6F) : v.scale;
  };
  return pixels_per_unit(layers.views.front()) / std::max<double>(pixels_per_unit(camera), 1e-6);
}

std::vector<cl_uint> covered_texels(Passes& p) {
  const std::vector<cl_uint> slots = p.compute.read<cl_uint>(p.layers.slots, p.layers.level_first[1]);
  std::vector<cl_uint> texels;
  for (cl_uint t = 0; t < slots.size(); ++t)
    if (slots[t] != NO_SLOT) texels.push_back(t);
  return texels;
}

void mark_needed(Passes& p, const kernels::View& view, const kernels::Window& window, const cl::Buffer& marks) {
  const Geometry& g = p.geometry;
  const Layers& k = p.layers;
  draw_film(p, view, window, false, Stage::plan);
  for (cl_uint i = 0; i < launches(p, window); ++i)
    p.compute.launch("visibility_mark", in_lanes(p, window), Stage::plan, view, window, p.film.ids, g.positions,
                     g.triangles, g.normals, k.views_buffer, k.level_first_buffer, k.geometry, k.slots, 0U, k.count(),
                     i, marks);
}

std::vector<cl_uint> read_texels(Passes& p, const std::vector<kernels::View>& cameras, glm::uvec2 film) {
  const std::size_t count = p.layers.level_first[1];
  Compute::Temporary marks(p.compute, p.compute.buffer<cl_uint>(count));
  p.compute.fill(marks, 0, count);
  for (const kernels::View& view : cameras) {
    const double texels = texels_per_pixel(p.layers, view);
    const auto positions = static_cast<std::uint32_t>(std::clamp(8.0 * std::ceil(texels * texels), 8.0, 64.0));
    for (kernels::Window w : tiles(film, p.film.side))
      for (std::uint32_t i = 0; i < positions;) {
        i += set_positions(w, i, positions - i);
        mark_needed(p, view, w, marks);
      }
  }
  const std::vector<cl_uint> marked = p.compute.read<cl_uint>(marks, count);
  p.compute.release(marks);
  std::vector<cl_uint> texels;
  for (cl_uint t = 0; t < count; ++t)
    if (marked[t]) texels.push_back(t);
  return texels;
}

}  // namespace parian
