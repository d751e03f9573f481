// Embree finds the triangle; what matters of the hit is computed anew in double.
#include "reference_surface.hpp"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "error.hpp"

namespace parian {
namespace {

constexpr double step_back = 1e-6;    // light rays start behind their place: float32 puts coinciding triangles there
constexpr double coincident = 1e-10;  // distance up to which two triangles count as meeting in a place

/// A light ray as the filter needs it, in double.
struct LightRay {
  RTCIntersectContext context;  // first, so that Embree's pointer to it is one to the whole
  const ReferenceSurface* surface;
  glm::dvec3 x, towards;
  std::uint32_t triangle;
};

/// Rejects what Embree took for an occluder and isn't: the place's own triangle, and neighbours that rounding moved
/// above it.
void keep_occluders(const RTCFilterFunctionNArguments* arguments) {
  const auto& ray = *reinterpret_cast<const LightRay*>(arguments->context);
  const unsigned other = RTCHitN_primID(arguments->hit, arguments->N, 0);
  const double distance = ray.surface->plane_distance(other, ray.x, ray.towards);
  const bool before = distance > coincident || (distance >= -coincident && other < ray.triangle);
  if (other == ray.triangle || !before) arguments->valid[0] = 0;
}

RTCRay make_ray(glm::dvec3 origin, glm::dvec3 direction) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x);
  ray.org_y = static_cast<float>(origin.y);
  ray.org_z = static_cast<float>(origin.z);
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tnear = 0.0F;
  ray.tfar = std::numeric_limits<float>::infinity();
  ray.mask = ~0U;
  return ray;
}

}  // namespace

struct ReferenceSurface::Embree {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = device ? rtcNewScene(device) : nullptr;
  ~Embree() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  Embree() = default;
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;
  void check() const {
    const RTCError error = rtcGetDeviceError(device);
    if (!device || error != RTC_ERROR_NONE) {
      throw Error(ErrorKind::device,
                  fmt::format("Embree refused the mesh (error {}); use a smaller one", static_cast<int>(error)));
    }
  }
};

ReferenceSurface::ReferenceSurface(const Mesh& mesh, const ObjectSpace& space)
    : mesh_(mesh), embree_(std::make_unique<Embree>()) {
  positions_.reserve(mesh.positions.size());
  for (const glm::dvec3& p : mesh.positions) positions_.push_back((p - space.centre) / space.radius);
  embree_->check();
  const RTCGeometry geometry = rtcNewGeometry(embree_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<glm::vec3*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(glm::vec3), positions_.size()));
  auto* corners = static_cast<glm::uvec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   sizeof(glm::uvec3), mesh.triangles.size()));
  if (vertices && corners) {
    std::transform(positions_.begin(), positions_.end(), vertices, [](glm::dvec3 p) { return glm::vec3(p); });
    std::copy(mesh.triangles.begin(), mesh.triangles.end(), corners);
    rtcSetGeometryOccludedFilterFunction(geometry, keep_occluders);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(embree_->scene, geometry);
    rtcSetSceneFlags(embree_->scene, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(embree_->scene);
  }
  rtcReleaseGeometry(geometry);
  embree_->check();
}

ReferenceSurface::~ReferenceSurface() = default;

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
  RTCRayHit hit{};
  hit.ray = make_ray(origin + begin * direction, direction);
  hit.hit.geomID = hit.hit.primID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(embree_->scene, &context, &hit);
  if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  // The ray against the triangle's plane, as barycentric coordinates; clamped, since Embree rounds at edges.
  SurfacePlace place{hit.hit.primID, hit.hit.u, hit.hit.v};
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
  LightRay light{{}, this, x, towards, triangle};
  rtcInitIntersectContext(&light.context);
  RTCRay ray = make_ray(x - step_back * towards, towards);
  rtcOccluded1(embree_->scene, &light.context, &ray);
  return ray.tfar >= 0.0F;
}

}  // namespace parian
