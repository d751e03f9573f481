// Programs whose locale has a decimal comma get the same materials, messages and pictures.
#include "comma_locale.hpp"

#include "frames.hpp"

namespace parian::test {
namespace {

class EmbeddedInLocale : public InCommaLocale {};

TEST_P(EmbeddedInLocale, NumbersStay) {
  const Rgba& wanted = right_image(2);
  const CommaLocale locale(GetParam());
  if (!locale.there()) GTEST_SKIP() << "no German locale could be made";
  auto marble = sized<parian_material>(), coke = sized<parian_material>(), milk = sized<parian_material>();
  CALL(parian_find_material("MARBLE", &marble));  // Turkish has two letters i, neither of which is ASCII's other one
  EXPECT_EQ(std::to_array(marble.sigma_s), (std::array{2.19, 2.62, 3.0}));
  EXPECT_EQ(std::to_array(marble.sigma_a), (std::array{0.0021, 0.0041, 0.0071}));
  EXPECT_EQ(marble.ior, 1.5);
  CALL(parian_find_material("coke", &coke));
  EXPECT_EQ(std::to_array(coke.sigma_s), (std::array{0.00254, 0.00299, 0.0}));
  EXPECT_EQ(std::to_array(coke.g), (std::array{0.965, 0.972, 0.0}));
  CALL(parian_find_material("Lowfat_Milk", &milk));
  EXPECT_EQ(milk.sigma_s[2], 17.9572);
  const SmallScene scene;
  const Handle r = planned(scene);
  EXPECT_EQ(read_after(r.get(), 2), wanted);
  marble.ior = -1234.5;
  EXPECT_EQ(parian_set_material(r.get(), &marble), PARIAN_INVALID_SCENE);
  EXPECT_NE(std::string(parian_message()).find("-1234.5"), std::string::npos) << parian_message();
  auto statistics = sized<parian_statistics>();
  CALL(parian_get_statistics(r.get(), &statistics));
  const char* text = nullptr;
  CALL(parian_get_explanation(r.get(), 4, &text));
  const std::size_t percent = std::string(text).find(" % of the visible");
  ASSERT_NE(percent, std::string::npos) << text;
  EXPECT_EQ(text[percent - 3], '.') << text;
}

INSTANTIATE_TEST_SUITE_P(Locale, EmbeddedInLocale, testing::Values(Library::c, Library::cpp), library_name);

}  // namespace
}  // namespace parian::test
