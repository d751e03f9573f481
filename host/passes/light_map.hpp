// Pass 1: the surface as each light sees it.
#pragma once
#include <CL/opencl.hpp>

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "kernels/types.h"
#include "scene/scene.hpp"

namespace parian {

struct Passes;

/// The light maps of both halves, their height pyramids, and the lights themselves.
struct LightMaps {
  std::vector<DirectionalLight> given;  ///< as they are now; at first as planned
  std::vector<kernels::Light> lights;
  cl::Buffer lights_buffer, map, extent, level_first;
  cl::Buffer depth, ids;
  cl_uint levels = 0, size = 0;
};

/// Makes room for maps of `size` texels a side, each fit to `points`.
void make_light_maps(Passes& p, const std::vector<glm::dvec3>& points, std::uint32_t size);
/// Sets light `l` to what is given; its map faces it, fit to `points`, or stays where it is.
void set_light(Passes& p, std::size_t l, const std::vector<glm::dvec3>* points);
/// (Re)draws the maps of all lights with the sub-texel shifts of `epoch`, and their height pyramids. Guides go by them,
/// and are made anew before the next samples.
void draw_light_maps(Passes& p, std::uint32_t epoch, bool shift);

}  // namespace parian
