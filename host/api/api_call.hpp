// A call of the C API: the renderer that it is for, and what becomes of what goes wrong inside.
#pragma once
#include <parian/parian.h>

#include <fmt/format.h>

#include <atomic>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/api_given.hpp"
#include "core/compute.hpp"
#include "core/words.hpp"
#include "passes/geometry.hpp"
#include "render/renderer.hpp"

namespace parian {

/// Lists that parian_get_statistics makes for the calls after it.
struct Texts {
  std::vector<Omission> omissions;
  std::vector<std::string> marked_warnings, warnings, explanation;
};

}  // namespace parian

struct parian_renderer {
  std::atomic_flag busy;
  bool lost = false;
  std::shared_ptr<parian::Compute> compute;
  parian::Scene scene;
  parian::Settings settings;
  std::optional<parian::DeviceMesh> device_mesh;
  bool for_one_plan = false, has_mesh = false, has_material = false, has_lights = false, has_cameras = false;
  std::unique_ptr<parian::Renderer> planned;
  parian::Texts texts;
};

namespace parian {

/// What parian_message and parian_opencl_code say, of each thread.
struct LastFailure {
  std::string marked, message;  ///< with marks for settings, and in the API's words
  cl_int code = CL_SUCCESS;
};
[[nodiscard]] LastFailure& last_failure() noexcept;

/// What a call needs that isn't there: see PARIAN_NOT_PLANNED.
struct NotPlanned {
  std::string message;
};

[[nodiscard]] parian_status status_of(ErrorKind kind, int code);

/// Notes what `message()` says.
template <class F>
parian_status failed(parian_status status, cl_int code, F&& message) noexcept {
  LastFailure& failure = last_failure();
  failure.code = code;
  try {
    failure.marked = message();
    failure.message = in_api_words(failure.marked);
  } catch (...) {  // no memory for the text
    failure.marked.clear();
    failure.message.clear();
  }
  return status;
}
inline parian_status failed(parian_status status, const char* message) noexcept {
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
    return failed(status_of(ErrorKind::device, e.err()), e.err(), [&] { return describe_cl_error(e); });
  } catch (const NotPlanned& e) {
    return failed(PARIAN_NOT_PLANNED, e.message.c_str());
  } catch (const Cancelled&) {
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
void undo_plan(parian_renderer& r) noexcept;

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

/// Throw NotPlanned without all that a plan needs, a plan, a frame.
void require_complete(const parian_renderer& r);
void require_plan(const parian_renderer& r);
void require_frame(const parian_renderer& r);
/// Throws Error(usage) where there is no such camera.
void require_camera(const parian_renderer& r, std::size_t camera);

/// The settings as a plan takes them. A mesh in buffers may move whatever cameras do: nothing about it is fixed.
[[nodiscard]] Settings settings_of_plan(const parian_renderer& r);
/// The plan, with commands going to `queue` after `wait`.
Renderer& planned(parian_renderer& r, cl_command_queue queue, cl_uint n_wait = 0, const cl_event* wait = nullptr);
/// Ends a call that enqueued something.
void submit(parian_renderer& r, cl_event* event);

}  // namespace parian
