// What tests of refused arguments share.
#pragma once
#include <limits>
#include <string>
#include <vector>

#include "small_scene.hpp"

namespace parian::test {

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                        infinity = std::numeric_limits<double>::infinity();

/// Expects a status and words in its message.
inline void refused(parian_status status, parian_status expected, const std::vector<std::string>& words) {
  EXPECT_EQ(status, expected) << parian_message();
  const std::string message = parian_message();
  EXPECT_EQ(message.find('\n'), std::string::npos);
  for (const std::string& word : words) EXPECT_NE(message.find(word), std::string::npos) << message;
}

/// A renderer with a plan and a frame, and the same image at the end as at the start.
class Arguments : public testing::Test {
 protected:
  void SetUp() override {
    CALL(scene.give(r.get()));
    CALL(parian_plan(r.get(), nullptr));
    CALL(parian_frame(r.get(), nullptr, 0, nullptr, nullptr));
    before = gathered(r.get());
    expect_picture(before);
  }
  void TearDown() override { EXPECT_EQ(gathered(r.get()), before) << "a refused call changed something"; }

  parian_status gather(const parian_image& image, cl_command_queue queue = nullptr, cl_uint n = 0,
                       const cl_event* wait = nullptr) {
    return parian_gather(r.get(), queue, 0, &image, n, wait, nullptr);
  }

  SmallScene scene;
  Handle r = create();
  Pixels pixels;
  Rgba before;
};

}  // namespace parian::test
