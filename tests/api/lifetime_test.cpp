// Who outlives whom, who calls when: releases in any order, failures and what comes after, cancelling, and a thousand
// renderers one after the other.
#include <algorithm>
#include <fstream>

#include <unistd.h>

#include "opencl_watch.hpp"
#include "small_scene.hpp"

namespace parian::test {
namespace {

TEST(Lifetime, ReleasesInAnyOrder) {
  const SmallScene scene;
  std::array<int, 5> order{0, 1, 2, 3, 4};  // renderer, queue, context, mesh and scratch, image
  int orders = 0;
  opencl();  // before anything is counted
  do {
    OpenclWatch watch;
    watch.build_once();
    {
      cl::Context context = opencl().context;
      cl::CommandQueue queue(context, opencl().device);
      cl::Buffer vertices = opencl().buffer(scene.positions), triangles = opencl().buffer(scene.indices);
      Pixels pixels;
      Handle r = create();
      const parian_mesh mesh = SmallScene::mesh(scene, vertices, triangles);
      CALL(parian_set_mesh(r.get(), &mesh));
      CALL(scene.describe(r.get()));
      std::size_t bytes = 0;
      CALL(parian_scratch_size(r.get(), &bytes));
      cl::Buffer scratch = opencl().buffer(bytes);
      CALL(parian_set_scratch(r.get(), scratch()));
      CALL(parian_plan(r.get(), queue()));
      const parian_image image = pixels.image(1);
      CALL(parian_frame(r.get(), queue(), 0, nullptr, nullptr));
      CALL(parian_gather(r.get(), queue(), 0, &image, 0, nullptr, nullptr));
      for (const int which : order) {  // with everything still under way
        if (which == 0) r.reset();
        if (which == 1) queue = cl::CommandQueue();
        if (which == 2) context = cl::Context();
        if (which == 3) vertices = triangles = scratch = cl::Buffer();
        if (which == 4) pixels.buffer = cl::Buffer();
      }
    }
    EXPECT_EQ(watch.unbalanced(), "");
    orders += 7;
    for (int i = 0; i < 6; ++i) std::next_permutation(order.begin(), order.end());  // every seventh of 120
  } while (std::next_permutation(order.begin(), order.end()));
  EXPECT_GE(orders, 120);
}

TEST(Lifetime, ContextOfNobodyElse) {
  Handle r(nullptr, &parian_release);
  {
    const cl::Context context(opencl().device);
    r = create(in_context(context));
  }
  const SmallScene scene;
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
}

TEST(Lifetime, ParianPicksTheDevice) {
  const std::string name = opencl().device.getInfo<CL_DEVICE_NAME>();
  auto info = sized<parian_create_info>();
  info.selector = name.c_str();
  const Handle r = create(info);
  cl_context context = nullptr;
  cl_device_id device = nullptr;
  CALL(parian_get_opencl(r.get(), &context, &device));
  ASSERT_NE(context, nullptr);
  const cl::CommandQueue queue(cl::Context(context, true), cl::Device(device, true));
  const SmallScene scene;
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), queue()));
  EXPECT_EQ(read_after(r.get(), 2, queue()), right_image());
  auto described = sized<parian_device>();
  CALL(parian_get_device(r.get(), &described));
  EXPECT_EQ(name.find(described.name), 0U) << described.name;
}

TEST(Lifetime, QueuesAndEventsAreNotRetained) {
  const SmallScene scene;
  const cl::CommandQueue queue(opencl().context, opencl().device);
  const cl::UserEvent wait(opencl().context);
  const cl_event waits[] = {wait()};
  cl::UserEvent(wait).setStatus(CL_COMPLETE);
  const Pixels pixels;
  const parian_image image = pixels.image();
  Rgba rgba(Pixels::count * 4);
  const Handle r = create();
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), queue()));
  OpenclWatch watch;
  CALL(parian_frame(r.get(), queue(), 1, waits, nullptr));
  CALL(parian_gather(r.get(), queue(), 0, &image, 1, waits, nullptr));
  EXPECT_EQ(watch.more("queues"), 0);
  EXPECT_EQ(watch.more("buffers"), 0);
  EXPECT_LE(watch.more("events"), 1) << "the last command's";
  CALL(parian_read(r.get(), queue(), 0, rgba.data(), nullptr));
  EXPECT_EQ(watch.more("queues"), 0);
  EXPECT_EQ(watch.more("events"), 0);
}

TEST(Lifetime, WaitListsAreWaitedFor) {
  const SmallScene scene;
  const Handle r = create();
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  for (const cl::CommandQueue& queue : {opencl().queue, opencl().unordered}) {
    cl::UserEvent first(opencl().context), second(opencl().context);
    const cl_event waits[] = {first(), second()};
    cl_event frame = nullptr, gathered_event = nullptr;
    CALL(parian_restart(r.get()));
    CALL(parian_frame(r.get(), queue(), 2, waits, &frame));
    const Pixels pixels;
    const parian_image image = pixels.image();
    CALL(parian_gather(r.get(), queue(), 0, &image, 0, nullptr, &gathered_event));
    const cl::Event framed(frame);
    first.setStatus(CL_COMPLETE);
    EXPECT_GT(framed.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>(), CL_COMPLETE) << "it did not wait for the second";
    second.setStatus(CL_COMPLETE);
    expect_picture(pixels.read(gathered_event));
    EXPECT_EQ(framed.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>(), CL_COMPLETE);
  }
}

/// A frame that waits for what the caller has not let go yet, and then doesn't come to its end, must come back.
TEST(Lifetime, FailedFramesDoNotWaitForTheCaller) {
  struct Calls {
    int until = -1;
  } calls;
  parian_create_info info = in_context();
  info.user = &calls;
  info.cancel = [](void* user) { return static_cast<Calls*>(user)->until-- == 0 ? 1 : 0; };
  const SmallScene scene;
  const Handle r = create(info);
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  cl::UserEvent later(opencl().context);
  const cl_event wait = later();
  cl_event frame = nullptr;
  CALL(parian_frame(r.get(), nullptr, 1, &wait, nullptr));
  calls.until = 0;
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, &frame), PARIAN_CANCELLED);
  EXPECT_EQ(frame, nullptr);
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, &frame), PARIAN_NOT_PLANNED);
  later.setStatus(CL_COMPLETE);
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
}

TEST(Lifetime, WhatTheCallerFailsIsNoDeviceLost) {
  const SmallScene scene;
  const Handle r = create();
  CALL(scene.give(r.get()));
  CALL(parian_plan(r.get(), nullptr));
  cl::UserEvent failing(opencl().context);
  const cl_event wait = failing();
  CALL(parian_frame(r.get(), nullptr, 1, &wait, nullptr));
  failing.setStatus(-1);
  Rgba rgba(Pixels::count * 4);
  EXPECT_EQ(parian_read(r.get(), nullptr, 0, rgba.data(), nullptr), PARIAN_DEVICE_FAILED) << parian_message();
  EXPECT_NE(parian_opencl_code(), CL_SUCCESS);
  EXPECT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
  CALL(parian_plan(r.get(), nullptr));
  EXPECT_EQ(read_after(r.get(), 2), right_image());
}

/// Cancels at the `at`-th question.
struct Cancel {
  int at = -1, asked = 0;
  static int ask(void* user) {
    auto& c = *static_cast<Cancel*>(user);
    return c.asked++ == c.at ? 1 : 0;
  }
};

TEST(Cancelling, AtAnyPoint) {
  const SmallScene scene;
  const Rgba& right = right_image();
  OpenclWatch watch;
  watch.build_once();
  int points = 0;
  {
    Cancel cancel;
    parian_create_info info = in_context();
    info.cancel = &Cancel::ask;
    info.user = &cancel;
    const Handle r = create(info);
    CALL(scene.give(r.get()));
    const Pixels pixels;
    const parian_image image = pixels.image();
    Rgba rgba(Pixels::count * 4);
    double relmse = 0.0;
    const auto render = [&] {
      parian_status status = parian_plan(r.get(), nullptr);
      if (status == PARIAN_SUCCESS) status = parian_frame(r.get(), nullptr, 0, nullptr, nullptr);
      if (status == PARIAN_SUCCESS) status = parian_frame(r.get(), nullptr, 0, nullptr, nullptr);
      if (status == PARIAN_SUCCESS) status = parian_gather(r.get(), nullptr, 0, &image, 0, nullptr, nullptr);
      if (status == PARIAN_SUCCESS) status = parian_estimate(r.get(), nullptr, &relmse);
      if (status == PARIAN_SUCCESS) status = parian_read(r.get(), nullptr, 0, rgba.data(), nullptr);
      return status;
    };
    cancel = {0, 0};
    ASSERT_EQ(render(), PARIAN_CANCELLED) << "before kernels are compiled";
    cancel = {};
    CALL(render());
    cancel = {};
    CALL(render());  // all is compiled
    const int questions = cancel.asked;
    EXPECT_GT(questions, 300);
    for (int k = 0; k < questions; k += k < 150 || k > questions - 50 ? 1 : 23, ++points) {
      cancel = {k, 0};
      ASSERT_EQ(render(), PARIAN_CANCELLED) << k;
      ASSERT_EQ(cancel.asked, k + 1) << "asked again after it was cancelled";
      ASSERT_EQ(parian_frame(r.get(), nullptr, 0, nullptr, nullptr), PARIAN_NOT_PLANNED);
    }
    cancel = {};
    CALL(render());
    EXPECT_EQ(rgba, right);
  }
  EXPECT_EQ(watch.unbalanced(), "");
  RecordProperty("points", points);
}

/// Bytes of this process in memory, 0 where nobody says.
std::size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

TEST(Lifetime, AThousandRenderers) {
  const SmallScene scene;
  const cl::Buffer vertices = opencl().buffer(scene.positions), triangles = opencl().buffer(scene.indices);
  constexpr int cycles = 1000, warm = 200;
  std::size_t before = 0;
  const Pixels pixels;
  const parian_image image = pixels.image(1);
  for (int i = 0; i < cycles; ++i) {
    if (i == warm) before = resident_bytes();
    OpenclWatch watch;
    watch.build_once();
    {
      const Handle r = create();
      // Layers of a mesh in host memory are placed, which takes most of the time: in the long form alone, and at first.
      const bool on_host = deep() || i < warm / 2;
      const parian_mesh mesh = on_host ? scene.mesh() : SmallScene::mesh(scene, vertices, triangles);
      CALL(parian_set_mesh(r.get(), &mesh));
      CALL(scene.describe(r.get()));
      CALL(parian_plan(r.get(), nullptr));
      CALL(parian_frame(r.get(), nullptr, 0, nullptr, nullptr));
      CALL(parian_gather(r.get(), nullptr, 0, &image, 0, nullptr, nullptr));
    }
    ASSERT_EQ(watch.unbalanced(), "") << i;
  }
  const std::size_t after = resident_bytes();
  EXPECT_LE(after, before + (std::size_t{4} << 20)) << "bytes in memory grow";
  std::printf("%.2f MiB more after %d cycles than after %d\n",
              (static_cast<double>(after) - static_cast<double>(before)) / 1048576.0, cycles, warm);
}

}  // namespace
}  // namespace parian::test
