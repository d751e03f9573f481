// Rays by Embree, 3 or 4: between these, calls and contexts have other names.
#include "truth/rays/rays.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "core/error.hpp"

#if PARIAN_EMBREE >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace parian::rays {
namespace {

#if PARIAN_EMBREE >= 4
using Context = RTCRayQueryContext;

void begin(Context& context) { rtcInitRayQueryContext(&context); }

void intersect(RTCScene scene, Context& context, RTCRayHit& hit) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context;
  rtcIntersect1(scene, &hit, &arguments);
}

void occlude(RTCScene scene, Context& context, RTCRay& ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.context = &context;
  rtcOccluded1(scene, &ray, &arguments);
}
#else
using Context = RTCIntersectContext;

void begin(Context& context) { rtcInitIntersectContext(&context); }

void intersect(RTCScene scene, Context& context, RTCRayHit& hit) { rtcIntersect1(scene, &context, &hit); }

void occlude(RTCScene scene, Context& context, RTCRay& ray) { rtcOccluded1(scene, &context, &ray); }
#endif

/// What the filter gets to see of a light ray.
struct LightRay {
  Context context;  // first, so that Embree's pointer to it is one to the whole
  const Occluders* occluders;
};

void keep_occluders(const RTCFilterFunctionNArguments* arguments) {
  const auto& ray = *reinterpret_cast<const LightRay*>(arguments->context);
  if (!ray.occluders->has(RTCHitN_primID(arguments->hit, arguments->N, 0))) arguments->valid[0] = 0;
}

RTCRay embree_ray(const Ray& from) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(from.origin.x);
  ray.org_y = static_cast<float>(from.origin.y);
  ray.org_z = static_cast<float>(from.origin.z);
  ray.dir_x = static_cast<float>(from.direction.x);
  ray.dir_y = static_cast<float>(from.direction.y);
  ray.dir_z = static_cast<float>(from.direction.z);
  ray.tnear = 0.0F;
  ray.tfar = std::numeric_limits<float>::infinity();
  ray.mask = ~0U;
  return ray;
}

class EmbreeTracer final : public Tracer {
 public:
  EmbreeTracer() : device_(rtcNewDevice(nullptr)), scene_(device_ ? rtcNewScene(device_) : nullptr) {}
  ~EmbreeTracer() override {
    if (scene_) rtcReleaseScene(scene_);
    if (device_) rtcReleaseDevice(device_);
  }
  EmbreeTracer(const EmbreeTracer&) = delete;
  EmbreeTracer& operator=(const EmbreeTracer&) = delete;

  void set(const std::vector<glm::dvec3>& positions, const std::vector<glm::uvec3>& triangles) {
    check();
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<glm::vec3*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(glm::vec3), positions.size()));
    auto* corners = static_cast<glm::uvec3*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(glm::uvec3), triangles.size()));
    if (vertices && corners) {
      std::transform(positions.begin(), positions.end(), vertices, [](glm::dvec3 p) { return glm::vec3(p); });
      std::copy(triangles.begin(), triangles.end(), corners);
      rtcSetGeometryOccludedFilterFunction(geometry, keep_occluders);
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(scene_, geometry);
      rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
      rtcCommitScene(scene_);
    }
    rtcReleaseGeometry(geometry);
    check();
  }

  [[nodiscard]] std::optional<Hit> first_hit(const Ray& ray) const override {
    RTCRayHit hit{};
    hit.ray = embree_ray(ray);
    hit.hit.geomID = hit.hit.primID = RTC_INVALID_GEOMETRY_ID;
    Context context;
    begin(context);
    intersect(scene_, context, hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return Hit{hit.hit.primID, hit.hit.u, hit.hit.v};
  }

  [[nodiscard]] bool is_occluded(const Ray& ray, const Occluders& occluders) const override {
    LightRay light{{}, &occluders};
    begin(light.context);
    RTCRay to_light = embree_ray(ray);
    occlude(scene_, light.context, to_light);
    return to_light.tfar < 0.0F;
  }

 private:
  void check() const {
    const RTCError error = rtcGetDeviceError(device_);
    if (!device_ || error != RTC_ERROR_NONE)
      throw Error(ErrorKind::device,
                  "Embree refused the mesh (error " + std::to_string(error) + "); use a smaller one");
  }

  RTCDevice device_;
  RTCScene scene_;
};

std::unique_ptr<Tracer> make_tracer(const std::vector<glm::dvec3>& positions,
                                    const std::vector<glm::uvec3>& triangles) {
  auto tracer = std::make_unique<EmbreeTracer>();
  tracer->set(positions, triangles);
  return tracer;
}

}  // namespace
}  // namespace parian::rays

extern "C" [[gnu::visibility("default")]] const parian::rays::MakeTracer parian_rays;

const parian::rays::MakeTracer parian_rays = parian::rays::make_tracer;
