// The C++20 face of parian.h, header-only: a renderer that releases itself, spans for arrays, and exceptions for
// statuses. Units, ownership and thread rules are those of parian.h; each function here says only what it adds.
#pragma once
#include <parian/parian.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace parian {
inline namespace v0 {

/// Thrown by everything here that fails; what() is parian_message().
class Failure : public std::runtime_error {
 public:
  explicit Failure(parian_status status)
      : std::runtime_error(parian_message()), status_(status), opencl_code_(parian_opencl_code()) {}
  [[nodiscard]] parian_status status() const noexcept { return status_; }
  /// CL_SUCCESS where no OpenCL call is behind it.
  [[nodiscard]] cl_int opencl_code() const noexcept { return opencl_code_; }

 private:
  parian_status status_;
  cl_int opencl_code_;
};

inline void require(parian_status status) {
  if (status != PARIAN_SUCCESS) throw Failure(status);
}

/// A zeroed struct of the API that knows its size; settings come with their defaults.
template <class T>
[[nodiscard]] T make() {
  T t{};
  t.struct_size = sizeof(T);
  return t;
}
template <>
[[nodiscard]] inline parian_settings make<parian_settings>() {
  parian_settings s{};
  s.struct_size = sizeof s;
  require(parian_default_settings(&s));
  return s;
}

using Triple = std::array<double, 3>;

/// Scattering and absorption in 1/mm, index of refraction, and mean cosine of scattering.
[[nodiscard]] inline parian_material material(const Triple& sigma_s, const Triple& sigma_a, double ior,
                                              const Triple& g = {}) {
  auto m = make<parian_material>();
  std::copy(sigma_s.begin(), sigma_s.end(), m.sigma_s);
  std::copy(sigma_a.begin(), sigma_a.end(), m.sigma_a);
  std::copy(g.begin(), g.end(), m.g);
  m.ior = ior;
  return m;
}
/// A measured one, by the name that `parian materials` lists.
[[nodiscard]] inline parian_material material(const char* name) {
  auto m = make<parian_material>();
  require(parian_find_material(name, &m));
  return m;
}
[[nodiscard]] inline parian_light light(const Triple& towards, const Triple& irradiance) {
  auto l = make<parian_light>();
  std::copy(towards.begin(), towards.end(), l.towards);
  std::copy(irradiance.begin(), irradiance.end(), l.irradiance);
  return l;
}
[[nodiscard]] inline parian_camera camera(const Triple& eye, const Triple& target, double fov,
                                          const Triple& up = {0, 1, 0}) {
  auto c = make<parian_camera>();
  std::copy(eye.begin(), eye.end(), c.eye);
  std::copy(target.begin(), target.end(), c.target);
  std::copy(up.begin(), up.end(), c.up);
  c.fov = fov;
  return c;
}

/// An OpenCL event, released when it goes out of scope.
class Event {
 public:
  Event() = default;
  explicit Event(cl_event event) noexcept : event_(event) {}
  Event(Event&& other) noexcept : event_(std::exchange(other.event_, nullptr)) {}
  Event& operator=(Event&& other) noexcept {
    std::swap(event_, other.event_);
    return *this;
  }
  ~Event() {
    if (event_) clReleaseEvent(event_);
  }
  [[nodiscard]] cl_event get() const noexcept { return event_; }
  void wait() const {
    if (event_) clWaitForEvents(1, &event_);
  }

 private:
  cl_event event_ = nullptr;
};

/// parian_renderer, released when it goes out of scope.
class Renderer {
 public:
  /// On the device that `selector` means, or the best one if it's null.
  explicit Renderer(const char* selector = nullptr) {
    auto info = make<parian_create_info>();
    info.selector = selector;
    require(parian_create(&info, &renderer_));
  }
  Renderer(cl_context context, cl_device_id device) {
    auto info = make<parian_create_info>();
    info.context = context;
    info.device = device;
    require(parian_create(&info, &renderer_));
  }
  explicit Renderer(const parian_create_info& info) { require(parian_create(&info, &renderer_)); }
  Renderer(Renderer&& other) noexcept : renderer_(std::exchange(other.renderer_, nullptr)), floats_(other.floats_) {}
  Renderer& operator=(Renderer&& other) noexcept {
    std::swap(renderer_, other.renderer_);
    std::swap(floats_, other.floats_);
    return *this;
  }
  ~Renderer() { parian_release(renderer_); }
  [[nodiscard]] parian_renderer* get() const noexcept { return renderer_; }

  /// Not retained.
  [[nodiscard]] cl_context context() const {
    cl_context context = nullptr;
    require(parian_get_opencl(renderer_, &context, nullptr));
    return context;
  }
  [[nodiscard]] cl_device_id device_id() const {
    cl_device_id device = nullptr;
    require(parian_get_opencl(renderer_, nullptr, &device));
    return device;
  }
  [[nodiscard]] parian_device device() const {
    auto device = make<parian_device>();
    require(parian_get_device(renderer_, &device));
    return device;
  }

  void set(const parian_settings& settings) { require(parian_set_settings(renderer_, &settings)); }
  void set(const parian_mesh& mesh) { require(parian_set_mesh(renderer_, &mesh)); }
  void set(const parian_material& material) { require(parian_set_material(renderer_, &material)); }
  void set(std::span<const parian_light> lights) {
    require(parian_set_lights(renderer_, lights.size(), lights.data()));
  }
  void set(const parian_light& light) { set(std::span(&light, 1)); }
  void set(std::span<const parian_camera> cameras, std::uint32_t width, std::uint32_t height) {
    require(parian_set_cameras(renderer_, cameras.size(), cameras.data(), width, height));
    floats_ = std::size_t{4} * width * height;
  }
  void set(const parian_camera& camera, std::uint32_t width, std::uint32_t height) {
    set(std::span(&camera, 1), width, height);
  }
  /// A mesh in host memory: x, y, z of each vertex, and three indices of each triangle. Throws std::invalid_argument
  /// if these aren't whole.
  void set_mesh(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    auto mesh = make<parian_mesh>();
    mesh.n_positions = thirds(positions.size(), "positions");
    mesh.n_triangles = thirds(indices.size(), "indices");
    mesh.positions = positions.data();
    mesh.indices = indices.data();
    set(mesh);
  }
  void positions_changed() { require(parian_positions_changed(renderer_)); }
  void restart() { require(parian_restart(renderer_)); }

  [[nodiscard]] std::size_t scratch_size() const {
    std::size_t bytes = 0;
    require(parian_scratch_size(renderer_, &bytes));
    return bytes;
  }
  void set_scratch(cl_mem scratch) { require(parian_set_scratch(renderer_, scratch)); }

  /// Where compiled programs are kept between runs; null: nowhere.
  void set_cache(const char* folder) { require(parian_set_cache(renderer_, folder)); }

  void plan(cl_command_queue queue = nullptr) { require(parian_plan(renderer_, queue)); }
  Event frame(cl_command_queue queue = nullptr, std::span<const cl_event> wait = {}) {
    cl_event event = nullptr;
    require(parian_frame(renderer_, queue, static_cast<cl_uint>(wait.size()), wait.empty() ? nullptr : wait.data(),
                         &event));
    return Event(event);
  }
  Event gather(std::size_t camera, const parian_image& image, cl_command_queue queue = nullptr,
               std::span<const cl_event> wait = {}) {
    cl_event event = nullptr;
    require(parian_gather(renderer_, queue, camera, &image, static_cast<cl_uint>(wait.size()),
                          wait.empty() ? nullptr : wait.data(), &event));
    return Event(event);
  }
  [[nodiscard]] bool estimate_due() const {
    std::uint32_t due = 0;
    require(parian_estimate_due(renderer_, &due));
    return due != 0;
  }
  double estimate(cl_command_queue queue = nullptr) {
    double relmse = -1;
    require(parian_estimate(renderer_, queue, &relmse));
    return relmse;
  }
  /// Fills `rgba`, which the caller sizes at 4 x width x height; returns the image's estimated relMSE. Throws
  /// std::invalid_argument if it is smaller.
  double read(std::size_t camera, std::span<float> rgba, cl_command_queue queue = nullptr) {
    if (rgba.size() < floats_)
      throw std::invalid_argument("rgba: it has " + std::to_string(rgba.size()) + " floats and needs " +
                                  std::to_string(floats_));
    double relmse = -1;
    require(parian_read(renderer_, queue, camera, rgba.data(), &relmse));
    return relmse;
  }

  [[nodiscard]] parian_statistics statistics() const {
    auto statistics = make<parian_statistics>();
    require(parian_get_statistics(renderer_, &statistics));
    return statistics;
  }
  /// What was left out, what to beware of, and the plan in words, as of now.
  [[nodiscard]] std::vector<parian_omission> omissions() const {
    std::vector<parian_omission> all(statistics().n_omissions, make<parian_omission>());
    for (std::size_t i = 0; i < all.size(); ++i) require(parian_get_omission(renderer_, i, &all[i]));
    return all;
  }
  [[nodiscard]] std::vector<std::string> warnings() const {
    return texts(statistics().n_warnings, &parian_get_warning);
  }
  [[nodiscard]] std::vector<std::string> explanation() const {
    return texts(statistics().n_explanations, &parian_get_explanation);
  }

 private:
  [[nodiscard]] std::vector<std::string> texts(std::size_t n,
                                               parian_status (*text_of)(const parian_renderer*, std::size_t,
                                                                        const char**)) const {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < n; ++i) {
      const char* text = nullptr;
      require(text_of(renderer_, i, &text));
      all.emplace_back(text);
    }
    return all;
  }

  [[nodiscard]] static std::uint32_t thirds(std::size_t n, const char* what) {
    if (n % 3 != 0 || n / 3 > UINT32_MAX)
      throw std::invalid_argument(std::string(what) + ": their number is " + std::to_string(n) +
                                  ", not three for each of at most 2^32 - 1");
    return static_cast<std::uint32_t>(n / 3);
  }

  parian_renderer* renderer_ = nullptr;
  std::size_t floats_ = 0;  // of an image
};

}  // namespace v0
}  // namespace parian
