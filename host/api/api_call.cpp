// What calls of the C API have in common.
#include "api/api_call.hpp"

#include "api/api_marked.hpp"

namespace parian {

LastFailure& last_failure() noexcept {
  thread_local LastFailure failure;
  return failure;
}

const std::string& marked_message() { return last_failure().marked; }

const std::vector<std::string>& marked_warnings(const parian_renderer* renderer) {
  return renderer->texts.marked_warnings;
}

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

void undo_plan(parian_renderer& r) noexcept {
  r.planned.reset();
  r.compute->release_all();
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

void require_camera(const parian_renderer& r, std::size_t camera) {
  if (camera >= r.scene.cameras.size())
    refuse(fmt::format("camera: {} of {}; they are numbered from 0", camera, r.scene.cameras.size()));
}

Settings settings_of_plan(const parian_renderer& r) {
  Settings settings = r.settings;
  if (!r.device_mesh) return settings;
  if (settings.gather == Gather::camera)
    refuse("settings: views is PARIAN_CAMERA, where the mesh may move; give PARIAN_LAYERS, or the mesh in host memory");
  settings.still = false;
  return settings;
}

Renderer& planned(parian_renderer& r, cl_command_queue queue, cl_uint n_wait, const cl_event* wait) {
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

void submit(parian_renderer& r, cl_event* event) {
  cl::Event done = r.compute->submit();
  if (!event) return;
  *event = done();
  done() = nullptr;  // the caller's now
}

}  // namespace parian
