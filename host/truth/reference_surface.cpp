// Embree finds the triangle; what matters of the hit is computed anew in double.
#include "truth/reference_surface.hpp"

#include <algorithm>
#include <cmath>

#include "io/module.hpp"

namespace parian {
namespace {

constexpr double step_back = 1e-6;    // light rays start behind their place: float32 puts coinciding triangles there
constexpr double coincident = 1e-10;  // distance up to which two triangles count as meeting in a place

rays::MakeTracer make_tracer() {
  static const auto* make = static_cast<const rays::MakeTracer*>(
      module_symbol(PARIAN_RAYS, "parian_rays", ErrorKind::device, "the reference can't trace rays"));
  return *make;
}

/// What lies before a place on a light ray, in double: not its own triangle, nor neighbours that rounding moved above
/// it.
class Before final : public rays::Occluders {
 public:
  Before(const ReferenceSurface& surface, glm::dvec3 x, glm::dvec3 towards, std::uint32_t triangle)
      : surface_(surface), x_(x), towards_(towards), triangle_(triangle) {}
  [[nodiscard]] bool has(std::uint32_t other) const override {
    const double distance = surface_.plane_distance(other, x_, towards_);
    return other != triangle_ && (distance > coincident || (distance >= -coincident && other < triangle_));
  }

 private:
  const ReferenceSurface& surface_;
  glm::dvec3 x_, towards_;
  std::uint32_t triangle_;
};

}  // namespace

ReferenceSurface::ReferenceSurface(const Mesh& mesh, const ObjectSpace& space) : mesh_(mesh) {
  positions_.reserve(mesh.positions.size());
  for (const glm::dvec3& p : mesh.positions) positions_.push_back((p - space.centre) / space.radius);
  tracer_ = make_tracer()(positions_, mesh.triangles);
}

double ReferenceSurface::plane_distance(std::uint32_t triangle, glm::dvec3 origin, glm::dvec3 direction) const {
  const glm::uvec3& t = mesh_.triangles[triangle];
  const glm::dvec3 v0 = positions_[t.x];
  const glm::dvec3 n = glm::cross(positions_[t.y] - v0, positions_[t.z] - v0);
  return glm::dot(v0 - origin, n) / glm::dot(direction, n);
}

std::optional<SurfacePlace> ReferenceSurface::first_hit(glm::dvec3 origin, glm::dvec3 direction, double from) const {
  // Rays start at the bounding sphere, where float32 is as fine as on the mesh, however far away the viewer is.
  const double along = -glm::dot(origin, direction);
  const glm::dvec3 nearest = origin + along * direction;
  const double half_chord_squared = 1.0 + 1e-6 - glm::dot(nearest, nearest);
  if (half_chord_squared < 0.0) return std::nullopt;
  const double begin = std::max(from, along - std::sqrt(half_chord_squared));
  const std::optional<rays::Hit> hit = tracer_->first_hit({origin + begin * direction, direction});
  if (!hit) return std::nullopt;
  // The ray against the triangle's plane, as barycentric coordinates; clamped, since Embree rounds at edges.
  SurfacePlace place{hit->triangle, hit->u, hit->v};
  const glm::uvec3& t = mesh_.triangles[place.triangle];
  const glm::dvec3 v0 = positions_[t.x], e1 = positions_[t.y] - v0, e2 = positions_[t.z] - v0;
  const glm::dvec3 p = glm::cross(direction, e2), s = origin - v0, q = glm::cross(s, e1);
  const double determinant = glm::dot(e1, p);
  const double u = glm::dot(s, p) / determinant, v = glm::dot(direction, q) / determinant;
  if (std::isfinite(u) && std::isfinite(v)) {
    place.u = std::clamp(u, 0.0, 1.0);
    place.v = std::clamp(v, 0.0, 1.0);
  }
  const double excess = std::max(place.u + place.v, 1.0);
  place.u /= excess;
  place.v /= excess;
  return place;
}

SurfacePoint ReferenceSurface::at(const SurfacePlace& place, glm::dvec3 viewer) const {
  const glm::uvec3& t = mesh_.triangles[place.triangle];
  const glm::dvec3 v0 = positions_[t.x], e1 = positions_[t.y] - v0, e2 = positions_[t.z] - v0;
  const glm::vec3* n = &mesh_.normals[3 * std::size_t{place.triangle}];
  SurfacePoint point;
  point.x = v0 + place.u * e1 + place.v * e2;
  point.n_g = glm::normalize(glm::cross(e1, e2));
  point.n_s = glm::normalize((1.0 - place.u - place.v) * glm::dvec3(n[0]) + place.u * glm::dvec3(n[1]) +
                             place.v * glm::dvec3(n[2]));
  if (glm::dot(point.n_g, viewer) < 0.0) {
    point.n_g = -point.n_g;
    point.n_s = -point.n_s;
  }
  return point;
}

bool ReferenceSurface::is_lit(glm::dvec3 x, std::uint32_t triangle, glm::dvec3 towards) const {
  return !tracer_->is_occluded({x - step_back * towards, towards}, Before(*this, x, towards, triangle));
}

}  // namespace parian
