#pragma once

#include <functional>
#include <string>

namespace feeler::cad {

/// Runs `work` in a process of its own, for a library that bad input can crash, and returns the bytes that it gives.
/// Throws ChildDied if a signal ended it (SIGXCPU after `most_cpu_s` of CPU), Interrupted if one came for this process
/// while it waited (the child ends too), std::bad_alloc if there is no memory or process to be had. What else `work`
/// throws, it must turn into bytes.
std::string RunApart(const std::function<std::string()>& work, unsigned most_cpu_s = 120);

struct ChildDied {
  int signal = 0;
};

}  // namespace feeler::cad
