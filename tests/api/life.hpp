// A renderer's whole life on the small scene, for tests in which something fails.
#pragma once
#include <algorithm>

#include "small_scene.hpp"

namespace parian::test {

enum class Kind { host, buffers, fixed };

/// A renderer's life: made, described, planned, two frames, gathered, estimated and read. Once it is there it takes no
/// memory itself.
class Life {
 public:
  explicit Life(Kind kind) : kind_(kind) {
    scene_.settings.fixed_cameras = scene_.settings.time_stages = kind == Kind::fixed;
    scene_.settings.samples = 64;  // light maps are shifted between the frames
    rgba.resize(Pixels::count * 4);
  }
  /// Its first failure, where it ends.
  parian_status live() {
    const parian_create_info info = in_context();
    parian_renderer* made = nullptr;
    parian_status s = parian_create(&info, &made);
    if (s != PARIAN_SUCCESS) return s;
    renderer.reset(made);
    return render();
  }
  /// From describing on; also again after a failure.
  parian_status render() {
    parian_renderer* r = renderer.get();
    std::fill(rgba.begin(), rgba.end(), 0.0F);
    const parian_mesh mesh = kind_ == Kind::buffers ? SmallScene::mesh(scene_, vertices_, triangles_) : scene_.mesh();
    const parian_image image = pixels_.image();
    const cl_command_queue queue = opencl().unordered();
    cl_event framed = nullptr;
    double relmse = 0.0;
    parian_status s = parian_set_mesh(r, &mesh);
    if (s == PARIAN_SUCCESS) s = scene_.describe(r);
    if (s == PARIAN_SUCCESS && kind_ == Kind::buffers) s = parian_set_scratch(r, scratch_());
    if (s == PARIAN_SUCCESS) s = parian_plan(r, nullptr);
    if (s == PARIAN_SUCCESS) s = parian_frame(r, queue, 0, nullptr, &framed);
    if (s == PARIAN_SUCCESS) s = parian_frame(r, nullptr, 1, &framed, nullptr);
    if (framed) clReleaseEvent(framed);
    if (s == PARIAN_SUCCESS) s = parian_gather(r, queue, 0, &image, 0, nullptr, nullptr);
    if (s == PARIAN_SUCCESS) s = parian_estimate(r, nullptr, &relmse);
    if (s == PARIAN_SUCCESS) s = parian_read(r, nullptr, 0, rgba.data(), nullptr);
    return s;
  }

  Handle renderer{nullptr, &parian_release};
  Rgba rgba;

 private:
  Kind kind_;
  SmallScene scene_;
  Pixels pixels_;
  cl::Buffer scratch_ = opencl().buffer(std::size_t{16} << 20);
  cl::Buffer vertices_ = opencl().buffer(scene_.positions), triangles_ = opencl().buffer(scene_.indices);
};

}  // namespace parian::test
