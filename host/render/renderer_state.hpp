// What a renderer holds between calls; shared by the files that implement it.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "passes/passes.hpp"
#include "passes/visibility.hpp"
#include "render/estimate.hpp"
#include "render/renderer.hpp"

namespace parian {

inline constexpr std::uint32_t subpixel_positions = 64;  // of an image that is written
inline constexpr std::uint32_t redraw_samples = 64;      // per texel and half between two shifts of the light map

/// Adds the wall time of its own life to a counter.
class Timer {
  using Clock = std::chrono::steady_clock;

 public:
  explicit Timer(double& seconds) : seconds_(seconds), start_(Clock::now()) {}
  ~Timer() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  double& seconds_;
  Clock::time_point start_;
};

/// A plan for a device that has passed its self-test and has the plan's program, and the seconds that it took.
struct Readied {
  Plan plan;
  Statistics statistics;
};
/// Makes a device ready for a scene. The sphere of a mesh on the device is measured, and grows in `scene` to what it
/// has to hold.
[[nodiscard]] Readied make_ready(Scene& scene, const Settings& settings, Compute& compute, const DeviceMesh* mesh);

/// A camera's view as it is to be gathered.
struct Gathering {
  Gathering(std::size_t of_camera, std::vector<cl_uint> of_levels, std::uint32_t n_positions)
      : camera(of_camera), levels(std::move(of_levels)), positions(n_positions) {}

  std::size_t camera;
  std::vector<cl_uint> levels;  ///< of the pyramids, each into sums of its own
  std::uint32_t positions;      ///< subpixel positions
  bool waits = false;           ///< for each pass
  /// The pixels of a window that alone are gathered, less what pass 2's function gives at their own points; else all.
  std::function<std::vector<cl_uint>(const kernels::Window&)> chosen;
  /// Takes the sums of each window that has been gathered.
  std::function<void(const kernels::Window&)> take;
};

/// What is due of the four passes.
struct Due {
  bool light_maps = false;             ///< pass 1: all of them anew, shifted as in this epoch
  bool samples = false;                ///< pass 2: another frame
  const Gathering* picture = nullptr;  ///< passes 3 and 4
};

struct Renderer::State {
  State(Scene s, const Settings& set, std::shared_ptr<Compute> device, const DeviceMesh* mesh, Readied ready)
      : scene(std::move(s)),
        settings(set),
        shared(std::move(device)),
        compute(*shared),
        plan(std::move(ready.plan)),
        left_out(plan.left_out),
        passes(compute, plan),
        statistics(std::move(ready.statistics)) {
    if (mesh) device_mesh = *mesh;
  }

  Scene scene;  // the mesh only until the plan is made, its positions then in object units
  Settings settings;
  std::shared_ptr<Compute> shared;
  Compute& compute;
  std::optional<DeviceMesh> device_mesh;
  const Plan plan;
  std::vector<Omission> left_out;  // by the plan, and by its second half
  Passes passes;
  std::vector<kernels::View> cameras;
  Statistics statistics;
  std::uint32_t frame = 0, epoch = 0;
  std::uint32_t level = 0;         // of the pyramids, as shown by the last estimate
  std::uint32_t estimated_at = 0;  // the frame of the last estimate

  // What has changed since the last frame, see live.cpp.
  bool moved = false;      // the mesh
  bool relit = false;      // directions of lights
  bool anew = false;       // sums start again
  glm::dvec3 colour{1.0};  // of the lights, relative to the values of what has been summed

  // Of the last gather, level after level, and what was read for it; to allocate them anew would take longer.
  std::vector<Halves> halves;
  std::vector<kernels::float4> film_sums;
  std::uint64_t fallback_pixels = 0;  // of the last gather
  Outside outside;                    // of a mesh in buffers, in all frames so far
  std::vector<std::string> doubts;    // of pictures, each once
  double direct_evaluations = 0.0;    // at pixels themselves
  std::uint32_t redraws = 0;          // of the light maps, after the first
  // What has been left out while rendering:
  std::uint32_t unbuilt = 0;           // pyramid levels that nothing read
  std::uint32_t undrawn = 0;           // views of the camera that were there already
  std::uint32_t unestimated = 0;       // checkpoints where the error could not be below its target yet
  std::uint32_t last_unestimated = 0;  // the frame of the last of these
  std::uint64_t unasked = 0;           // subpixel positions of pixels on one smooth surface
  double further_seconds = 0;          // of pictures after the first
  std::uint32_t further_views = 0;

  /// The algorithm.
  void run(const Due& due);

  void prepare();
  void settle();  // waits, if stages are timed
  void look_outside();
  [[nodiscard]] bool lit() const;
  [[nodiscard]] Expected expected(std::size_t camera) const;
  void doubt_picture(std::size_t camera, const Halves& image);
  [[nodiscard]] std::vector<DirectionalLight> taking_part(const std::vector<DirectionalLight>& lights) const;
  void plan_layers();
  void plan_live_layers();
  [[nodiscard]] std::vector<kernels::View> placed_layers(SurfaceSight& sight);
  void measure_rate();
  void apply_changes();
  bool recolour(const std::vector<DirectionalLight>& lights);
  void count_layers(std::size_t covered, std::size_t needed);
  void allocate_film();
  void touch_film();
  [[nodiscard]] LayerRange layers_of(std::size_t camera) const;
  void leave_out(const std::string& what, const std::string& why, const std::string& unit, double count);
  [[nodiscard]] std::vector<Omission> left_out_while_rendering() const;
  [[nodiscard]] std::uint32_t samples_per_frame() const;
  [[nodiscard]] std::uint32_t likely_level() const;
  [[nodiscard]] std::uint32_t positions_of_estimate(std::size_t camera) const;
  /// Whether, of so many subpixel positions, pixels without an edge near by need the first few only.
  [[nodiscard]] bool settles(std::uint32_t positions) const;
  /// Estimated relMSE of looking light up in layers, from some random pixels of the image whose halves these are.
  double bias_relmse(std::size_t camera, const Halves& image);
  [[nodiscard]] std::uint32_t levels_to_build(const Gathering& picture);
  void gather_film(const Gathering& picture);
  void gather_window(const Gathering& picture, kernels::Window w, const std::vector<cl_uint>& chosen);
  /// Subpixel positions that pixels without an edge near by didn't need.
  [[nodiscard]] std::uint64_t settled(const std::vector<kernels::float4>& sums, std::size_t n_pixels,
                                      std::uint32_t positions);
  /// Rounds of samples at each position of a point that has as many samples in all as a texel has had.
  [[nodiscard]] std::uint32_t rounds_of(std::uint32_t positions) const;
  /// Valid until the next call.
  std::span<const Halves> gather_halves(std::size_t camera, const std::vector<cl_uint>& levels,
                                        std::uint32_t positions);
};

}  // namespace parian
