#pragma once

#include <string>
#include <string_view>

#include "feeler/execution/remote/protocol/messages.h"

namespace feeler::execution {

// The JSON form of messages.h: an object a line, checked against protocol.schema.json in both directions.
std::string RequestToJson(std::uint64_t seq, const Request& request);
std::string ReplyToJson(std::uint64_t seq, const Reply& reply);
Framed<Request> RequestFromJson(std::string_view line);
Framed<Reply> ReplyFromJson(std::string_view line);

}  // namespace feeler::execution
