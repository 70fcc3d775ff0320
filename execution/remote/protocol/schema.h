#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace feeler::execution {

/// The JSON Schema of the protocol (protocol.schema.json), as both ends hold it.
const nlohmann::json& ProtocolSchema();

/// Why `value` is not what `#/$defs/NAME` of the schema describes, as "PLACE: WHAT"; empty if it is. Of JSON Schema it
/// knows what our schema uses: type, const, enum, properties, required, additionalProperties (false), items, minItems,
/// maxItems, minimum, maximum, exclusiveMinimum, maxLength, $ref.
std::string FaultAgainstSchema(const std::string& name, const nlohmann::json& value);

}  // namespace feeler::execution
