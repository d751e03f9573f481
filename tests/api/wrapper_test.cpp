// parian.hpp: failures become exceptions with their message, sizes of spans are looked at, moved renderers stay whole.
#include <parian/parian.hpp>

#include <array>
#include <utility>

#include "small_scene.hpp"

namespace parian::test {
namespace {

using v0::Renderer;  // the library has one of its own inside

TEST(Wrapper, FailuresHaveStatusAndMessage) {
  Renderer renderer(opencl().context(), opencl().device());
  try {
    renderer.frame();
    FAIL() << "a frame without a plan";
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.status(), PARIAN_NOT_PLANNED);
    EXPECT_EQ(failure.opencl_code(), CL_SUCCESS);
    EXPECT_STREQ(failure.what(), parian_message());
  }
  EXPECT_THROW(renderer.set(parian::material({-1, 1, 1}, {0, 0, 0}, 1.3)), Failure);
  EXPECT_THROW(Renderer("no such device"), Failure);
}

TEST(Wrapper, LooksAtSizes) {
  Renderer renderer(opencl().context(), opencl().device());
  const std::array<float, 10> positions{};
  const std::array<std::uint32_t, 3> triangle{0, 1, 2};
  EXPECT_THROW(renderer.set_mesh(positions, triangle), std::invalid_argument);
  EXPECT_THROW(renderer.set_mesh(std::span(positions).first(9), std::span(triangle).first(2)), std::invalid_argument);
  renderer.set(parian::camera({0, 0, 9}, {0, 0, 0}, 30), 4, 2);
  std::vector<float> rgba(4 * 4 * 2 - 1);
  EXPECT_THROW(renderer.read(0, rgba), std::invalid_argument);
  rgba.resize(4 * 4 * 2);
  EXPECT_THROW(renderer.read(0, rgba), Failure);  // there is no plan
}

TEST(Wrapper, FindsMaterials) {
  const parian_material marble = parian::material("Marble"), spaced = parian::material("  mar-ble");
  EXPECT_EQ(marble.sigma_s[0], 2.19);
  EXPECT_EQ(marble.sigma_a[2], 0.0071);
  EXPECT_EQ(marble.ior, 1.5);
  EXPECT_EQ(marble.name, spaced.name);
  try {
    static_cast<void>(parian::material("marbel"));
    FAIL() << "found what isn't there";
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.status(), PARIAN_INVALID_SCENE);
    EXPECT_NE(std::string(failure.what()).find("arble"), std::string::npos) << failure.what();
  }
}

TEST(Wrapper, MovedRenderersStayWhole) {
  Renderer first(opencl().context(), opencl().device());
  first.set(parian::camera({0, 0, 9}, {0, 0, 0}, 30), 4, 2);
  Renderer second = std::move(first);
  // What a move leaves behind is promised here: NOLINTNEXTLINE(bugprone-use-after-move,clang-analyzer-cplusplus.Move)
  EXPECT_EQ(first.get(), nullptr);
  EXPECT_EQ(second.context(), opencl().context());
  EXPECT_EQ(second.device_id(), opencl().device());
  std::vector<float> rgba(4);
  EXPECT_THROW(second.read(0, rgba), std::invalid_argument);
  second = Renderer(opencl().other(), opencl().device());
  EXPECT_EQ(second.context(), opencl().other());
}

TEST(Wrapper, FillsInDefaults) {
  const auto settings = make<parian_settings>();
  EXPECT_EQ(settings.struct_size, sizeof settings);
  EXPECT_EQ(settings.layers, 16U);
  EXPECT_EQ(make<parian_image>().struct_size, sizeof(parian_image));
  EXPECT_EQ(parian::camera({0, 0, 9}, {0, 0, 0}, 30).up[1], 1.0);
}

}  // namespace
}  // namespace parian::test
