#pragma once

#include <map>
#include <string>
#include <vector>

#include "feeler/policies/storage/database.h"
#include "feeler/policies/storage/sqlite.h"

namespace feeler::policies {

/// The table meta: key -> value, with a checksum over all of it.
using Meta = std::map<std::string, std::string>;
inline constexpr const char* kMetaChecksum = "checksum";
inline constexpr const char* kMetaAxes = "axes";         // since version 2
inline constexpr const char* kMetaShard = "shard";       // of a part of a family: JSON
inline constexpr const char* kMetaCount = "problems";    // rows of the table problems
inline constexpr const char* kMetaSum = "problems_sum";  // of their checksums, modulo 2^64: a lost row shows

std::string MetaChecksum(const Meta& meta);

/// Throws InputError if the table is altered.
Meta ReadMeta(const SqliteConnection& connection, const std::string& path);
void WriteMeta(const SqliteConnection& connection, const Meta& meta);

std::string AxesText(const std::vector<AxisKind>& axes);
std::string ShardText(const DatabaseShard& shard);
/// Throws std::invalid_argument for settings that are not a JSON object.
Meta ToMeta(const DatabaseIdentity& identity);
/// Throws InputError if an entry is missing or unreadable.
DatabaseIdentity FromMeta(const Meta& meta, const std::string& path);
/// Throws InputError, naming what differs, unless the stored entries are those of the identity.
void RequireSameIdentity(const Meta& stored, const DatabaseIdentity& identity, const std::string& path);

}  // namespace feeler::policies
