// The C API's border, what is rendered: plans, frames, pictures, and what is said of them.
#include <parian/parian.h>

#include <algorithm>

#include "api/api_call.hpp"
#include "plan/plan.hpp"
#include "render/image_target.hpp"
#include "scene/limits.hpp"

namespace {

using namespace parian;

parian_seconds seconds_of(const Seconds& s) {
  return {s.plan, s.compile, s.light_map, s.layers, s.pyramids, s.gather, s.bias, s.read};
}

template <class T>
const T& at(const std::vector<T>& list, std::size_t i, const char* what) {
  if (i >= list.size()) refuse(fmt::format("{}: {} of {}; parian_get_statistics makes the list", what, i, list.size()));
  return list[i];
}

parian_status text_at(const parian_renderer* renderer, std::vector<std::string> Texts::*list, std::size_t i,
                      const char* what, const char** text) {
  return with(renderer, [&](const parian_renderer& r) {
    if (!text) refuse("text: it is NULL; give a place for the pointer");
    *text = at(r.texts.*list, i, what).c_str();
  });
}

}  // namespace

extern "C" {

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
