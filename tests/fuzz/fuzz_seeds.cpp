// fuzz_seeds FOLDER: writes the seeds of each reader as FOLDER/READER/NUMBER, the corpus that libFuzzer begins with.
#include <filesystem>
#include <fstream>

#include "tests/fuzz/readers.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  for (const feeler::fuzz::Reader& reader : feeler::fuzz::Readers()) {
    const std::filesystem::path folder = std::filesystem::path(argv[1]) / reader.name;
    std::filesystem::create_directories(folder);
    int number = 0;
    for (const std::string& seed : feeler::fuzz::Seeds(reader)) {
      std::ofstream(folder / std::to_string(number++), std::ios::binary) << seed;
    }
  }
  return 0;
}
