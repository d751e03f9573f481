// The plain form of S_d that the benchmark measures against: it must be right itself, or the measure is worth nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "evaluation_kernels.hpp"
#include "test_render.hpp"

namespace parian {
namespace {

using namespace test;

/// S_d of each pair and channel in double.
std::vector<double> exact_evaluations(const Evaluations& e) {
  std::vector<double> S;
  const std::size_t all = e.all_samples();
  const auto channels = evaluation_channels();
  const kernels::ExactBoundary boundary = exact_boundary(static_cast<float>(channels[0].eta));
  for (std::size_t i = 0; i < e.n_points; ++i) {
    const auto of_sample = [&](std::size_t k) {
      const float* v = e.samples.data() + 3 * k * all + i * e.stride;
      return kernels::real3{v[0], v[all], v[2 * all]};
    };
    const float* p = e.points.data() + 6 * i;
    const kernels::real3 n_i = of_sample(2), w12 = kernels::refract_into(of_sample(1), n_i, boundary);
    const kernels::DipoleGeometry g =
        kernels::dipole_geometry(kernels::real3_sub({p[0], p[1], p[2]}, of_sample(0)), w12, n_i, {p[3], p[4], p[5]});
    for (const ChannelConstants& c : channels)
      S.push_back(exact_bssrdf(Model::directional, exact_medium(c, Model::directional, 1), boundary, g));
  }
  return S;
}

TEST(Evaluation, ThePlainFormAgreesWithTheLibrarys) {
  const Evaluations e = make_evaluations(fitted(4000U, 400U), 0, 1);
  const std::vector<double> right = exact_evaluations(e);
  for (const std::uint32_t lanes : {0U, 1U, 8U, 16U}) {
    EvaluationKernel kernel(test_selector(), lanes, e);
    double seconds = 0, worst = 0;
    const std::vector<float> found = kernel.run(seconds);
    std::size_t judged = 0, at = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      // Far away both sources nearly cancel. Here at least a thousandth of them is left, so that their rounding, some
      // 1e-7 of them, is some 1e-4 of S.
      if (right[i] < 1e-4) continue;
      ++judged;
      const double error = std::fabs(found[i] / double{widest} / right[i] - 1);
      if (error <= worst) continue;
      worst = std::isnan(error) ? INFINITY : error;
      at = i;
    }
    fmt::print("{}: {} evaluations, worst relative error {:.2g} at {}, where S is {:.3g}\n",
               lanes == 0 ? "plain" : fmt::format("library, {} lanes", lanes), judged, worst, at, right[at]);
    EXPECT_GT(judged, right.size() / 2);
    EXPECT_LT(worst, 3e-4);
  }
}

}  // namespace
}  // namespace parian
