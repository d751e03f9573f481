// What the reference asks of Embree, apart from everything else: Embree brings TBB, of which a process has one, and
// drivers of OpenCL may need a newer one. So this is a module, which reference_surface.cpp loads after them.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

namespace parian::rays {

/// A ray without end.
struct Ray {
  glm::dvec3 origin{}, direction{};  // Embree takes them in float32
};

/// The triangle that a ray meets first, and the barycentric coordinates of its second and third corner.
struct Hit {
  std::uint32_t triangle = 0;
  float u = 0, v = 0;
};

/// Says of each triangle that Embree takes for an occluder whether it is one.
class Occluders {
 public:
  [[nodiscard]] virtual bool has(std::uint32_t triangle) const = 0;
  Occluders(const Occluders&) = delete;
  Occluders& operator=(const Occluders&) = delete;

 protected:
  Occluders() = default;
  ~Occluders() = default;
};

/// Triangles as Embree keeps them. Several threads may ask at once.
class Tracer {
 public:
  Tracer() = default;
  virtual ~Tracer() = default;
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  [[nodiscard]] virtual std::optional<Hit> first_hit(const Ray& ray) const = 0;
  /// Whether the ray meets one of `occluders`.
  [[nodiscard]] virtual bool is_occluded(const Ray& ray, const Occluders& occluders) const = 0;
};

/// What the module hands over under the name "parian_rays": it makes a tracer, which needs neither argument afterwards.
/// Throws Error(device) when Embree refuses.
using MakeTracer = std::unique_ptr<Tracer> (*)(const std::vector<glm::dvec3>& positions,
                                               const std::vector<glm::uvec3>& triangles);

}  // namespace parian::rays
