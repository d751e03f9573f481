// Pass 1: the maps of all lights, and their height pyramids.
#include "passes/light_map.hpp"

#include "kernels/raster.h"
#include "kernels/sampling.h"
#include "passes/passes.hpp"
#include "passes/raster.hpp"

namespace parian {

void make_light_maps(Passes& p, const std::vector<glm::dvec3>& points, std::uint32_t size) {
  LightMaps& m = p.light_maps;
  m.size = size;
  const std::size_t texels = std::size_t{size} * size;
  const std::vector<std::uint32_t> first = mip_offsets(glm::uvec2(size), 1);
  m.levels = static_cast<cl_uint>(first.size() - 1);
  for (std::size_t l = 0; l < p.plan.lights.size(); ++l) {
    const PlannedLight& planned = p.plan.lights[l];
    kernels::Light light{};
    light.samples = planned.samples;
    light.number = planned.number;
    light.map = static_cast<cl_uint>(2 * l * texels);
    light.extent = static_cast<cl_uint>(l * first.back());
    m.lights.push_back(light);
    m.given.push_back(planned.light);
    set_light(p, l, &points);
  }
  m.lights_buffer = p.compute.upload(m.lights);
  m.map = p.compute.buffer<kernels::float4>(2 * texels * m.lights.size());
  m.extent = p.compute.buffer<cl_float2>(p.plan.height_pyramids ? first.back() * m.lights.size() : 1);
  m.level_first = p.compute.upload(first);
  m.depth = p.compute.buffer<cl_uint>(texels);
  m.ids = p.compute.buffer<cl_uint>(texels);
}

void set_light(Passes& p, std::size_t l, const std::vector<glm::dvec3>* points) {
  const DirectionalLight& given = p.light_maps.given[l];
  kernels::Light& light = p.light_maps.lights[l];
  if (points) light.view = orthographic_view(*points, given.towards, p.light_maps.size);
  light.irradiance =
      to_float4((p.plan.unit_lights ? glm::dvec3(1.0) : given.irradiance) / static_cast<double>(light.samples));
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
  p.layers.guided = false;
}

}  // namespace parian
