// fuzz_readers: mutated inputs over all readers, in a process of their own each; resumable.
//   fuzz_readers [--runs N in all] [--seed S] [--reader NAME] [--state FILE]
// The runs are shared out evenly. Input k of a reader is drawn from (seed, k, its name): a number found once is found
// again. A reader that crashes, hangs for kHang_s or ends the process is started again behind that input; the state
// file keeps how far each is. What crashes in another library's reader is counted apart (`third_party_crashes`). Built
// with the preset `fuzz`, the readers run under the address and undefined-behaviour sanitizers. The last line is a JSON
// object; exit code 1 if one of our readers crashed, hung, or threw what is no refusal.
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <fstream>
#include <map>
#include <new>
#include <string>

#include "tests/fuzz/mutate.h"
#include "tests/fuzz/readers.h"

namespace feeler::fuzz {
namespace {

constexpr unsigned kHang_s = 200;          // longer than libraries are given (RunApart)
constexpr std::uint64_t kKeepEach = 5000;  // inputs between two states on disk

struct Options {
  std::uint64_t runs = 1000;
  std::uint64_t seed = 1;
  std::string reader;
  std::string state;
};

/// Of one reader. It lies in memory that parent and child share.
struct Progress {
  std::uint64_t next = 0;  ///< input that runs, or would run, next
  std::uint64_t refused = 0;
  std::uint64_t unexpected = 0;  ///< exceptions that are no refusals, refusals that are no messages
  std::uint64_t crashes = 0;
  double cpu_s = 0.0;
};

using States = std::map<std::string, Progress>;

States ReadState(const std::string& file) {
  States state;
  std::ifstream in(file);
  std::string name;
  for (Progress p; in >> name >> p.next >> p.refused >> p.unexpected >> p.crashes >> p.cpu_s;) state[name] = p;
  return state;
}

void WriteState(const std::string& file, const States& state) {
  if (file.empty()) return;
  std::ofstream out(file + ".part");
  for (const auto& [name, p] : state) {
    out << name << " " << p.next << " " << p.refused << " " << p.unexpected << " " << p.crashes << " " << p.cpu_s
        << "\n";
  }
  out.close();
  std::rename((file + ".part").c_str(), file.c_str());
}

/// In the child: inputs up to `end`.
void Work(const Reader& reader, const std::vector<std::string>& seeds, const Options& options, std::uint64_t end,
          Progress& progress) {
  for (; progress.next < end; ++progress.next) {
    alarm(kHang_s);
    RandomStream random(options.seed, progress.next, reader.name);
    try {
      if (!ReadOnce(reader, Mutate(seeds, random))) ++progress.refused;
    } catch (const std::bad_alloc&) {
      ++progress.refused;  // the command line says so in one line
    } catch (const std::exception& error) {
      ++progress.unexpected;
      std::fprintf(stderr, "%s, input %llu of seed %llu: %s\n", reader.name,
                   static_cast<unsigned long long>(progress.next), static_cast<unsigned long long>(options.seed),
                   error.what());
    }
  }
}

void RunReader(const Reader& reader, const std::vector<std::string>& seeds, const Options& options, std::uint64_t runs,
               States& states, Progress& shared) {
  shared = states[reader.name];
  while (shared.next < runs) {
    const std::uint64_t end = std::min(runs, shared.next + kKeepEach);
    const pid_t child = fork();
    if (child == 0) {
      Work(reader, seeds, options, end, shared);
      std::fflush(nullptr);
      _exit(0);  // what the parent made stays
    }
    int status = 0;
    rusage usage{};
    if (child < 0 || wait4(child, &status, 0, &usage) != child) std::abort();
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    shared.cpu_s += seconds(usage.ru_utime) + seconds(usage.ru_stime);
    if (shared.next < end) {
      std::fprintf(stderr, "%s, input %llu of seed %llu: ended the process (status %d)\n", reader.name,
                   static_cast<unsigned long long>(shared.next), static_cast<unsigned long long>(options.seed), status);
      ++shared.crashes;
      ++shared.next;
    }
    states[reader.name] = shared;
    WriteState(options.state, states);
  }
  const Progress& p = states[reader.name] = shared;
  std::fprintf(stderr, "%-16s %9llu inputs, %9llu refused, %llu crashes, %llu unexpected, %.0f s of CPU\n", reader.name,
               static_cast<unsigned long long>(p.next), static_cast<unsigned long long>(p.refused),
               static_cast<unsigned long long>(p.crashes), static_cast<unsigned long long>(p.unexpected), p.cpu_s);
}

std::vector<std::pair<Reader, std::vector<std::string>>> AllReaders(const std::string& wanted) {
  std::vector<std::pair<Reader, std::vector<std::string>>> all;
  for (const Reader& reader : Readers()) {
    if (wanted.empty() || wanted == reader.name) all.emplace_back(reader, Seeds(reader));
  }
#ifdef FEELER_FUZZ_MORE
  for (const Reader& reader : MoreReaders()) {
    if (wanted.empty() || wanted == reader.name) all.emplace_back(reader, MoreSeeds(reader));
  }
#endif
  return all;
}

int Run(const Options& options) {
  void* memory = mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return 2;
  auto& shared = *new (memory) Progress;
  const auto readers = AllReaders(options.reader);
  if (readers.empty()) return 2;
  States states = ReadState(options.state);
  Progress ours;
  std::uint64_t third_party_crashes = 0;
  for (std::size_t i = 0; i < readers.size(); ++i) {
    const auto& [reader, seeds] = readers[i];
    const std::uint64_t runs = options.runs * (i + 1) / readers.size() - options.runs * i / readers.size();
    RunReader(reader, seeds, options, runs, states, shared);
    ours.next += shared.next;
    ours.refused += shared.refused;
    ours.unexpected += shared.unexpected;
    ours.cpu_s += shared.cpu_s;
    (reader.third_party ? third_party_crashes : ours.crashes) += shared.crashes;
  }
  std::printf(
      "{\"readers\": %zu, \"runs\": %llu, \"refused\": %llu, \"unexpected\": %llu, \"crashes\": %llu, "
      "\"third_party_crashes\": %llu, \"cpu_h\": %.3f}\n",
      readers.size(), static_cast<unsigned long long>(ours.next), static_cast<unsigned long long>(ours.refused),
      static_cast<unsigned long long>(ours.unexpected), static_cast<unsigned long long>(ours.crashes),
      static_cast<unsigned long long>(third_party_crashes), ours.cpu_s / 3600);
  return ours.unexpected + ours.crashes > 0 ? 1 : 0;
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
