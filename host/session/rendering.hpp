// A front's way into the C API: a scene as it was loaded, rendered, and what the renderer says of itself.
#pragma once
#include <parian/parian.hpp>

#include <functional>
#include <memory>

#include "core/device.hpp"
#include "scene/scene.hpp"
#include "session/session.hpp"

namespace parian {

/// A renderer of the API that takes scenes and throws Error, of the kind that a failure's status stands for.
class Rendering final : public FrameSource {
 public:
  /// Plans `scene` on the device that `selector` means, as parian_create_info has it. Moving a large scene in saves
  /// its copy. Compiled programs are kept as program_folder says. While it plans, `step` is called before kernels are
  /// compiled and before each launch; it may not throw.
  Rendering(Scene scene, const Settings& settings, const std::string& selector, std::function<void()> step = {});

  void frame() override;
  [[nodiscard]] std::uint32_t frames() const { return frames_; }
  [[nodiscard]] bool estimate_due() const override;
  double estimate() override;
  [[nodiscard]] Image image(std::size_t camera);
  [[nodiscard]] DeviceInfo device() const;
  [[nodiscard]] Statistics statistics() const;
  [[nodiscard]] std::vector<std::string> explanation() const;

 private:
  glm::uvec2 film_;
  std::uint32_t frames_ = 0;
  std::unique_ptr<std::function<void()>> step_;  ///< its place is known to the renderer
  v0::Renderer renderer_;
  std::string doubt_;  ///< about the folder for compiled programs
};

}  // namespace parian
