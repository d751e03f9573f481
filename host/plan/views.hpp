// Views of the object: light maps, layers and cameras, all in object units (centre at 0, bounding radius 1).
#pragma once
#include <glm/glm.hpp>
#include <vector>

#include "kernels/types.h"
#include "scene/scene.hpp"

namespace parian {

/// A vector as kernels take it, with w = 0.
[[nodiscard]] inline kernels::float4 to_float4(glm::dvec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z), 0.0F};
}

/// World millimetres to object units: (p - centre) / radius, in double before anything becomes float.
struct ObjectSpace {
  glm::dvec3 centre{};
  double radius = 1.0;  ///< mm; of the sphere around the box's centre that holds all positions
};
[[nodiscard]] ObjectSpace object_space(const std::vector<glm::dvec3>& positions);

/// The orthographic view from direction `towards` (unit, from the object to the viewer) that fits `points` (object
/// units) into a square film of `size` pixels with one pixel to spare.
[[nodiscard]] kernels::View orthographic_view(const std::vector<glm::dvec3>& points, glm::dvec3 towards,
                                              std::uint32_t size);

/// The pinhole view of a camera (world mm), near plane at 1e-4 of the distance to the object's centre.
[[nodiscard]] kernels::View pinhole_view(const Camera& camera, const ObjectSpace& space, glm::uvec2 film);

/// A camera's own view as a layer: the same, with sides halved until it has at most 2^20 texels.
[[nodiscard]] kernels::View camera_layer(kernels::View camera);

/// Whether the object's centre lies in front of the camera and in its film.
[[nodiscard]] bool centre_in_film(const kernels::View& pinhole);

/// True when some triangle may need clipping: the object reaches the near plane or leaves the guard band.
[[nodiscard]] bool needs_clipping(const kernels::View& pinhole);

/// Points whose views hold the sphere of radius 1: of a mesh that nobody on the host has seen.
[[nodiscard]] std::vector<glm::dvec3> sphere_points();

/// `count` directions spread evenly over the sphere (Fibonacci lattice).
[[nodiscard]] std::vector<glm::dvec3> even_directions(std::size_t count);

/// Points spread evenly over the surface by area, with geometric normals; object units.
struct SurfacePoints {
  std::vector<glm::dvec3> x, n;
};
[[nodiscard]] SurfacePoints surface_points(const std::vector<glm::dvec3>& positions,
                                           const std::vector<glm::uvec3>& triangles, std::size_t count);

/// Chooses `count` of the candidate directions greedily, each by the surface that it adds: quality[c][p] is the cosine
/// at which candidate c sees point p, 0 where it doesn't. A point is worth its best cosine, sight counting most. Where
/// no candidate adds anything any more, the choice ends early, unless it has to be `complete`.
[[nodiscard]] std::vector<std::size_t> choose_directions(const std::vector<std::vector<float>>& quality,
                                                         std::size_t count, bool complete = false);

}  // namespace parian
