// How many times as fast as the plain form the library evaluates S_d: both over the same arrays, taking turns, with the
// spread and the worst difference of their values.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "evaluation_kernels.hpp"

namespace parian {
namespace {

using namespace test;

constexpr std::uint32_t points = 4096, samples = 512;
constexpr int repetitions = 9, iterations = 3;

/// A kernel with what it has shown so far.
struct Contender {
  std::string name;
  std::unique_ptr<EvaluationKernel> kernel;
  std::vector<float> sums;
  std::vector<double> pairs_per_second;  ///< of each repetition
};

void measure(benchmark::State& state, Contender& contender) {
  double total = 0;
  for ([[maybe_unused]] const auto& iteration : state) {
    double seconds = 0;
    contender.sums = contender.kernel->run(seconds);
    state.SetIterationTime(seconds);
    total += seconds;
  }
  contender.pairs_per_second.push_back(double{points} * samples * static_cast<double>(state.iterations()) / total);
  state.counters["pairs"] = benchmark::Counter(contender.pairs_per_second.back());
}

/// The median of `values`, and their range, in units of `unit`.
std::string spread(std::vector<double> values, double unit) {
  std::sort(values.begin(), values.end());
  return fmt::format("{:8.2f} ({:.2f} to {:.2f})", values[values.size() / 2] / unit, values.front() / unit,
                     values.back() / unit);
}

void print_ratios(const std::vector<Contender>& contenders) {
  const Contender& plain = contenders.front();
  fmt::print("\n{}: three-channel pairs a second, medians of {} repetitions with least and most\n",
             plain.kernel->info().name, repetitions);
  for (const Contender& c : contenders) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < c.pairs_per_second.size(); ++i)
      ratios.push_back(c.pairs_per_second[i] / plain.pairs_per_second[i]);
    double worst = 0;
    for (std::size_t i = 0; i < c.sums.size(); ++i)
      worst = std::max(worst, std::fabs(double{c.sums[i]} / plain.sums[i] - 1));
    fmt::print("{:<20} {} M/s, {} times the plain form, sums differ by at most {:.2g} of themselves\n", c.name,
               spread(c.pairs_per_second, 1e6), spread(ratios, 1), worst);
  }
}

int run(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  std::string interleave = "--benchmark_enable_random_interleaving=true";
  arguments.insert(arguments.begin() + 1, interleave.data());
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  const char* wanted = std::getenv("PARIAN_DEVICE");
  const Evaluations evaluations = make_evaluations(points, samples, 2);
  std::vector<Contender> contenders;
  for (const std::uint32_t lanes : {0U, 1U, 8U, 16U}) {
    contenders.push_back({lanes == 0 ? "plain, 8 lanes" : fmt::format("library, {} lanes", lanes),
                          std::make_unique<EvaluationKernel>(wanted ? wanted : "", lanes, evaluations),
                          {},
                          {}});
    double compiling = 0;
    contenders.back().kernel->run(compiling);
  }
  for (Contender& c : contenders)
    benchmark::RegisterBenchmark(c.name.c_str(), [&c](benchmark::State& state) { measure(state, c); })
        ->UseManualTime()
        ->Iterations(iterations)
        ->Repetitions(repetitions)
        ->Unit(benchmark::kMillisecond);
  benchmark::RunSpecifiedBenchmarks();
  print_ratios(contenders);
  return 0;
}

}  // namespace
}  // namespace parian

int main(int argc, char** argv) { return parian::run(argc, argv); }
