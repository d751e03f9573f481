// One scene on one device: frames, checkpoints, and what is asked of them. The algorithm is in algorithm.cpp.
#include "render/renderer.hpp"

#include <algorithm>

#include "render/renderer_state.hpp"

namespace parian {

Renderer::Renderer(Scene scene, const Settings& settings, const std::string& selector)
    : Renderer(std::move(scene), settings, std::make_shared<Compute>(selector), nullptr) {}

Renderer::Renderer(Scene scene, const Settings& settings, std::shared_ptr<Compute> compute, const DeviceMesh* mesh) {
  Readied ready = make_ready(scene, settings, *compute, mesh);
  state_ = std::make_unique<State>(std::move(scene), settings, std::move(compute), mesh, std::move(ready));
  try {
    state_->prepare();
  } catch (...) {
    leave();
    throw;
  }
}

Renderer::~Renderer() { leave(); }

/// Buffers of a driver that is of no use any more can't be released.
void Renderer::leave() noexcept {
  if (state_ && state_->compute.abandoned()) (void)state_.release();
}

void Renderer::frame() {
  State& s = *state_;
  with_device_errors(s.compute.info(), [&] {
    s.apply_changes();
    std::uint32_t most = 0;
    for (const auto& light : s.plan.lights) most = std::max(most, light.samples);
    const std::uint32_t epoch = s.settings.light_map_shift ? s.frame * most / redraw_samples : 0;
    const bool redrawn = epoch != s.epoch || (s.frame > 0 && kept(s.settings, "light-map-redraws"));
    s.epoch = epoch;
    s.redraws += redrawn;
    s.run({.light_maps = redrawn, .samples = true});
    ++s.frame;
  });
}

std::uint32_t Renderer::frames() const { return state_->frame; }

bool Renderer::checkpoint() const {
  State& s = *state_;
  std::uint32_t n = s.frame;
  while (n > 4 && n % 2 == 0) n /= 2;
  if (n < 1 || n > 4) return false;
  // Error falls about as one over the frames, never as their square: until then it needn't be asked for.
  const double ratio = static_cast<double>(s.estimated_at) / s.frame;
  const bool hopeless = s.estimated_at > 0 && s.statistics.estimated_relmse * ratio * ratio > s.settings.error;
  if (!hopeless || !(s.settings.error > 0) || kept(s.settings, "checkpoints")) return true;
  if (s.last_unestimated != s.frame) ++s.unestimated;  // however often it is asked
  s.last_unestimated = s.frame;
  return false;
}

const KernelTable& Renderer::kernel_table() const { return state_->compute.kernel_table(); }

const DeviceInfo& Renderer::device() const { return state_->compute.info(); }

}  // namespace parian
