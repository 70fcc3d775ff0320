#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/random.h"

namespace feeler::execution {

/// What may go wrong on a wire or in a robot behind it, to order.
enum class WireFault {
  kDrop,        ///< the connection breaks in the middle of a motion
  kStall,       ///< the link is silent for `stall_s`
  kProtective,  ///< the robot stops by itself in the middle of a motion
  kMalformed,   ///< a reply is garbage
  kHalf,        ///< half of a reply, then the connection breaks
  kVersion,     ///< the robot speaks another version
  kNan,         ///< a reply holds what is no number
  kBackwards,   ///< the clock of the robot goes back
  kJump,        ///< the reported pose jumps
};
inline constexpr int kWireFaultCount = 9;
std::string_view ToString(WireFault fault);

/// How often, as a share of the episodes, and how much.
struct OrderedFaults {
  double share[kWireFaultCount] = {};
  double stall_s = 0.05;
  double latency_s = 0.0;  ///< one way
  double jitter_s = 0.0;   ///< up to so much more
  double slowed = 1.0;     ///< by a safety field: all speeds times this
  double bias_n = 0.0;     ///< of the force sensor, along z, from the start of each episode on
  bool any() const;
};

/// "latency=2,jitter=1,drop=0.1,stall=0.2,stall-ms=50,protective=0.1,slowed=0.5,bias=1.5,...": latency, jitter and
/// stall-ms in milliseconds, the others shares. Throws InputError naming what is known.
OrderedFaults ParseOrderedFaults(const std::string& text);

/// When a fault comes: within motion number `motion` of the episode, `after_s` behind its beginning (or at its end).
struct PlannedFault {
  WireFault fault = WireFault::kDrop;
  int motion = 0;
  double after_s = 0.0;
};
/// Those of one episode: each kind with its share, in one of the first twelve motions.
std::vector<PlannedFault> PlanFaults(const OrderedFaults& ordered, std::uint64_t seed, std::uint64_t episode);

}  // namespace feeler::execution
