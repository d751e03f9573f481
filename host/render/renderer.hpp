// The renderer: one scene on one device, refined frame by frame. The algorithm is four calls in renderer.cpp.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "core/device.hpp"
#include "core/stage.hpp"
#include "scene/scene.hpp"

namespace parian {

class Compute;
struct DeviceMesh;
struct ImageTarget;

class Renderer {
 public:
  /// Plans and compiles for `scene` on the device that `selector` means: an index, a case-insensitive part of
  /// "NAME PLATFORM", or empty for the default (a GPU before an accelerator before a CPU, then the most compute units).
  /// Throws Error(input) for a scene that can't be rendered and Error(device) when the device is missing, too small,
  /// refuses, or fails the self-test and `settings` doesn't force it. Moving a large scene in saves its copy.
  Renderer(Scene scene, const Settings& settings, const std::string& selector);
  /// The same on a device that is at work already, and with the mesh that lies on it if `scene.on_device` says so.
  Renderer(Scene scene, const Settings& settings, std::shared_ptr<Compute> compute, const DeviceMesh* mesh);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// The plan as lines of text: what the scene needs, what was left out, why, and what that saves.
  [[nodiscard]] std::vector<std::string> explanation() const;
  /// One frame: `samples` more evaluations at every layer texel that is needed. Waits with `settings.time_stages` only.
  void frame();
  /// Without `settings.still`: other cameras, another film; what was summed stays.
  void set_cameras(const std::vector<Camera>& cameras, glm::uvec2 film);
  /// Other colours of lights, and without `settings.still` other directions. Keeps what was summed, where each light
  /// has its own sums or all change alike, or starts anew; false when only a new plan will do.
  bool set_lights(const std::vector<DirectionalLight>& lights);
  /// The mesh on the device has moved: the next frame reads it again, and starts anew.
  void positions_changed();
  /// The next frame starts anew.
  void restart();
  /// Gathers a camera's view into somebody's buffer, from the pyramid level of the last estimate or, before one, from
  /// the level that suits the number of frames. Neither waits nor reads back.
  void gather_into(std::size_t camera, const ImageTarget& target);
  /// Frames done so far.
  [[nodiscard]] std::uint32_t frames() const;
  /// True after frames 1, 2, 3, 4, 6, 8, 12, 16, ..., when an estimate is due; of these not where the error can't yet
  /// be below its target, going by the last estimate.
  [[nodiscard]] bool checkpoint() const;
  /// Gathers the image and estimates its relMSE (sampling error, blur included); negative when no pixel is covered
  /// fully, so that nothing is known. Waits.
  double estimate();
  /// The image of one camera, gathered with 64 subpixel positions. Waits.
  Image image(std::size_t camera);
  /// What was done so far; call after the last image for final figures (load, total and stopped_by are the caller's).
  [[nodiscard]] const Statistics& statistics() const;
  /// The same by stage and kernel, of all that has been waited for.
  [[nodiscard]] const KernelTable& kernel_table() const;
  [[nodiscard]] const DeviceInfo& device() const;

 private:
  void leave() noexcept;

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace parian
