#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace feeler::evaluation {

/// Where a result came from: enough to run it again and to judge its times.
struct Manifest {
  std::string command;      ///< as typed
  nlohmann::json settings;  ///< every option that shaped the result
  std::vector<std::uint64_t> seeds;
};

/// A table: one JSON scalar per cell, as many cells in a row as there are columns.
struct ResultTable {
  std::vector<std::string> columns;
  std::vector<std::vector<nlohmann::json>> rows;
};

/// `{"version", "command", "settings", "seeds", "machine": {"processor", "cores", "memory_bytes", "system"}}`
nlohmann::json ManifestJson(const Manifest& manifest);

/// A point of a curve with its interval.
struct FigurePoint {
  double x = 0.0;
  double y = 0.0;
  double low = 0.0;
  double high = 0.0;
};
struct FigureSeries {
  std::string name;
  std::vector<FigurePoint> points;
};
/// A line plot.
struct Figure {
  std::string title;
  std::string x_label;
  std::string y_label;
  bool x_log = false;
  bool y_log = false;
  std::vector<FigureSeries> series;
};
/// `{"title", "x_label", "y_label", "x_log", "y_log", "series": [{"name", "points": [{"x", "y", "low", "high"}]}]}`
nlohmann::json ToJson(const Figure& figure);

/// An existing NAME.csv in `folder` is replaced only if it is the table of the NAME.json beside it, which an experiment
/// wrote: its first line names the same columns. Throws InputError otherwise.
void RequireOwnCsv(const std::string& folder, const std::string& name);

/// Writes NAME.csv (the table), NAME.json (table, details and figures) and manifest.json into `folder`, created if
/// missing; each file is replaced whole or not at all. Throws InputError if the folder cannot be written or a row has a
/// wrong length.
void WriteExperiment(const std::string& folder, const std::string& name, const ResultTable& table,
                     const nlohmann::json& details, const Manifest& manifest, const std::vector<Figure>& figures = {});

/// CSV of a table (RFC 4180 quoting).
std::string ToCsv(const ResultTable& table);

}  // namespace feeler::evaluation
