#include "feeler/execution/remote/protocol/schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace feeler::execution {

extern const char* const kProtocolSchemaText;  // protocol_schema.cpp, made by CMake

namespace {

using nlohmann::json;

bool HasType(const json& value, const std::string& type) {
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "string") return value.is_string();
  if (type == "boolean") return value.is_boolean();
  if (type == "integer") return value.is_number_integer();
  if (type == "number") return value.is_number() && std::isfinite(value.get<double>());
  return type == "null" && value.is_null();
}

bool HasOneType(const json& value, const json& types) {
  if (types.is_string()) return HasType(value, types.get_ref<const std::string&>());
  return std::any_of(types.begin(), types.end(),
                     [&](const json& type) { return HasType(value, type.get_ref<const std::string&>()); });
}

const json* Find(const json& object, const char* key) {
  const auto at = object.find(key);
  return at == object.end() ? nullptr : &*at;
}

std::string Fault(const json& schema, const json& value, const std::string& place);

std::string FaultOfObject(const json& schema, const json& value, const std::string& place) {
  if (const json* required = Find(schema, "required")) {
    for (const json& key : *required) {
      const auto& name = key.get_ref<const std::string&>();
      if (!value.contains(name)) return fmt::format("{}: '{}' is missing", place, name);
    }
  }
  const json* properties = Find(schema, "properties");
  if (properties == nullptr) return "";
  for (const auto& [key, member] : value.items()) {
    const auto known = properties->find(key);
    if (known == properties->end()) return fmt::format("{}: '{}' is not known", place, key.substr(0, 40));
    if (std::string fault = Fault(*known, member, place + "." + key); !fault.empty()) return fault;
  }
  return "";
}

std::string FaultOfNumber(const json& schema, const json& value, const std::string& place) {
  const double number = value.get<double>();
  if (const json* least = Find(schema, "minimum"); least != nullptr && number < least->get<double>()) {
    return fmt::format("{} is {}, less than {}", place, number, least->get<double>());
  }
  if (const json* most = Find(schema, "maximum"); most != nullptr && number > most->get<double>()) {
    return fmt::format("{} is {}, more than {}", place, number, most->get<double>());
  }
  if (const json* above = Find(schema, "exclusiveMinimum"); above != nullptr && number <= above->get<double>()) {
    return fmt::format("{} is {}, not more than {}", place, number, above->get<double>());
  }
  return "";
}

std::string FaultOfList(const json& schema, const json& value, const std::string& place) {
  const json* least = Find(schema, "minItems");
  const json* most = Find(schema, "maxItems");
  if ((least != nullptr && value.size() < least->get<std::size_t>()) ||
      (most != nullptr && value.size() > most->get<std::size_t>())) {
    return fmt::format("{} has {} elements", place, value.size());
  }
  const json* items = Find(schema, "items");
  if (items == nullptr) return "";
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (std::string fault = Fault(*items, value[i], fmt::format("{}[{}]", place, i)); !fault.empty()) return fault;
  }
  return "";
}

std::string Fault(const json& schema, const json& value, const std::string& place) {
  if (const json* reference = Find(schema, "$ref")) {
    constexpr std::size_t kPrefix = 8;  // "#/$defs/"
    return Fault(ProtocolSchema().at("$defs").at(reference->get<std::string>().substr(kPrefix)), value, place);
  }
  if (const json* type = Find(schema, "type"); type != nullptr && !HasOneType(value, *type)) {
    return fmt::format("{} is no {}", place, type->is_string() ? type->get<std::string>() : type->dump());
  }
  if (const json* constant = Find(schema, "const"); constant != nullptr && value != *constant) {
    return fmt::format("{} is not {}", place, constant->dump());
  }
  if (const json* words = Find(schema, "enum");
      words != nullptr && std::find(words->begin(), words->end(), value) == words->end()) {
    return fmt::format("{} is none of {}", place, words->dump());
  }
  if (value.is_object()) return FaultOfObject(schema, value, place);
  if (value.is_number()) return FaultOfNumber(schema, value, place);
  if (value.is_array()) return FaultOfList(schema, value, place);
  if (const json* most = Find(schema, "maxLength");
      most != nullptr && value.is_string() && value.get_ref<const std::string&>().size() > most->get<std::size_t>()) {
    return fmt::format("{} is longer than {}", place, most->get<std::size_t>());
  }
  return "";
}

}  // namespace

const json& ProtocolSchema() {
  static const json kSchema = json::parse(kProtocolSchemaText);
  return kSchema;
}

std::string FaultAgainstSchema(const std::string& name, const json& value) {
  const json& definitions = ProtocolSchema().at("$defs");
  const auto found = definitions.find(name);
  if (found == definitions.end()) return "no message of that type";
  return Fault(*found, value, "message");
}

}  // namespace feeler::execution
