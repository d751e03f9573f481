// Threads: one renderer refuses the second, several work side by side, and messages are each thread's own.
#include <atomic>
#include <thread>
#include <vector>

#include "small_scene.hpp"

namespace parian::test {
namespace {

/// What everything that takes a renderer says of it.
std::vector<parian_status> all_calls(parian_renderer* r, const SmallScene& scene) {
  const Pixels pixels;
  const parian_image image = pixels.image();
  const parian_mesh mesh = scene.mesh();
  cl_context context = nullptr;
  auto device = sized<parian_device>();
  auto statistics = sized<parian_statistics>();
  auto omission = sized<parian_omission>();
  const char* text = nullptr;
  std::size_t bytes = 0;
  std::uint32_t due = 0;
  double relmse = 0.0;
  Rgba rgba(Pixels::count * 4);
  return {parian_get_opencl(r, &context, nullptr),
          parian_get_device(r, &device),
          parian_set_settings(r, &scene.settings),
          parian_set_mesh(r, &mesh),
          parian_set_material(r, &scene.material),
          parian_set_lights(r, 1, scene.lights.data()),
          parian_set_cameras(r, 1, &scene.camera, 8, 8),
          parian_positions_changed(r),
          parian_restart(r),
          parian_scratch_size(r, &bytes),
          parian_set_scratch(r, nullptr),
          parian_plan(r, nullptr),
          parian_frame(r, nullptr, 0, nullptr, nullptr),
          parian_gather(r, nullptr, 0, &image, 0, nullptr, nullptr),
          parian_estimate_due(r, &due),
          parian_estimate(r, nullptr, &relmse),
          parian_read(r, nullptr, 0, rgba.data(), nullptr),
          parian_get_statistics(r, &statistics),
          parian_get_omission(r, 0, &omission),
          parian_get_warning(r, 0, &text),
          parian_get_explanation(r, 0, &text)};
}

TEST(Threads, OneRendererRefusesTheSecond) {
  struct Meeting {
    std::atomic<bool> inside = false, leave = false;
    bool armed = false;
    parian_renderer* renderer = nullptr;
    parian_status re_entered = PARIAN_SUCCESS;
  } meeting;
  parian_create_info info = in_context();
  info.user = &meeting;
  info.cancel = [](void* user) {
    auto& m = *static_cast<Meeting*>(user);
    if (!m.armed) return 0;
    m.armed = false;
    m.re_entered = parian_frame(m.renderer, nullptr, 0, nullptr, nullptr);
    m.inside = true;
    while (!m.leave) std::this_thread::yield();
    return 0;
  };
  const SmallScene scene;
  const Handle r = create(info);
  meeting.renderer = r.get();
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  CALL(parian_frame(r.get(), nullptr, 0, nullptr, nullptr));
  meeting.armed = true;
  std::thread other([&] { EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_SUCCESS); });
  while (!meeting.inside) std::this_thread::yield();
  // While the other thread is inside.
  for (const parian_status status : all_calls(r.get(), scene)) EXPECT_EQ(status, PARIAN_BUSY);
  meeting.leave = true;
  other.join();
  EXPECT_EQ(meeting.re_entered, PARIAN_BUSY);
  EXPECT_EQ(read_after(r.get(), 0), right_image());
}

TEST(Threads, BothCallWithoutRest) {
  const SmallScene scene;
  const Handle r = create();
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  std::atomic<int> done = 0, busy = 0, other = 0;
  const auto call = [&] {
    while (done < 40) {
      const parian_status status = parian_frame(r.get(), nullptr, 0, nullptr, nullptr);
      ++(status == PARIAN_SUCCESS ? done : status == PARIAN_BUSY ? busy : other);
    }
  };
  std::thread first(call), second(call);
  first.join();
  second.join();
  EXPECT_EQ(other, 0);
  auto statistics = sized<parian_statistics>();
  CALL(parian_get_statistics(r.get(), &statistics));
  EXPECT_EQ(statistics.frames, static_cast<std::uint32_t>(done));
  RecordProperty("refused", busy);
  const Rgba image = read_after(r.get(), 0);
  // As many frames by one thread.
  const Handle alone = create();
  CALL(scene.give(alone.get()));
  CALL(parian_plan(alone.get(), nullptr));
  EXPECT_EQ(image, read_after(alone.get(), done));
}

TEST(Threads, TwoRenderersTwoQueues) {
  SmallScene scenes[2];
  scenes[1].settings.seed = 7;
  scenes[1].lights.push_back(SmallScene::light({1, 0, 0.2}, 2.0));
  Rgba alone[2], together[2];
  const auto render = [&](int i) {
    const cl::CommandQueue queue(opencl().context, opencl().device, i ? CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE : 0);
    const Handle r = create();
    EXPECT_EQ(scenes[i].give(r.get()), PARIAN_SUCCESS);
    EXPECT_EQ(parian_plan(r.get(), queue()), PARIAN_SUCCESS) << parian_message();
    Rgba all;
    for (int k = 0; k < 5; ++k) {
      const Rgba image = read_after(r.get(), 2, queue());
      all.insert(all.end(), image.begin(), image.end());
    }
    return all;
  };
  for (int i = 0; i < 2; ++i) alone[i] = render(i);
  std::thread threads[2];
  for (int i = 0; i < 2; ++i) threads[i] = std::thread([&, i] { together[i] = render(i); });
  for (std::thread& t : threads) t.join();
  for (int i = 0; i < 2; ++i) EXPECT_EQ(together[i], alone[i]) << i;
}

TEST(Threads, MessagesAreTheThreadsOwn) {
  EXPECT_EQ(parian_set_material(nullptr, nullptr), PARIAN_INVALID_ARGUMENT);
  const std::string mine = parian_message();
  std::string first, after;
  std::thread([&] {
    first = parian_message();
    EXPECT_EQ(parian_create(nullptr, nullptr), PARIAN_INVALID_ARGUMENT);
    after = parian_message();
  }).join();
  EXPECT_EQ(first, "");
  EXPECT_NE(after, mine);
  EXPECT_EQ(parian_message(), mine);
}

}  // namespace
}  // namespace parian::test
