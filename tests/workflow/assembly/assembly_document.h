#pragma once

// Assembly files that the tests write: what ships, changed.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "feeler/workflow/assembly/assembly.h"

namespace feeler::workflow {

inline nlohmann::json ShippedAssembly(const std::string& name) {
  std::ifstream file(std::string(FEELER_SOURCE_DIR) + "/models/assemblies/" + name + ".json");
  return nlohmann::json::parse(file);
}

/// Through a file of the running test's own: tests run side by side.
inline Assembly LoadAssemblyText(const std::string& text) {
  const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / (std::string(test.test_suite_name()) + "_" + test.name());
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "assembly_under_test.json";
  std::ofstream(file) << text;
  return LoadAssembly(file.string());
}

}  // namespace feeler::workflow
