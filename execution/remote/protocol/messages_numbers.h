#pragma once

#include <string>
#include <string_view>

#include "feeler/execution/remote/protocol/messages.h"

namespace feeler::execution {

/// Way points that one compliant motion has in the numbers-only form: a controller's script reads at most 30 numbers.
inline constexpr std::size_t kMostWayPointsInNumbers = 3;

// The numbers-only form of messages.h: `(code, seq, ...)`, what a controller's script reads and writes. Texts are left
// out or become numbers; messages of simulations, pictures and twists have no such form (InputError).
std::string RequestToNumbers(std::uint64_t seq, const Request& request);
std::string ReplyToNumbers(std::uint64_t seq, const Reply& reply);
Framed<Request> RequestFromNumbers(std::string_view line);
Framed<Reply> ReplyFromNumbers(std::string_view line);

}  // namespace feeler::execution
