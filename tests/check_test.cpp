// The check of a device: it passes here, and names what is wrong when something is broken on purpose.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "plan.hpp"
#include "self_test.hpp"
#include "test_scene.hpp"
#include "vectors.hpp"

namespace parian {
namespace {

using namespace test;

TEST(SelfTest, PassesHere) {
  for (const int lanes : {1, 4, 8, 16})
    for (const Model model : models) {
      Settings settings;
      settings.model = model;
      Compute compute(test_selector());
      Plan plan = make_plan(scene_of(icosphere(1)), settings, compute.info());
      set_option(plan.options, "VW", lanes);
      compute.build(plan.options);
      for (const SelfTestAnswer& answer : self_test(compute, model, static_cast<std::uint32_t>(lanes))) {
        EXPECT_TRUE(answer.passed) << answer.name << ": " << answer.found;
        fmt::print("{:2} lanes {:12} {:18} {}\n", lanes, model_names[static_cast<std::size_t>(model)], answer.name,
                   answer.found);
      }
    }
}

TEST(CheckVectors, RandomCasesPassHere) {
  const std::vector<VectorCase> cases = random_vectors(100000, 0);
  for (const Model model : models) {
    Settings settings;
    settings.model = model;
    Compute compute(test_selector());
    const Plan plan = make_plan(scene_of(icosphere(1)), settings, compute.info());
    compute.build(plan.options);
    const Judgement j = judge(cases, device_bssrdf(compute, cases, model, plan.lanes), model);
    fmt::print("{}: {} cases, bad {}, outside {}, median {:.2g} p999 {:.2g} worst {:.2g} of tol {:.2g}\n  {}\n",
               model_names[static_cast<std::size_t>(model)], j.cases, j.bad, j.outside, j.median, j.p999,
               j.worst_relative, j.worst_of_tol, vector_json(cases[j.worst]));
    EXPECT_TRUE(j.passed());
  }
}

}  // namespace
}  // namespace parian
