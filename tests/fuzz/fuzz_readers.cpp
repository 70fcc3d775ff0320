// fuzz_readers: mutated inputs over the readers of this process; resumable.
//   fuzz_readers [--runs N a reader] [--seed S] [--reader NAME] [--state FILE]
// Input k of a reader is drawn from (seed, k, its name): a number found once is found again. The state file keeps how
// far each reader is; a reader that crashes leaves the number of the input in it, and the next call begins behind it.
// Built with the preset `fuzz`, the readers run under the address and undefined-behaviour sanitizers.
// The last line is a JSON object: runs, refused, unexpected, crashes, cpu_s.
#include <charconv>
#include <cstdio>
#include <ctime>
#include <exception>
#include <fstream>
#include <map>
#include <string>

#include "tests/fuzz/mutate.h"
#include "tests/fuzz/readers.h"

namespace feeler::fuzz {
namespace {

struct Options {
  std::uint64_t runs = 1000;
  std::uint64_t seed = 1;
  std::string reader;
  std::string state;
};

struct Progress {
  std::uint64_t next = 0;  ///< input that runs, or would run, next
  std::uint64_t crashes = 0;
  bool running = false;
};

std::map<std::string, Progress> ReadState(const std::string& file) {
  std::map<std::string, Progress> state;
  std::ifstream in(file);
  std::string name;
  for (Progress p; in >> name >> p.next >> p.crashes >> p.running;) state[name] = p;
  for (auto& [reader, p] : state) {
    if (!p.running) continue;  // it ended within this input
    ++p.crashes;
    ++p.next;
    p.running = false;
  }
  return state;
}

void WriteState(const std::string& file, const std::map<std::string, Progress>& state) {
  if (file.empty()) return;
  std::ofstream out(file + ".part");
  for (const auto& [name, p] : state) out << name << " " << p.next << " " << p.crashes << " " << p.running << "\n";
  out.close();
  std::rename((file + ".part").c_str(), file.c_str());
}

int Run(const Options& options) {
  constexpr std::uint64_t kKeepEach = 1000;
  std::map<std::string, Progress> state = ReadState(options.state);
  std::uint64_t runs = 0, refused = 0, unexpected = 0, crashes = 0;
  const std::clock_t begin = std::clock();
  for (const Reader& reader : Readers()) {
    if (!options.reader.empty() && options.reader != reader.name) continue;
    const std::vector<std::string> seeds = Seeds(reader);
    Progress& progress = state[reader.name];
    for (; progress.next < options.runs; ++progress.next) {
      if (progress.next % kKeepEach == 0) {
        progress.running = true;
        WriteState(options.state, state);
      }
      RandomStream random(options.seed, progress.next, reader.name);
      try {
        refused += ReadOnce(reader, Mutate(seeds, random)) ? 0 : 1;
      } catch (const std::exception& error) {
        ++unexpected;
        std::fprintf(stderr, "%s, input %llu of seed %llu: %s\n", reader.name,
                     static_cast<unsigned long long>(progress.next), static_cast<unsigned long long>(options.seed),
                     error.what());
      }
      ++runs;
    }
    progress.running = false;
    crashes += progress.crashes;
    WriteState(options.state, state);
    std::fprintf(stderr, "%-16s %llu inputs\n", reader.name, static_cast<unsigned long long>(progress.next));
  }
  std::printf("{\"runs\": %llu, \"refused\": %llu, \"unexpected\": %llu, \"crashes\": %llu, \"cpu_s\": %.1f}\n",
              static_cast<unsigned long long>(runs), static_cast<unsigned long long>(refused),
              static_cast<unsigned long long>(unexpected), static_cast<unsigned long long>(crashes),
              static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  return unexpected + crashes > 0 ? 1 : 0;
}

}  // namespace
}  // namespace feeler::fuzz

int main(int argc, char** argv) {
  feeler::fuzz::Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    const std::string value = argv[i + 1];
    std::uint64_t number = 0;
    std::from_chars(value.data(), value.data() + value.size(), number);
    if (name == "--runs") options.runs = number;
    if (name == "--seed") options.seed = number;
    if (name == "--reader") options.reader = value;
    if (name == "--state") options.state = value;
  }
  return feeler::fuzz::Run(options);
}
