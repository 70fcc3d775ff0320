// libFuzzer harness of one reader (FEELER_FUZZ_READER): build/fuzz_NAME CORPUS -runs=N. `-seed_inputs` comes from
// `fuzz_seeds`. A refusal that is not one printable line, and any exception that is no feeler::Error, ends the run.
#include <cstdlib>
#include <cstring>

#include "tests/fuzz/readers.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const feeler::fuzz::Reader* reader = [] {
    for (const feeler::fuzz::Reader& known : feeler::fuzz::Readers()) {
      if (std::strcmp(known.name, FEELER_FUZZ_READER) == 0) return &known;
    }
    std::abort();
  }();
  feeler::fuzz::ReadOnce(*reader, {reinterpret_cast<const char*>(data), size});
  return 0;
}
