// Laws of work in a process of its own: what it gives arrives whole; what kills it kills nothing else, and is named; a
// signal to the one who waits ends both.
#include "feeler/cad/readers/run_apart.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <new>
#include <string>
#include <thread>

#include "feeler/core/interrupted.h"

namespace feeler::cad {
namespace {

TEST(RunApart, GivesWhatTheWorkGives) {
  EXPECT_EQ(RunApart([] { return std::string(); }), "");
  const std::string large(3'000'000, 'x');
  EXPECT_EQ(RunApart([&] { return large + '\0' + std::to_string(getpid()); }).substr(0, large.size()), large);
  const pid_t here = getpid();
  EXPECT_NE(RunApart([] { return std::to_string(getpid()); }), std::to_string(here));
}

TEST(RunApart, NamesTheSignalThatEndsIt) {
  for (const int number : {SIGSEGV, SIGABRT, SIGKILL}) {
    try {
      RunApart([number]() -> std::string {
        std::signal(number, SIG_DFL);
        raise(number);
        return "";
      });
      ADD_FAILURE() << number;
    } catch (const ChildDied& died) {
      EXPECT_EQ(died.signal, number);
    }
  }
  EXPECT_THROW(RunApart([]() -> std::string { throw std::bad_alloc(); }), std::bad_alloc);
}

TEST(RunApart, WhatComesToNoEndIsEnded) {
  try {
    RunApart(
        []() -> std::string {
          for (;;) getpid();
        },
        1);
    ADD_FAILURE();
  } catch (const ChildDied& died) {
    EXPECT_EQ(died.signal, SIGXCPU);
  }
}

TEST(RunApart, ASignalEndsBoth) {
  struct sigaction act {};
  struct sigaction before {};
  act.sa_handler = [](int) {};
  sigaction(SIGUSR1, &act, &before);
  const auto begun = std::chrono::steady_clock::now();
  const pthread_t waiting = pthread_self();
  std::thread later([waiting] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    pthread_kill(waiting, SIGUSR1);
  });
  EXPECT_THROW(RunApart([]() -> std::string {
                 sleep(60);
                 return "";
               }),
               Interrupted);
  later.join();
  sigaction(SIGUSR1, &before, nullptr);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(30));
}

}  // namespace
}  // namespace feeler::cad
