// Work in a process of its own: what it tells arrives, and neither a crash nor a hang reaches this one.
#include "truth/child_process.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <stdexcept>

namespace parian {
namespace {

TEST(ChildProcess, TellsUntilItEndsHoweverItDoes) {
  const std::string text(100'000, 'x');  // more than a pipe holds
  ChildOutcome outcome = in_child_process(60, [&](const auto& tell) { tell(text), tell("!"); });
  EXPECT_EQ(outcome.told, text + "!");
  EXPECT_EQ(outcome.trouble, "");

  outcome = in_child_process(60, [](const auto& tell) {
    tell("first");
    std::signal(SIGABRT, SIG_DFL);
    std::abort();
  });
  EXPECT_EQ(outcome.told, "first");
  EXPECT_EQ(outcome.trouble, "crashed (signal 6)");

  outcome = in_child_process(60, [](const auto&) { _exit(3); });
  EXPECT_EQ(outcome.trouble, "ended by itself (exit code 3)");

  outcome = in_child_process(60, [](const auto&) { throw std::runtime_error("lost"); });
  EXPECT_EQ(outcome.trouble, "ended by itself (exit code 1)");

  outcome = in_child_process(0.2, [](const auto& tell) {
    tell("before");
    for (;;) pause();
  });
  EXPECT_EQ(outcome.told, "before");
  EXPECT_EQ(outcome.trouble, "no answer within 0.2 s");
}

TEST(ChildProcess, EndsWithItsParent) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    close(ends[0]);
    (void)in_child_process(600, [&](const auto&) {
      if (write(ends[1], "!", 1) == 1)
        for (;;) pause();
    });
    _exit(0);
  }
  close(ends[1]);
  char byte = 0;
  EXPECT_EQ(read(ends[0], &byte, 1), 1);
  kill(parent, SIGTERM);
  waitpid(parent, nullptr, 0);
  pollfd waited{ends[0], POLLIN, 0};
  ASSERT_EQ(poll(&waited, 1, 60'000), 1) << "the child lives on";
  EXPECT_EQ(read(ends[0], &byte, 1), 0);  // nobody has the other end any more
  close(ends[0]);
}

}  // namespace
}  // namespace parian
