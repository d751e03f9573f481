// A renderer's whole life on the small scene, for tests in which something fails.
#pragma once
#include <algorithm>
#include <utility>

#include "small_scene.hpp"

namespace parian::test {

/// How the mesh is given, what it's looked up in, and where commands go: a mesh in host memory in layers that are
/// placed, two lights, and one of the caller's queues; in buffers of the caller's, as the scratch memory is, and the
/// renderer's own queue; or in host memory in the fixed camera's own view, stages timed, and both kinds of queue.
/// Placing takes long, so that the first life ends with its picture in the caller's buffer; the others are estimated
/// and read, too.
enum class Kind { host, buffers, fixed };

/// A renderer's life: made, described, planned, two frames, gathered, estimated and read. Once it is there it takes no
/// memory itself.
class Life {
 public:
  explicit Life(Kind kind) : kind_(kind) {
    scene_.settings.samples = 64;  // light maps are shifted between the frames
    scene_.settings.layers = 2;
    short_scene_.settings.layers = 1;
    short_scene_.settings.layer_size = short_scene_.settings.light_map_size = 8;
    scene_.settings.keep = "clipping";  // one program for all
    scene_.settings.fixed_cameras = scene_.settings.time_stages = kind == Kind::fixed;
    if (kind == Kind::fixed) scene_.settings.views = PARIAN_CAMERA;
    if (kind == Kind::host) scene_.lights.push_back(SmallScene::light({1, 0.2, 0.4}, 3.0));
    rgba.resize(Pixels::count * 4);
  }
  ~Life() { end(); }
  Life(const Life&) = delete;
  Life& operator=(const Life&) = delete;

  /// Its first failure, where it ends.
  parian_status live() {
    const parian_status s = make();
    return s == PARIAN_SUCCESS ? render() : s;
  }
  parian_status make() {
    const parian_create_info info = in_context();
    parian_renderer* made = nullptr;
    const parian_status s = parian_create(&info, &made);
    renderer.reset(made);
    return s;
  }
  /// From describing on; also again after a failure.
  parian_status render() {
    parian_renderer* r = renderer.get();
    std::fill(rgba.begin(), rgba.end(), 0.0F);
    const bool buffers = kind_ == Kind::buffers;
    const parian_mesh mesh = buffers ? SmallScene::mesh(scene_, vertices_, triangles_) : scene_.mesh();
    const cl_command_queue unordered = opencl().unordered(), queue = buffers ? nullptr : unordered,
                           other = kind_ == Kind::host ? unordered : nullptr;
    cl_event framed = nullptr;
    parian_status s = parian_set_mesh(r, &mesh);
    if (s == PARIAN_SUCCESS) s = scene_.describe(r);
    if (s == PARIAN_SUCCESS && buffers) s = parian_set_scratch(r, scratch_());
    if (s == PARIAN_SUCCESS) s = parian_plan(r, queue);
    if (s == PARIAN_SUCCESS) s = parian_frame(r, unordered, 0, nullptr, &framed);
    if (s == PARIAN_SUCCESS) s = parian_frame(r, other, 1, &framed, nullptr);
    if (framed) clReleaseEvent(framed);
    if (s == PARIAN_SUCCESS) s = gather(queue, 2);
    if (s != PARIAN_SUCCESS || kind_ == Kind::host) return s;
    double relmse = 0.0;
    s = parian_estimate(r, other, &relmse);
    if (s == PARIAN_SUCCESS) s = parian_read(r, unordered, 0, rgba.data(), nullptr);
    return s;
  }
  /// The same renderer, or a new one if there is none, with a shorter life: the mesh in buffers, one frame, one
  /// subpixel position.
  parian_status render_shortly() {
    parian_status s = renderer ? PARIAN_SUCCESS : make();
    const parian_mesh mesh = SmallScene::mesh(scene_, vertices_, triangles_);
    if (s == PARIAN_SUCCESS) s = parian_set_mesh(renderer.get(), &mesh);
    if (s == PARIAN_SUCCESS) s = short_scene_.describe(renderer.get());
    if (s == PARIAN_SUCCESS) s = parian_plan(renderer.get(), opencl().unordered());
    if (s == PARIAN_SUCCESS) s = parian_frame(renderer.get(), opencl().unordered(), 0, nullptr, nullptr);
    return s == PARIAN_SUCCESS ? gather(opencl().unordered(), 1) : s;
  }
  /// What the last gather put into the caller's buffer.
  Rgba image() { return pixels_.read(std::exchange(gathered_, nullptr)); }
  void end() {
    renderer.reset();
    if (gathered_) clReleaseEvent(std::exchange(gathered_, nullptr));
  }

  Handle renderer{nullptr, &parian_release};
  Rgba rgba;

 private:
  parian_status gather(cl_command_queue queue, std::uint32_t positions) {
    const parian_image image = pixels_.image(positions);
    if (gathered_) clReleaseEvent(std::exchange(gathered_, nullptr));
    return parian_gather(renderer.get(), queue, 0, &image, 0, nullptr, &gathered_);
  }

  Kind kind_;
  SmallScene scene_, short_scene_;
  Pixels pixels_;
  cl_event gathered_ = nullptr;
  cl::Buffer scratch_ = opencl().buffer(std::size_t{16} << 20);
  cl::Buffer vertices_ = opencl().buffer(scene_.positions), triangles_ = opencl().buffer(scene_.indices);
};

}  // namespace parian::test
