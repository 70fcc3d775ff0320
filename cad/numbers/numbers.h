#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "feeler/cad/measure/mating.h"
#include "feeler/cad/mesh/triangle_mesh.h"

namespace feeler::cad {

/// What a part is made of: what it weighs, and how hard its contacts are.
struct Material {
  std::string name;
  double density_kg_m3 = 0.0;
  double friction = 0.3;         ///< against itself, sliding
  double contact_time_s = 0.01;  ///< MuJoCo's solref: the time in which an overlap is undone; short is stiff
  double yield_pa = 0.0;         ///< pressure at which it gives way
};
/// aluminium, steel, brass, abs, nylon, rubber. Throws InputError listing them for another name.
Material ParseMaterial(const std::string& name);

/// Coordinates at which faces of tool and target meet, m, along x, y and z: displacements of the tool.
using Walls = std::array<std::vector<double>, 3>;

struct NumberOptions {
  /// Half widths of the uncertainty, m; 0: the axis is certain.
  Eigen::Vector3d uncertainty_m{0.005, 0.005, 0.005};
  std::string uncertainty_source;  ///< where that is known from, a half sentence; empty: it is assumed
  Material material;
  std::map<std::string, std::string> overrides;  ///< field (feeler_...) -> value, as people give it
};

/// A field of the task file, and why it is what it is.
struct TaskNumber {
  std::string field;
  bool text = false;
  std::string value;
  std::string reason;
};

/// A stand-in for what the robot needs to hold a tool that is too short for its fingers.
struct Handle {
  Eigen::Vector3d center_m;  ///< in the tool frame
  Eigen::Vector3d half_m;
};

struct DerivedNumbers {
  std::vector<TaskNumber> fields;  ///< in the order of the file
  double cell_m = 0.002;
  double margin_cells = 0.0;  ///< smallest distance from a wall to a lattice plane that the cell allows
  std::vector<int> cells;     ///< hypotheses along each uncertain axis
  std::optional<Handle> handle;
  double target_height_m = 0.2;  ///< of the target frame over the table
  std::vector<std::string> warnings;
};

/// Derives what a task file needs from the measured parts, both in the frame of the mating. `walls`: from the pieces;
/// empty for a first guess, with which they are found. Throws InputError for an override of an unknown field.
DerivedNumbers DeriveNumbers(const Mating& mating, const TriangleMesh& tool, const TriangleMesh& target,
                             const Walls& walls, const NumberOptions& options);

}  // namespace feeler::cad
