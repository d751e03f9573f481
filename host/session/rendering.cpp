// From the scene's structs to the API's, and back.
#include "session/rendering.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "api/api_marked.hpp"
#include "core/error.hpp"
#include "core/words.hpp"
#include "session/program_folder.hpp"

namespace parian {
namespace {

void copy(glm::dvec3 v, double (&to)[3]) {
  for (int c = 0; c < 3; ++c) to[c] = v[c];
}

v0::Renderer create(const std::string& selector, std::function<void()>& step) {
  auto info = make<parian_create_info>();
  info.selector = selector.c_str();
  info.cancel = [](void* user) {
    const auto& call = *static_cast<const std::function<void()>*>(user);
    if (call) call();
    return 0;
  };
  info.user = &step;
  return v0::Renderer(info);
}

void set_settings(v0::Renderer& renderer, const Settings& s) {
  auto t = make<parian_settings>();
  t.error = s.error;
  t.layers = s.layers;
  t.layer_size = s.layer_size;
  t.light_map_size = s.light_map_size;
  t.light_map_shift = s.light_map_shift;
  t.samples = s.samples;
  t.model = static_cast<parian_model>(s.model);
  t.estimator = static_cast<parian_estimator>(s.estimator);
  t.disc_radius = s.disc_radius;
  t.views = static_cast<parian_views>(s.gather);
  t.fixed_cameras = 1;
  t.pyramids = s.pyramids;
  t.seed = s.seed;
  t.frames = s.frames;
  std::string keep;
  for (const std::string& name : s.keep) keep += (keep.empty() ? "" : ",") + name;
  t.keep = keep.c_str();
  t.force = s.force;
  t.time_stages = 1;
  renderer.set(t);
}

void set_mesh(v0::Renderer& renderer, Mesh& mesh) {
  static_assert(sizeof(glm::dvec3) == 3 * sizeof(double) && sizeof(glm::uvec3) == 3 * sizeof(std::uint32_t));
  auto t = make<parian_mesh>();
  t.n_positions = static_cast<std::uint32_t>(mesh.positions.size());
  t.n_triangles = static_cast<std::uint32_t>(mesh.triangles.size());
  t.positions_double = &mesh.positions.data()->x;
  t.indices = &mesh.triangles.data()->x;
  t.normals = &mesh.normals.data()->x;
  t.normals_kind = PARIAN_NORMALS_PER_CORNER;
  t.for_one_plan = 1;
  renderer.set(t);
  mesh.positions = {};
  mesh.triangles = {};
  mesh.normals = {};
}

/// Runs `f`, turning failures of the API into Error.
template <class F>
decltype(auto) with_errors(F&& f) {
  try {
    return f();
  } catch (const Failure& failure) {
    const ErrorKind kind = failure.status() == PARIAN_INVALID_ARGUMENT ? ErrorKind::usage
                           : failure.status() == PARIAN_INVALID_SCENE  ? ErrorKind::input
                                                                       : ErrorKind::device;
    throw Error(kind, in_command_words(marked_message()), failure.opencl_code());
  }
}

void set_scene(v0::Renderer& renderer, Scene& scene) {
  set_mesh(renderer, scene.mesh);
  auto material = make<parian_material>();
  copy(scene.material.sigma_s, material.sigma_s);
  copy(scene.material.sigma_a, material.sigma_a);
  copy(scene.material.g, material.g);
  material.ior = scene.material.ior;
  material.name = scene.material.name.c_str();
  renderer.set(material);
  std::vector<parian_light> lights(scene.lights.size(), make<parian_light>());
  for (std::size_t i = 0; i < lights.size(); ++i) {
    copy(scene.lights[i].towards, lights[i].towards);
    copy(scene.lights[i].irradiance, lights[i].irradiance);
  }
  renderer.set(lights);
  std::vector<parian_camera> cameras(scene.cameras.size(), make<parian_camera>());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    copy(scene.cameras[i].eye, cameras[i].eye);
    copy(scene.cameras[i].target, cameras[i].target);
    copy(scene.cameras[i].up, cameras[i].up);
    cameras[i].fov = scene.cameras[i].fov;
  }
  renderer.set(cameras, scene.film.x, scene.film.y);
}

Seconds seconds_of(const parian_seconds& s) {
  return {0, s.plan, s.compile, s.light_map, s.layers, s.pyramids, s.gather, s.bias, s.read, 0};
}

}  // namespace

Rendering::Rendering(Scene scene, const Settings& settings, const std::string& selector, std::function<void()> step)
    : film_(scene.film),
      step_(std::make_unique<std::function<void()>>(std::move(step))),
      renderer_(with_errors([&] { return create(selector, *step_); })) {
  const ProgramFolder programs = program_folder(renderer_.device().platform);
  doubt_ = programs.doubt;
  with_errors([&] {
    if (!programs.path.empty()) renderer_.set_cache(programs.path.c_str());
    set_settings(renderer_, settings);
    set_scene(renderer_, scene);
    renderer_.plan();
  });
  *step_ = {};
}

void Rendering::frame() {
  with_errors([&] { renderer_.frame(); });
  ++frames_;
}

bool Rendering::estimate_due() const {
  return with_errors([&] { return renderer_.estimate_due(); });
}

double Rendering::estimate() {
  return with_errors([&] { return renderer_.estimate(); });
}

Image Rendering::image(std::size_t camera) {
  Image image{film_.x, film_.y, std::vector<float>(std::size_t{4} * film_.x * film_.y), -1.0, {}};
  image.estimated_relmse = with_errors([&] { return renderer_.read(camera, image.rgba); });
  return image;
}

std::vector<std::string> Rendering::explanation() const {
  return with_errors([&] { return renderer_.explanation(); });
}

DeviceInfo Rendering::device() const {
  const parian_device d = renderer_.device();
  DeviceInfo info;
  info.index = d.index;
  info.name = d.name;
  info.platform = d.platform;
  info.vendor = d.vendor;
  info.driver = d.driver;
  info.version = d.version;
  info.compute_units = d.compute_units;
  info.vector_width = d.lanes;
  return info;
}

Statistics Rendering::statistics() const {
  const parian_statistics s = renderer_.statistics();
  Statistics t;
  t.frames = s.frames;
  t.estimated_relmse = s.estimated_relmse;
  t.estimated_bias_relmse = s.estimated_bias_relmse;
  t.evaluations = s.evaluations;
  t.bias_evaluations = s.bias_evaluations;
  t.seconds = seconds_of(s.seconds);
  t.kernel_seconds = seconds_of(s.kernel_seconds);
  const parian_seconds& k = s.kernel_seconds;
  t.kernel_seconds.total = k.plan + k.light_map + k.layers + k.pyramids + k.gather + k.bias;
  t.layers_count = s.layers_count;
  t.layers_size = s.layers_size;
  t.layers_covered = s.layers_covered;
  t.layers_texels = s.layers_texels;
  t.layers_texels_evaluated = s.layers_texels_evaluated;
  t.fallback_pixels = s.fallback_pixels;
  t.bytes_peak = s.bytes_peak;
  t.bytes_planned = s.bytes_planned;
  t.nonfinite = s.nonfinite;
  t.further_view_seconds = s.further_view_seconds;
  if (!doubt_.empty()) t.warnings.push_back(doubt_);
  for (const std::string& warning : marked_warnings(renderer_.get())) t.warnings.push_back(in_command_words(warning));
  for (const parian_omission& o : renderer_.omissions()) t.left_out.push_back({o.what, o.why, o.unit, o.count, false});
  return t;
}

}  // namespace parian
