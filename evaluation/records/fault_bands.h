#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace feeler::evaluation {

/// Episodes of faults that are drawn from ranges, counted by how large the fault was.
class FaultBands {
 public:
  /// A line of a records file.
  void Add(const nlohmann::json& record);
  bool empty() const { return seen_.empty(); }
  /// For each fault four bands of equal width between the least and the greatest value met: `{fault, from, to,
  /// episodes, inserted, time_max_s}`, bands without an episode left out.
  nlohmann::json ToJson() const;
  /// The same, a line per band.
  std::string ToText() const;

 private:
  struct Seen {
    double value = 0.0;
    bool inserted = false;
    double time_s = 0.0;
  };
  std::map<std::string, std::vector<Seen>> seen_;
};

}  // namespace feeler::evaluation
