// The C API's border, what is given: arguments are checked here, and whatever goes wrong inside becomes a status and a
// line of text.
#include <parian/parian.h>

#include <algorithm>

#include "api/api_call.hpp"
#include "core/embedded.hpp"
#include "plan/plan.hpp"
#include "scene/limits.hpp"
#include "scene/medium.hpp"

namespace {

using namespace parian;

bool same_lights(const std::vector<DirectionalLight>& a, const std::vector<DirectionalLight>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.towards == y.towards && x.irradiance == y.irradiance;
  });
}

}  // namespace

extern "C" {

const char* parian_version(void) { return parian::version; }
const char* parian_message(void) { return last_failure().message.c_str(); }
cl_int parian_opencl_code(void) { return last_failure().code; }

parian_status parian_create(const parian_create_info* given, parian_renderer** renderer) {
  return caught([&] {
    const parian_create_info info = taken(given, "create_info");
    if (!renderer) refuse("renderer: it is NULL; give a place for the pointer");
    if ((info.context != nullptr) != (info.device != nullptr))
      refuse("create_info: one of context and device is NULL; give both or none");
    auto r = std::make_unique<parian_renderer>();
    r->compute = info.context ? std::make_shared<parian::Compute>(info.context, info.device)
                              : std::make_shared<parian::Compute>(info.selector ? info.selector : "");
    r->settings.still = r->settings.time_stages = false;
    if (info.cancel) r->compute->ask([cancel = info.cancel, user = info.user] { return cancel(user) != 0; });
    *renderer = r.release();
  });
}

void parian_release(parian_renderer* renderer) {
  if (!renderer) return;
  if (renderer->compute->abandoned()) return;  // so are its objects
  undo_plan(*renderer);
  renderer->compute->drain();
  delete renderer;
}

parian_status parian_get_opencl(const parian_renderer* renderer, cl_context* context, cl_device_id* device) {
  return with(renderer, [&](const parian_renderer& r) {
    if (context) *context = r.compute->context()();
    if (device) *device = r.compute->device()();
  });
}

parian_status parian_get_device(const parian_renderer* renderer, parian_device* device) {
  return with(renderer, [&](const parian_renderer& r) {
    const parian::DeviceInfo& i = r.compute->info();
    give(device,
         parian_device{0, i.name.c_str(), i.platform.c_str(), i.vendor.c_str(), i.driver.c_str(), i.version.c_str(),
                       i.compute_units, i.vector_width, i.index},
         "device");
  });
}

parian_status parian_default_settings(parian_settings* settings) {
  return caught([&] {
    const parian::Settings d;
    parian_settings s{};
    s.error = d.error;
    s.layers = d.layers;
    s.layer_size = d.layer_size;
    s.light_map_size = d.light_map_size;
    s.light_map_shift = d.light_map_shift;
    s.samples = d.samples;
    s.pyramids = d.pyramids;
    s.seed = d.seed;
    s.frames = d.frames;
    give(settings, s, "settings");
  });
}

parian_status parian_find_material(const char* name, parian_material* material) {
  return caught([&] {
    if (!name) refuse("name: it is NULL; give one that 'parian materials' lists");
    const parian::Material found = parian::find_material(name);
    parian_material m{};
    for (int c = 0; c < 3; ++c) {
      m.sigma_s[c] = found.sigma_s[c];
      m.sigma_a[c] = found.sigma_a[c];
      m.g[c] = found.g[c];
    }
    m.ior = found.ior;
    for (const parian::MeasuredMaterial& measured : parian::measured_materials())
      if (measured.material.name == found.name) m.name = measured.material.name.c_str();
    give(material, m, "material");
  });
}

parian_status parian_set_settings(parian_renderer* renderer, const parian_settings* settings) {
  return with(renderer, [&](parian_renderer& r) {
    r.settings = parian::settings_of(taken(settings, "settings"));
    undo_plan(r);
  });
}

parian_status parian_set_mesh(parian_renderer* renderer, const parian_mesh* mesh) {
  return with(renderer, [&](parian_renderer& r) {
    const parian_mesh m = taken(mesh, "mesh");
    if (m.n_positions == 0 || m.n_triangles == 0)
      throw Error(ErrorKind::input,
                  fmt::format("mesh: it has {} positions and {} triangles; give at least one triangle", m.n_positions,
                              m.n_triangles));
    one_of<parian_normals>(m.normals_kind, "mesh: normals_kind");
    if (m.position_buffer || m.index_buffer) {
      const parian::MeshBounds bounds{m.n_positions, m.n_triangles, vec3(m.centre), m.radius};
      parian::check_bounds(bounds);
      r.device_mesh = parian::device_mesh(*r.compute, m);
      r.scene.mesh = {};
      r.scene.on_device = bounds;
    } else {
      parian::Mesh host = parian::host_mesh(m);
      if (host.triangles.empty()) throw Error(ErrorKind::input, "mesh: no triangle has an area; give one that has");
      r.scene.mesh = std::move(host);
      r.scene.on_device.reset();
      r.device_mesh.reset();
    }
    r.for_one_plan = m.for_one_plan != 0;
    r.has_mesh = true;
    undo_plan(r);
  });
}

parian_status parian_set_material(parian_renderer* renderer, const parian_material* material) {
  return with(renderer, [&](parian_renderer& r) {
    const parian_material m = taken(material, "material");
    const parian::Material checked{m.name ? m.name : "given", vec3(m.sigma_s), vec3(m.sigma_a), vec3(m.g), m.ior};
    parian::validate(checked, "material '" + checked.name + "'");
    r.scene.material = checked;
    r.has_material = true;
    undo_plan(r);
  });
}

parian_status parian_set_lights(parian_renderer* renderer, size_t n, const parian_light* lights) {
  return with(renderer, [&](parian_renderer& r) {
    if (n > 0 && !lights) refuse("lights: it is NULL; give an array");
    std::vector<parian::DirectionalLight> all;
    const auto* next = reinterpret_cast<const unsigned char*>(lights);
    for (std::size_t i = 0; i < n; ++i) {
      const auto* given = reinterpret_cast<const parian_light*>(next);
      const parian_light l = taken(given, "light");
      all.push_back({vec3(l.towards), vec3(l.irradiance)});
      next += given->struct_size;
    }
    parian::check_lights(all);
    if (r.has_lights && same_lights(all, r.scene.lights)) return;
    if (r.planned && !r.planned->set_lights(all)) undo_plan(r);
    r.scene.lights = std::move(all);
    r.has_lights = true;
  });
}

parian_status parian_set_cameras(parian_renderer* renderer, size_t n, const parian_camera* cameras, uint32_t width,
                                 uint32_t height) {
  return with(renderer, [&](parian_renderer& r) {
    if (n == 0 || !cameras) refuse("cameras: none given; give at least one");
    std::vector<parian::Camera> all;
    const auto* next = reinterpret_cast<const unsigned char*>(cameras);
    for (std::size_t i = 0; i < n; ++i) {
      const auto* given = reinterpret_cast<const parian_camera*>(next);
      const parian_camera c = taken(given, "camera");
      all.push_back({vec3(c.eye), vec3(c.target), vec3(c.up), c.fov});
      next += given->struct_size;
    }
    parian::check_cameras(all, {width, height});
    if (r.planned && settings_of_plan(r).still) undo_plan(r);
    r.scene.cameras = std::move(all);
    r.scene.film = {width, height};
    r.has_cameras = true;
    if (r.planned) r.planned->set_cameras(r.scene.cameras, r.scene.film);
  });
}

parian_status parian_positions_changed(parian_renderer* renderer) {
  return with(renderer, [&](parian_renderer& r) {
    if (r.has_mesh && !r.device_mesh) refuse("mesh: it is a copy in host memory; set it again");
    if (r.planned) r.planned->positions_changed();
  });
}

parian_status parian_restart(parian_renderer* renderer) {
  return with(renderer, [&](parian_renderer& r) {
    if (r.planned) r.planned->restart();
  });
}

parian_status parian_scratch_size(parian_renderer* renderer, size_t* bytes) {
  return with(renderer, [&](parian_renderer& r) {
    if (!bytes) refuse("bytes: it is NULL; give a place for the number");
    require_complete(r);
    parian::Settings settings = settings_of_plan(r);
    settings.force = true;  // the caller sees to it that there is enough
    *bytes = parian::make_plan(r.scene, settings, r.compute->info()).bytes + parian::scratch_slack;
  });
}

parian_status parian_set_scratch(parian_renderer* renderer, cl_mem scratch) {
  return with(renderer, [&](parian_renderer& r) {
    cl::Buffer buffer;
    if (scratch) buffer = buffer_of(*r.compute, scratch, "scratch");
    undo_plan(r);
    r.compute->take_scratch(std::move(buffer));
  });
}

parian_status parian_set_cache(parian_renderer* renderer, const char* folder) {
  return with(renderer, [&](parian_renderer& r) {
    if (folder && !*folder) refuse("cache: the folder's name is empty; give one, or NULL for none");
    r.compute->use_cache(folder ? parian::ProgramCache(folder) : parian::ProgramCache());
  });
}

}  // extern "C"
