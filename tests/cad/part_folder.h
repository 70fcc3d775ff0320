#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>

#include "feeler/core/error.h"

namespace feeler::cad {

/// Of the InputError that `work` throws; empty if it throws none.
inline std::string MessageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// A folder of a test's own, which goes with it.
class PartFolder : public testing::Test {
 protected:
  PartFolder()
      : folder_(std::filesystem::path(testing::TempDir()) /
                ("cad_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::create_directories(folder_);
  }
  ~PartFolder() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

}  // namespace feeler::cad
