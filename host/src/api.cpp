// The C API's border: arguments are checked here, and whatever goes wrong inside becomes a status and a line of text.
#include <parian/parian.h>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <new>
#include <optional>

#include "api_given.hpp"
#include "api_marked.hpp"
#include "compute.hpp"
#include "embedded.hpp"
#include "geometry.hpp"
#include "image_target.hpp"
#include "limits.hpp"
#include "medium.hpp"
#include "plan.hpp"
#include "renderer.hpp"
#include "words.hpp"

namespace {

struct LastFailure {
  std::string marked, message;  // with marks for settings, and in the API's words
  cl_int code = CL_SUCCESS;
};
thread_local LastFailure last_failure;

/// Lists that parian_get_statistics makes for the calls after it.
struct Texts {
  std::vector<parian::Omission> omissions;
  std::vector<std::string> marked_warnings, warnings, explanation;
};

}  // namespace

struct parian_renderer {
  std::atomic_flag busy;
  bool lost = false;
  std::shared_ptr<parian::Compute> compute;
  parian::Scene scene;
  parian::Settings settings;
  std::optional<parian::DeviceMesh> device_mesh;
  bool for_one_plan = false, has_mesh = false, has_material = false, has_lights = false, has_cameras = false;
  std::unique_ptr<parian::Renderer> planned;
  Texts texts;
};

namespace {

using parian::buffer_of;
using parian::Error;
using parian::ErrorKind;
using parian::give;
using parian::in_api_words;
using parian::one_of;
using parian::refuse;
using parian::taken;
using parian::vec3;

/// What a call needs that isn't there: see PARIAN_NOT_PLANNED.
struct NotPlanned {
  std::string message;
};

parian_status status_of(ErrorKind kind, int code) {
  if (kind == ErrorKind::usage) return PARIAN_INVALID_ARGUMENT;
  if (kind == ErrorKind::input) return PARIAN_INVALID_SCENE;
  switch (code) {
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
    case CL_OUT_OF_HOST_MEMORY:
    case CL_INVALID_BUFFER_SIZE:
      return PARIAN_OUT_OF_MEMORY;
    case CL_DEVICE_NOT_AVAILABLE:
    case CL_OUT_OF_RESOURCES:
    case CL_INVALID_COMMAND_QUEUE:
    case CL_INVALID_CONTEXT:
      return PARIAN_DEVICE_LOST;
    default:
      return PARIAN_DEVICE_FAILED;
  }
}

/// Notes what `message()` says.
template <class F>
parian_status failed(parian_status status, cl_int code, F&& message) noexcept {
  last_failure.code = code;
  try {
    last_failure.marked = message();
    last_failure.message = in_api_words(last_failure.marked);
  } catch (...) {  // no memory for the text
    last_failure.marked.clear();
    last_failure.message.clear();
  }
  return status;
}
parian_status failed(parian_status status, const char* message) noexcept {
  return failed(status, CL_SUCCESS, [&] { return message; });
}

/// Runs `f`; every exception ends here.
template <class F>
parian_status caught(F&& f) noexcept {
  try {
    f();
    return PARIAN_SUCCESS;
  } catch (const Error& e) {
    return failed(status_of(e.kind(), e.code()), e.code(), [&] { return e.what(); });
  } catch (const cl::Error& e) {
    return failed(status_of(ErrorKind::device, e.err()), e.err(), [&] { return parian::describe_cl_error(e); });
  } catch (const NotPlanned& e) {
    return failed(PARIAN_NOT_PLANNED, e.message.c_str());
  } catch (const parian::Cancelled&) {
    return failed(PARIAN_CANCELLED, "cancelled by the caller's callback; call parian_plan to start anew");
  } catch (const std::bad_alloc&) {
    return failed(PARIAN_OUT_OF_MEMORY, "the host is out of memory; render a smaller scene");
  } catch (const std::exception& e) {
    return failed(PARIAN_INTERNAL, CL_SUCCESS,
                  [&] { return fmt::format("a defect of Parian: {}; please report it", e.what()); });
  } catch (...) {
    return failed(PARIAN_INTERNAL, "a defect of Parian; please report it");
  }
}

/// What has been enqueued goes on: the next plan and the release wait for it.
void undo_plan(parian_renderer& r) noexcept {
  r.planned.reset();
  r.compute->release_all();
}

/// Runs `f` with a renderer that no other thread is using. What fails on the device undoes the plan.
template <class F>
parian_status with(const parian_renderer* renderer, F&& f) noexcept {
  if (!renderer) return failed(PARIAN_INVALID_ARGUMENT, "renderer: it is NULL; create one with parian_create");
  auto& r = const_cast<parian_renderer&>(*renderer);  // the flag and the lists; `f` takes care of the rest
  if (r.busy.test_and_set())
    return failed(PARIAN_BUSY, "renderer: another call is inside it; use it from one thread at a time");
  parian_status status = caught([&] {
    if (r.lost)
      throw Error(ErrorKind::device, "the device was lost; release the renderer and make a new context",
                  CL_INVALID_CONTEXT);
    f(r);
  });
  if (r.compute->abandoned() && !r.lost && status != PARIAN_DEVICE_LOST)  // no memory to say so
    status = failed(PARIAN_DEVICE_LOST, "the driver left a call by an exception; give the process more memory");
  r.lost = r.lost || status == PARIAN_DEVICE_LOST;
  if (status >= PARIAN_DEVICE_FAILED && status != PARIAN_NOT_PLANNED) undo_plan(r);
  r.compute->leave();
  r.busy.clear();
  return status;
}

void require_complete(const parian_renderer& r) {
  const auto missing = [](const char* what, const char* call) {
    throw NotPlanned{fmt::format("{}: not set yet; call {} first", what, call)};
  };
  if (!r.has_mesh) missing("mesh", "parian_set_mesh");
  if (!r.has_material) missing("material", "parian_set_material");
  if (!r.has_lights) missing("lights", "parian_set_lights");
  if (!r.has_cameras) missing("cameras", "parian_set_cameras");
  if (r.scene.mesh.triangles.empty() && !r.scene.on_device)
    throw NotPlanned{"mesh: it was for one plan; call parian_set_mesh again"};
}

void require_plan(const parian_renderer& r) {
  if (!r.planned) throw NotPlanned{"something changed that needs a new plan; call parian_plan first, which waits"};
}

void require_frame(const parian_renderer& r) {
  require_plan(r);
  if (r.planned->frames() == 0) throw NotPlanned{"no frame has been summed yet; call parian_frame first"};
}

/// The settings as a plan takes them. A mesh in buffers may move whatever cameras do: nothing about it is fixed.
parian::Settings settings_of_plan(const parian_renderer& r) {
  parian::Settings settings = r.settings;
  if (!r.device_mesh) return settings;
  if (settings.gather == parian::Gather::camera)
    refuse("settings: views is PARIAN_CAMERA, where the mesh may move; give PARIAN_LAYERS, or the mesh in host memory");
  settings.still = false;
  return settings;
}

/// The plan, with commands going to `queue` after `wait`.
parian::Renderer& planned(parian_renderer& r, cl_command_queue queue, cl_uint n_wait = 0,
                          const cl_event* wait = nullptr) {
  require_plan(r);
  if ((n_wait > 0) != (wait != nullptr)) refuse("wait list: its length and its pointer disagree");
  std::vector<cl::Event> events;
  for (cl_uint i = 0; i < n_wait; ++i) {
    if (!wait[i]) refuse(fmt::format("wait list: event {} is NULL", i));
    events.emplace_back(wait[i], true);
  }
  r.compute->use(queue, std::move(events));
  return *r.planned;
}

/// Ends a call that enqueued something.
void submit(parian_renderer& r, cl_event* event) {
  cl::Event done = r.compute->submit();
  if (!event) return;
  *event = done();
  done() = nullptr;  // the caller's now
}

void require_camera(const parian_renderer& r, std::size_t camera) {
  if (camera >= r.scene.cameras.size())
    refuse(fmt::format("camera: {} of {}; they are numbered from 0", camera, r.scene.cameras.size()));
}

parian_seconds seconds_of(const parian::Seconds& s) {
  return {s.plan, s.compile, s.light_map, s.layers, s.pyramids, s.gather, s.bias, s.read};
}

template <class T>
const T& at(const std::vector<T>& list, std::size_t i, const char* what) {
  if (i >= list.size()) refuse(fmt::format("{}: {} of {}; parian_get_statistics makes the list", what, i, list.size()));
  return list[i];
}

bool same_lights(const std::vector<parian::DirectionalLight>& a, const std::vector<parian::DirectionalLight>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.towards == y.towards && x.irradiance == y.irradiance;
  });
}

parian_status text_at(const parian_renderer* renderer, std::vector<std::string> Texts::*list, std::size_t i,
                      const char* what, const char** text) {
  return with(renderer, [&](const parian_renderer& r) {
    if (!text) refuse("text: it is NULL; give a place for the pointer");
    *text = at(r.texts.*list, i, what).c_str();
  });
}

}  // namespace

const std::string& parian::marked_message() { return last_failure.marked; }
const std::vector<std::string>& parian::marked_warnings(const parian_renderer* renderer) {
  return renderer->texts.marked_warnings;
}

extern "C" {

const char* parian_version(void) { return parian::version; }
const char* parian_message(void) { return last_failure.message.c_str(); }
cl_int parian_opencl_code(void) { return last_failure.code; }

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

parian_status parian_plan(parian_renderer* renderer, cl_command_queue queue) {
  return with(renderer, [&](parian_renderer& r) {
    require_complete(r);
    const parian::Settings settings = settings_of_plan(r);
    r.compute->use(queue, {});
    undo_plan(r);
    r.compute->drain();  // before memory is taken anew
    parian::Scene scene;
    if (r.for_one_plan && !r.device_mesh) {
      scene.mesh = std::move(r.scene.mesh);
      r.scene.mesh = {};
    } else {
      scene.mesh = r.scene.mesh;
    }
    scene.on_device = r.scene.on_device;
    scene.material = r.scene.material;
    scene.lights = r.scene.lights;
    scene.cameras = r.scene.cameras;
    scene.film = r.scene.film;
    r.planned = std::make_unique<parian::Renderer>(std::move(scene), settings, r.compute,
                                                   r.device_mesh ? &*r.device_mesh : nullptr);
  });
}

parian_status parian_frame(parian_renderer* renderer, cl_command_queue queue, cl_uint n_wait, const cl_event* wait,
                           cl_event* event) {
  return with(renderer, [&](parian_renderer& r) {
    planned(r, queue, n_wait, wait).frame();
    submit(r, event);
  });
}

parian_status parian_gather(parian_renderer* renderer, cl_command_queue queue, size_t camera, const parian_image* image,
                            cl_uint n_wait, const cl_event* wait, cl_event* event) {
  return with(renderer, [&](parian_renderer& r) {
    const parian_image given = taken(image, "image");
    require_camera(r, camera);
    if (!given.buffer) refuse("image: its buffer is NULL; give one");
    parian::ImageTarget target{buffer_of(*r.compute, given.buffer, "image")};
    const std::size_t row = std::size_t{16} * r.scene.film.x;
    const std::size_t pitch = given.row_pitch ? given.row_pitch : row;
    if (given.offset % 16 || pitch % 16) refuse("image: offset and row_pitch must be multiples of 16 bytes");
    if (pitch < row) refuse(fmt::format("image: row_pitch is {} bytes and needs {}", pitch, row));
    parian::require_bytes(target.buffer, given.offset, r.scene.film.y, pitch, row, "image");
    if (given.offset / 16 > 0xffffffffU || pitch / 16 > 0xffffffffU / r.scene.film.y)
      refuse("image: more than 2^32 pixels; give less");
    if (target.buffer.getInfo<CL_MEM_FLAGS>() & CL_MEM_READ_ONLY) refuse("image: kernels may not write its buffer");
    if (given.positions > 64) refuse(fmt::format("image: {} subpixel positions; give 1 to 64", given.positions));
    if (!(std::abs(given.exposure) <= parian::largest_stops))
      refuse(fmt::format("image: exposure is {}; give -{} to {} stops", given.exposure, parian::largest_stops,
                         parian::largest_stops));
    target.first = static_cast<cl_uint>(given.offset / 16);
    target.pitch = static_cast<cl_uint>(pitch / 16);
    target.positions = given.positions ? given.positions : 64;
    target.gain = std::exp2(given.exposure);
    require_frame(r);
    planned(r, queue, n_wait, wait).gather_into(camera, target);
    submit(r, event);
  });
}

parian_status parian_estimate_due(const parian_renderer* renderer, uint32_t* due) {
  return with(renderer, [&](const parian_renderer& r) {
    if (!due) refuse("due: it is NULL; give a place for the answer");
    *due = r.planned && r.planned->checkpoint();
  });
}

parian_status parian_estimate(parian_renderer* renderer, cl_command_queue queue, double* relmse) {
  return with(renderer, [&](parian_renderer& r) {
    require_frame(r);
    const double estimated = planned(r, queue).estimate();
    if (relmse) *relmse = estimated;
  });
}

parian_status parian_read(parian_renderer* renderer, cl_command_queue queue, size_t camera, float* rgba,
                          double* relmse) {
  return with(renderer, [&](parian_renderer& r) {
    require_camera(r, camera);
    if (!rgba) refuse("rgba: it is NULL; give room for four floats a pixel");
    require_frame(r);
    const parian::Image image = planned(r, queue).image(camera);
    std::copy(image.rgba.begin(), image.rgba.end(), rgba);
    if (relmse) *relmse = image.estimated_relmse;
  });
}

parian_status parian_get_statistics(parian_renderer* renderer, parian_statistics* statistics) {
  return with(renderer, [&](parian_renderer& r) {
    parian_statistics s{};
    s.estimated_relmse = s.estimated_bias_relmse = s.layers_covered = s.further_view_seconds = -1.0;
    r.texts = {};
    if (r.planned) {
      const parian::Statistics& t = r.planned->statistics();
      r.texts = {t.left_out, t.warnings, {}, r.planned->explanation()};
      for (const std::string& warning : t.warnings) r.texts.warnings.push_back(in_api_words(warning));
      s.frames = t.frames;
      s.layers_count = t.layers_count;
      s.layers_size = t.layers_size;
      s.layers_covered = t.layers_covered;
      s.layers_texels = t.layers_texels;
      s.layers_texels_evaluated = t.layers_texels_evaluated;
      s.fallback_pixels = t.fallback_pixels;
      s.evaluations = t.evaluations;
      s.bias_evaluations = t.bias_evaluations;
      s.estimated_relmse = t.estimated_relmse;
      s.estimated_bias_relmse = t.estimated_bias_relmse;
      s.bytes_peak = t.bytes_peak;
      s.bytes_planned = t.bytes_planned;
      s.nonfinite = t.nonfinite;
      s.further_view_seconds = t.further_view_seconds;
      s.seconds = seconds_of(t.seconds);
      s.kernel_seconds = seconds_of(t.kernel_seconds);
    }
    s.n_omissions = r.texts.omissions.size();
    s.n_warnings = r.texts.warnings.size();
    s.n_explanations = r.texts.explanation.size();
    give(statistics, s, "statistics");
  });
}

parian_status parian_get_omission(const parian_renderer* renderer, size_t i, parian_omission* omission) {
  return with(renderer, [&](const parian_renderer& r) {
    const parian::Omission& o = at(r.texts.omissions, i, "omission");
    give(omission, parian_omission{0, o.what.c_str(), o.why.c_str(), o.unit.c_str(), o.count}, "omission");
  });
}

parian_status parian_get_warning(const parian_renderer* renderer, size_t i, const char** text) {
  return text_at(renderer, &Texts::warnings, i, "warning", text);
}

parian_status parian_get_explanation(const parian_renderer* renderer, size_t i, const char** text) {
  return text_at(renderer, &Texts::explanation, i, "explanation", text);
}

}  // extern "C"
