// What all passes share: a device, the plan, and the buffers between them.
#pragma once
#include "core/compute.hpp"
#include "passes/gather.hpp"
#include "passes/geometry.hpp"
#include "passes/layers.hpp"
#include "passes/light_map.hpp"
#include "plan/plan.hpp"

namespace parian {

struct Passes {
  Passes(Compute& c, const Plan& p) : compute(c), plan(p) { film.side = plan.window; }

  Compute& compute;
  const Plan& plan;
  Geometry geometry;
  cl::Buffer media, rho;
  LightMaps light_maps;
  Layers layers;
  Film film;
  cl_uint seed = 0;
};

[[nodiscard]] inline cl_uint n_lights(const Passes& p) { return static_cast<cl_uint>(p.light_maps.lights.size()); }

}  // namespace parian
