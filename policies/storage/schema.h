#pragma once

#include <array>

namespace feeler::policies {

/// The tables of a version, in the order they are made. A file whose tables read otherwise is not taken for ours.
/// `problems` holds all that is content; `timings` what differs from run to run.
struct TableSchema {
  const char* name;
  const char* sql;
};
inline constexpr TableSchema kMeta = {"meta",
                                      "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID"};
inline constexpr TableSchema kTimings = {
    "timings",
    "CREATE TABLE timings (extents TEXT PRIMARY KEY, cpu_s REAL NOT NULL, wall_s REAL NOT NULL, "
    "checksum INTEGER NOT NULL) WITHOUT ROWID"};

/// Positions only.
inline constexpr std::array<TableSchema, 3> kSchemaVersion1 = {{
    kMeta,
    {"problems",
     "CREATE TABLE problems (id INTEGER PRIMARY KEY, extents TEXT NOT NULL UNIQUE, "
     "nx INTEGER NOT NULL, ny INTEGER NOT NULL, nz INTEGER NOT NULL, "
     "status TEXT NOT NULL, solver TEXT NOT NULL, epsilon REAL NOT NULL, expected_cost REAL, "
     "lower_bound REAL NOT NULL, expansions INTEGER NOT NULL, seed INTEGER NOT NULL, version TEXT NOT NULL, "
     "checksum INTEGER NOT NULL, policy BLOB)"},
    kTimings,
}};
/// Angles as well; meta names the axes of the task.
inline constexpr std::array<TableSchema, 3> kSchemaVersion2 = {{
    kMeta,
    {"problems",
     "CREATE TABLE problems (id INTEGER PRIMARY KEY, extents TEXT NOT NULL UNIQUE, "
     "nx INTEGER NOT NULL, ny INTEGER NOT NULL, nz INTEGER NOT NULL, n_yaw INTEGER NOT NULL, n_pitch INTEGER NOT NULL, "
     "status TEXT NOT NULL, solver TEXT NOT NULL, epsilon REAL NOT NULL, expected_cost REAL, "
     "lower_bound REAL NOT NULL, expansions INTEGER NOT NULL, seed INTEGER NOT NULL, version TEXT NOT NULL, "
     "checksum INTEGER NOT NULL, policy BLOB)"},
    kTimings,
}};
/// The inflation and the gap in columns of their own: one of them is null.
inline constexpr std::array<TableSchema, 3> kSchemaVersion3 = {{
    kMeta,
    {"problems",
     "CREATE TABLE problems (id INTEGER PRIMARY KEY, extents TEXT NOT NULL UNIQUE, "
     "nx INTEGER NOT NULL, ny INTEGER NOT NULL, nz INTEGER NOT NULL, n_yaw INTEGER NOT NULL, n_pitch INTEGER NOT NULL, "
     "status TEXT NOT NULL, solver TEXT NOT NULL, epsilon REAL, gap REAL, expected_cost REAL, "
     "lower_bound REAL NOT NULL, expansions INTEGER NOT NULL, seed INTEGER NOT NULL, version TEXT NOT NULL, "
     "checksum INTEGER NOT NULL, policy BLOB)"},
    kTimings,
}};

}  // namespace feeler::policies
