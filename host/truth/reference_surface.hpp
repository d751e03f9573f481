// The surface that the reference renders: the mesh in double, and what a ray meets first on it.
#pragma once
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "plan/views.hpp"
#include "scene/scene.hpp"
#include "truth/rays/rays.hpp"

namespace parian {

/// A place on the mesh: a triangle and the barycentric coordinates of its second and third corner.
struct SurfacePlace {
  std::uint32_t triangle = 0;
  double u = 0, v = 0;
};

/// The surface at a place, both normals turned to the viewer.
struct SurfacePoint {
  glm::dvec3 x{};    ///< object units
  glm::dvec3 n_g{};  ///< geometric normal
  glm::dvec3 n_s{};  ///< shading normal, interpolated from the corners'
};

/// A mesh in object units (centre at 0, bounding radius 1). Embree chooses triangles in float32; places and distances
/// come from the mesh's own vertices in double.
class ReferenceSurface {
 public:
  /// Keeps a reference to `mesh`. Throws Error(device) when Embree refuses, or isn't there.
  ReferenceSurface(const Mesh& mesh, const ObjectSpace& space);

  [[nodiscard]] const std::vector<glm::dvec3>& positions() const { return positions_; }
  [[nodiscard]] const std::vector<glm::uvec3>& triangles() const { return mesh_.triangles; }

  /// Where the ray from `origin` along `direction` (unit) first meets the surface beyond the distance `from`.
  [[nodiscard]] std::optional<SurfacePlace> first_hit(glm::dvec3 origin, glm::dvec3 direction, double from) const;
  /// The surface as seen from the direction `viewer`.
  [[nodiscard]] SurfacePoint at(const SurfacePlace& place, glm::dvec3 viewer) const;
  /// Whether the place `x` on `triangle` is the first that light from the direction `towards` (unit) meets. Of
  /// triangles that coincide there, the one with the lowest number is.
  [[nodiscard]] bool is_lit(glm::dvec3 x, std::uint32_t triangle, glm::dvec3 towards) const;
  /// Distance along the ray at which it meets the plane of `triangle`; not finite where they are parallel.
  [[nodiscard]] double plane_distance(std::uint32_t triangle, glm::dvec3 origin, glm::dvec3 direction) const;

 private:
  const Mesh& mesh_;
  std::vector<glm::dvec3> positions_;
  std::unique_ptr<rays::Tracer> tracer_;
};

}  // namespace parian
